"""Elements of a file that holds several: each has a name and a kind, and one is read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum
from pathlib import Path
from typing import Any

from geounfold.errors import InputError
from geounfold.io.messages import shown

_LONGEST = 80  # characters of a name in a message: a user copies it
_MOST = 12  # elements that a message lists


class Kind(Enum):
    """Kinds of elements; the value is the word for messages."""

    POINTS = "point set"
    BLOCKS = "block model"
    SURFACE = "surface"
    OTHER = "other"


@dataclass(frozen=True, eq=False)
class Element:
    """One element of a project, loaded on demand.

    Attributes
    ----------
    name : str
        Name in the file.
    kind : Kind
        The element's kind.
    load : function
        Function that returns the element's `Points` or `Surface`.
    """

    name: str
    kind: Kind
    load: Callable[[], Any]

    def __str__(self) -> str:
        name = "".join(c if c.isprintable() else "?" for c in self.name[:_LONGEST])
        return f"{self.kind.value} '{name}'"


def chosen(
    path: Path, elements: Sequence[Element], kinds: tuple[Kind, ...], name: str | None
) -> Element:
    """Return the element of some kinds that a name chooses, or the only one without a name.

    Names are matched exactly, else in any letter case.

    Raises
    ------
    InputError
        There is none, or there are several and no name chooses one of them.
    """
    words = " nor a ".join(kind.value for kind in kinds)
    fitting = [element for element in elements if element.kind in kinds]
    if not fitting:
        there = f"; it has: {_listed(elements)}" if elements else ""
        holds = "holds no" if len(kinds) == 1 else "holds neither a"
        raise InputError(f"{path}: {holds} {words}{there}")
    found = fitting if name is None else _called(name, fitting)
    if len(found) == 1:
        return found[0]
    if name is None:
        raise InputError(
            f"{path}: holds {len(found)} elements of which each may be meant: {_listed(found)}; "
            "choose one by --element NAME"
        )
    if found:
        raise InputError(
            f"{path}: {len(found)} elements are called '{shown(name)}' ({_listed(found)}); rename "
            "all but one"
        )
    said = " or ".join(kind.value for kind in kinds)
    near = get_close_matches(name.casefold(), [e.name.casefold() for e in fitting], n=1)
    hint = next((f"; did you mean {e}?" for e in fitting if [e.name.casefold()] == near), ";")
    raise InputError(
        f"{path}: no {said} is called '{shown(name)}'{hint} the file has: {_listed(elements)}"
    )


def _listed(elements: Sequence[Element]) -> str:
    more = len(elements) - _MOST
    return ", ".join(map(str, elements[:_MOST])) + (f" and {more} more" if more > 0 else "")


def _called(name: str, elements: Sequence[Element]) -> list[Element]:
    exact = [element for element in elements if element.name == name]
    folded = name.strip().casefold()
    return exact or [e for e in elements if e.name.strip().casefold() == folded]
