"""OMF 2: a zip archive of an index in JSON and of arrays as Parquet tables.

The archive's comment names format and version. In the index, geometries and attributes have a
``type``, and arrays have the name of their member. In the order of blocks and their values u runs
fastest. Sub-blocks are in any order, each with the indices of its parent block.
"""

from __future__ import annotations

import gzip
import io
import json
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.extras import require
from geounfold.geometry.mesh import Floats
from geounfold.io.formats.elements import Element, Kind
from geounfold.io.formats.grids import Blocks, Grid, places, regular_grid, tensor_grid
from geounfold.io.formats.omf.elements import (
    block_points,
    coordinate_meta,
    of_parents,
    unread_version,
    values_by_name,
    vector,
    words_of,
)
from geounfold.io.formats.registry import Meta, Points, Surface

COMMENT = b"Open Mining Format "
_INDEX = "index.json.gz"
_NO_ORIGIN = [0.0, 0.0, 0.0]
_AXES = {"u": [1.0, 0.0, 0.0], "v": [0.0, 1.0, 0.0], "w": [0.0, 0.0, 1.0]}


@dataclass(frozen=True, eq=False)
class _File:
    """A file and its project."""

    path: Path
    project: dict[str, Any]

    def table(self, entry: dict[str, Any]) -> Any:
        """Return an array as a table of pyarrow."""
        parquet = require("pyarrow.parquet", "OMF 2 files")

        with zipfile.ZipFile(self.path) as archive:
            content = archive.read(entry["filename"])
        table = parquet.read_table(io.BytesIO(content))
        if table.num_rows != entry["item_count"]:
            raise ValueError(
                f"{entry['filename']} has {table.num_rows} rows, not {entry['item_count']}"
            )
        return table

    def columns(self, entry: dict[str, Any], *names: str) -> np.ndarray:
        """Return columns of numbers beside each other, (n, columns)."""
        table = self.table(entry)
        return np.column_stack([table[name].to_numpy() for name in names])

    @property
    def origin(self) -> Floats:
        return vector(self.project.get("origin", _NO_ORIGIN))

    @property
    def meta(self) -> Meta:
        project = self.project
        return coordinate_meta(project.get("units"), project.get("coordinate_reference_system"))


def elements(path: Path) -> list[Element]:
    """Return the elements of a file, including those of composites.

    Raises
    ------
    InputError
        The file has another version.
    """
    with zipfile.ZipFile(path) as archive:
        version = archive.comment.removeprefix(COMMENT).decode("latin-1")
        if not re.match(r"2(\D|$)", version):
            raise unread_version(path, version)
        project = json.loads(gzip.decompress(archive.read(_INDEX)))
    file = _File(path, project)
    return [_element(file, entry) for entry in _flat(project.get("elements", []))]


def _flat(entries: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for entry in entries:
        if entry["geometry"]["type"] == "Composite":
            yield from _flat(entry["geometry"]["elements"])
        else:
            yield entry


_KINDS = {"PointSet": Kind.POINTS, "BlockModel": Kind.BLOCKS, "Surface": Kind.SURFACE}


def _element(file: _File, entry: dict[str, Any]) -> Element:
    kind = _KINDS.get(entry["geometry"]["type"], Kind.OTHER)
    loaders = {Kind.POINTS: _points, Kind.BLOCKS: _block_model, Kind.SURFACE: _surface}
    return Element(
        str(entry.get("name", "")), kind, partial(loaders.get(kind, _points), file, entry)
    )


def _points(file: _File, entry: dict[str, Any]) -> Points:
    xyz = _vertices(file, entry["geometry"])
    return Points(xyz, values_by_name(_values(file, entry, "Vertices"), len(xyz)), file.meta)


def _surface(file: _File, entry: dict[str, Any]) -> Surface:
    F = file.columns(entry["geometry"]["triangles"], "a", "b", "c").astype(np.int64)
    return Surface(_vertices(file, entry["geometry"]), F, file.meta)


def _vertices(file: _File, geometry: dict[str, Any]) -> Floats:
    V = file.columns(geometry["vertices"], "x", "y", "z").astype(np.float64)
    return np.asarray(V + vector(geometry.get("origin", _NO_ORIGIN)) + file.origin)


def _block_model(file: _File, entry: dict[str, Any]) -> Points:
    geometry = entry["geometry"]
    grid = _grid(file, geometry)
    if geometry.get("subblocks") is None:
        blocks = grid.blocks(places(grid.shape, "u"))
        return block_points(blocks, _values(file, entry, "Primitives"), file.meta)
    blocks = _subblocks(file, grid, geometry["subblocks"])
    found = list(_values(file, entry, "Subblocks"))
    parent = np.ravel_multi_index(tuple(blocks.ijk.T), grid.shape, order="F")
    found += of_parents(_values(file, entry, "Primitives"), parent, int(np.prod(grid.shape)))
    return block_points(blocks, found, file.meta)


def _grid(file: _File, geometry: dict[str, Any]) -> Grid:
    orient, grid = geometry["orient"], geometry["grid"]
    corner = vector(orient.get("origin", _NO_ORIGIN)) + file.origin
    axes = [orient.get(a, along) for a, along in _AXES.items()]
    if grid["type"] == "Regular":
        return regular_grid(corner, axes, grid["count"], grid["size"])
    if grid["type"] == "Tensor":
        return tensor_grid(corner, axes, [file.columns(grid[a], "scalar") for a in "uvw"])
    raise ValueError(f"a block model's grid is of the unknown type '{grid['type']}'")


def _subblocks(file: _File, grid: Grid, parts: dict[str, Any]) -> Blocks:
    names = [f"{what}_{a}" for what in ("parent", "corner_min", "corner_max") for a in "uvw"]
    table = file.columns(parts["subblocks"], *names).astype(np.float64)
    ijk = table[:, :3].astype(np.int64)
    if parts["type"] not in ("Regular", "Freeform"):
        raise ValueError(f"sub-blocks are of the unknown type '{parts['type']}'")
    division = vector(parts["count"]) if parts["type"] == "Regular" else np.ones(3)
    return grid.blocks(ijk, table[:, 3:6] / division, table[:, 6:] / division)


def _values(file: _File, entry: dict[str, Any], location: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield an element's attributes at a location; categories as their names."""
    for attribute in entry.get("attributes", []):
        data = attribute["data"]
        if attribute["location"] != location or "values" not in data:
            continue
        array = _plain(file.table(data["values"]))
        if data["type"] == "Category":
            names = _plain(file.table(data["names"]))
            array = words_of(np.nan_to_num(array, nan=-1), dict(enumerate(names)))
        yield str(attribute.get("name", "")), array


def _plain(table: Any) -> np.ndarray:
    """Return a table's one column; missing numbers are NaN, missing texts empty.

    Dates become texts; vectors and colours become rows of an (n, wide) array.
    """
    pa = require("pyarrow", "OMF 2 files")
    compute = require("pyarrow.compute", "OMF 2 files")

    column = table.column(0).combine_chunks()
    if pa.types.is_struct(column.type):
        return np.column_stack([_numbers(part) for part in column.flatten()])
    if pa.types.is_temporal(column.type):
        column = compute.cast(column, pa.string())
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        return np.array(column.fill_null("").to_pylist(), dtype=object)
    return _numbers(column)


def _numbers(column: Any) -> np.ndarray:
    """Return a column of numbers; if values are missing, as floats with NaN."""
    pa = require("pyarrow", "OMF 2 files")
    compute = require("pyarrow.compute", "OMF 2 files")

    if pa.types.is_boolean(column.type):
        column = compute.cast(column, pa.int8())
    if column.null_count:
        column = compute.cast(column, pa.float64(), safe=False)
    return np.asarray(column.to_numpy(zero_copy_only=False))
