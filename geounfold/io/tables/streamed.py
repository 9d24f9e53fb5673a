"""Coordinates of Parquet files read batch by batch, with no row kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.io.coordinate_columns import coordinate_columns, numbers
from geounfold.io.packages.names import Triple
from geounfold.io.paths import ending, existing_file
from geounfold.io.tables.large import ParquetSource, PointStream
from geounfold.io.tables.parts import files_in
from geounfold.io.tables.points import Place

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.geometry.mesh import Floats, Ints

_PLACES, _RUN = 8, 20_000  # places of the file from which a sample is taken, and rows of each


class ParquetFolder:
    """Parquet files of a folder, or one file, as one table: a `large.Source`.

    Parameters
    ----------
    path : path
        The folder or file.

    Raises
    ------
    InputError
        A file is missing, damaged or of another format, or the files' columns differ.
    """

    text = False
    notes: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        paths = files_in(path) if path.is_dir() else [existing_file(path)]
        other = next((file for file in paths if ending(file) != ".parquet"), None)
        if other is not None:
            raise InputError(f"{other}: is no Parquet file, which is read in batches")
        self.first, self.files, self._paths = paths[0], len(paths), paths
        self._files = [_opened(file) for file in paths]
        self.names = self._files[0].names
        for file, source in zip(paths, self._files, strict=True):
            if source.names != self.names:
                raise InputError(f"{file}: has other columns than {paths[0]}")
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: two columns have the same name; rename all but one")
        self.rows = sum(source.rows for source in self._files)
        if not self.rows:
            raise InputError(f"{path}: the table has no rows")

    def batches(self, columns: tuple[int, ...] | None = None) -> Iterator[pd.DataFrame]:
        """Yield the rows in batches, of all columns or of some, by position."""
        for path, source in zip(self._paths, self._files, strict=True):
            with _readable(path):
                yield from source.batches(columns)

    def sample(self, columns: tuple[int, ...]) -> Iterator[pd.DataFrame]:
        """Yield runs of rows from places spread over the files."""
        ends = np.cumsum([source.rows for source in self._files])
        for row in np.unique(np.linspace(0, self.rows - 1, _PLACES).astype(np.int64)).tolist():
            file = int(np.searchsorted(ends, row, side="right"))
            source = self._files[file]
            with _readable(self._paths[file]):
                yield source.run(row - int(ends[file]) + source.rows, _RUN, columns)


def _opened(path: Path) -> ParquetSource:
    existing_file(path)
    with _readable(path):
        return ParquetSource(path)


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Give Arrow's errors on damaged files the file's name."""
    try:
        yield
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is no Parquet file, or a damaged one: {error}") from error


class StreamedPoints:
    """The points of a Parquet file or folder, of which no row is kept.

    Parameters
    ----------
    path : path
        The file or folder.
    columns : three str, optional
        Names of the coordinate columns; by default they are found by name.
    drop_invalid : bool
        Whether rows whose coordinates are missing or infinite are left out.
    place : callable, optional
        Takes the file's coordinates to the world's.
    rows : ParquetFolder, optional
        The file or folder if it is open already.

    Raises
    ------
    InputError
        The file cannot be used, or has no coordinate columns.
    """

    def __init__(
        self,
        path: str | Path,
        columns: Triple | None = None,
        *,
        drop_invalid: bool = False,
        place: Place | None = None,
        rows: ParquetFolder | None = None,
    ) -> None:
        self.source = str(path)
        self._rows = ParquetFolder(Path(path)) if rows is None else rows
        self._drop, self._place = drop_invalid, place
        names = self._rows.names
        self._axes = coordinate_columns(names, columns, source=self.source, own=place is not None)
        self._dropped: Ints | None = None

    def sample(self) -> Floats:
        """Return finite coordinates of runs of rows, (k, 3)."""
        runs = [self._points(frame) for frame in self._rows.sample(self._axes)]
        found: Floats = np.concatenate(runs)
        return found[np.isfinite(found).all(axis=1)]

    def batches(self) -> Iterator[Floats]:
        """Yield the coordinates of all rows, (n, 3) in each batch.

        Raises
        ------
        InputError
            A coordinate is no number, missing or too large, or the file cannot be read.
        """
        row, dropped = 0, []
        for frame in self._rows.batches(self._axes):
            points = self._points(frame)
            valid = np.isfinite(points).all(axis=1)
            if not valid.all():
                bad = np.flatnonzero(~valid) + 1 + row
                if not self._drop:
                    raise InputError(
                        f"{self.source}: data row {bad[0]} has a missing or infinite coordinate; "
                        "correct it, or go on without such rows by --drop-invalid"
                    )
                dropped.append(bad)
                points = points[valid]
            if (np.abs(points) > LARGEST_COORDINATE).any():
                raise InputError(f"{self.source}: a coordinate is beyond {LARGEST_COORDINATE:g}")
            row += len(frame)
            yield points
        self._dropped = np.concatenate([np.empty(0, np.int64), *dropped])

    def table(self, duplicates: int) -> PointStream:
        """Return the table of all rows, once `batches` has come to its end.

        Parameters
        ----------
        duplicates : int
            Number of points with the coordinates of an earlier one.
        """
        if self._dropped is None:
            raise ValueError("the rows were not read")
        a, b, c = (self._rows.names[k] for k in self._axes)
        count = self._rows.rows - len(self._dropped)
        found = PointStream(
            self.source, self._rows, (a, b, c), None, count, self._dropped, self._place
        )
        found.__dict__["duplicates"] = duplicates  # a cached property, which needs all points
        return found

    def _points(self, frame: pd.DataFrame) -> Floats:
        columns = [numbers(frame.iloc[:, k], source=self.source) for k in range(3)]
        points = np.column_stack(columns)
        return points if self._place is None else self._place(points)
