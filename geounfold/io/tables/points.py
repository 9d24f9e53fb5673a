"""Tables of points: coordinates are checked, all other columns kept unchanged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.coordinate_columns import coordinate_columns, numbers, without
from geounfold.io.messages import counted, listing, rows_named, shown
from geounfold.io.packages.names import Triple
from geounfold.io.selection import Where, column_position, nearest_name, not_chosen
from geounfold.io.selection.labels import codes_of
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
        World coordinates, in the file's unit; finite, but for rows that are not chosen.
    dropped : (k,) int
        Data rows left out because a coordinate is not finite; 1 is the first one.
    text : bool
        Whether the columns are text, because the file is a CSV.
    meta : dict of str
        Unit and coordinate reference, if the file holds them.
    chosen : (n,) bool or None
        Rows that the user chose; None if all are.
    where : str
        The expression that chose them.
    element : str
        Name of the element that was read, if the file may hold several.
    notes : tuple of str
        What was left out or assumed in reading, a sentence each.
    """

    source: str
    frame: pd.DataFrame
    columns: Triple
    points: Floats
    dropped: Ints
    text: bool
    meta: Mapping[str, str] = field(default_factory=dict)
    chosen: Bools | None = None
    where: str = ""
    element: str = ""
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.points)

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return [str(name) for name in self.frame.columns]

    @cached_property
    def duplicates(self) -> int:
        """Number of points with the coordinates of an earlier one; they are kept."""
        points = self.points if self.chosen is None else self.points[self.chosen]
        return int(pd.DataFrame(points).duplicated().sum())

    def only(self, rows: Bools | Ints | None = None) -> PointTable:
        """Return a table of some rows, or of those that the user chose."""
        rows = self.chosen if rows is None else rows
        if rows is None:
            return self
        frame = self.frame.iloc[np.flatnonzero(rows) if rows.dtype == bool else rows]
        return replace(
            self, frame=frame.reset_index(drop=True), points=self.points[rows], chosen=None
        )

    def categories(self, column: str) -> tuple[Ints, list[str]]:
        """Return a column's values as `labels.codes_of` does."""
        where = column_position(self.names, column, self.source)
        return codes_of([self.frame.iloc[:, where]])

    def numbers(self, column: str) -> Floats:
        """Return a column's values, (n,) float; missing ones are NaN.

        Raises
        ------
        InputError
            No such column, two of that name, or a value that is not a number.
        """
        return numbers(self.column(column), source=self.source)

    def column(self, column: str) -> pd.Series:
        """Return a column as it was read.

        Raises
        ------
        InputError
            No such column, or two of that name.
        """
        where = np.flatnonzero(self.frame.columns == column)
        if len(where) != 1:
            what = "no" if not len(where) else "more than one"
            near = None if len(where) else nearest_name(column, map(str, self.frame.columns))
            hint = f" (did you mean '{shown(near)}'?)" if near else ""
            raise InputError(
                f"{self.source}: {what} column '{shown(column)}'{hint}; the file has: "
                f"{listing(self.frame.columns)}"
            )
        return self.frame.iloc[:, int(where[0])]

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
            **chosen_facts(self.chosen, self.where),
            **({"element": self.element} if self.element else {}),
            **({"notes": list(self.notes)} if self.notes else {}),
            **self.meta,
        }


def chosen_facts(chosen: Bools | None, where: str) -> dict[str, Any]:
    """Return the figures of a choice of rows, for a summary; none without a choice."""
    if chosen is None:
        return {}
    return {"where": where, "selected": int(np.count_nonzero(chosen))}


def read_points(  # 9 parameters: the choices of columns, rows and element, and codes
    path: str | Path,
    columns: Triple | None = None,
    *,
    prefer: tuple[Triple, ...] = (),
    drop_invalid: bool = False,
    place: Place | None = None,
    where: Where | None = None,
    among: Bools | None = None,
    element: str | None = None,
    missing: tuple[float, ...] = (),
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
    where : Where, optional
        Chooses rows. The others stay in the table; their coordinates may be missing.
    among : (n,) bool, optional
        The rows to read, of a file whose row i is the point of row i of another file.
    element : str, optional
        Name of the element to read, for a file of several.
    missing : tuple of float, optional
        Values that mean a missing coordinate if they lie far from all others (see `coded`).

    Raises
    ------
    InputError
        The file cannot be read; no row is chosen; columns are missing, ambiguous or not numeric;
        coordinates are missing, infinite or too large; or no rows are left.
    """
    source = str(path)
    table = read_table(path, element, columns=columns)
    if among is not None and len(among) == len(table.frame):
        table = replace(table, frame=table.frame.loc[among].reset_index(drop=True))
    names = [str(name) for name in table.frame.columns]
    if columns is None:
        columns = next((p for p in prefer if set(p) <= set(names)), table.columns)
    found = coordinate_columns(names, columns, source=source, own=place is not None)
    chosen = None if where is None else chosen_rows(where, table.frame, source)
    axes = [without(numbers(table.frame.iloc[:, i], source=source), missing) for i in found]
    points = np.column_stack(axes)
    if place is not None:
        points = place(points)
    valid: Bools = np.asarray(np.isfinite(points).all(axis=1))
    _check_size(points, valid if chosen is None else valid & chosen, source)
    kept = valid if chosen is None else valid | ~chosen
    dropped = np.flatnonzero(~kept) + 1
    if len(dropped) and not drop_invalid:
        raise _invalid(dropped, len(points), source)
    if not (kept if chosen is None else valid & chosen).any():
        raise InputError(f"{source}: no row has finite coordinates")
    frame = table.frame
    if len(dropped):
        frame, points = frame.loc[kept].reset_index(drop=True), points[kept]
        chosen = None if chosen is None else chosen[kept]
    a, b, c = (names[i] for i in found)
    text = "" if where is None else where.text
    return PointTable(
        source, frame, (a, b, c), points, dropped, table.text, table.meta, chosen, text,
        table.element, table.notes,
    )  # fmt: skip


def chosen_rows(where: Where, frame: pd.DataFrame, source: str) -> Bools:
    """Return the rows that an expression chooses, (n,).

    Raises
    ------
    InputError
        It chooses none, or its columns do not fit.
    """
    chosen = where.mask(frame, source)
    if not chosen.any():
        raise not_chosen(where, frame, source)
    return chosen


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
