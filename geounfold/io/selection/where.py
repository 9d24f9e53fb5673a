"""An expression that chooses rows of a table, such as ``ROCK=ORE and AU>0.2``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools
from geounfold.io.column_values import objects
from geounfold.io.coordinate_columns import readable_numbers
from geounfold.io.messages import listing, shown
from geounfold.io.selection.conditions import Condition, holds_numbers
from geounfold.io.selection.parse import parse

_MOST_VALUES = 8  # values of a column that a message lists


@dataclass(frozen=True)
class Where:
    """Chooses rows by comparing columns with values.

    Attributes
    ----------
    text : str
        The expression. Left of a sign stands a column, right of it a value: a number, a word, or
        text in quotes. A column's name with blanks or signs is in quotes or backticks; backticks
        right of a sign name a column too. ``and`` binds before ``or``. Keywords and names of
        columns are found in any letter case, an exact name first. Text is compared exactly, upper
        and lower case apart, blanks around it aside; numbers are compared as numbers, so that 1
        equals 1.0. A missing value equals nothing; ``!=`` is the opposite of ``=``.
    condition : Condition
        What it states.

    Examples
    --------
    >>> frame = pd.DataFrame({"ROCK": ["ORE", "WASTE", "ORE"], "AU": [0.5, 0.1, 0.1]})
    >>> read_where("ROCK=ORE and not AU<0.2").mask(frame).tolist()
    [True, False, False]
    """

    text: str
    condition: Condition

    def positions(self, names: Sequence[str], source: str = "the table") -> list[int]:
        """Return the positions of the columns that the expression names, each once.

        Raises
        ------
        InputError
            No such column, or several.
        """
        found = [column_position(names, n, source, self.text) for n in self.condition.names()]
        return list(dict.fromkeys(found))

    def mask(self, frame: pd.DataFrame, source: str = "the table") -> Bools:
        """Return which rows are chosen, (n,).

        Raises
        ------
        InputError
            A column is missing, or its values cannot be compared in this way.
        """
        names = [str(name) for name in frame.columns]
        self.positions(names, source)
        try:
            return self.condition.of(
                lambda name: frame.iloc[:, column_position(names, name, source, self.text)]
            )
        except InputError as error:
            raise InputError(f"{source}: {error}") from error


def read_where(text: str) -> Where:
    """Return the choice of rows that an expression states.

    Raises
    ------
    OptionError
        The expression is not well-formed.
    """
    return Where(text, parse(text))


def column_position(names: Sequence[str], wanted: str, source: str, text: str = "") -> int:
    """Return the position of a column: by its exact name, else in any letter case.

    Raises
    ------
    InputError
        There is none, and the message has the nearest name; or there are several.
    """
    for same in (str.__eq__, lambda a, b: a.strip().casefold() == b.strip().casefold()):
        found = [k for k, name in enumerate(names) if same(str(name), wanted)]
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError(
                f"{source}: {len(found)} columns are called '{shown(wanted)}' "
                f"({listing(names[k] for k in found)}); rename all but one"
            )
    within = f" in where '{shown(text)}'" if text else ""
    near = nearest_name(wanted, names)
    hint = f"; did you mean {shown(near)}?" if near else ";"
    raise InputError(
        f"{source}: no column '{shown(wanted)}'{within}{hint} the file has: {listing(names)}"
    )


def nearest_name(wanted: str, names: Iterable[object]) -> str | None:
    """Return the name most like another, in any letter case; None if none is alike.

    Examples
    --------
    >>> nearest_name("rok", ["X", "ROCK"])
    'ROCK'
    """
    folded = {str(name).casefold(): str(name) for name in names}
    found = get_close_matches(wanted.casefold(), folded, n=1, cutoff=0.5)
    return folded[found[0]] if found else None


def not_chosen(where: Where, frame: pd.DataFrame, source: str) -> InputError:
    """Return the error for an expression that no row meets, with what its columns hold."""
    names = [str(name) for name in frame.columns]
    held = [
        f"column {shown(names[k])} has {values_told(frame.iloc[:, k])}"
        for k in where.positions(names, source)
    ]
    return InputError(
        f"{source}: no row meets where '{shown(where.text)}': {'; '.join(held)} (text is compared "
        "exactly, upper and lower case apart)"
    )


def values_told(column: pd.Series) -> str:
    """Return a column's values for a message: each with its count, or the range of numbers.

    Examples
    --------
    >>> values_told(pd.Series(["ORE", "WASTE", "ORE"]))
    'ORE (2), WASTE (1)'
    """
    words = pd.Series([str(v).strip() for v in objects(column)], dtype=object)
    counts = words[words != ""].value_counts(sort=False)
    if not len(counts):
        return "no values"
    if holds_numbers(column) and len(counts) > _MOST_VALUES:
        values = readable_numbers(column)[0]
        return f"numbers from {np.nanmin(values):g} to {np.nanmax(values):g}"
    order = sorted(counts.index, key=lambda w: (-counts[w], w))
    told = [f"{shown(w)} ({counts[w]})" for w in order[:_MOST_VALUES]]
    more = len(order) - len(told)
    return ", ".join(told) + (f" and {more} more values" if more else "")
