"""Surfaces given by the user, in place of an extracted hull: two references, or a solid's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geounfold.backends.igl import SurfaceIndex, triangle_adjacency
from geounfold.backends.meshlab import remesh
from geounfold.body.fill.between import facing_away
from geounfold.errors import HullError, InputError
from geounfold.geometry.measures import enclosed_volume, face_normals, triangle_areas
from geounfold.geometry.mesh import Floats, Ints, TriMesh
from geounfold.surfaces.hull import Hull, unsuitability
from geounfold.surfaces.hull._finish import finish, smoothed
from geounfold.surfaces.split.result import SurfaceSplit

EDGE = 1.5
"""Edge length to which reference surfaces are resampled, working units."""


SOLID = "solid"
"""Name of the hull that is a solid's own surface."""


def split_reference(top: TriMesh, bottom: TriMesh) -> SurfaceSplit:
    """Return two reference surfaces as a split hull without rim.

    Parameters
    ----------
    top, bottom : TriMesh
        Hanging wall and footwall in working units, in any orientation.

    Raises
    ------
    InputError
        The surfaces do not face each other anywhere.
    """
    upper, lower = (_resampled(mesh) for mesh in (top, bottom))
    upper, lower = facing_away(upper, lower), facing_away(lower, upper)
    V = np.concatenate([upper.V, lower.V])
    F = np.concatenate([upper.F, lower.F + len(upper.V)])
    side = np.repeat([1, -1], [len(upper.F), len(lower.F)])
    hit, distance = _opposite(V, F, len(upper.F))
    seen = hit >= 0
    if not seen.any():
        raise InputError(
            "the reference surfaces do not face each other; check --top and --bottom, and "
            "that they are in the points' coordinates"
        )
    median = float(np.median(distance[seen]))
    adjacency = triangle_adjacency(F)
    rim = ~seen | (distance > 2 * median) | (adjacency < 0).any(axis=1)
    beyond = np.zeros(len(F), dtype=bool)
    return SurfaceSplit(TriMesh(V, F), side, rim, hit, distance, median, adjacency, False, beyond)


COARSE = 6.0
"""Mean thickness of a solid, in blocks, below which its details are smoothed.

A mesh of blocks as large cannot follow them. On an overturned fold of 3.2 blocks 87 of 6,750 blocks
lay outside the mesh after 233 s; smoothed, none after 11 s, with horizons level to 3 %, for 5 % of
the blocks' own hull. Of 6.5 blocks smoothing would cost: level to 0.9 % for 0.7 %.
"""


def solid_hull(mesh: TriMesh, cells: Floats, volume: float) -> Hull:
    """Return a solid's own surface as the hull of its blocks.

    It has no stairs and is not blurred, so top and bottom are the solid's, not those of blocks.

    Parameters
    ----------
    mesh : TriMesh
        The closed surface, in the unit of the cells.
    cells : (n, 3) float
        Centres of the blocks, or of merged ones, whose side is one unit.
    volume : float
        Their volume.

    Raises
    ------
    HullError
        It has a handle, or does not hold the blocks.
    """
    hull = finish(mesh.V, mesh.F, method=SOLID, blocks=volume, edge=EDGE)
    area = float(triangle_areas(mesh.V, mesh.F).sum())
    if 2 * enclosed_volume(mesh.V, mesh.F) < COARSE * area:
        hull = smoothed(hull)
    handles = 1 - _euler(hull.mesh.F) // 2
    if handles:
        raise HullError(f"the solid's surface has {handles} handle{'s' if handles > 1 else ''}")
    fault = unsuitability(hull, cells)
    if fault:
        raise HullError(f"the solid's surface does not fit its blocks: {fault}")
    return replace(hull, reason="the surface of the solid that was given")


def _euler(F: Ints) -> int:
    """Return vertices less edges plus triangles of a closed surface."""
    return len(np.unique(F)) - len(F) // 2


def _resampled(mesh: TriMesh) -> TriMesh:
    V, F = remesh(mesh.V, mesh.F, EDGE, 3)
    return TriMesh(V, F)


def _opposite(V: Floats, F: np.ndarray, tops: int) -> tuple[np.ndarray, Floats]:
    """Return for each face the face of the other surface behind it, and the distance."""
    centres, normals = V[F].mean(axis=1), face_normals(V, F)
    hit = np.full(len(F), -1, dtype=np.int64)
    distance = np.full(len(F), np.inf)
    for mine, theirs, offset in (
        (slice(0, tops), F[tops:], tops),
        (slice(tops, None), F[:tops], 0),
    ):
        face, ray = SurfaceIndex(V, theirs).first_hit(centres[mine], -normals[mine])
        hit[mine] = np.where(face >= 0, face + offset, -1)
        distance[mine] = ray
    return hit, distance
