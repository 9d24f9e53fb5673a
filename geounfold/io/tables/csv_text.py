"""Text tables: content, rows as text, and tables written as CSV text."""

from __future__ import annotations

import gzip
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import IO, Any, overload

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.io.column_values import objects
from geounfold.io.paths import ending
from geounfold.io.tables.layout import BLANKS, TextLayout

_CHUNK = 1 << 20  # bytes unpacked at once
_ROOM = 1 << 28  # bytes that every compressed table may unpack to
_RATIO = 100  # times its size that a larger one may unpack to; tables of points: 3 to 10


@overload
def csv_reader(stream: IO[bytes], layout: TextLayout, batch: None = None) -> pd.DataFrame: ...


@overload
def csv_reader(
    stream: IO[bytes], layout: TextLayout, batch: int
) -> AbstractContextManager[Iterable[pd.DataFrame]]: ...


def csv_reader(stream: IO[bytes], layout: TextLayout, batch: int | None = None) -> Any:
    """Return the columns of a text in UTF-8, numbered from 0; with ``batch``, batches of its rows.

    The stream stands where the data begin.
    """
    return pd.read_csv(
        stream,
        sep=layout.separator,
        header=None,
        names=range(len(layout.names)),
        dtype=str,
        na_filter=False,
        encoding="utf-8",
        chunksize=batch,
    )


def named_frame(frame: pd.DataFrame, layout: TextLayout, path: str | Path) -> pd.DataFrame:
    """Return rows as `csv_reader` gives them with the columns' names and decimal points.

    Raises
    ------
    InputError
        Rows have more values than there are names, or a row whose columns are separated by blanks
        has fewer.
    """
    if not isinstance(frame.index, pd.RangeIndex):
        more = frame.index.nlevels + len(layout.names)
        raise InputError(
            f"{path}: is not a well-formed table: the names are of {len(layout.names)} columns, "
            f"but rows have up to {more} values"
        )
    if layout.separator == BLANKS and frame.shape[1]:
        short = frame.iloc[:, -1].replace("", np.nan).isna().to_numpy(dtype=bool)
        if short.any():
            row = frame.index.start + int(short.argmax()) + 1
            raise InputError(
                f"{path}: data row {row} has fewer values than the "
                f"{len(layout.names)} columns that blanks separate, so their places are not known; "
                "write missing values as NA"
            )
    frame = frame.fillna("").reset_index(drop=True)  # the fields that a short row lacks
    frame.columns = pd.Index(layout.names, dtype=object)
    return layout.with_points(frame, path)


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
    if not ending(path).endswith(".gz"):
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
