"""Surpac string files: text with commas, northing before easting.

The first line names the file and its purpose, the second the axis of sections. Each further line is
a point: the string's number, y, x, z and descriptions. A point of string 0 ends a string; END in
its last field ends the file. Sources: `geounfold.io.packages.exports`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OutputError
from geounfold.io.formats.registry import Strings
from geounfold.io.messages import shown
from geounfold.io.tables.encoding import as_utf8, text_encoding

_LARGEST = 32000  # string number


def read_strings(path: Path) -> Strings:
    """Return the strings; the name of each is its number.

    Raises
    ------
    InputError
        The file is no Surpac string file, or holds no points.
    """
    xyz, first, names, _ = _read(path)
    return Strings(xyz, first, names)


def read_frame(path: Path) -> pd.DataFrame:
    """Return the points as rows: string, name (its number), x, y, z and descriptions d1, d2 ..."""
    xyz, first, names, more = _read(path)
    count = max((len(row) for row in more), default=0)
    texts = {
        f"d{k + 1}": np.array([row[k] if k < len(row) else "" for row in more], dtype=object)
        for k in range(count)
    }
    return pd.DataFrame({**Strings(xyz, first, names).columns(), **texts})


def write_strings(path: Path, strings: Strings) -> None:
    """Write strings under their numbers; strings without a number get that of their place.

    Raises
    ------
    OutputError
        A coordinate is not finite.
    """
    if not np.isfinite(strings.xyz).all():
        raise OutputError("Surpac string files need finite coordinates")
    zero = ", ".join(["0.000"] * 3)
    lines = [f"{path.stem},,,geounfold", f"0, {zero}, {zero}"]
    parts = np.split(strings.xyz, strings.first[1:-1])
    for k, (name, points) in enumerate(zip(strings.names, parts, strict=True)):
        own = name.isascii() and name.isdecimal() and 0 < int(name) <= _LARGEST
        number = int(name) if own else k % _LARGEST + 1
        lines += [f"{number}, {y!r}, {x!r}, {z!r}," for x, y, z in points.tolist()]
        lines.append(f"0, {zero},")
    path.write_text("\n".join([*lines, f"0, {zero}, END", ""]), encoding="utf-8", newline="\n")


def _read(path: Path) -> tuple[np.ndarray, np.ndarray, tuple[str, ...], list[list[str]]]:
    """Return points (n, 3), where strings begin (k + 1,), their numbers, and descriptions."""
    content = path.read_bytes()
    lines = as_utf8(content, text_encoding(path, [content])).decode("utf-8-sig").splitlines()
    points: list[tuple[float, float, float]] = []
    first, names, more = [0], [], []
    number = ""
    for k, line in enumerate(lines[2:], 3):
        fields = [field.strip() for field in line.split(",")]
        if len(fields) < 4 or fields[-1].upper() == "END":
            if any(fields) and fields[-1].upper() != "END":
                raise _wrong(path, k, line)
            continue
        try:
            own = int(fields[0])
            y, x, z = (float(field) for field in fields[1:4])
        except ValueError:
            raise _wrong(path, k, line) from None
        if own == 0 or (number and str(own) != number):
            if len(points) > first[-1]:
                first.append(len(points))
                names.append(number)
            number = ""
        if own:
            number = str(own)
            points.append((x, y, z))
            more.append(fields[4:] if any(fields[4:]) else [])
    if len(points) > first[-1]:
        first.append(len(points))
        names.append(number)
    if not points:
        raise InputError(f"{path}: is not a Surpac string file, or holds no points")
    return np.array(points), np.array(first, dtype=np.int64), tuple(names), more


def _wrong(path: Path, line: int, text: str) -> InputError:
    return InputError(
        f"{path}: line {line} is not a point of a Surpac string file (string number, y, x, z): "
        f"'{shown(text)}'"
    )
