"""A table whose rows are divided into parts: those chosen, those of each domain, and the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.tables.points import PointTable

if TYPE_CHECKING:
    from geounfold.io.tables.large import PointStream

NOT_SELECTED, ELSEWHERE = "not selected", "elsewhere"
"""``location`` of rows that ``--where`` does not choose, and of rows in no domain with a result."""

_OTHERS = {-1: NOT_SELECTED, -2: ELSEWHERE}

T = TypeVar("T", "PointTable", "PointStream", "PointTable | PointStream")

Make = Callable[[pd.DataFrame, Floats, slice], dict[str, Any]]
"""Returns the results of some rows of one part, from their table, their points (k, 3), and their
place among the part's rows."""


@dataclass(frozen=True, eq=False)
class PartedTable:
    """Points of a file of which one part or several get results, and the others empty ones.

    Attributes
    ----------
    table : PointTable or PointStream
        All rows.
    part : (n,) int
        Part of each row, from 0; -1 if it was not selected, -2 if it is elsewhere.
    count : int
        Number of parts.
    """

    table: PointTable | PointStream
    part: Ints
    count: int = 1

    @classmethod
    def chosen(cls, table: T) -> PartedTable | T:
        """Return a table with the rows chosen as its one part, or as it is without a choice."""
        if table.chosen is None:
            return table
        return cls(table, np.where(table.chosen, 0, -1))

    def __len__(self) -> int:
        return int(np.count_nonzero(self.part >= 0))

    @property
    def source(self) -> str:
        """The file's path, as given."""
        return self.table.source

    @property
    def columns(self) -> tuple[str, str, str]:
        """Names of the coordinate columns."""
        return self.table.columns

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return self.table.names

    @property
    def points(self) -> Floats:
        """World coordinates of the rows of all parts, (k, 3), in the file's order."""
        return self.table.points[self.part >= 0]

    def rows_of(self, part: int) -> Bools:
        """Return which rows are a part's, (n,)."""
        return np.asarray(self.part == part)

    @cached_property
    def inner(self) -> PointTable:
        """The rows of all parts; only of a table that was read whole."""
        if not isinstance(self.table, PointTable):
            raise TypeError("the table was not read whole")
        return self.table.only(self.part >= 0)

    @property
    def frame(self) -> pd.DataFrame:
        """The columns of the rows of all parts; only of a table that was read whole."""
        return self.inner.frame

    def numbers(self, column: str) -> Floats:
        """Return a column's values on the rows of all parts, as `PointTable.numbers`."""
        return self.inner.numbers(column)

    def check_writable(self, path: str | Path) -> None:
        """Raise OutputError if a file of this ending cannot hold the table's columns."""
        self.table.check_writable(path)

    def facts(self) -> dict[str, Any]:
        """Return the figures of what was read, for a summary."""
        return self.table.facts()

    def write(self, path: str | Path, columns: Mapping[str, Any]) -> None:
        """Write the table with results, given for the rows of all parts in the file's order."""
        one = PartedTable(self.table, np.where(self.part >= 0, 0, self.part))
        one.write_parts(path, sliced(columns))

    def write_parts(self, path: str | Path, *makes: Make) -> None:
        """Write the table with the results that one function returns for each part."""
        done = [0] * len(makes)

        def spread(frame: pd.DataFrame, points: Floats, batch: slice) -> dict[str, Any]:
            own, found = self.part[batch], []
            for k, make in enumerate(makes):
                rows = np.flatnonzero(own == k)
                part = slice(done[k], done[k] + len(rows))
                done[k] = part.stop
                inner = frame.iloc[rows].reset_index(drop=True)
                found.append((rows, make(inner, points[rows], part)))
            return spread_columns(found, own)

        self.table.write_parts(path, spread)


def sliced(columns: Mapping[str, Any]) -> Make:
    """Return what writes a part's results, given for all of its rows."""
    kept = {name: np.asarray(values) for name, values in columns.items()}
    return lambda _, __, rows: {name: values[rows] for name, values in kept.items()}


def spread_columns(found: Sequence[tuple[Ints, Mapping[str, Any]]], part: Ints) -> dict[str, Any]:
    """Return results of some rows as columns of all rows; the others are empty.

    Parameters
    ----------
    found : sequence of (rows, results)
        Rows (k,), and their results by column.
    part : (n,) int
        Part of each row; the words of rows in no part go into ``location``.
    """
    names = list(dict.fromkeys(name for _, results in found for name in results))
    out: dict[str, Any] = {}
    for name in names:
        pieces = [(rows, np.asarray(results[name])) for rows, results in found if name in results]
        column = _empty(len(part), {values.dtype.kind for _, values in pieces})
        for rows, values in pieces:
            column[rows] = values
        if name == "location":
            for code, word in _OTHERS.items():
                column[part == code] = word
        out[name] = column
    return out


def _empty(count: int, kinds: set[str]) -> Any:
    """Return a column of missing values that can hold values of some kinds of NumPy's types."""
    if kinds <= {"i", "u"}:
        return pd.array([pd.NA] * count, dtype="Int64")
    if kinds <= {"b"}:
        return pd.array([pd.NA] * count, dtype="boolean")
    if kinds <= {"f", "i", "u"}:
        return np.full(count, np.nan)
    return np.full(count, "", dtype=object)
