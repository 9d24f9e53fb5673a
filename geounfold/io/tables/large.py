"""Large tables of points, read and written in batches of rows.

The coordinates are read first, and kept if the caller needs them all. The other columns are read
when the result is written, in the same batches, so that memory holds at most one batch of them. The
output is the same as for a table that is read whole (`PointTable`).
"""

from __future__ import annotations

import csv
import gzip
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any, Protocol, cast

import numpy as np
import pandas as pd

from geounfold.backends.system.files import reachable
from geounfold.body.check import count_duplicates
from geounfold.errors import InputError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.column_values import TextKind
from geounfold.io.coordinate_columns import coordinate_columns, numbers
from geounfold.io.packages.names import Triple
from geounfold.io.paths import TEXT_ENDINGS, ending
from geounfold.io.selection import Where, column_position
from geounfold.io.selection.labels import codes_of
from geounfold.io.tables.csv_text import csv_reader, most_unpacked, named_frame
from geounfold.io.tables.encoding import encoding_note, text_encoding, utf8_stream
from geounfold.io.tables.files import is_gslib, table_writer, with_columns
from geounfold.io.tables.layout import text_layout
from geounfold.io.tables.parquet import pyarrow_module
from geounfold.io.tables.points import Place, PointTable, chosen_facts, read_points

BATCH = 1 << 17
"""Number of rows in a batch."""

LARGE = 1 << 24
"""Bytes above which a CSV is read in batches; a compressed one above a fourth of it."""

_HEAD = 1 << 20  # bytes in which the header is looked for

_FAULTS = (
    InputError,
    ValueError,
    KeyError,
    NotImplementedError,
    OSError,
    EOFError,
    zlib.error,
    csv.Error,
)
"""Exceptions of readers on damaged files, Arrow's and pandas's included."""

Make = Callable[[pd.DataFrame, Floats, slice], dict[str, Any]]
"""Returns the result's columns for a batch, from its table, points (k, 3) and rows in the whole."""


class Source(Protocol):
    """A file of rows that can be read several times."""

    names: list[str]
    text: bool
    notes: tuple[str, ...]

    def batches(self, columns: tuple[int, ...] | None = None) -> Iterator[pd.DataFrame]:
        """Yield the rows in batches, of all columns or of some, by position."""


class ParquetSource:
    """A Parquet file."""

    text = False
    notes: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        self._file = pyarrow_module().parquet.ParquetFile(path)
        self.names = list(self._file.schema_arrow.names)
        self.rows = int(self._file.metadata.num_rows)

    @property
    def group_rows(self) -> list[int]:
        """Number of rows in each row group."""
        meta = self._file.metadata
        return [int(meta.row_group(k).num_rows) for k in range(meta.num_row_groups)]

    def batches(self, columns: tuple[int, ...] | None = None) -> Iterator[pd.DataFrame]:
        """Yield batches in the columns' own types."""
        chosen = None if columns is None else [self.names[k] for k in columns]
        for batch in self._file.iter_batches(batch_size=BATCH, columns=chosen):
            frame = batch.to_pandas(types_mapper=pd.ArrowDtype, ignore_metadata=True)
            yield frame if chosen is None else frame[chosen]

    def run(self, start: int, count: int, columns: tuple[int, ...]) -> pd.DataFrame:
        """Return up to ``count`` rows from a row on, of some columns, out of one row group."""
        ends = np.cumsum(self.group_rows)
        group = int(np.searchsorted(ends, start, side="right"))
        before = int(ends[group]) - self.group_rows[group]
        chosen = [self.names[k] for k in columns]
        rows = self._file.read_row_group(group, columns=chosen)
        first = max(0, min(start - before, len(rows) - count))
        frame = rows.slice(first, count).to_pandas(types_mapper=pd.ArrowDtype, ignore_metadata=True)
        out: pd.DataFrame = frame[chosen]
        return out


class CsvSource:
    """A text table, whose columns are text."""

    text = True

    def __init__(self, path: Path, columns: Triple | None = None) -> None:
        self._path = path
        self._packed = ending(path).endswith(".gz")
        self.encoding = text_encoding(path, self._chunks())
        with self._open() as stream:
            self.layout = text_layout(path, stream.read(_HEAD), columns)
        self.names = list(self.layout.names)
        self.notes = (*encoding_note(self.encoding), *self.layout.notes)

    def _raw(self) -> IO[bytes]:
        if self._packed:
            return cast(IO[bytes], gzip.open(self._path, "rb"))
        return self._path.open("rb")

    def _open(self) -> IO[bytes]:
        return utf8_stream(self._raw(), self.encoding)

    def _chunks(self) -> Iterator[bytes]:
        """Yield the content; raise InputError if it unpacks to more than `most_unpacked`."""
        most, total = most_unpacked(self._path), 0
        with self._raw() as stream:
            while chunk := stream.read(_HEAD):
                total += len(chunk)
                if self._packed and total > most:
                    raise InputError(f"{self._path}: is not a table")
                yield chunk

    def batches(self, columns: tuple[int, ...] | None = None) -> Iterator[pd.DataFrame]:
        """Yield batches of text."""
        with ExitStack() as stack:
            stream = stack.enter_context(self._open())
            stream.read(self.layout.start)
            reader = stack.enter_context(csv_reader(stream, self.layout, BATCH))
            for frame in reader:
                whole = named_frame(frame, self.layout, self._path)
                yield whole if columns is None else whole.iloc[:, list(columns)]


@dataclass(frozen=True, eq=False)
class PointStream:
    """Points of a large file, with the methods of `PointTable`.

    Attributes
    ----------
    source : str
        The file's path, as given.
    rows : Source
        The file's rows.
    columns : three str
        Names of the coordinate columns.
    kept : (n, 3) float or None
        World coordinates; None if they are not kept.
    count : int
        Number of points.
    dropped : (k,) int
        Data rows left out because a coordinate is not finite, counted from 1.
    place : callable or None
        Returns world coordinates of the file's (see Place); None if the file holds the world's.
    meta : dict of str
        Empty, because CSV and Parquet hold neither unit nor coordinate reference.
    chosen : (n,) bool or None
        Rows that the user chose; None if all are.
    where : str
        The expression that chose them.
    """

    source: str
    rows: Source
    columns: Triple
    kept: Floats | None
    count: int
    dropped: Ints
    place: Place | None = None
    meta: Mapping[str, str] = field(default_factory=dict)
    chosen: Bools | None = None
    where: str = ""

    def __len__(self) -> int:
        return self.count

    @property
    def points(self) -> Floats:
        """The coordinates, (n, 3), in the file's unit."""
        if self.kept is None:
            raise ValueError("the coordinates were not kept")
        return self.kept

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return self.rows.names

    @cached_property
    def duplicates(self) -> int:
        """Number of points with the coordinates of an earlier one; they are kept."""
        points = self.points if self.chosen is None else self.points[self.chosen]
        return count_duplicates(points)

    def categories(self, column: str) -> tuple[Ints, list[str]]:
        """Return a column's values as `labels.codes_of` does."""
        where = column_position(self.rows.names, column, self.source)
        codes, names = codes_of(f.iloc[:, 0] for f in self.rows.batches((where,)))
        there = np.ones(len(codes), dtype=bool)
        there[self.dropped - 1] = False
        return codes[there], names

    def check_writable(self, path: str | Path) -> None:
        """Do nothing, because CSV and Parquet can hold each other's columns."""

    def facts(self) -> dict[str, Any]:
        """Return the figures of what was read, for a summary."""
        return {
            "file": self.source,
            "columns": list(self.columns),
            "rows": self.count + len(self.dropped),
            "dropped_invalid": len(self.dropped),
            "dropped_rows": self.dropped[:100].tolist(),
            "duplicates": self.duplicates,
            **chosen_facts(self.chosen, self.where),
            **({"notes": list(self.notes)} if self.notes else {}),
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out or assumed in reading, a sentence each."""
        return self.rows.notes

    def write_parts(self, path: str | Path, make: Make) -> None:
        """Write the table with results added, in batches.

        Parameters
        ----------
        path : path
            A file whose ending is one of `paths.TABLE_ENDINGS`.
        make : callable
            Returns a batch's results (see Make); called for one batch after the other.

        Raises
        ------
        InputError
            A result would replace the coordinates, or the file has changed since it was read.
        """
        path = Path(path)
        typed = self.rows.text and ending(path) == ".parquet"
        kinds = self._kinds() if typed else {}
        with table_writer(path) as write:
            for frame, points, rows in self._parts():
                results = make(frame, points, rows)
                clash = [name for name in self.columns if name in results]
                if clash:
                    raise InputError(
                        f"{self.source}: the result's column '{clash[0]}' would replace the "
                        "coordinates read; rename the input's columns"
                    )
                own = {n: k for n, k in kinds.items() if n not in results}
                write(with_columns(frame, results), own)

    def _parts(self) -> Iterator[tuple[pd.DataFrame, Floats, slice]]:
        """Yield batches: all columns, the coordinates (k, 3), and their rows among the points."""
        where = coordinate_columns(self.rows.names, self.columns, source=self.source)
        start, row, bad = 0, 0, self.dropped - 1
        for batch in self.rows.batches():
            frame = batch
            left_out = bad[(bad >= row) & (bad < row + len(frame))] - row
            row += len(frame)
            if len(left_out):
                there = np.ones(len(frame), dtype=bool)
                there[left_out] = False
                frame = frame.loc[there].reset_index(drop=True)
            rows = slice(start, start + len(frame))
            points = _coordinates(frame, where, self.source, self.place)
            start = rows.stop
            if not len(frame):
                continue
            if self.kept is not None and not np.array_equal(
                points, self.kept[rows], equal_nan=True
            ):
                break
            yield frame, points, rows
        if start != self.count:
            raise InputError(f"{self.source}: has changed while it was read; run again")

    def _kinds(self) -> dict[str, TextKind]:
        """Return the kind of each text column over all rows."""
        kinds: dict[str, TextKind] = {}
        for frame, _, _ in self._parts():
            for i, name in enumerate(self.rows.names):
                seen = TextKind.of(frame.iloc[:, i])
                kinds[name] = seen if name not in kinds else kinds[name].joined(seen)
        return kinds


def _coordinates(
    frame: pd.DataFrame, where: tuple[int, ...], source: str, place: Place | None
) -> Floats:
    points = np.column_stack([numbers(frame.iloc[:, i], source=source) for i in where])
    return points if place is None else place(points)


def open_points(  # 9 parameters: the choices of columns, rows and element, and codes
    path: str | Path,
    columns: Triple | None = None,
    *,
    prefer: tuple[Triple, ...] = (),
    drop_invalid: bool = False,
    place: Place | None = None,
    keep: bool = True,
    where: Where | None = None,
    element: str | None = None,
    missing: tuple[float, ...] = (),
) -> PointTable | PointStream:
    """Return the points of a file, in batches if it is a large table.

    Parameters
    ----------
    path, columns, prefer, drop_invalid, place, where, element, missing
        As `read_points` takes them; the errors are the same too.
    keep : bool
        Whether the coordinates of a large file are kept in memory.
    """
    whole = element is not None or bool(missing)  # a code is known by all other values
    source = None if whole else _large(Path(path), columns)
    if source is not None:
        found = _opened(str(path), source, columns, prefer, drop_invalid, place, keep, where)
        if found is not None:
            return found
    return read_points(
        path, columns,
        prefer=prefer, drop_invalid=drop_invalid, place=place, where=where, element=element,
        missing=missing,
    )  # fmt: skip


def _large(path: Path, columns: Triple | None) -> Source | None:
    """Return the rows of a large table; None for a small or damaged file, or another format."""
    path, kind = reachable(path), ending(path)
    if kind not in (".parquet", *TEXT_ENDINGS) or not path.is_file():
        return None
    try:
        if kind == ".parquet":
            parquet = ParquetSource(path)
            return parquet if parquet.rows > BATCH else None
        size = path.stat().st_size * (4 if kind.endswith(".gz") else 1)
        if size <= LARGE or is_gslib(path, kind):
            return None
        return CsvSource(path, columns)
    except _FAULTS:  # read_points then raises the error
        return None


def _opened(  # 8 arguments: those of open_points, checked
    path: str,
    source: Source,
    columns: Triple | None,
    prefer: tuple[Triple, ...],
    drop_invalid: bool,
    place: Place | None,
    keep: bool,
    where: Where | None,
) -> PointStream | None:
    """Return the points of a source; None if something is wrong, for which `read_points` raises."""
    if len(set(source.names)) < len(source.names):
        return None
    if columns is None:
        columns = next((p for p in prefer if set(p) <= set(source.names)), None)
    kept: list[Floats] = []
    dropped = [np.empty(0, np.int64)]
    chosen = [np.empty(0, bool)]
    row = 0
    try:
        axes = coordinate_columns(source.names, columns, source=path, own=place is not None)
        more = [] if where is None else where.positions(source.names, path)
        for frame in source.batches((*axes, *(k for k in more if k not in axes))):
            points = _coordinates(frame, (0, 1, 2), path, place)
            mask = np.ones(len(frame), bool) if where is None else where.mask(frame, path)
            valid: Bools = np.asarray(np.isfinite(points).all(axis=1))
            if (np.abs(points[valid & mask]) > LARGEST_COORDINATE).any():
                return None
            there = valid | ~mask
            if not there.all():
                dropped.append(np.flatnonzero(~there) + 1 + row)
                points = points[there]
            chosen.append(mask[there])
            row += len(frame)
            if keep:
                kept.append(points)
    except _FAULTS:  # read_points then raises the error
        return None
    left_out = np.concatenate(dropped)
    every = np.concatenate(chosen)
    if (len(left_out) and not drop_invalid) or not every.any():
        return None
    a, b, c = (source.names[i] for i in axes)
    whole = np.concatenate(kept) if keep else None
    count = row - len(left_out)
    found = PointStream(path, source, (a, b, c), whole, count, left_out, place)
    return found if where is None else replace(found, chosen=every, where=where.text)
