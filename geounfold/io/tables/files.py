"""Tables read and written by the file's ending, values unchanged.

A CSV's values stay text, so that leading zeros, blanks and 20-digit numbers are written as they
were read. Only the columns that the caller needs as numbers are converted. Parquet columns keep
their types.
"""

from __future__ import annotations

import csv
import gzip
import io
import re
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
from geounfold.io.packages.names import Triple
from geounfold.io.paths import TABLE_ENDINGS, TEXT_ENDINGS, ending, existing_file, wrong_kind
from geounfold.io.tables.csv_text import csv_reader, csv_text, named_frame, text_content
from geounfold.io.tables.encoding import as_utf8, encoding_note, text_encoding
from geounfold.io.tables.layout import TextLayout, text_layout
from geounfold.io.tables.parquet import ParquetParts, pyarrow_module

_HEAD = 1 << 16  # bytes in which a GSLIB header is looked for

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
    notes : tuple of str
        What was left out or assumed in reading, a sentence each.
    """

    frame: pd.DataFrame
    text: bool
    columns: tuple[str, str, str] | None = None
    meta: Mapping[str, str] = field(default_factory=dict)
    element: str = ""
    notes: tuple[str, ...] = ()


def read_table(
    path: str | Path, element: str | None = None, *, columns: Triple | None = None
) -> Table:
    """Return the table in a file.

    A text table is in UTF-8, UTF-16 or Windows-1252 (see `text_encoding`). Its columns are
    separated by commas, semicolons, tabs, bars or blanks. Lines above their names, and rows of
    units or types below, are left out (see `text_layout`).

    Parameters
    ----------
    path : path
        A file whose ending is one of `TEXT_ENDINGS`, .parquet, or one of `formats.point_endings`.
        Points of those formats become columns x, y, z.
    element : str, optional
        Name of the element to read, for a file of several (OMF, geoh5).
    columns : three str, optional
        Names of the coordinates, by which the row of names is found.

    Raises
    ------
    InputError
        The file is missing, empty, a directory, not a table, damaged, or holds no rows; it holds
        several elements and none is named, or none of that name.
    MissingDependencyError
        The format's library is not installed.
    """
    path = existing_file(Path(path))
    kind = ending(path)
    if kind == ".parquet" or (kind in TEXT_ENDINGS and not is_gslib(path, kind)):
        if element is not None:
            raise no_elements(path)
        table = _read_parquet(path) if kind == ".parquet" else _read_text(path, columns)
    else:
        table = _read_format(path, ".gslib" if kind in TEXT_ENDINGS else kind, element)
    if not len(table.frame):
        raise InputError(f"{path}: the table has a header but no rows")
    return table


def _read_format(path: Path, kind: str, element: str | None) -> Table:
    """Return the points of a file of another format as a table."""
    from geounfold.io.formats import find_format, point_endings, point_tables

    found = find_format(kind, "reads_points")
    if found is None:
        usual = (*TABLE_ENDINGS, ".txt", ".gslib", ".vtu")
        raise InputError(wrong_kind(path, "points", (*usual, *point_endings())))
    module = found.load()
    if element is not None and not found.elements:
        raise no_elements(path)
    if hasattr(module, "read_frame"):
        return Table(module.read_frame(path), text=False)
    points = module.read_points(path, element) if found.elements else module.read_points(path)
    return Table(point_tables.to_frame(points), False, ("x", "y", "z"), points.meta, points.element)


@contextmanager
def _as_input_error(path: Path, layout: TextLayout | None = None) -> Iterator[None]:
    """Raise InputError, in one line, for the exceptions that readers raise on a damaged file.

    ``layout`` is that of the rows that are read; without, nothing but the file is known.
    """
    above = 0 if layout is None else layout.lines
    try:
        yield
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not a table of text; save it as UTF-8") from error
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the compressed file is damaged: {error}") from error
    except (csv.Error, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        if "out of memory" in str(error):
            raise MemoryError from error
        words = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        words = re.sub(r"(?<=\bline )\d+", lambda found: str(int(found[0]) + above), words)
        raise InputError(f"{path}: is not a well-formed table: {words}") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def is_gslib(path: Path, kind: str) -> bool:
    """Return whether a text file has a GSLIB header, which any of the endings may have."""
    if kind.endswith(".gz"):
        return False
    from geounfold.io.formats.gslib import has_header

    with path.open("rb") as stream:
        return has_header(stream.read(_HEAD))


def _read_text(path: Path, columns: Triple | None) -> Table:
    """Return a text table's columns as text."""
    with _as_input_error(path):
        content = text_content(path)
        encoding = text_encoding(path, [content])
        content = as_utf8(content, encoding)
        layout = text_layout(path, content, columns)
    with _as_input_error(path, layout):
        stream = io.BytesIO(content)
        stream.seek(layout.start)
        try:
            frame = csv_reader(stream, layout)
        except pd.errors.EmptyDataError:
            frame = pd.DataFrame(columns=range(len(layout.names)), dtype=str)
    notes = (*encoding_note(encoding), *layout.notes)
    return Table(named_frame(frame, layout, path), text=True, notes=notes)


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
