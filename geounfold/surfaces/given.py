"""Reference surfaces given by the user, in place of an extracted hull."""

from __future__ import annotations

import numpy as np

from geounfold.backends.igl import SurfaceIndex, triangle_adjacency
from geounfold.backends.meshlab import remesh
from geounfold.errors import InputError
from geounfold.geometry.measures import face_normals
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.surfaces.split.result import SurfaceSplit

EDGE = 1.5
"""Edge length to which reference surfaces are resampled, working units."""


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
    upper, lower = _facing_away(upper, lower), _facing_away(lower, upper)
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


def _resampled(mesh: TriMesh) -> TriMesh:
    V, F = remesh(mesh.V, mesh.F, EDGE, 3)
    return TriMesh(V, F)


def _facing_away(mesh: TriMesh, other: TriMesh) -> TriMesh:
    """Return a surface with its normals turned away from the other."""
    centres = mesh.V[mesh.F].mean(axis=1)
    nearest = SurfaceIndex(other.V, other.F).closest(centres)[2]
    outward = np.einsum("ij,ij->i", centres - nearest, face_normals(mesh.V, mesh.F))
    return mesh if outward.sum() >= 0 else TriMesh(mesh.V, mesh.F[:, ::-1])


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
