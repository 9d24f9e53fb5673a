"""geoh5, the open format of Geoscience ANALYST, through geoh5py (extra ``formats``).

One object of a workspace is read: a set of points, a block model's cells with their sides (dx, dy,
dz) and indices (i, j, k), or a surface. If several fit, the user names one. The object's coordinate
reference and the workspace's unit are kept. A workspace must have a unit, so it is metres if the
data have none, as in the library itself. Floats are read back bit for bit, whole numbers beyond 32
bits as floats.

On Python 3.11 geoh5py needs NumPy below 2, with which geounfold does not work. The extra therefore
installs it from Python 3.12 on.
"""

from __future__ import annotations

import errno
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from geounfold.errors import InputError, MissingDependencyError, OutputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.formats.elements import Element, Kind, chosen
from geounfold.io.formats.grids import with_sides
from geounfold.io.formats.point_tables import flattened
from geounfold.io.formats.registry import Meta, Points, Surface, require
from geounfold.io.formats.units import unit_name

_WORDS = {"m": "meter", "ft": "feet"}
_LARGEST = 2**31 - 1
_OWN = {"Visual Parameters", "A3D Node Data", "UserComments"}


def read_points(path: Path, element: str | None = None) -> Points:
    """Return the set of points of a workspace, or the cells of its block model.

    Parameters
    ----------
    path : path
        The file.
    element : str, optional
        Name of the object, if there are several.

    Raises
    ------
    InputError
        The file is no geoh5 file; it has no such object, or several and none is named.
    """
    with _workspace(path) as (workspace, objects):
        found = chosen(path, _elements(workspace, objects), (Kind.POINTS, Kind.BLOCKS), element)
        points: Points = found.load()
        return replace(points, element=found.name)


def _points(workspace: Any, found: Any) -> Points:
    xyz = np.asarray(found.vertices, dtype=np.float64)
    return Points(xyz, _values(found, "VERTEX", len(xyz)), _meta(workspace, found))


def _blocks(workspace: Any, model: Any) -> Points:
    xyz = np.asarray(model.centroids, dtype=np.float64)
    values = with_sides(_values(model, "CELL", len(xyz)), *_cells(model))
    return Points(xyz, values, _meta(workspace, model))


def _surface(workspace: Any, surface: Any) -> Surface:
    return Surface(
        np.asarray(surface.vertices, dtype=np.float64),
        np.asarray(surface.cells, dtype=np.int64),
        _meta(workspace, surface),
    )


def write_points(path: Path, points: Points) -> None:
    """Write a workspace of one set of points."""
    if not np.isfinite(points.xyz).all():
        raise OutputError("geoh5 files need finite coordinates")
    data: dict[str, Any] = {}
    for name, values in points.data.items():
        if values.dtype == object:
            data[name] = {"values": values.astype(str), "type": "text"}
        elif values.dtype.kind == "i" and np.abs(values).max(initial=0) < _LARGEST:
            data[name] = {"values": values.astype(np.int32)}
        else:
            data[name] = {"values": values.astype(np.float64)}
    with _created(path, points.meta) as (workspace, objects):
        made = objects.Points.create(workspace, name=path.stem, vertices=points.xyz)
        _refer(made, points.meta)
        if data:
            made.add_data(data)


def read_surface(path: Path, element: str | None = None) -> Surface:
    """Return the surface of a workspace, or that of a name."""
    with _workspace(path) as (workspace, objects):
        found = chosen(path, _elements(workspace, objects), (Kind.SURFACE,), element)
        surface: Surface = found.load()
        return surface


def write_surface(path: Path, surface: Surface) -> None:
    """Write a workspace of one surface."""
    with _created(path, surface.meta) as (workspace, objects):
        made = objects.Surface.create(
            workspace, name=path.stem, vertices=surface.V, cells=surface.F
        )
        _refer(made, surface.meta)


def _library() -> tuple[ModuleType, ModuleType]:
    """Return the library's workspaces and objects."""
    library = require("geoh5py.workspace", "geoh5")
    if not hasattr(library.Workspace, "create"):
        raise MissingDependencyError(
            "geoh5 files need geoh5py 0.13 or later, which is here from Python 3.12 on: "
            "pip install 'geounfold[formats]' there"
        )
    return library, require("geoh5py.objects", "geoh5")


@contextmanager
def _workspace(path: Path) -> Iterator[tuple[Any, Any]]:
    """Yield a file's workspace and the library's objects."""
    library, objects = _library()
    try:
        workspace = library.Workspace(path, mode="r")
    except Exception as error:  # the library raises errors of many classes
        words = " ".join(str(error).split())
        raise InputError(f"{path}: is not a geoh5 file, or is damaged: {words}") from error
    with workspace:
        yield workspace, objects


@contextmanager
def _created(path: Path, meta: Meta) -> Iterator[tuple[Any, Any]]:
    """Yield a new workspace and the library's objects."""
    library, objects = _library()
    unit = meta.get("unit", "m")
    try:
        with (
            warnings.catch_warnings(),
            library.Workspace.create(path, distance_unit=_WORDS.get(unit, unit)) as workspace,
        ):
            warnings.simplefilter("ignore")
            yield workspace, objects
    except RuntimeError as error:  # HDF5 raises it for a full disk, among others
        code = errno.ENOSPC if os.strerror(errno.ENOSPC) in str(error) else errno.EIO
        raise OSError(code, os.strerror(code), str(path)) from error


def elements_of(path: Path) -> list[Element]:
    """Return the objects of a workspace, by name and kind."""
    with _workspace(path) as (workspace, objects):
        return _elements(workspace, objects)


def _elements(workspace: Any, objects: Any) -> list[Element]:
    """Return the objects of a workspace, in its order."""
    readers = {
        objects.Points: (Kind.POINTS, _points),
        objects.BlockModel: (Kind.BLOCKS, _blocks),
        objects.Surface: (Kind.SURFACE, _surface),
    }
    found = []
    for made in workspace.objects:
        kind, load = readers.get(type(made), (Kind.OTHER, _surface))
        found.append(Element(str(made.name), kind, partial(load, workspace, made)))
    return found


def _values(parent: Any, location: str, rows: int) -> dict[str, np.ndarray]:
    """Return an object's data by name; referenced data as their words."""
    columns: dict[str, np.ndarray] = {}
    for child in parent.children:
        association = getattr(getattr(child, "association", None), "name", "")
        values = getattr(child, "values", None)
        if association != location or values is None or child.name in _OWN:
            continue
        array = np.asarray(values)
        named = getattr(child, "value_map", None)
        if named is not None:
            words = dict(named.map)
            array = np.array([str(words.get(int(v), "")) for v in array], dtype=object)
        if array.size and array.size % rows == 0:
            columns |= flattened(child.name, array, rows)
    return columns


def _cells(model: Any) -> tuple[Floats, Ints]:
    """Return sides and indices of a block model's cells, in the order of its centroids.

    Steps along z are negative if the cells are counted downwards.
    """
    widths = [np.abs(np.asarray(getattr(model, f"{a}_cells"), dtype=np.float64)) for a in "uvz"]
    # The library's order of centroids: z runs fastest, then u, then v.
    v, u, z = np.unravel_index(
        np.arange(model.n_cells), (len(widths[1]), len(widths[0]), len(widths[2]))
    )
    ijk = np.column_stack([u, v, z]).astype(np.int64)
    return np.column_stack([widths[a][ijk[:, a]] for a in range(3)]), ijk


def _refer(made: Any, meta: Meta) -> None:
    if "crs" in meta:
        made.coordinate_reference_system = {"Code": meta["crs"], "Name": meta["crs"]}


def _meta(workspace: Any, found: Any) -> Meta:
    meta = {"unit": unit_name(str(workspace.distance_unit))}
    reference = found.coordinate_reference_system or {}
    code = str(reference.get("Code", "Unknown"))
    return meta if code == "Unknown" else {**meta, "crs": code}
