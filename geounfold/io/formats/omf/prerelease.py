"""The layout of the Python library's pre-release 2.0.0a0: a zip archive of JSON and plain arrays.

``project.json`` holds the project; every array in it names the archive's member with its bytes.
There are five kinds of block models. In their order of blocks u runs fastest. ``cbc`` holds the
number of sub-blocks of each block (0: no block there), which are listed one after the other.
Regular sub-blocks have the same order within their block; octrees are given by their Z-order curve.

The kind of an element follows from its entries, because the library writes no name for one kind
(which it cannot read back either).
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.formats.elements import Element, Kind
from geounfold.io.formats.grids import Blocks, places, regular_grid, tensor_grid
from geounfold.io.formats.omf.elements import (
    block_points,
    coordinate_meta,
    of_parents,
    unread_version,
    values_by_name,
    words_of,
)
from geounfold.io.formats.registry import Meta, Points, Surface

INDEX = "project.json"
_VERSIONS = ("2.0", None)
_DEPTH = 8  # bits of an octree's position along each axis
_LEVEL_BITS = 4  # bits of its level, the lowest ones


@dataclass(frozen=True, eq=False)
class _File:
    """A file and its project's metadata."""

    path: Path
    metadata: dict[str, Any]

    def array(self, entry: dict[str, Any]) -> np.ndarray:
        """Return an array, (n,) or (n, wide); texts as objects."""
        with zipfile.ZipFile(self.path) as archive:
            content = archive.read(entry["array"])
        kind = str(entry["data_type"]).removesuffix("Array")
        if kind in ("String", "DateTime"):
            return np.array([str(word) for word in json.loads(content)], dtype=object)
        shape = [int(n) for n in entry["shape"]]
        if kind == "Boolean":
            bits = np.unpackbits(np.frombuffer(content, dtype=np.uint8))
            return bits[: int(np.prod(shape))].reshape(shape)
        little_endian = np.dtype(kind.lower()).newbyteorder("<")
        return np.frombuffer(content, dtype=little_endian).reshape(shape)

    def meta(self, entry: dict[str, Any]) -> Meta:
        own = entry.get("metadata", {}).get("coordinate_reference_system")
        whole = self.metadata.get("coordinate_reference_system")
        return coordinate_meta(self.metadata.get("units"), own or whole)


def elements(path: Path) -> list[Element]:
    """Return the elements of a file, including those of composites.

    Raises
    ------
    InputError
        The file has another version.
    """
    with zipfile.ZipFile(path) as archive:
        project = json.loads(archive.read(INDEX))
    if project.get("version") not in _VERSIONS:
        raise unread_version(path, project["version"])
    file = _File(path, project.get("metadata", {}))
    return [_element(file, entry) for entry in _flat(project["elements"])]


def _flat(entries: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for entry in entries:
        if "elements" in entry:
            yield from _flat(entry["elements"])
        else:
            yield entry


def _element(file: _File, entry: dict[str, Any]) -> Element:
    name = str(entry.get("name", ""))
    if "triangles" in entry:
        return Element(name, Kind.SURFACE, partial(_surface, file, entry))
    if "tensor_w" in entry or "block_count" in entry or "parent_block_count" in entry:
        return Element(name, Kind.BLOCKS, partial(_block_model, file, entry))
    if "vertices" in entry and "segments" not in entry:
        return Element(name, Kind.POINTS, partial(_points, file, entry))
    return Element(name, Kind.OTHER, partial(_points, file, entry))


def _points(file: _File, entry: dict[str, Any]) -> Points:
    xyz = np.asarray(file.array(entry["vertices"]), dtype=np.float64)
    values = values_by_name(_values(file, entry, ("vertices",)), len(xyz))
    return Points(xyz, values, file.meta(entry))


def _surface(file: _File, entry: dict[str, Any]) -> Surface:
    V = np.asarray(file.array(entry["vertices"]), dtype=np.float64)
    F = np.asarray(file.array(entry["triangles"]), dtype=np.int64)
    return Surface(V, F, file.meta(entry))


def _block_model(file: _File, entry: dict[str, Any]) -> Points:
    blocks, counts = _blocks(file, entry)
    found = list(_values(file, entry, ("cells", "sub_blocks")))
    own = np.repeat(np.arange(len(counts)), counts)  # of each block, its parent among those there
    found += of_parents(_values(file, entry, ("parent_blocks",)), own, len(counts))
    return block_points(blocks, found, file.meta(entry))


def _blocks(file: _File, entry: dict[str, Any]) -> tuple[Blocks, Ints]:
    """Return the blocks, and their number in each parent block that has any."""
    corner, axes = entry["corner"], [entry[f"axis_{a}"] for a in "uvw"]
    if "tensor_w" in entry:
        grid = tensor_grid(corner, axes, [entry[f"tensor_{a}"] for a in "uvw"])
    elif "block_count" in entry:
        grid = regular_grid(corner, axes, entry["block_count"], entry["block_size"])
    else:
        grid = regular_grid(corner, axes, entry["parent_block_count"], entry["parent_block_size"])
    parents = places(grid.shape, "u")
    counts = np.ones(len(parents), dtype=np.int64)
    if "cbc" in entry:
        counts = np.asarray(file.array(entry["cbc"]), dtype=np.int64)
        if len(counts) != len(parents) or counts.min(initial=0) < 0:
            raise ValueError(f"{len(counts)} counts of sub-blocks for {len(parents)} blocks")
    ijk = np.repeat(parents, counts, axis=0)
    low, high = _parts(file, entry, counts)
    return grid.blocks(ijk, low, high), counts[counts > 0]


def _parts(
    file: _File, entry: dict[str, Any], counts: Ints
) -> tuple[Floats | float, Floats | float]:
    """Return lower and upper corners of sub-blocks, as shares of their parent's sides."""
    if "zoc" in entry:
        low, side = _octree(np.asarray(file.array(entry["zoc"]), dtype=np.int64))
        return low, low + side
    if "sub_block_corners" in entry:
        low = np.asarray(file.array(entry["sub_block_corners"]), dtype=np.float64)
        # Rounding may make the sum of two shares greater than 1.
        sides = np.asarray(file.array(entry["sub_block_sizes"]), dtype=np.float64)
        return low, _to_whole(low + sides)
    if "sub_block_count" in entry:
        return _regular(np.asarray(entry["sub_block_count"], dtype=np.int64), counts)
    return 0.0, 1.0


def _regular(division: Ints, counts: Ints) -> tuple[Floats, Floats]:
    """Return the parts of blocks that are whole (count 1) or divided into equal parts."""
    many = int(division.prod())
    if not np.isin(counts, (0, 1, many)).all():
        raise ValueError("a block is divided into other than the stated number of sub-blocks")
    begin = places(division.tolist(), "u") / division
    end = (places(division.tolist(), "u") + 1) / division
    divided = np.repeat(counts == many, counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    low, high = np.zeros((len(number), 3)), np.ones((len(number), 3))
    low[divided], high[divided] = begin[number[divided]], end[number[divided]]
    return low, high


def _octree(curve: Ints) -> tuple[Floats, Floats]:
    """Return corner and side of octree sub-blocks, as shares of their block's sides.

    The last four bits of a value are the level. The bits above them are the corner, in units of
    1/256 of the block: bits 0, 3, 6, ... for u, 1, 4, 7, ... for v, and 2, 5, 8, ... for w.
    """
    level = curve & (2**_LEVEL_BITS - 1)
    if (level > _DEPTH).any() or (curve < 0).any():
        raise ValueError("an octree's sub-block has a level beyond 8")
    pointer = np.zeros((len(curve), 3), dtype=np.int64)
    for bit in range(_DEPTH):
        for axis in range(3):
            pointer[:, axis] |= (curve >> (_LEVEL_BITS + 3 * bit + axis) & 1) << bit
    return pointer / 2**_DEPTH, np.repeat(0.5 ** level[:, None], 3, axis=1)


def _to_whole(shares: Floats) -> Floats:
    near = np.abs(shares - 1) < 1e-12
    return np.asarray(np.where(near, 1.0, shares), dtype=np.float64)


def _values(
    file: _File, entry: dict[str, Any], locations: tuple[str, ...]
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield an element's attributes at some locations, categories as their words."""
    for attribute in entry.get("attributes", []):
        if attribute["location"] not in locations:
            continue
        array = file.array(attribute["array"])
        if "categories" in attribute:
            legend = attribute["categories"]
            named = zip(legend["indices"], legend["values"], strict=True)
            array = words_of(array, {int(code): str(word) for code, word in named})
        yield str(attribute.get("name", "")), array
