"""Tables in and out, by the file's ending; what is read goes out unchanged.

A CSV's values stay the text they are (leading zeros, blanks and 20-digit numbers survive); only
the columns that are asked for become numbers. Parquet columns keep their types.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import json
import re
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast, overload

import numpy as np
import pandas as pd

from geounfold.errors import InputError, MissingDependencyError, OutputError
from geounfold.io._text import shown

if TYPE_CHECKING:
    from types import ModuleType

TABLE_ENDINGS = (".csv", ".csv.gz", ".parquet")
_LINE_END = re.compile(rb"\r\n|\n|\r")
_MOST_COLUMNS = 1 << 16  # what a line without end is cut into
_CHUNK = 1 << 20
_ROOM = 1 << 28  # bytes that any compressed table may unpack to
_RATIO = 100  # ... and how often its own size where it is larger; tables of points: 3 to 10
_FOREIGN = {
    b"PAR1": "a Parquet file: name it .parquet",
    b"\x1f\x8b": "compressed by gzip: name it .csv.gz",
    b"PK\x03\x04": "a zip archive, perhaps a spreadsheet: export it as CSV",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet: export it as CSV",
    b"\xff\xfe": "in UTF-16: save it as UTF-8",
    b"\xfe\xff": "in UTF-16: save it as UTF-8",
}


Writer = Callable[..., None]
"""Writes a DataFrame, and of its columns from a CSV what they show by their names."""


@dataclass(frozen=True, eq=False)
class Table:
    """A table as it is in its file.

    Attributes
    ----------
    frame : DataFrame, n rows
        Columns in the file's order under the file's names, even where two are called alike.
    text : bool
        True for a CSV, whose columns are all text.
    columns : three str, optional
        Names of the coordinates, where the file is one of points and not of columns.
    meta : dict of str
        Unit (``unit``) and coordinate reference (``crs``) of the coordinates, where the file
        tells them.
    """

    frame: pd.DataFrame
    text: bool
    columns: tuple[str, str, str] | None = None
    meta: Mapping[str, str] = field(default_factory=dict)


def ending(path: Path) -> str:
    """Return a file's ending in lower case; ``.csv.gz`` counts as one.

    Examples
    --------
    >>> ending(Path("Blocks.v2.CSV.GZ"))
    '.csv.gz'
    """
    name = path.name.lower()
    return ".csv.gz" if name.endswith(".csv.gz") else Path(name).suffix


def existing_file(path: Path) -> Path:
    """Return the path of a file that can be read and is not empty.

    Raises
    ------
    InputError
        No such file, a directory, a pipe or device, not readable, or empty.
    """
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a directory, not a file")
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: is a pipe or a device; save what it holds to a file first")
        with path.open("rb") as stream:
            if not stream.read(1):
                raise InputError(f"{path}: the file is empty")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{shown(path)}: cannot be read: {reason}") from error
    return path


def read_table(path: str | Path) -> Table:
    """Return the table in a ``.csv``, ``.csv.gz`` or ``.parquet`` file, or one of other formats.

    Those are of `geounfold.io.formats`; their points are columns x, y, z.

    A CSV is UTF-8 (with or without a byte-order mark), its first row names the columns, and
    commas, semicolons or tabs separate them (found from the first row).

    Raises
    ------
    InputError
        The file is missing, empty, a directory, no table, damaged, or holds no rows.
    MissingDependencyError
        A file whose library is not installed.
    """
    path = Path(path)
    kind = ending(path)
    existing_file(path)
    if kind in TABLE_ENDINGS:
        table = _read_parquet(path) if kind == ".parquet" else _read_csv(path)
    else:
        table = _read_format(path, kind)
    if not len(table.frame):
        raise InputError(f"{path}: the table has a header but no rows")
    return table


def _read_format(path: Path, kind: str) -> Table:
    """Return the points of a file of another format as a table."""
    from geounfold.io.formats import find_format, frames, point_endings

    found = find_format(kind, "reads_points")
    if found is None:
        endings = ", ".join((*TABLE_ENDINGS, *point_endings()))
        raise InputError(f"{path}: unknown kind of table '{kind}'; files end in {endings}")
    module = found.load()
    if hasattr(module, "read_frame"):
        return Table(module.read_frame(path), text=False)
    points = module.read_points(path)
    return Table(frames.to_frame(points), False, ("x", "y", "z"), points.meta)


@contextmanager
def _as_input_error(path: Path) -> Iterator[None]:
    """Turn what readers raise on a damaged file into one line."""
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
        content = _content(path)
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


@overload
def csv_reader(
    stream: IO[bytes], columns: int, separator: str, skip: int, batch: None = None
) -> pd.DataFrame: ...
@overload
def csv_reader(
    stream: IO[bytes], columns: int, separator: str, skip: int, batch: int
) -> AbstractContextManager[Iterable[pd.DataFrame]]: ...
def csv_reader(
    stream: IO[bytes], columns: int, separator: str, skip: int, batch: int | None = None
) -> Any:
    """Return a CSV's columns as text, numbered from 0, or what yields batches of its rows."""
    return pd.read_csv(
        stream,
        sep=separator,
        header=None,
        skiprows=skip,
        names=range(columns),
        dtype=str,
        na_filter=False,
        encoding="utf-8-sig",
        chunksize=batch,
    )


def most_unpacked(path: Path) -> int:
    """Return how many bytes a compressed table may unpack to."""
    return max(_ROOM, _RATIO * path.stat().st_size)


def _content(path: Path) -> bytes:
    """Return what a CSV holds, unpacked; not without end."""
    if ending(path) != ".csv.gz":
        return path.read_bytes()
    chunks, total = [], 0
    most = most_unpacked(path)
    with gzip.open(path, "rb") as stream:
        while chunk := stream.read(_CHUNK):
            chunks.append(chunk)
            total += len(chunk)
            if total > most:
                raise InputError(
                    f"{path}: is not a table: the file would unpack to more than {most >> 20} MiB; "
                    "if it is one, unpack it first"
                )
    return b"".join(chunks)


def csv_header(path: Path, content: bytes) -> tuple[list[str], str, int]:
    """Return a CSV's column names, its separator, and how many rows come before the first."""
    for magic, what in _FOREIGN.items():
        if content.startswith(magic):
            raise InputError(f"{path}: is not a CSV table but {what}")
    if b"\0" in content:  # at which the parser would cut a value short
        raise InputError(f"{path}: is not a table: it holds binary data")
    blank = 0
    lines = _lines(content)
    for line in lines:
        if line.strip():
            break
        blank += 1
    else:
        raise InputError(f"{path}: the file is empty")
    bare = "".join(line.split('"')[::2])  # what stands outside quotes
    separator = max(",;\t", key=bare.count)
    names = next(csv.reader(chain([line], lines), delimiter=separator))
    if len(names) > _MOST_COLUMNS:
        raise InputError(
            f"{path}: is not a table of points: its first row names {len(names)} columns"
        )
    return [n.strip() for n in names], separator, blank + 1


def _lines(content: bytes) -> Iterator[str]:
    """Yield lines with their ends, whichever these are, without a byte-order mark."""
    start = len(codecs.BOM_UTF8) if content.startswith(codecs.BOM_UTF8) else 0
    while start < len(content):
        found = _LINE_END.search(content, start)
        end = found.end() if found else len(content)
        yield content[start:end].decode("utf-8")
        start = end


def pyarrow_module() -> ModuleType:
    """Return pyarrow with its Parquet part, or MissingDependencyError."""
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise MissingDependencyError("Parquet files need pyarrow: pip install pyarrow") from error
    module: ModuleType = pyarrow
    return module


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


def objects(column: pd.Series) -> np.ndarray:
    """Return a column's values as Python objects, (n,); missing ones are empty strings."""
    values = np.array(column.to_numpy(dtype=object))
    missing = column.isna().to_numpy(dtype=bool)
    if missing.any():
        values[missing] = ""
    return values


def unique_names(names: Iterable[object]) -> list[str]:
    """Return names as text, numbered where they are there already.

    Examples
    --------
    >>> unique_names(["au", "cu", "au"])
    ['au', 'cu', 'au_2']
    """
    made: list[str] = []
    taken: set[str] = set()
    for name in map(str, names):
        number, unique = 1, name
        while unique in taken:
            number += 1
            unique = f"{name}_{number}"
        taken.add(unique)
        made.append(unique)
    return made


def with_columns(frame: pd.DataFrame, columns: dict[str, Any]) -> pd.DataFrame:
    """Return the frame with columns added at its end; one of the same name is replaced in place.

    Where several columns bear the name, the first is replaced and the others are dropped, so
    that no name of ours is there twice.
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
    """Write a table by the path's ending; floats come back bit for bit.

    Missing values (NaN) are empty. The frame's index is not written. The file is written in
    place: see `replacing` for one that appears whole or not at all.

    Parameters
    ----------
    path : path
        Ends in .csv, .csv.gz or .parquet, or as one of `formats.point_endings`.
    frame : DataFrame
        The table.
    text : names of columns, optional
        Columns that come from a CSV and whose types another file should find out: integers
        or floats where every value is one, else text.
    columns : three str, optional
        Names of the coordinates, for formats of points (found by name without).
    meta : dict of str, optional
        Unit and coordinate reference, for formats that have them.

    Raises
    ------
    MissingDependencyError
        A file whose library is not installed.
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
    """Raise what `write_table` would raise at the end, before anything is computed.

    Raises
    ------
    MissingDependencyError
        The format's library is not installed.
    OutputError
        A column has too many texts for a format that holds numbers only.
    """
    from geounfold.io.formats import find_format, frames

    found = find_format(ending(Path(path)), "writes_points")
    if found is not None:
        found.check_library()
    if found is not None and found.numbers_only:
        for i, name in enumerate(frame.columns):
            column = frame.iloc[:, i]
            values = frames.typed_values(_typed(column) if name in text else column)
            frames.coded(str(name), values, found.name)


def _all_typed(frame: pd.DataFrame, text: tuple[str, ...]) -> pd.DataFrame:
    """Return a frame whose columns from a CSV have the types they show."""
    series = [
        _typed(frame.iloc[:, i]) if name in text else frame.iloc[:, i]
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
    from geounfold.io.coordinates import coordinate_columns
    from geounfold.io.formats import find_format, frames

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
    module.write_points(path, frames.to_points(frame, xyz, named, meta))


def _csv_text(frame: pd.DataFrame, *, header: bool = True) -> str:
    """Return a frame as comma-separated lines."""
    head = [",".join(_quoted([str(name) for name in frame.columns]))] if header else []
    columns = [_fields(frame.iloc[:, i]) for i in range(frame.shape[1])]
    if len(columns) == 1:  # a blank line would be no row
        columns = [[field or '""' for field in columns[0]]]
    return "\n".join([*head, *map(",".join, zip(*columns, strict=True)), ""])


def _fields(column: pd.Series) -> list[str]:
    """Return a column's values as CSV fields."""
    if isinstance(column.dtype, np.dtype) and column.dtype == np.float64:
        values = column.to_numpy()
        fields = list(map(repr, values.tolist()))
        for row in np.flatnonzero(np.isnan(values)):
            fields[row] = ""
        return fields
    if pd.api.types.is_float_dtype(column.dtype):
        return ["" if v == "" else repr(v) for v in objects(column).tolist()]
    return _quoted([str(v) for v in objects(column).tolist()])


def _quoted(fields: list[str]) -> list[str]:
    """Return fields in quotes where their text needs them."""
    blob = "".join(fields)
    if not any(sign in blob for sign in ',"\n\r'):
        return fields
    special = set(',"\n\r')
    return ['"' + f.replace('"', '""') + '"' if special & set(f) else f for f in fields]


@contextmanager
def table_writer(path: Path) -> Iterator[Writer]:
    """Yield what writes one part of a table after the other into a file, by its ending.

    All parts have the same columns; `write_table` says how their values are written.
    """
    kind = ending(path)
    with ExitStack() as stack:
        if kind == ".parquet":
            yield stack.enter_context(closing(_ParquetParts(path))).write
            return
        raw = stack.enter_context(path.open("wb"))
        stream: IO[bytes] = raw
        if kind == ".csv.gz":
            packed = gzip.GzipFile("", "wb", 3, raw, mtime=0)
            stream = stack.enter_context(cast(IO[bytes], packed))
        first = True

        def write(frame: pd.DataFrame, kinds: Mapping[str, TextKind] | None = None) -> None:
            nonlocal first
            stream.write(_csv_text(frame, header=first).encode("utf-8"))
            first = False

        yield write


class _ParquetParts:
    """A Parquet file that grows part by part."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._pyarrow = pyarrow_module()
        self._writer: Any = None

    def write(self, frame: pd.DataFrame, kinds: Mapping[str, TextKind] | None = None) -> None:
        """Write a frame's columns as they are, those from a CSV in the types they show."""
        pyarrow, kinds = self._pyarrow, kinds or {}
        names = [str(name) for name in frame.columns]
        arrays = [
            pyarrow.array(kinds[name].typed(column) if name in kinds else column, from_pandas=True)
            for name, column in ((n, frame.iloc[:, i]) for i, n in enumerate(names))
        ]
        table = pyarrow.Table.from_arrays(arrays, names=names)
        if self._writer is None:
            # Coordinates hardly repeat: a dictionary of them costs time and room.
            others = [f.name for f in table.schema if not pyarrow.types.is_floating(f.type)]
            unique = len(set(names)) == len(names)
            self._writer = pyarrow.parquet.ParquetWriter(
                self._path, table.schema, use_dictionary=others if unique else True
            )
        self._writer.write_table(table.cast(self._writer.schema))

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.close()


@dataclass(frozen=True)
class TextKind:
    """What the texts of a column show.

    Attributes
    ----------
    filled : bool
        Whether any is not blank.
    whole, real : bool
        Whether all that are not blank are integers, or floats, that lose nothing as numbers.
    """

    filled: bool
    whole: bool
    real: bool

    @classmethod
    def of(cls, column: pd.Series) -> TextKind:
        """Return what a column of text shows."""
        words = _words(column)
        filled = words[words != ""]
        whole, fraction = r"(?:0|[1-9]\d{0,14})", r"(?:[eE][+-]?\d+)?"
        return cls(
            len(filled) > 0,
            bool(filled.str.fullmatch(r"0|-?[1-9]\d{0,17}").all()),
            bool(filled.str.fullmatch(rf"[+-]?(?:{whole}(?:\.\d*)?|\.\d+){fraction}").all()),
        )

    def joined(self, other: TextKind) -> TextKind:
        """Return what the texts of both show."""
        return TextKind(
            self.filled or other.filled, self.whole and other.whole, self.real and other.real
        )

    def typed(self, column: pd.Series) -> pd.Series:
        """Return text as integers or floats where that loses nothing, blanks as missing."""
        if not self.filled or not (self.whole or self.real):
            return column
        words = _words(column)
        blank = (words == "").to_numpy()
        if self.whole:
            integers = pd.Series(pd.array([0] * len(words), dtype="Int64"))
            integers[~blank] = words[~blank].astype(np.int64)
            integers[blank] = pd.NA
            return integers
        return words.where(~blank, "nan").astype(np.float64)


def _words(column: pd.Series) -> pd.Series:
    return pd.Series(column.to_numpy(dtype=object), dtype=object).astype(str)


def _typed(column: pd.Series) -> pd.Series:
    """Return text as integers or floats where that loses nothing, blanks as missing."""
    return TextKind.of(column).typed(column)


def write_json(path: str | Path, content: dict[str, Any]) -> None:
    """Write figures as JSON; what is not finite becomes null, as JSON has no word for it."""
    Path(path).write_text(json_text(content), encoding="utf-8")


def json_text(content: dict[str, Any]) -> str:
    """Return figures as one JSON object; what is not finite is null."""
    return json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Return a value in JSON's own types."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if value is None or isinstance(value, str | int | bool):
        return value
    return str(value)
