"""CSV files: content, header, rows as text, and tables written as CSV text."""

from __future__ import annotations

import codecs
import csv
import gzip
import re
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from itertools import chain
from pathlib import Path
from typing import IO, Any, overload

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.io.column_values import objects
from geounfold.io.paths import ending

_LINE_END = re.compile(rb"\r\n|\n|\r")
_MOST_COLUMNS = 1 << 16  # names in the first row beyond which the file is no table
_CHUNK = 1 << 20  # bytes unpacked at once
_ROOM = 1 << 28  # bytes that every compressed table may unpack to
_RATIO = 100  # times its size that a larger one may unpack to; tables of points: 3 to 10

_FOREIGN = {
    b"PAR1": "a Parquet file: name it .parquet",
    b"\x1f\x8b": "compressed by gzip: name it .csv.gz",
    b"PK\x03\x04": "a zip archive, perhaps a spreadsheet: export it as CSV",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet: export it as CSV",
    b"\xff\xfe": "in UTF-16: save it as UTF-8",
    b"\xfe\xff": "in UTF-16: save it as UTF-8",
}


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
    """Return a CSV's columns as text, numbered from 0; with ``batch``, batches of its rows."""
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


def text_content(path: Path) -> bytes:
    """Return a CSV's bytes, unpacked.

    Raises
    ------
    InputError
        The file would unpack to more bytes than `most_unpacked`.
    """
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
    """Return a CSV's column names, its separator, and the number of rows down to the header.

    Raises
    ------
    InputError
        The content is of another format, binary or empty, or its first row is no header.
    """
    for magic, what in _FOREIGN.items():
        if content.startswith(magic):
            raise InputError(f"{path}: is not a CSV table but {what}")
    if b"\0" in content:  # the parser would cut a value short at it
        raise InputError(f"{path}: is not a table: it holds binary data")
    blank = 0
    lines = _lines(content)
    for line in lines:
        if line.strip():
            break
        blank += 1
    else:
        raise InputError(f"{path}: the file is empty")
    bare = "".join(line.split('"')[::2])  # the text outside quotes
    separator = max(",;\t", key=bare.count)
    names = next(csv.reader(chain([line], lines), delimiter=separator))
    if len(names) > _MOST_COLUMNS:
        raise InputError(
            f"{path}: is not a table of points: its first row names {len(names)} columns"
        )
    return [n.strip() for n in names], separator, blank + 1


def _lines(content: bytes) -> Iterator[str]:
    """Yield lines with their ends, of any of the three kinds, without a byte-order mark."""
    start = len(codecs.BOM_UTF8) if content.startswith(codecs.BOM_UTF8) else 0
    while start < len(content):
        found = _LINE_END.search(content, start)
        end = found.end() if found else len(content)
        yield content[start:end].decode("utf-8")
        start = end


def csv_text(frame: pd.DataFrame, *, header: bool = True) -> str:
    """Return a DataFrame as comma-separated lines."""
    head = [",".join(_quoted([str(name) for name in frame.columns]))] if header else []
    columns = [_fields(frame.iloc[:, i]) for i in range(frame.shape[1])]
    if len(columns) == 1:  # a blank line would not be read as a row
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
    """Return fields; those with a comma, a quote or a line end are in quotes."""
    blob = "".join(fields)
    if not any(sign in blob for sign in ',"\n\r'):
        return fields
    special = set(',"\n\r')
    return ['"' + f.replace('"', '""') + '"' if special & set(f) else f for f in fields]
