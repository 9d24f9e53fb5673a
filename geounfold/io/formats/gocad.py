"""GOCAD's text files: TSurf (.ts) triangles and VSet (.vs) points with properties.

Coordinates are returned with z up; in a file with ZPOSITIVE Depth, z changes its sign. The unit of
the axes and the name of the coordinate system (with projection and datum) are kept. Numbers are
read back bit for bit.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from geounfold.errors import InputError, OutputError
from geounfold.io.formats.point_tables import coded, missing_code
from geounfold.io.formats.registry import Meta, Points, Surface
from geounfold.io.formats.units import unit_name
from geounfold.io.messages import shown

_NO_NAME = {"default", "local", "gocad local", "unknown", ""}


@dataclass
class _Object:
    """One object of a file, filled while its lines are read."""

    kind: str
    names: list[str] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    number: dict[int, int] = field(default_factory=dict)
    xyz: list[tuple[float, float, float]] = field(default_factory=list)
    properties: list[list[str]] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    up: float = 1.0
    meta: dict[str, str] = field(default_factory=dict)


def read_points(path: Path) -> Points:
    """Return the vertices of a file with their properties."""
    objects = _read(path)
    xyz = np.concatenate([_vertices(o) for o in objects])
    names = list(dict.fromkeys(name for o in objects for name in _columns(o)))
    parts = [_properties(o, path) for o in objects]
    values = {
        name: np.concatenate(
            [
                part.get(name, np.full(len(o.xyz), np.nan))
                for part, o in zip(parts, objects, strict=True)
            ]
        )
        for name in names
    }
    return Points(xyz, values, _meta(objects, path))


def read_surface(path: Path) -> Surface:
    """Return the triangles of all surfaces in a file."""
    objects = [o for o in _read(path) if o.triangles]
    if not objects:
        raise InputError(f"{path}: holds no triangles (TRGL)")
    first = np.cumsum([0, *(len(o.xyz) for o in objects)])
    F = [
        np.array(o.triangles, dtype=np.int64) + k for o, k in zip(objects, first[:-1], strict=True)
    ]
    V = np.concatenate([_vertices(o) for o in objects])
    return Surface(V, np.concatenate(F), _meta(objects, path))


def write_points(path: Path, points: Points) -> None:
    """Write a VSet; texts become codes, which the header lists.

    Raises
    ------
    OutputError
        A coordinate is not finite, or a column has more than 100 texts.
    """
    made = {name: coded(name, values, "GOCAD") for name, values in points.data.items()}
    values = [v for v, _ in made.values()]
    if not np.isfinite(points.xyz).all():
        raise OutputError("GOCAD files need finite coordinates")
    lines = _head("VSet", path, points.meta, [legend for _, legend in made.values() if legend])
    if made:
        code = missing_code(values)
        no_data = -99999.0 if code is None else code
        lines.append("PROPERTIES " + " ".join(_quoted(name) for name in made))
        lines.append("ESIZES " + " ".join(["1"] * len(made)))
        lines.append("NO_DATA_VALUES " + " ".join([repr(no_data)] * len(made)))
        values = [np.where(np.isnan(v), no_data, v) if v.dtype.kind == "f" else v for v in values]
    lines.append("SUBVSET")
    word = "PVRTX" if made else "VRTX"
    fields = [map(repr, c.tolist()) for c in (*points.xyz.T, *values)]
    for k, row in enumerate(zip(*fields, strict=True), 1):
        lines.append(f"{word} {k} {' '.join(row)}")
    path.write_text("\n".join([*lines, "END", ""]), encoding="utf-8", newline="\n")


def write_surface(path: Path, surface: Surface) -> None:
    """Write a TSurf."""
    lines = [*_head("TSurf", path, surface.meta, []), "TFACE"]
    rows = enumerate(zip(*(map(repr, c.tolist()) for c in surface.V.T), strict=True), 1)
    lines += [f"VRTX {k} {' '.join(row)}" for k, row in rows]
    lines += [f"TRGL {a} {b} {c}" for a, b, c in (surface.F + 1).tolist()]
    path.write_text("\n".join([*lines, "END", ""]), encoding="utf-8", newline="\n")


def _head(kind: str, path: Path, meta: Meta, legends: list[str]) -> list[str]:
    unit = _quoted(meta.get("unit", ""), always=True)
    return [
        f"GOCAD {kind} 1",
        "HEADER {",
        f"name:{path.stem}",
        *(f"*legend*{legend}" for legend in legends),
        "}",
        "GOCAD_ORIGINAL_COORDINATE_SYSTEM",
        f"NAME {_quoted(meta.get('crs', 'Default'))}",
        'AXIS_NAME "X" "Y" "Z"',
        *([f"AXIS_UNIT {unit} {unit} {unit}"] if "unit" in meta else []),
        "ZPOSITIVE Elevation",
        "END_ORIGINAL_COORDINATE_SYSTEM",
    ]


def _quoted(text: str, *, always: bool = False) -> str:
    plain = " ".join(text.replace('"', "'").split())
    return f'"{plain}"' if always or " " in plain or not plain else plain


def _words(line: str) -> list[str]:
    """Return a line's words; text in double quotes is one word."""
    return [quoted or bare for quoted, bare in re.findall(r'"([^"]*)"|(\S+)', line)]


def _read(path: Path) -> list[_Object]:
    """Return those objects of a file that have vertices."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        lines = path.read_text(encoding="latin-1").splitlines()
    objects: list[_Object] = []
    header = False
    for k, line in enumerate(lines, 1):
        words = line.split()
        if not words or line.startswith("#"):
            continue
        if header:
            header = "}" not in line
        elif words[0] == "GOCAD":
            objects.append(_Object(words[1] if len(words) > 1 else ""))
        elif words[0] == "HEADER":
            header = "{" in line and "}" not in line
        elif not objects:
            raise InputError(f"{path}: is not a GOCAD file: it must begin with the word GOCAD")
        else:
            try:
                _take(objects[-1], words, line)
            except (ValueError, IndexError, KeyError) as error:
                raise InputError(
                    f"{path}: line {k} is no valid {shown(words[0])}: '{shown(line.strip())}'"
                ) from error
    if not objects:
        raise InputError(f"{path}: is not a GOCAD file: it must begin with the word GOCAD")
    whole = [o for o in objects if o.xyz]
    if not whole:
        raise InputError(f"{path}: holds no vertices (VRTX)")
    return whole


def _take(o: _Object, words: list[str], line: str) -> None:
    """Add one line to its object."""
    word, rest = words[0], words[1:]
    if word in ("VRTX", "PVRTX"):
        o.number[int(rest[0])] = len(o.xyz)
        o.xyz.append((float(rest[1]), float(rest[2]), float(rest[3])))
        o.properties.append(rest[4:] if word == "PVRTX" else [])
    elif word in ("ATOM", "PATOM"):
        of = o.number[int(rest[1])]
        o.number[int(rest[0])] = len(o.xyz)
        o.xyz.append(o.xyz[of])
        o.properties.append(rest[2:] if word == "PATOM" else [])
    elif word == "TRGL":
        a, b, c = (o.number[int(v)] for v in rest[:3])
        o.triangles.append((a, b, c))
    elif word == "PROPERTIES":
        o.names = _words(line)[1:]
    elif word == "ESIZES":
        o.sizes = [int(v) for v in rest]
    elif word == "NO_DATA_VALUES":
        o.missing = rest
    elif word == "ZPOSITIVE":
        o.up = -1.0 if rest[0].lower() == "depth" else 1.0
    elif word == "AXIS_UNIT":
        units = {unit_name(u) for u in _words(line)[1:]}
        o.meta |= {"unit": units.pop()} if len(units) == 1 else {"unit": " ".join(sorted(units))}
    elif word in ("NAME", "PROJECTION", "DATUM"):
        text = " ".join(_words(line)[1:])
        if text.lower() not in _NO_NAME:
            o.meta["crs"] = " ".join(filter(None, [o.meta.get("crs"), text]))


def _vertices(o: _Object) -> np.ndarray:
    return np.array(o.xyz, dtype=np.float64) * (1.0, 1.0, o.up)


def _columns(o: _Object) -> list[str]:
    """Return property names; those of a vector's parts are numbered from 0."""
    sizes = o.sizes if len(o.sizes) == len(o.names) else [1] * len(o.names)
    return [
        name if size == 1 else f"{name}_{j}"
        for name, size in zip(o.names, sizes, strict=True)
        for j in range(size)
    ]


def _properties(o: _Object, path: Path) -> dict[str, np.ndarray]:
    """Return an object's properties by name, with NaN for missing values."""
    names = _columns(o)
    if not names:
        return {}
    wrong = next((k for k, row in enumerate(o.properties) if len(row) not in (0, len(names))), None)
    if wrong is not None:
        raise InputError(
            f"{path}: vertex {wrong + 1} has {len(o.properties[wrong])} properties, but "
            f"{len(names)} are named"
        )
    blank = ["nan"] * len(names)
    try:
        table = np.array([row or blank for row in o.properties], dtype=np.float64)
        sizes = o.sizes if len(o.sizes) == len(o.names) else [1] * len(o.names)
        missing = np.repeat([float(v) for v in o.missing], sizes) if o.missing else None
    except ValueError as error:
        raise InputError(f"{path}: a property is not a number: {error}") from error
    if missing is not None and len(missing) == len(names):
        table = np.where(table == missing, np.nan, table)
    return {name: table[:, j] for j, name in enumerate(names)}


def _meta(objects: list[_Object], path: Path) -> Meta:
    """Return the unit and coordinate system that all objects share."""
    if any(o.meta != objects[0].meta for o in objects):
        raise InputError(
            f"{path}: its objects have different units or coordinate systems; split the file"
        )
    return objects[0].meta
