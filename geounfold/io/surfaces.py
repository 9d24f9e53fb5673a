"""Reference surfaces given by the user: mesh files, or tables of vertices and triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial import Delaunay

from geounfold.errors import BackendError, InputError, MeshError
from geounfold.io._text import listing
from geounfold.io.coordinates import numbers
from geounfold.io.points import PointTable, read_points
from geounfold.io.tables import TABLE_ENDINGS, ending, existing_file
from geounfold.mesh import Floats, Ints, TriMesh

MESH_ENDINGS = (".ply", ".obj", ".stl", ".off")
SURFACE_ENDINGS = (*MESH_ENDINGS, *TABLE_ENDINGS)
_CORNERS = (("v1", "v2", "v3"), ("v0", "v1", "v2"))
_LONG_EDGE = 4.0  # of the median edge: what the triangulation spans beyond the points' outline
_STEEP = 0.1  # cosine between a triangle and the mean plane below which it stands upright
_MOST_STEEP = 0.02  # share of upright triangles; a sheet that does not overhang has none


def read_surface(path: str | Path) -> TriMesh:
    """Return the triangulated surface of a file.

    Mesh files end in .ply, .obj, .stl or .off. A table (.csv, .csv.gz, .parquet) holds one
    vertex per row, and triangle k's three vertices beside vertex k in columns v1, v2, v3 (from
    1) or v0, v1, v2 (from 0), blank in the rows beyond the last triangle. A table of vertices
    alone is triangulated over its mean plane, which asks that the surface nowhere overhangs it.

    Raises
    ------
    InputError
        An unknown ending, a file that cannot be read, fewer than one triangle, vertex numbers
        out of range, or vertices alone that overhang their mean plane.
    """
    path = Path(path)
    kind = ending(path)
    if kind not in SURFACE_ENDINGS:
        existing_file(path)
        raise InputError(
            f"{path}: unknown kind of surface '{kind}'; files end in {', '.join(SURFACE_ENDINGS)}"
        )
    try:
        mesh = _from_mesh_file(path) if kind in MESH_ENDINGS else _from_table(read_points(path))
    except (MeshError, BackendError) as error:
        raise InputError(f"{path}: is not a surface: {' '.join(str(error).split())}") from error
    if not len(mesh.F):
        raise InputError(f"{path}: the surface has no triangles")
    return mesh


def _from_mesh_file(path: Path) -> TriMesh:
    from geounfold.backends import meshlab

    existing_file(path)
    vertices, faces = meshlab.read_mesh(path)
    return TriMesh(vertices, faces)


def _from_table(table: PointTable) -> TriMesh:
    """Return the surface of a table with or without triangles."""
    names = [str(n).strip().casefold() for n in table.frame.columns]
    for base, corners in ((1, _CORNERS[0]), (0, _CORNERS[1])):
        if set(corners) <= set(names):
            columns = [table.frame.iloc[:, names.index(c)] for c in corners]
            return TriMesh(table.points, _triangles(columns, base, table))
    if {"v1", "v2", "v0", "v3"} & set(names):
        found = [n for n in names if n in {"v0", "v1", "v2", "v3"}]
        raise InputError(
            f"{table.source}: triangles need columns v1, v2, v3 or v0, v1, v2, not {listing(found)}"
        )
    return _draped(table)


def _triangles(columns: list[pd.Series], base: int, table: PointTable) -> Ints:
    """Return vertex numbers (m, 3) from 0; rows beyond the last triangle are blank."""
    corners = np.column_stack([numbers(column, source=table.source) for column in columns])
    corners = corners[~np.isnan(corners).all(axis=1)]
    whole = np.isfinite(corners).all(axis=1) & (corners == np.round(corners)).all(axis=1)
    inside = whole & ((corners >= base) & (corners < base + len(table))).all(axis=1)
    if not inside.all():
        k = int(np.flatnonzero(~inside)[0])
        raise InputError(
            f"{table.source}: triangle {k + 1} has vertices {corners[k].tolist()}, but vertices "
            f"are numbered {base} to {base + len(table) - 1}"
        )
    return np.asarray(corners.astype(np.int64) - base, dtype=np.int64)


def _draped(table: PointTable) -> TriMesh:
    """Return the Delaunay triangulation of points seen across their mean plane."""
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
    """Return faces turned to one side of the mean plane; raise where many stand upright on it."""
    a, b, c = (table.points[faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    size = np.linalg.norm(cross, axis=1)
    cosine = cross @ (normal if normal[2] >= 0 else -normal) / np.where(size > 0, size, 1.0)
    upright = np.sign(cosine) * cosine < _STEEP
    if upright.mean() > _MOST_STEEP:
        raise InputError(
            f"{table.source}: a surface given by points alone must not overhang its mean plane, "
            f"but {upright.mean():.0%} of the triangles stand upright; give triangles "
            "(columns v1, v2, v3)"
        )
    turned = np.where((cosine < 0)[:, None], faces[:, ::-1], faces)
    return np.asarray(turned, dtype=np.int64)
