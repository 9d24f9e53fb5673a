"""Tables of points: coordinates are checked, all other columns kept unchanged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.coordinate_columns import Triple, coordinate_columns, numbers
from geounfold.io.messages import counted, listing, rows_named, shown
from geounfold.io.tables.files import check_writable, read_table, with_columns, write_table

Place = Callable[[Floats], Floats]
"""Returns world coordinates (n, 3) of points in a model's own coordinates."""


@dataclass(frozen=True, eq=False)
class PointTable:
    """Points of a file, with all its columns.

    Attributes
    ----------
    source : str
        The file's path, as given.
    frame : DataFrame, n rows
        Every column, in order; a CSV's as text (see `numbers`).
    columns : three str
        Names of the coordinate columns.
    points : (n, 3) float
        World coordinates, in the file's unit; finite.
    dropped : (k,) int
        Data rows left out because a coordinate is not finite; 1 is the first one.
    text : bool
        Whether the columns are text, because the file is a CSV.
    meta : dict of str
        Unit and coordinate reference, if the file holds them.
    """

    source: str
    frame: pd.DataFrame
    columns: Triple
    points: Floats
    dropped: Ints
    text: bool
    meta: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def duplicates(self) -> int:
        """Number of points with the coordinates of an earlier one; they are kept."""
        return int(pd.DataFrame(self.points).duplicated().sum())

    def numbers(self, column: str) -> Floats:
        """Return a column's values, (n,) float; missing ones are NaN.

        Raises
        ------
        InputError
            No such column, two of that name, or a value that is not a number.
        """
        where = np.flatnonzero(self.frame.columns == column)
        if len(where) != 1:
            what = "no" if not len(where) else "more than one"
            raise InputError(
                f"{self.source}: {what} column '{shown(column)}'; the file has: "
                f"{listing(self.frame.columns)}"
            )
        return numbers(self.frame.iloc[:, int(where[0])], source=self.source)

    def with_columns(self, columns: dict[str, Any]) -> pd.DataFrame:
        """Return the frame with results at its end; one of the same name is replaced in place.

        Raises
        ------
        InputError
            A result would replace the coordinates themselves.
        """
        clash = [name for name in self.columns if name in columns]
        if clash:
            raise InputError(
                f"{self.source}: the result's column '{clash[0]}' would replace the coordinates "
                "read; rename the input's columns"
            )
        return with_columns(self.frame, columns)

    def write(self, path: str | Path, columns: dict[str, Any]) -> None:
        """Write the table with results added, by the path's ending."""
        frame = self.with_columns(columns)
        own = tuple(n for n in self._text_columns if n not in columns)
        write_table(path, frame, text=own, columns=self.columns, meta=self.meta)

    def write_parts(
        self, path: str | Path, make: Callable[[pd.DataFrame, Floats, slice], dict[str, Any]]
    ) -> None:
        """Write the table with the results that ``make(frame, points, rows)`` returns."""
        self.write(path, make(self.frame, self.points, slice(0, len(self))))

    def check_writable(self, path: str | Path) -> None:
        """Raise OutputError if a file of this ending cannot hold the table's columns."""
        check_writable(path, self.frame, self._text_columns)

    @property
    def _text_columns(self) -> tuple[str, ...]:
        return tuple(str(n) for n in self.frame.columns) if self.text else ()

    def facts(self) -> dict[str, Any]:
        """Return the figures of what was read, for a summary."""
        return {
            "file": self.source,
            "columns": list(self.columns),
            "rows": len(self) + len(self.dropped),
            "dropped_invalid": len(self.dropped),
            "dropped_rows": self.dropped[:100].tolist(),
            "duplicates": self.duplicates,
            **self.meta,
        }


def read_points(
    path: str | Path,
    columns: Triple | None = None,
    *,
    prefer: tuple[Triple, ...] = (),
    drop_invalid: bool = False,
    place: Place | None = None,
) -> PointTable:
    """Return the points of a file: a table, or any format of `geounfold.io.formats`.

    Parameters
    ----------
    path : path
        The file.
    columns : three str, optional
        Names of the coordinate columns. By default `coordinate_columns` finds them.
    prefer : tuples of three str, optional
        Names that are taken first if a table has all three, such as an output's ``unfolded_x`` ...
    drop_invalid : bool, optional
        True to leave out rows whose coordinates are missing or infinite; False to raise an error.
    place : callable, optional
        Returns world coordinates of a model's own, for a file in the latter (see Place).

    Raises
    ------
    InputError
        The file cannot be read; columns are missing, ambiguous or not numeric; coordinates are
        missing, infinite or too large; or no rows are left.
    """
    source = str(path)
    table = read_table(path)
    names = [str(name) for name in table.frame.columns]
    if columns is None:
        columns = next((p for p in prefer if set(p) <= set(names)), table.columns)
    where = coordinate_columns(names, columns, source=source, own=place is not None)
    axes = [numbers(table.frame.iloc[:, i], source=source) for i in where]
    points = np.column_stack(axes)
    if place is not None:
        points = place(points)
    valid: Bools = np.asarray(np.isfinite(points).all(axis=1))
    _check_size(points, valid, source)
    dropped = np.flatnonzero(~valid) + 1
    if len(dropped) and not drop_invalid:
        raise _invalid(dropped, len(points), source)
    if len(dropped) == len(points):
        raise InputError(f"{source}: no row has finite coordinates")
    frame = table.frame
    if len(dropped):
        frame, points = frame.loc[valid].reset_index(drop=True), points[valid]
    a, b, c = (names[i] for i in where)
    return PointTable(source, frame, (a, b, c), points, dropped, table.text, table.meta)


def _invalid(rows: Ints, total: int, source: str) -> InputError:
    """Return the error that names the rows without finite coordinates."""
    verb = "has" if len(rows) == 1 else "have"
    return InputError(
        f"{source}: {len(rows)} of {counted(total, 'row')} {verb} a missing or infinite "
        f"coordinate: {rows_named(rows.tolist())} (counted from 1 after the header); correct "
        "them, or leave them out by --drop-invalid"
    )


def _check_size(points: Floats, valid: Bools, source: str) -> None:
    """Raise InputError if a finite coordinate is too large for neighbouring blocks to differ."""
    huge = np.flatnonzero(valid & (np.abs(points) > LARGEST_COORDINATE).any(axis=1))
    if len(huge):
        row = int(huge[0])
        raise InputError(
            f"{source}: data row {row + 1} has a coordinate beyond {LARGEST_COORDINATE:g}, too "
            f"large for numbers to resolve a block: {points[row].tolist()}"
        )
