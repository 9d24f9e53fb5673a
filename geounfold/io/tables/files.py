"""Tables read and written by the file's ending, values unchanged.

A CSV's values stay text, so that leading zeros, blanks and 20-digit numbers are written as they
were read. Only the columns that the caller needs as numbers are converted. Parquet columns keep
their types.
"""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OutputError
from geounfold.io.column_values import TextKind, typed_values
from geounfold.io.messages import no_elements, shown
from geounfold.io.paths import TABLE_ENDINGS, ending, existing_file
from geounfold.io.tables.csv_text import csv_header, csv_reader, csv_text, text_content
from geounfold.io.tables.parquet import ParquetParts, pyarrow_module

Writer = Callable[..., None]
"""Writes a DataFrame; a second argument holds the TextKind of columns from a CSV, by name."""


@dataclass(frozen=True, eq=False)
class Table:
    """A table as its file holds it.

    Attributes
    ----------
    frame : DataFrame, n rows
        Columns in the file's order under the file's names, even if two have the same name.
    text : bool
        True for a CSV, whose columns are all text.
    columns : three str, optional
        Names of the coordinate columns, if the file's format defines them.
    meta : dict of str
        Unit (``unit``) and coordinate reference (``crs``) of the coordinates, if the file holds
        them.
    element : str
        Name of the element that was read, if the file may hold several.
    """

    frame: pd.DataFrame
    text: bool
    columns: tuple[str, str, str] | None = None
    meta: Mapping[str, str] = field(default_factory=dict)
    element: str = ""


def read_table(path: str | Path, element: str | None = None) -> Table:
    """Return the table in a file.

    A CSV is in UTF-8, with or without a byte-order mark. Its first row names the columns. Commas,
    semicolons or tabs separate them; the first row shows which.

    Parameters
    ----------
    path : path
        A file ending in .csv, .csv.gz or .parquet, or as one of `formats.point_endings`. Points
        of those formats become columns x, y, z.
    element : str, optional
        Name of the element to read, for a file of several (OMF, geoh5).

    Raises
    ------
    InputError
        The file is missing, empty, a directory, not a table, damaged, or holds no rows; it holds
        several elements and none is named, or none of that name.
    MissingDependencyError
        The format's library is not installed.
    """
    path = Path(path)
    kind = ending(path)
    existing_file(path)
    if kind in TABLE_ENDINGS:
        if element is not None:
            raise no_elements(path)
        table = _read_parquet(path) if kind == ".parquet" else _read_csv(path)
    else:
        table = _read_format(path, kind, element)
    if not len(table.frame):
        raise InputError(f"{path}: the table has a header but no rows")
    return table


def _read_format(path: Path, kind: str, element: str | None) -> Table:
    """Return the points of a file of another format as a table."""
    from geounfold.io.formats import find_format, point_endings, point_tables

    found = find_format(kind, "reads_points")
    if found is None:
        endings = ", ".join((*TABLE_ENDINGS, *point_endings()))
        raise InputError(f"{path}: unknown kind of table '{kind}'; files end in {endings}")
    module = found.load()
    if element is not None and not found.elements:
        raise no_elements(path)
    if hasattr(module, "read_frame"):
        return Table(module.read_frame(path), text=False)
    points = module.read_points(path, element) if found.elements else module.read_points(path)
    return Table(point_tables.to_frame(points), False, ("x", "y", "z"), points.meta, points.element)


@contextmanager
def _as_input_error(path: Path) -> Iterator[None]:
    """Raise InputError, in one line, for the exceptions that readers raise on a damaged file."""
    try:
        yield
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not a table in UTF-8; save it as UTF-8") from error
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the compressed file is damaged: {error}") from error
    except (csv.Error, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        if "out of memory" in str(error):
            raise MemoryError from error
        words = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        raise InputError(f"{path}: is not a well-formed table: {words}") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def _read_csv(path: Path) -> Table:
    """Return a CSV's columns as text."""
    with _as_input_error(path):
        content = text_content(path)
        names, separator, skip = csv_header(path, content)
        try:
            frame = csv_reader(io.BytesIO(content), len(names), separator, skip)
        except pd.errors.EmptyDataError:
            frame = pd.DataFrame(columns=range(len(names)), dtype=str)
    if not isinstance(frame.index, pd.RangeIndex):
        more = frame.index.nlevels + len(names)
        raise InputError(
            f"{path}: is not a well-formed table: the first row names {len(names)} columns, "
            f"but rows have up to {more} values"
        )
    frame = frame.fillna("")  # the fields that a short row lacks
    frame.columns = pd.Index(names, dtype=object)
    return Table(frame, text=True)


def _read_parquet(path: Path) -> Table:
    """Return a Parquet file's physical columns in their own types."""
    pyarrow = pyarrow_module()
    try:
        arrow = pyarrow.parquet.ParquetFile(path).read()
        frame = arrow.to_pandas(types_mapper=pd.ArrowDtype, ignore_metadata=True)
    except MemoryError:
        raise
    except (pyarrow.ArrowException, OSError) as error:
        words = shown(" ".join(str(error).split()))
        raise InputError(f"{path}: is not a Parquet table, or is damaged: {words}") from error
    return Table(frame, text=False)


def with_columns(frame: pd.DataFrame, columns: dict[str, Any]) -> pd.DataFrame:
    """Return the frame with columns added at its end; one of the same name is replaced in place.

    If several columns of the frame have that name, the first is replaced and the others are
    dropped.
    """
    series: list[Any] = []
    names: list[str] = []
    for i, name in enumerate(frame.columns):
        if name not in columns:
            series.append(frame.iloc[:, i])
        elif name not in names:
            series.append(pd.Series(columns[name], index=frame.index))
        else:
            continue
        names.append(name)
    for name in columns:
        if name not in names:
            series.append(pd.Series(columns[name], index=frame.index))
            names.append(name)
    out: pd.DataFrame = pd.concat(series, axis=1)
    out.columns = pd.Index(names, dtype=object)
    return out


def write_table(
    path: str | Path,
    frame: pd.DataFrame,
    *,
    text: tuple[str, ...] = (),
    columns: tuple[str, str, str] | None = None,
    meta: Mapping[str, str] | None = None,
) -> None:
    """Write a table by the path's ending; floats are read back bit for bit.

    Missing values (NaN) are written empty. The frame's index is not written. The file is written
    in place; `replacing` writes one that appears whole or not at all.

    Parameters
    ----------
    path : path
        A file ending in .csv, .csv.gz or .parquet, or as one of `formats.point_endings`.
    frame : DataFrame
        The table.
    text : names of columns, optional
        Columns of text from a CSV. Files of other formats get them as integers or floats if every
        value is one, else as text.
    columns : three str, optional
        Names of the coordinate columns, for formats of points. By default they are found by name.
    meta : dict of str, optional
        Unit and coordinate reference, for formats that hold them.

    Raises
    ------
    MissingDependencyError
        The format's library is not installed.
    OutputError
        Values that the format cannot hold.
    """
    path = Path(path)
    kind = ending(path)
    if kind in TABLE_ENDINGS:
        typed = kind == ".parquet" and text
        with table_writer(path) as write:
            write(_all_typed(frame, text) if typed else frame)
    else:
        _write_format(path, _all_typed(frame, text), columns, meta or {})


def check_writable(path: str | Path, frame: pd.DataFrame, text: tuple[str, ...] = ()) -> None:
    """Raise the errors that `write_table` would raise at the end, before anything is computed.

    Raises
    ------
    MissingDependencyError
        The format's library is not installed.
    OutputError
        A column has too many texts for a format that holds numbers only.
    """
    from geounfold.io.formats import find_format, point_tables

    found = find_format(ending(Path(path)), "writes_points")
    if found is not None:
        found.check_library()
    if found is not None and found.numbers_only:
        for i, name in enumerate(frame.columns):
            column = frame.iloc[:, i]
            values = point_tables.typed_values(typed_values(column) if name in text else column)
            point_tables.coded(str(name), values, found.name)


def _all_typed(frame: pd.DataFrame, text: tuple[str, ...]) -> pd.DataFrame:
    """Return a frame with its columns from a CSV as numbers if their values are."""
    series = [
        typed_values(frame.iloc[:, i]) if name in text else frame.iloc[:, i]
        for i, name in enumerate(frame.columns)
    ]
    whole: pd.DataFrame = pd.concat([s.reset_index(drop=True) for s in series], axis=1)
    whole.columns = frame.columns
    return whole


def _write_format(
    path: Path,
    frame: pd.DataFrame,
    columns: tuple[str, str, str] | None,
    meta: Mapping[str, str],
) -> None:
    """Write a table's rows as points of another format."""
    from geounfold.io.coordinate_columns import coordinate_columns
    from geounfold.io.formats import find_format, point_tables

    found = find_format(ending(path), "writes_points")
    if found is None:
        raise OutputError(f"{path}: points cannot be written as '{ending(path)}'")
    module = found.load()
    if hasattr(module, "write_frame"):
        module.write_frame(path, frame, meta)
        return
    names = [str(name) for name in frame.columns]
    where = coordinate_columns(names, columns, source=str(path))
    xyz = np.column_stack([frame.iloc[:, i].to_numpy(dtype=np.float64) for i in where])
    named = tuple(names[i] for i in where)
    module.write_points(path, point_tables.to_points(frame, xyz, named, meta))


@contextmanager
def table_writer(path: Path) -> Iterator[Writer]:
    """Yield a function that writes a table into a file, one part after the other.

    The file's ending selects the format. All parts have the same columns; values are written as
    by `write_table`.
    """
    kind = ending(path)
    with ExitStack() as stack:
        if kind == ".parquet":
            yield stack.enter_context(closing(ParquetParts(path))).write
            return
        raw = stack.enter_context(path.open("wb"))
        stream: IO[bytes] = raw
        if kind == ".csv.gz":
            packed = gzip.GzipFile("", "wb", 3, raw, mtime=0)
            stream = stack.enter_context(cast(IO[bytes], packed))
        first = True

        def write(frame: pd.DataFrame, kinds: Mapping[str, TextKind] | None = None) -> None:
            nonlocal first
            stream.write(csv_text(frame, header=first).encode("utf-8"))
            first = False

        yield write
