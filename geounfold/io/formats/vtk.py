"""VTK's XML and legacy files through pyvista: points, block models and triangles.

Floats are written and read as float64, bit for bit. Unit and coordinate reference are field data
called ``unit`` and ``crs``, because VTK has no entry for them.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.io.formats.grids import places, with_sides
from geounfold.io.formats.point_tables import flattened
from geounfold.io.formats.registry import Meta, Points, Surface, require

_META = ("unit", "crs")


def read_points(path: Path) -> Points:
    """Return the centres of a file's solid cells with cell data; without such cells, its points.

    Cells that VTK hides as ghosts are left out. Boxes get columns with their sides (dx, dy, dz);
    those of an image or another structured grid also get their indices (i, j, k).

    Raises
    ------
    InputError
        The file is damaged, or holds no points.
    """
    mesh = _read(path)
    solid = _solid(mesh)
    if solid.any():
        hidden = mesh.cell_data.get("vtkGhostType", np.zeros(mesh.n_cells, dtype=np.uint8))
        keep = solid & (np.asarray(hidden) == 0)
        centres = np.asarray(mesh.cell_centers().points, dtype=np.float64)
        values = _with_sides(mesh, _values(mesh.cell_data, mesh.n_cells, keep), keep)
        return Points(centres[keep], values, _meta(mesh))
    if not mesh.n_points:
        raise InputError(f"{path}: holds no points")
    keep = np.ones(mesh.n_points, dtype=bool)
    data = mesh.point_data
    points = np.asarray(mesh.points, dtype=np.float64)
    # If there is one vertex cell for each point, as in files written here, it may hold the values.
    if not len(data) and len(mesh.cell_data) and _is_cloud(mesh):
        data, points = mesh.cell_data, np.asarray(mesh.cell_centers().points, dtype=np.float64)
    return Points(points, _values(data, mesh.n_points, keep), _meta(mesh))


def write_points(path: Path, points: Points) -> None:
    """Write points as vertices with point data (.vtp poly data, .vtu unstructured grid)."""
    mesh = cloud(points.xyz, points.data)
    if path.suffix.lower() == ".vtu":
        mesh = mesh.cast_to_unstructured_grid()
    _save(mesh, path, points.meta)


def cloud(xyz: Floats, data: Mapping[str, np.ndarray]) -> Any:
    """Return points (n, 3) and their values (texts: object arrays) as pyvista poly data."""
    pyvista = require("pyvista", "VTK")

    mesh: Any = pyvista.PolyData(np.array(xyz, dtype=np.float64, order="C"))
    for name, values in data.items():
        if values.dtype == object:
            add_text(mesh.GetPointData(), name, values)
        else:
            mesh.point_data[name] = values
    return mesh


def hexahedra(corners: Floats, data: Mapping[str, np.ndarray]) -> Any:
    """Return cells of eight corners each, (n, 8, 3), and their values as a pyvista grid."""
    pyvista = require("pyvista", "VTK")

    n = len(corners)
    cells = np.column_stack([np.full(n, 8), np.arange(8 * n).reshape(n, 8)]).ravel()
    kinds = np.full(n, pyvista.CellType.HEXAHEDRON)
    grid: Any = pyvista.UnstructuredGrid(cells, kinds, np.ascontiguousarray(corners.reshape(-1, 3)))
    for name, values in data.items():
        if values.dtype == object:
            add_text(grid.GetCellData(), name, values)
        else:
            grid.cell_data[name] = values
    return grid


def read_surface(path: Path) -> Surface:
    """Return a poly data file's faces; polygons are cut into triangles."""
    pyvista = require("pyvista", "VTK")

    mesh = _read(path)
    if isinstance(mesh, pyvista.UnstructuredGrid):
        mesh = _faces_only(mesh)
    faces = isinstance(mesh, pyvista.PolyData)
    if not faces or not mesh.GetNumberOfPolys() + mesh.GetNumberOfStrips():
        raise InputError(f"{path}: holds no faces")
    triangles = mesh.triangulate()
    return Surface(
        np.asarray(triangles.points, dtype=np.float64),
        np.asarray(triangles.regular_faces, dtype=np.int64),
        _meta(mesh),
    )


def write_surface(path: Path, surface: Surface) -> None:
    """Write triangles as poly data."""
    pyvista = require("pyvista", "VTK")

    mesh = pyvista.PolyData.from_regular_faces(np.ascontiguousarray(surface.V), surface.F)
    _save(mesh, path, surface.meta)


def add_text(data: Any, name: str, words: Iterable[str]) -> None:
    """Add texts to a VTK object's point, cell or field data; pyvista itself takes ASCII only."""
    array = require("vtkmodules.vtkCommonCore", "VTK").vtkStringArray()
    array.SetName(name)
    for word in words:
        array.InsertNextValue(str(word))
    data.AddArray(array)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress VTK's messages on stderr; its error codes report the same."""
    vtkObject = require("vtkmodules.vtkCommonCore", "VTK").vtkObject

    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        yield
    finally:
        vtkObject.SetGlobalWarningDisplay(shown)


def _read(path: Path) -> Any:
    pyvista = require("pyvista", "VTK")

    try:
        with _quiet():
            reader = pyvista.get_reader(path)
            mesh = reader.read()
            code = reader.reader.GetErrorCode()
    except (ValueError, TypeError, RuntimeError, OSError, AttributeError) as error:
        words = " ".join(str(error).split())
        raise InputError(f"{path}: is not a VTK file of its ending: {words}") from error
    if code or mesh is None or not mesh.n_points:
        raise InputError(f"{path}: is not a VTK file of its ending, is damaged, or holds no points")
    return mesh


def _solid(mesh: Any) -> np.ndarray:
    """Return whether each cell has a volume, (n,)."""
    pyvista = require("pyvista", "VTK")

    if isinstance(mesh, pyvista.ImageData):
        return np.full(mesh.n_cells, min(mesh.dimensions) > 1 and bool(len(mesh.cell_data)))
    if isinstance(mesh, pyvista.RectilinearGrid | pyvista.StructuredGrid):
        filled = bool(len(mesh.cell_data)) or not len(mesh.point_data)
        return np.full(mesh.n_cells, min(mesh.dimensions) > 1 and filled)
    if not isinstance(mesh, pyvista.UnstructuredGrid):
        return np.zeros(mesh.n_cells, dtype=bool)
    flat = {
        int(getattr(pyvista.CellType, name))
        for name in (
            "EMPTY_CELL", "VERTEX", "POLY_VERTEX", "LINE", "POLY_LINE", "TRIANGLE",
            "TRIANGLE_STRIP", "POLYGON", "PIXEL", "QUAD",
        )
    }  # fmt: skip
    return ~np.isin(mesh.celltypes, list(flat))


def _with_sides(
    mesh: Any, values: dict[str, np.ndarray], keep: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the values of kept cells, with their sides if all of them are boxes."""
    pyvista = require("pyvista", "VTK")

    if isinstance(mesh, pyvista.ImageData):
        ijk = places([n - 1 for n in mesh.dimensions], "u")[keep]
        sides = np.broadcast_to(np.asarray(mesh.spacing, dtype=np.float64), ijk.shape)
        return with_sides(values, sides, ijk)
    if isinstance(mesh, pyvista.RectilinearGrid | pyvista.StructuredGrid):
        ijk = places([n - 1 for n in mesh.dimensions], "u")[keep]
        box = _box_sides(mesh.cast_to_unstructured_grid(), keep)
        return values if box is None else with_sides(values, box, ijk)
    box = _box_sides(mesh, keep)
    return values if box is None else with_sides(values, box)


def _faces_only(grid: Any) -> Any:
    """Return an unstructured grid whose cells all are faces as poly data, any other as it is."""
    pyvista = require("pyvista", "VTK")

    faces = [int(getattr(pyvista.CellType, name)) for name in ("TRIANGLE", "POLYGON", "QUAD")]
    whole = np.isin(grid.celltypes, faces).all()
    return pyvista.PolyData(grid.points, faces=grid.cells) if whole else grid


def _box_sides(mesh: Any, keep: np.ndarray) -> Floats | None:
    """Return the sides (n, 3) of kept cells; None unless all are boxes of one cell type."""
    pyvista = require("pyvista", "VTK")

    # Of a cell's eight corners: the ends of the three edges from the first, and the opposite one.
    ends = {
        int(pyvista.CellType.VOXEL): [1, 2, 4, 7],
        int(pyvista.CellType.HEXAHEDRON): [1, 3, 4, 6],
    }
    kinds = np.unique(mesh.celltypes[keep])
    if len(kinds) != 1 or int(kinds[0]) not in ends:
        return None
    corners = mesh.cells_dict[int(kinds[0])][keep[mesh.celltypes == kinds[0]]]
    points = np.asarray(mesh.points, dtype=np.float64)
    edges = points[corners[:, ends[int(kinds[0])]]] - points[corners[:, :1]]
    along, opposite = edges[:, :3], edges[:, 3]
    sides: Floats = np.linalg.norm(along, axis=2)
    # Corners are rounded to the precision of the file's floats.
    room = 1e-6 * sides.max(axis=1) + 8 * _spacing(mesh.points)
    skew = np.einsum("nac,nbc->nab", along, along) * (1 - np.eye(3))
    square = np.abs(skew).max(axis=(1, 2)) <= room * sides.max(axis=1)
    whole = np.abs(along.sum(axis=1) - opposite).max(axis=1) <= room
    return sides if (square & whole).all() else None


def _spacing(points: Any) -> float:
    """Return the distance between neighbouring floats at the largest coordinate."""
    return float(np.spacing(np.abs(points).max()))


def _is_cloud(mesh: Any) -> bool:
    """Return whether there is one vertex cell for each point and nothing else."""
    pyvista = require("pyvista", "VTK")

    if mesh.n_cells != mesh.n_points:
        return False
    if isinstance(mesh, pyvista.PolyData):
        return bool(mesh.n_verts == mesh.n_points)
    return isinstance(mesh, pyvista.UnstructuredGrid) and bool(
        (mesh.celltypes == int(pyvista.CellType.VERTEX)).all()
    )


def _values(data: Any, rows: int, keep: np.ndarray) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {}
    for name in data:
        if name != "vtkGhostType" and not name.startswith("vtkOriginal"):
            columns |= flattened(name, np.asarray(data[name]), rows)
    return {name: values[keep] for name, values in columns.items()}


def _meta(mesh: Any) -> Meta:
    return {
        name: str(np.asarray(mesh.field_data[name]).ravel()[0])
        for name in _META
        if name in mesh.field_data and np.asarray(mesh.field_data[name]).size
    }


def _save(mesh: Any, path: Path, meta: Meta) -> None:
    for name in _META:
        if name in meta:
            add_text(mesh.GetFieldData(), name, [meta[name]])
    save(mesh, path)


def save(mesh: Any, path: Path) -> None:
    """Write poly data (.vtp) or an unstructured grid (.vtu).

    pyvista's own `save` ignores the writer's error code, so on a full disk it leaves half a file
    without an error.

    Raises
    ------
    OSError
        The file could not be written whole.
    """
    xml = require("vtkmodules.vtkIOXML", "VTK")
    kinds = {".vtp": xml.vtkXMLPolyDataWriter, ".vtu": xml.vtkXMLUnstructuredGridWriter}
    writer = kinds[path.suffix.lower()]()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    with _quiet():
        written = writer.Write()
    if not written or writer.GetErrorCode():
        code = int(writer.GetErrorCode()) or errno.EIO
        raise OSError(code, os.strerror(code), str(path))
