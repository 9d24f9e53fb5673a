"""GSLIB, or simplified GeoEAS: a title, the number of columns, their names, rows of numbers.

Deutsch and Journel 1998, *GSLIB: Geostatistical Software Library*, appendix B. The format has no
code for a missing value. Files written here name one in the title. Reading uses only a code that
the title names, because -999 may be a value in other files. Numbers are read back bit for bit.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.io.column_values import unique_names
from geounfold.io.formats.point_tables import coded, missing_code, typed_values
from geounfold.io.formats.registry import Meta
from geounfold.io.messages import shown

_MISSING = re.compile(r"missing values are (\S+)")
_MOST_COLUMNS = 10_000


def has_header(head: bytes) -> bool:
    """Return whether a text begins as GSLIB files do.

    The second line begins with the number of columns, that many lines of names follow, and the
    next line has that many numbers.
    """
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    words = lines[1].split() if len(lines) > 1 else []
    if not words or not words[0].isdecimal() or not 1 <= int(words[0]) <= _MOST_COLUMNS:
        return False
    count = int(words[0])
    row = lines[2 + count].split() if len(lines) > 2 + count else []
    try:
        return len([float(word) for word in row]) == count
    except ValueError:
        return False


def read_frame(path: Path) -> pd.DataFrame:
    """Return the columns as numbers; repeated names are numbered.

    Raises
    ------
    InputError
        The header is no GSLIB header, a row has another number of values, or a value is not a
        number.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not a GSLIB file: it is not text in UTF-8") from error
    words = lines[1].split() if len(lines) > 1 else []
    if not words or not words[0].isdecimal() or not 1 <= int(words[0]) <= _MOST_COLUMNS:
        raise InputError(
            f"{path}: is not a GSLIB file: its second line must begin with the number of columns, "
            f"not '{shown(lines[1] if len(lines) > 1 else '')}'"
        )
    count = int(words[0])
    names = [line.strip() for line in lines[2 : 2 + count]]
    rows = [(k, line.split()) for k, line in enumerate(lines[2 + count :], 3 + count)]
    rows = [(k, row) for k, row in rows if row]
    for k, row in rows:
        if len(row) != count:
            raise InputError(
                f"{path}: line {k} has {len(row)} values, but there are {count} columns"
            )
    if len(names) < count or not rows:
        raise InputError(f"{path}: the GSLIB header names {count} columns, but no row follows")
    try:
        values = np.array([row for _, row in rows], dtype=np.float64)
    except ValueError:
        raise InputError(f"{path}: {_first_word(rows)}") from None
    missing = _MISSING.search(lines[0])
    if missing:
        values[values == float(missing.group(1))] = np.nan
    return pd.DataFrame(dict(zip(unique_names(names), values.T, strict=True)))


def _first_word(rows: list[tuple[int, list[str]]]) -> str:
    """Return text that names the first value that is not a number."""
    for k, row in rows:
        for word in row:
            try:
                float(word)
            except ValueError:
                return f"line {k} has '{shown(word)}', which is not a number"
    return "a value is not a number"


def write_frame(path: Path, frame: pd.DataFrame, meta: Meta) -> None:
    """Write columns; texts become codes, which the title lists.

    Raises
    ------
    OutputError
        A column has more than 100 texts.
    """
    made = {
        name: coded(name, typed_values(frame.iloc[:, i]), "GSLIB")
        for i, name in enumerate(unique_names(frame.columns))
    }
    columns = [values for values, _ in made.values()]
    code = missing_code(columns)
    legends = [legend for _, legend in made.values() if legend]
    title = ["geounfold", *(f"{k} {v}" for k, v in meta.items()), *legends]
    if code is not None:
        title.append(f"missing values are {code!r}")
        columns = [np.where(np.isnan(c), code, c) if c.dtype.kind == "f" else c for c in columns]
    head = ["; ".join(" ".join(t.split()) for t in title), str(len(made))]
    head += [" ".join(name.split()) or "column" for name in made]
    rows = map(" ".join, zip(*(map(repr, c.tolist()) for c in columns), strict=True))
    path.write_text("\n".join([*head, *rows, ""]), encoding="utf-8", newline="\n")
