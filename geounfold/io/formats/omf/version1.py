"""OMF 1: a header of 60 bytes, arrays compressed one by one, and an index in JSON at the end.

The header holds a magic number, the version, the project's identifier and the position of the
index. The index holds every object under its identifier; arrays hold the position of their bytes.
"""

from __future__ import annotations

import json
import struct
import uuid
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.io.formats.elements import Element, Kind
from geounfold.io.formats.grids import places, tensor_grid
from geounfold.io.formats.omf.elements import (
    block_points,
    coordinate_meta,
    unread_version,
    values_by_name,
    vector,
    words_of,
)
from geounfold.io.formats.registry import Meta, Points, Surface

MAGIC = b"\x84\x83\x82\x81"
_HEADER = struct.Struct("<4s32s16sQ")
_VERSION = b"OMF-v0.9.0"
_WIDE = {"Vector2Array": 2, "Vector3Array": 3, "Int2Array": 2, "Int3Array": 3}
_KINDS = {
    "PointSetGeometry": Kind.POINTS,
    "VolumeGridGeometry": Kind.BLOCKS,
    "SurfaceGeometry": Kind.SURFACE,
}


@dataclass(frozen=True, eq=False)
class _File:
    """A file and its index."""

    path: Path
    index: dict[str, Any]
    project: dict[str, Any]

    def array(self, key: str) -> np.ndarray:
        """Return an array of the index, (n,) or (n, wide); lists as objects."""
        entry = self.index[key]
        where, kind = entry["array"], entry["__class__"]
        if isinstance(where, list):
            if kind == "ColorArray":
                return np.array(where, dtype=np.int64).reshape(-1, 3)
            return np.array([str(word) for word in where], dtype=object)
        with self.path.open("rb") as stream:
            stream.seek(where["start"])
            content = zlib.decompress(stream.read(where["length"]))
        flat = np.frombuffer(content, dtype=np.dtype(where["dtype"]))
        return flat.reshape(-1, _WIDE[kind]) if kind in _WIDE else flat

    @property
    def origin(self) -> Floats:
        return vector(self.project["origin"])

    @property
    def meta(self) -> Meta:
        return coordinate_meta(self.project.get("units"), None)


def elements(path: Path) -> list[Element]:
    """Return the elements of a file.

    Raises
    ------
    InputError
        The file has another version.
    """
    with path.open("rb") as stream:
        _, version, key, start = _HEADER.unpack(stream.read(_HEADER.size))
        if not version.startswith(_VERSION):
            named = version.rstrip(b"\0").decode("latin-1")
            raise unread_version(path, named)
        stream.seek(start)
        index = json.loads(stream.read().decode("utf-8"))
    file = _File(path, index, index[str(uuid.UUID(bytes=key))])
    found = []
    for entry in (index[k] for k in file.project["elements"]):
        geometry = index[entry["geometry"]]
        kind = _KINDS.get(geometry["__class__"], Kind.OTHER)
        load = partial(_LOADERS.get(kind, _not_read), file, entry, geometry)
        found.append(Element(str(entry.get("name", "")), kind, load))
    return found


def _points(file: _File, entry: dict[str, Any], geometry: dict[str, Any]) -> Points:
    xyz = _vertices(file, geometry)
    return Points(xyz, values_by_name(_values(file, entry, "vertices"), len(xyz)), file.meta)


def _blocks(file: _File, entry: dict[str, Any], geometry: dict[str, Any]) -> Points:
    corner = vector(geometry["origin"]) + file.origin
    axes, widths = ([geometry[f"{what}_{a}"] for a in "uvw"] for what in ("axis", "tensor"))
    grid = tensor_grid(corner, axes, widths)
    # w runs fastest: the library's own examples flatten arrays of (u, v, w).
    return block_points(
        grid.blocks(places(grid.shape, "w")), _values(file, entry, "cells"), file.meta
    )


def _surface(file: _File, entry: dict[str, Any], geometry: dict[str, Any]) -> Surface:
    F = np.asarray(file.array(geometry["triangles"]), dtype=np.int64)
    return Surface(_vertices(file, geometry), F, file.meta)


def _not_read(*_: object) -> None:
    raise AssertionError("only elements of a known kind are loaded")


_LOADERS = {Kind.POINTS: _points, Kind.BLOCKS: _blocks, Kind.SURFACE: _surface}


def _vertices(file: _File, geometry: dict[str, Any]) -> Floats:
    own = vector(geometry["origin"])
    V = np.asarray(file.array(geometry["vertices"]), dtype=np.float64)
    return V + own + file.origin


def _values(file: _File, entry: dict[str, Any], location: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield an element's data at a location; mapped data as their legend's words."""
    for data in (file.index[key] for key in entry.get("data", [])):
        if data["location"] != location:
            continue
        array = file.array(data["array"])
        if data.get("legends"):
            array = words_of(array, dict(enumerate(_legend(file, data["legends"]))))
        yield str(data.get("name", "")), array


def _legend(file: _File, keys: list[str]) -> list[str]:
    """Return the words of the first legend that has any; without words, the first one's values."""
    columns = [file.array(file.index[key]["values"]) for key in keys]
    words = next((c for c in columns if c.dtype == object), columns[0])
    return [str(v) if isinstance(v, str) else ",".join(str(x) for x in np.ravel(v)) for v in words]
