"""Tables cut into parts that are read independently, by several processes at once."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.io.paths import ending, existing_file
from geounfold.io.tables.csv_text import csv_reader, named_frame
from geounfold.io.tables.encoding import UTF8
from geounfold.io.tables.files import read_table
from geounfold.io.tables.large import BATCH, CsvSource, ParquetSource
from geounfold.io.tables.layout import TextLayout
from geounfold.io.tables.parquet import pyarrow_module

BYTES = 1 << 25
"""Bytes of a CSV in one part, about."""

_READ = 1 << 20  # bytes read at once to find the ends of rows
_NEWLINE, _QUOTE = 10, 34


@dataclass(frozen=True)
class Part:
    """Some rows of a table.

    Attributes
    ----------
    path : str
        The file.
    names : tuple of str
        Its columns.
    start, stop : int
        Row groups of a Parquet file, or bytes of a CSV.
    row : int
        Number of rows of the table before this part; blank lines of a CSV count.
    layout : TextLayout or None
        That of a CSV; None for Parquet.
    """

    path: str
    names: tuple[str, ...]
    start: int
    stop: int
    row: int
    layout: TextLayout | None = None

    @property
    def text(self) -> bool:
        """Whether the columns are text because the file is a CSV."""
        return self.layout is not None

    def frame(self) -> pd.DataFrame:
        """Return the rows with every column, as `read_table` returns them."""
        if self.layout is not None:
            return self._csv_frame(self.layout)
        file = pyarrow_module().parquet.ParquetFile(self.path)
        groups = file.read_row_groups(list(range(self.start, self.stop)))
        frame: pd.DataFrame = groups.to_pandas(types_mapper=pd.ArrowDtype, ignore_metadata=True)
        return frame

    def _csv_frame(self, layout: TextLayout) -> pd.DataFrame:
        with Path(self.path).open("rb") as stream:
            stream.seek(self.start)
            content = io.BytesIO(stream.read(self.stop - self.start))
        return named_frame(csv_reader(content, layout), layout, self.path)


def parts_of(path: str | Path) -> list[Part]:
    """Return the parts of a Parquet or CSV file, or of all such files in a folder, in order.

    Raises
    ------
    InputError
        The file is missing, of another format or not a table, or the files' columns differ.
    """
    path = Path(path)
    files = files_in(path) if path.is_dir() else [path]
    found: list[Part] = []
    row = 0
    for file in files:
        mine, rows = _split(file, row)
        if found and mine and mine[0].names != found[0].names:
            raise InputError(f"{file}: has other columns than {found[0].path}")
        found += mine
        row += rows
    if not found:
        raise InputError(f"{path}: the table has no rows")
    return found


def files_in(folder: Path) -> list[Path]:
    """Return a folder's tables by name, without names that begin with a point or underscore."""
    files = [f for f in sorted(folder.iterdir()) if f.is_file() and f.name[0] not in "._"]
    endings = {ending(f) for f in files}
    if len(endings) != 1 or not endings <= {".csv", ".parquet"}:
        held = ", ".join(sorted(endings)) or "nothing"
        raise InputError(
            f"{folder}: is a directory; one of parts must hold .parquet or .csv, not {held}"
        )
    return files


def _split(path: Path, row: int) -> tuple[list[Part], int]:
    """Return a file's parts and its number of rows; ``row`` rows of other files come before."""
    path = existing_file(path)
    kind = ending(path)
    if kind not in (".csv", ".parquet"):
        raise InputError(
            f"{path}: cannot be read in parts; give .parquet, .csv or a folder of them"
        )
    try:
        return _parquet_parts(path, row) if kind == ".parquet" else _csv_parts(path, row)
    except (InputError, OSError, ValueError) as error:
        read_table(path)  # raises an error that names the fault, if it finds one
        raise InputError(f"{path}: cannot be read in parts: {error}") from error


def _parquet_parts(path: Path, row: int) -> tuple[list[Part], int]:
    source = ParquetSource(path)
    names = _names(path, source.names)
    counts = source.group_rows
    found, start, before = [], 0, 0
    for stop in range(1, len(counts) + 1):
        rows = sum(counts[start:stop])
        if rows and (rows >= BATCH or stop == len(counts)):
            found.append(Part(str(path), names, start, stop, row + before))
            start, before = stop, before + rows
    return found, before


def _csv_parts(path: Path, row: int) -> tuple[list[Part], int]:
    source = CsvSource(path)
    if source.encoding != UTF8:
        raise InputError(f"{path}: its text is not in UTF-8; save it as UTF-8")
    names = _names(path, source.names)
    start, size = source.layout.start, path.stat().st_size
    cuts, rows, seen = [start], [0], 0
    for every in _row_ends(path):
        ends = every[every > start]
        while len(ends) and ends[-1] >= cuts[-1] + BYTES:
            at = int(np.searchsorted(ends, cuts[-1] + BYTES))
            cuts.append(int(ends[at]))
            rows.append(seen + at + 1)
        seen += len(ends)
    if start >= size:
        return [], 0
    if cuts[-1] < size:
        cuts.append(size)
    found = [
        Part(str(path), names, a, b, row + before, source.layout)
        for a, b, before in zip(cuts[:-1], cuts[1:], rows, strict=False)
    ]
    return found, seen + 1


def _row_ends(path: Path) -> Iterator[np.ndarray]:
    """Yield, by chunks of a CSV, where its rows end: behind newlines outside quotes."""
    at, quoted = 0, 0
    with path.open("rb") as stream:
        while chunk := stream.read(_READ):
            letters = np.frombuffer(chunk, dtype=np.uint8)
            ends = np.flatnonzero(letters == _NEWLINE)
            quotes = np.flatnonzero(letters == _QUOTE)
            if len(quotes) or quoted:
                before = np.searchsorted(quotes, ends) + quoted
                ends = ends[before % 2 == 0]
            quoted = (quoted + len(quotes)) % 2
            yield ends + at + 1
            at += len(chunk)


def _names(path: Path, names: list[str]) -> tuple[str, ...]:
    if len(set(names)) < len(names):
        raise InputError(f"{path}: two columns have the same name; rename all but one")
    return tuple(names)
