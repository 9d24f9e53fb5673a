"""Reference surfaces given by the user: mesh files, or tables of vertices and triangles."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial import Delaunay

from geounfold.errors import BackendError, InputError, MeshError, OutputError
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.io.coordinate_columns import coordinate_columns, numbers
from geounfold.io.formats import Surface, find_format, point_endings, surface_endings
from geounfold.io.formats.elements import Kind, chosen
from geounfold.io.messages import listing, no_elements, rows_named
from geounfold.io.paths import TABLE_ENDINGS, ending, existing_file, wrong_kind
from geounfold.io.tables.files import Table, read_table, write_table
from geounfold.io.tables.points import PointTable, read_points

MESH_ENDINGS = surface_endings()
SURFACE_ENDINGS = (*MESH_ENDINGS, *TABLE_ENDINGS)
_CORNERS = (("v1", "v2", "v3"), ("v0", "v1", "v2"))
_LONG_EDGE = 4.0  # median edges above which a triangle lies outside the points' outline
_STEEP = 0.1  # cosine of a triangle's angle with the mean plane below which it is upright
_MOST_STEEP = 0.02  # share of upright triangles allowed; without an overhang there are none


def read_surface(path: str | Path, element: str | None = None) -> TriMesh:
    """Return the triangulated surface of a file.

    A table (.csv, .csv.gz, .parquet) holds one vertex per row. Row k also holds the vertex numbers
    of triangle k, in columns v1, v2, v3 (from 1) or v0, v1, v2 (from 0). If the numbers of
    vertices and triangles differ, the last rows of the fewer are blank. A table without triangles
    is triangulated over its mean plane, so the surface must not overhang that plane.

    Parameters
    ----------
    path : path
        A file with one of `SURFACE_ENDINGS`.
    element : str, optional
        Name of the surface to read, for a file of several (OMF, geoh5).

    Raises
    ------
    InputError
        The ending is unknown; the file cannot be read or holds no triangle; vertex numbers are out
        of range; or vertices without triangles overhang their mean plane.
    MissingDependencyError
        The format's library is not installed.
    """
    return read_surface_with_meta(path, element)[0]


def read_surface_with_meta(
    path: str | Path, element: str | None = None
) -> tuple[TriMesh, Mapping[str, str]]:
    """Return the surface of a file, and its unit and coordinate reference if it holds them."""
    path = existing_file(Path(path))
    kind = ending(path)
    if kind not in SURFACE_ENDINGS:
        usual = (".dxf", ".ts", ".stl", ".obj", ".ply", ".omf")
        raise InputError(wrong_kind(path, "surface", (*usual, *SURFACE_ENDINGS)))
    meta: Mapping[str, str] = {}
    try:
        found = find_format(kind, "reads_surface")
        if element is not None and (found is None or not found.elements):
            raise no_elements(path)
        if found is None:
            mesh = _from_table(path)
        else:
            module = found.load()
            more = (element,) if found.elements else ()
            surface = module.read_surface(path, *more)
            mesh, meta = TriMesh(surface.V, surface.F), surface.meta
    except (MeshError, BackendError) as error:
        raise InputError(f"{path}: is not a surface: {' '.join(str(error).split())}") from error
    if not len(mesh.F):
        raise InputError(f"{path}: the surface has no triangles")
    return mesh, meta


def holds_surface(path: str | Path, element: str | None = None) -> bool:
    """Return whether a file is a surface, by its ending, or by its content if the ending is shared.

    Raises
    ------
    InputError
        No such file; or the file holds surfaces and points, and no element is named.
    """
    path = existing_file(Path(path))
    kind = ending(path)
    if kind not in MESH_ENDINGS or kind == ".ts" or kind not in point_endings():
        return kind in MESH_ENDINGS
    found = find_format(kind, "reads_surface")
    if found is not None and found.elements:
        usable = (Kind.SURFACE, Kind.POINTS, Kind.BLOCKS)
        try:
            held = found.load().elements_of(path)
        except InputError:
            return False
        return any(e.kind in usable for e in held) and (
            chosen(path, held, usable, element).kind is Kind.SURFACE
        )
    try:
        read_surface(path)
    except InputError:
        return False
    return True


def write_surface(path: str | Path, mesh: TriMesh, meta: Mapping[str, str] | None = None) -> None:
    """Write a surface by the path's ending; tables have columns x, y, z, v1, v2, v3.

    Coordinates are read back bit for bit, except from .stl, which is in single precision. Vertices
    keep their order, except in .stl and .dxf, which do not number them. The file is written in
    place; `replacing` writes one that appears whole or not at all.

    Raises
    ------
    OutputError
        The ending is unknown, or the format cannot hold the values.
    MissingDependencyError
        The format's library is not installed.
    """
    path = Path(path)
    kind = ending(path)
    found = find_format(kind, "writes_surface")
    if found is not None:
        found.load().write_surface(path, Surface(mesh.V, mesh.F, meta or {}))
    elif kind in TABLE_ENDINGS:
        rows = range(max(len(mesh.V), len(mesh.F)))
        vertices = pd.DataFrame(mesh.V, columns=["x", "y", "z"]).reindex(rows)
        corners = pd.DataFrame(mesh.F + 1, columns=["v1", "v2", "v3"], dtype="Int64").reindex(rows)
        write_table(path, pd.concat([vertices, corners], axis=1))
    else:
        known = ", ".join((*surface_endings(writing=True), *TABLE_ENDINGS))
        raise OutputError(f"{path}: unknown kind of surface '{kind}'; files end in {known}")


def points_alone(path: Path) -> bool:
    """Return whether a file is a table of points without triangles."""
    if ending(path) not in TABLE_ENDINGS:
        return False
    names = {str(name).strip().casefold() for name in read_table(path).frame.columns}
    return not names & {"v0", "v1", "v2", "v3"}


def _from_table(path: Path) -> TriMesh:
    """Return the surface of a table with or without triangles."""
    table = read_table(path)
    names = [str(n).strip().casefold() for n in table.frame.columns]
    for base, corners in ((1, _CORNERS[0]), (0, _CORNERS[1])):
        if set(corners) <= set(names):
            columns = [table.frame.iloc[:, names.index(c)] for c in corners]
            points = _vertices(table, str(path))
            return TriMesh(points, _triangles(columns, base, len(points), str(path)))
    if {"v1", "v2", "v0", "v3"} & set(names):
        found = [n for n in names if n in {"v0", "v1", "v2", "v3"}]
        raise InputError(
            f"{path}: triangles need columns v1, v2, v3 or v0, v1, v2, not {listing(found)}"
        )
    return _draped(read_points(path))


def _vertices(table: Table, source: str) -> Floats:
    """Return the vertices of a table that has triangles; rows below the last vertex are blank."""
    where = coordinate_columns([str(n) for n in table.frame.columns], source=source)
    axes = [numbers(table.frame.iloc[:, i], source=source) for i in where]
    points = np.column_stack(axes)
    whole: Bools = np.asarray(np.isfinite(points).all(axis=1))
    count = int(np.flatnonzero(whole)[-1]) + 1 if whole.any() else 0
    bad = np.flatnonzero(~whole[:count]) + 1
    partly = np.flatnonzero(~np.isnan(points[count:]).all(axis=1)) + 1 + count
    if len(bad) or len(partly) or not count:
        rows = rows_named([*bad.tolist(), *partly.tolist()] or [1])
        raise InputError(f"{source}: missing or infinite coordinates of vertices: {rows}")
    return points[:count]


def _triangles(columns: list[pd.Series], base: int, count: int, source: str) -> Ints:
    """Return vertex numbers (m, 3) from 0; rows beyond the last triangle are blank."""
    corners = np.column_stack([numbers(column, source=source) for column in columns])
    corners = corners[~np.isnan(corners).all(axis=1)]
    whole = np.isfinite(corners).all(axis=1) & (corners == np.round(corners)).all(axis=1)
    inside = whole & ((corners >= base) & (corners < base + count)).all(axis=1)
    if not inside.all():
        k = int(np.flatnonzero(~inside)[0])
        raise InputError(
            f"{source}: triangle {k + 1} has vertices {corners[k].tolist()}, but vertices "
            f"are numbered {base} to {base + count - 1}"
        )
    return np.asarray(corners.astype(np.int64) - base, dtype=np.int64)


def _draped(table: PointTable) -> TriMesh:
    """Return the Delaunay triangulation of points projected onto their mean plane."""
    centred = table.points - table.points.mean(axis=0)
    if len(centred) < 3:
        raise InputError(f"{table.source}: a surface needs three points or more")
    spread, axes = np.linalg.svd(centred, full_matrices=False)[1:]
    if spread[1] <= 1e-9 * spread[0]:
        raise InputError(f"{table.source}: all points of the surface lie on a line")
    faces = Delaunay(centred @ axes[:2].T).simplices.astype(np.int64)
    edges = np.linalg.norm(table.points[faces] - table.points[np.roll(faces, 1, axis=1)], axis=2)
    faces = faces[edges.max(axis=1) <= _LONG_EDGE * np.median(edges)]
    faces = _upward(table, faces, axes[2])
    mesh = TriMesh(table.points, faces)
    return mesh.submesh(np.arange(len(faces)))[0]


def _upward(table: PointTable, faces: Ints, normal: Floats) -> Ints:
    """Return faces turned to one side of the mean plane; raise InputError if many are upright."""
    a, b, c = (table.points[faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    size = np.linalg.norm(cross, axis=1)
    cosine = cross @ (normal if normal[2] >= 0 else -normal) / np.where(size > 0, size, 1.0)
    upright = np.sign(cosine) * cosine < _STEEP
    if upright.mean() > _MOST_STEEP:
        raise InputError(
            f"{table.source}: a surface given by points alone must not overhang its mean plane, "
            f"but {upright.mean():.0%} of the triangles are upright; give triangles "
            "(columns v1, v2, v3)"
        )
    turned = np.where((cosine < 0)[:, None], faces[:, ::-1], faces)
    return np.asarray(turned, dtype=np.int64)
