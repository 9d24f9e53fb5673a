"""Two open surfaces that bound a body: which sides of them face each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.igl import SurfaceIndex, face_components
from geounfold.backends.igl_solids import coherent
from geounfold.errors import InputError
from geounfold.geometry.measures import face_normals, triangle_areas
from geounfold.geometry.mesh import Floats, TriMesh


@dataclass(frozen=True, eq=False)
class Pair:
    """The surfaces above and below a body, their normals turned away from it.

    Attributes
    ----------
    top, bottom : TriMesh
        The surfaces, in the data's coordinates.
    thickness : float
        Median distance from one surface to the other.
    """

    top: TriMesh
    bottom: TriMesh
    thickness: float

    @property
    def volume(self) -> float:
        """About the volume between them: the smaller area times the distance."""
        areas = [float(triangle_areas(m.V, m.F).sum()) for m in (self.top, self.bottom)]
        return min(areas) * self.thickness


def facing_pair(top: TriMesh, bottom: TriMesh) -> Pair:
    """Return two surfaces turned away from each other.

    Raises
    ------
    InputError
        They are one surface, or lie in each other.
    """
    upper, lower = (TriMesh(mesh.V, coherent(mesh.F)) for mesh in (top, bottom))
    distance = np.concatenate([_distance(upper, lower), _distance(lower, upper)])
    thickness = float(np.median(distance))
    if not thickness > 0:
        raise InputError(
            "--top and --bottom are the same surface, so that nothing lies between them"
        )
    return Pair(facing_away(upper, lower), facing_away(lower, upper), thickness)


def facing_away(mesh: TriMesh, other: TriMesh) -> TriMesh:
    """Return a surface with the normals of each of its parts turned away from another surface."""
    centres = mesh.V[mesh.F].mean(axis=1)
    nearest = SurfaceIndex(other.V, other.F).closest(centres)[2]
    outward = np.einsum("ij,ij->i", centres - nearest, face_normals(mesh.V, mesh.F))
    part = face_components(mesh.F)
    total = np.bincount(part, outward * triangle_areas(mesh.V, mesh.F))
    return TriMesh(mesh.V, np.where((total < 0)[part][:, None], mesh.F[:, ::-1], mesh.F))


def _distance(mesh: TriMesh, other: TriMesh) -> Floats:
    """Return the distance of each triangle's centre from another surface."""
    return SurfaceIndex(other.V, other.F).closest(mesh.V[mesh.F].mean(axis=1))[0]
