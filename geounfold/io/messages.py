"""Parts of messages, kept to one printable line whatever a file holds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from geounfold.errors import OptionError

_SHOWN = 12
_LONGEST = 40


def shown(value: object) -> str:
    """Return a value from a file as short printable text."""
    text = "".join(c if c.isprintable() else "?" for c in str(value))
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def listing(values: Iterable[object]) -> str:
    """Return the first values, comma-separated, and how many more there are.

    Examples
    --------
    >>> listing(["x", "y"])
    'x, y'
    >>> listing(range(14))
    '0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 2 more'
    """
    every = [shown(v) or "''" for v in values]
    text = ", ".join(every[:_SHOWN])
    return text if len(every) <= _SHOWN else f"{text} and {len(every) - _SHOWN} more"


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """Return ``1 row`` or ``2 rows``."""
    return f"{count} {noun if count == 1 else plural or noun + 's'}"


def rows_named(rows: Sequence[int]) -> str:
    """Return ``data row 4`` or ``data rows 4, 17, ...``; 1 is the first row after the header."""
    return f"data row{'s' if len(rows) > 1 else ''} {listing(rows)}"


def no_elements(path: object) -> OptionError:
    """Return the error for an element named of a file that holds no elements."""
    return OptionError(f"{path}: --element chooses one of several elements, as OMF and geoh5 hold")
