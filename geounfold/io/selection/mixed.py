"""Columns of a table that tell of rows of other rock: what was taken as one body may be several."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Ints
from geounfold.io.messages import shown
from geounfold.io.packages.names import plain_name
from geounfold.io.selection.labels import codes_of

_NAMES = re.compile(
    r"(?:est|min|geo)?(?:rock|ore|oreflag|domain|dom|lode|vein|seam|reef|zone|orezone|orewaste|"
    r"orebody|body|litho?|lithology|geol|geology|stratum|strat|formation)"
    r"(?:type|code|id|no|num|name|flag)?"
)
_MOST = 40  # values beyond which a column holds grades or names of samples, not kinds of rock
_ORE = ("ore", "1", "true", "yes", "y", "min", "mineralised", "mineralized")
_TOLD = 4  # values that a message names

Categories = Callable[[str], tuple[Ints, list[str]]]
"""Returns the codes (n,) and the names of a column's values."""


def mixed_columns(names: Sequence[str], categories: Categories) -> str:
    """Return the sentence on columns of rock, ore or domain that vary; empty if none does.

    Parameters
    ----------
    names : sequence of str
        The table's columns.
    categories : callable
        Returns a column's values, see `labels.codes_of`.
    """
    return _told({name: _counts(*categories(name)) for name in names if is_rock(name)})


class MixedColumns:
    """Counts the values of the columns of rock batch by batch.

    Parameters
    ----------
    names : sequence of str
        The table's columns.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._counts: dict[str, dict[str, int]] = {name: {} for name in names if is_rock(name)}

    def add(self, frame: pd.DataFrame) -> None:
        """Count the values of a batch of rows; a column of too many is left out."""
        for name, counts in list(self._counts.items()):
            codes, values = codes_of([frame[name]])
            for value, count in _counts(codes, values, alone=True).items():
                counts[value] = counts.get(value, 0) + count
            if len(counts) > _MOST:
                del self._counts[name]

    def sentence(self) -> str:
        """Return the sentence of `mixed_columns` for all batches."""
        return _told(self._counts)


def _counts(codes: Ints, values: list[str], *, alone: bool = False) -> dict[str, int]:
    """Return how often each value is there; ``alone``: blanks too if there is nothing else."""
    counts = {v: int(np.count_nonzero(codes == k)) for k, v in enumerate(values)}
    blank = int(np.count_nonzero(codes < 0))
    if blank and (counts or alone):
        counts["blank"] = blank
    return counts


def _told(columns: Mapping[str, dict[str, int]]) -> str:
    """Return the sentence on columns and the counts of their values; empty if none varies."""
    found = [(name, counts) for name, counts in columns.items() if 2 <= len(counts) <= _MOST]
    if not found:
        return ""
    told = " and ".join(f"{shown(name)} ({_counted(counts)})" for name, counts in found)
    name, counts = found[0]
    choice = f"{quoted(name)}={quoted(_likely(counts))}"
    verb = "column {} varies" if len(found) == 1 else "columns {} vary"
    return (
        f"{verb.format(told)}, and all rows were taken as one body: choose the body's rows by "
        f'--where "{choice}", or unfold every value on its own by --by {quoted(name)}'
    )


def is_rock(name: object) -> bool:
    """Return whether a column is named as one of rock, ore or domain is.

    Examples
    --------
    >>> is_rock("ZONE_CODE"), is_rock("AU")
    (True, False)
    """
    return _NAMES.fullmatch(plain_name(name)) is not None


def mixed_frame(frame: pd.DataFrame) -> str:
    """Return the sentence of `mixed_columns` for a DataFrame."""
    names = [str(name) for name in frame.columns]
    if len(set(names)) < len(names):
        return ""
    return mixed_columns(names, lambda name: codes_of([frame.iloc[:, names.index(name)]]))


_OF_A_TABLE = "if waste is among them, choose the body's rows by --where COLUMN=VALUE"


def box_told(sides: Sequence[int] | None, way_out: str = _OF_A_TABLE) -> str:
    """Return the sentence on blocks that fill the box of their lattice; empty if they do not."""
    if sides is None:
        return ""
    return (
        f"the blocks fill the whole box of their lattice ({' x '.join(map(str, sides))}), so that "
        f"no border of a body shows in them; {way_out}"
    )


def _counted(counts: dict[str, int]) -> str:
    order = sorted(counts, key=lambda value: -counts[value])
    told = [f"{shown(value)} {counts[value]}" for value in order[:_TOLD]]
    more = len(order) - _TOLD
    return ", ".join(told) + (f" and {more} more" if more > 0 else "")


def _likely(counts: dict[str, int]) -> str:
    """Return the value that most probably is the body's: called ore, else the first."""
    named = [value for value in counts if value != "blank"]
    return next((value for value in named if value.casefold() in _ORE), named[0])


def quoted(word: str) -> str:
    """Return a word as an expression of --where has it: in quotes if it needs them."""
    return word if re.fullmatch(r"[\w.\-+%]+", word) else f"'{word}'"


def left_out(column: str, names: Sequence[str]) -> str:
    """Return the expression that leaves domains out."""
    if len(names) == 1:
        return f"{quoted(column)}!={quoted(names[0])}"
    return f"{quoted(column)} not in ({', '.join(quoted(name) for name in names)})"
