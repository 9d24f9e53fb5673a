"""Faces of a hull: what each one faces, creases, valleys and ridges."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.backends import igl as _igl
from geounfold.errors import NoSheetError, SplitError
from geounfold.geometry.measures import (
    bilateral_normals,
    face_normals,
    triangle_areas,
    unit,
    vertex_normals,
)
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh

SAME_WAY = 0.866
"""Cosine (30 degrees) above which two directions count as the same.

Neighbours' normals across no crease of the rim; the inward normal and the way to a near face.
Measured: twice the angle changes the rim by up to 30 % of the area at creases, 6 % at near faces.
"""

CREASE_WIDTH = 0.05
"""1 - cosine of two neighbours at which their pull has fallen to 1/e.

Of 106 hulls, half or twice moves sides by 1 % of the area or more on 80, by 44 % at most.
"""

FACING = 0.5
"""Cosine -N.N' above which two faces are opposite.

Measured: half the angle refuses two sheets; twice moves the rim by up to 6 % of the area.
"""

THICKEST = 2.0
"""Length of a ray, in median thicknesses, above which it has missed the other side.

Measured: half changes the rim of every hull, by up to 43 % of the area; twice by up to 19 %.
"""

NEARBY = 1.5
"""Distance, in median thicknesses, within which the nearest face of the other side is opposite.

Measured: half changes the rim by up to 13 % of the area, twice by up to 6 %.
"""

SWEEPS = 12
"""Bilateral sweeps that smooth the normals.

Measured: half or twice moves sides by up to 37 % of the area, by 1 % or more on 14 of 106 hulls.
"""


@dataclass(frozen=True, eq=False)
class Faces:
    """What both methods measure on the hull's faces.

    ``facing`` is -N.N' of a face and its opposite one, ``blunt`` the same of normals averaged
    over the vertices' faces: at the inside of a tight hinge a ray may meet any of its steep
    faces.  ``other`` marks faces known to belong to another pair of sides than the sheet's.
    """

    centre: Floats
    normal: Floats
    smoothed: Floats
    area: Floats
    adjacency: Ints
    hit: Ints
    distance: Floats
    facing: Floats
    blunt: Floats
    median: float
    other: Bools


def measure_faces(mesh: TriMesh) -> Faces:
    """Return normals, areas, neighbours and opposite faces."""
    V = mesh.V - mesh.V.mean(axis=0)
    N = face_normals(V, mesh.F)
    adjacency = _igl.triangle_adjacency(mesh.F)
    if (adjacency < 0).any():
        raise SplitError("the hull is not closed, so it has no inside; try hull 'density'")
    centre = V[mesh.F].mean(axis=1)
    start = centre - 1e-3 * N
    hit, distance = _igl.SurfaceIndex(V, mesh.F).first_hit(start, -N)
    facing = np.where(hit >= 0, -np.einsum("ij,ij->i", N, N[hit]), 0.0)
    across = facing > FACING
    if not across.any():
        raise NoSheetError("no two faces of the body look at each other, so there is no sheet")
    area = triangle_areas(V, mesh.F)
    M = unit(vertex_normals(V, mesh.F)[mesh.F].sum(axis=1))
    blunt = np.where(hit >= 0, -np.einsum("ij,ij->i", M, M[hit]), 0.0)
    smoothed = bilateral_normals(mesh, adjacency, SWEEPS, CREASE_WIDTH)
    median = float(np.median(distance[across]))
    other = np.zeros(len(N), dtype=bool)
    return Faces(centre, N, smoothed, area, adjacency, hit, distance, facing, blunt, median, other)


def valleys(faces: Faces, normal: Floats) -> Bools:
    """Return which of each face's neighbours rise above its plane, (m, 3)."""
    rise = faces.centre[faces.adjacency] - faces.centre[:, None]
    return np.asarray(np.einsum("ikj,ij->ik", rise, normal) > 0)


def ridges(faces: Faces, normal: Floats, limit: float) -> Bools:
    """Return across which edges the surface falls away at a cosine below the limit, (m, 3)."""
    cosine = np.einsum("ij,ikj->ik", normal, normal[faces.adjacency])
    out: Bools = (cosine < limit) & ~valleys(faces, normal)
    return out


def unmet_faces(faces: Faces, side: Ints) -> Bools:
    """Return the faces whose inward ray met no face of the other side that looks back, (m,)."""
    unmet: Bools = (faces.hit < 0) | (np.maximum(faces.facing, faces.blunt) < FACING)
    unmet |= (faces.distance > THICKEST * faces.median) | (side[faces.hit] == side)
    return unmet


def met_nearby(mesh: TriMesh, faces: Faces, side: Ints) -> Faces:
    """Return the faces, those that met nothing opposite the nearest face of the other side.

    The ray from the outside of a tight hinge misses the slit between the limbs and runs on
    along one of them, though the slit's end is near.  The nearest point counts if it lies
    within 30 degrees of the inward normal and 1.5 thicknesses away.  ``side`` (m,) is 0 on
    faces already known to be rim.
    """
    unmet = unmet_faces(faces, side)
    hit, distance, facing = faces.hit.copy(), faces.distance.copy(), faces.facing.copy()
    for s in (1, -1):
        mine, theirs = np.flatnonzero(unmet & (side == s)), np.flatnonzero(side == -s)
        if not (len(mine) and len(theirs)):
            continue
        index = _igl.SurfaceIndex(mesh.V - mesh.V.mean(axis=0), mesh.F[theirs])
        far, face, foot = index.closest(faces.centre[mine])
        way = unit(foot - faces.centre[mine])
        ahead = -np.einsum("ij,ij->i", way, faces.smoothed[mine]) > SAME_WAY
        good = ahead & (far < NEARBY * faces.median)
        rows = mine[good]
        hit[rows], distance[rows], facing[rows] = theirs[face[good]], far[good], 1.0
    return replace(faces, hit=hit, distance=distance, facing=facing)
