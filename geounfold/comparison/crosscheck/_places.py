"""Flat places of points by a mesh whose border follows the map and whose inside follows the border.

Two ways for the inside, both over the folded shape: each flat coordinate harmonic (cotangent
weights), or as rigid as possible (Sorkine and Alexa 2007, over tetrahedra: Chao et al. 2010).
"""

from __future__ import annotations

import numpy as np

from geounfold.backends.igl import (
    SurfaceIndex,
    TetDeformation,
    TetIndex,
    barycentric_in_tets,
    barycentric_in_triangles,
)
from geounfold.comparison.crosscheck._meshes import border
from geounfold.geometry.mesh import Floats, Ints, TetMesh
from geounfold.mapping.control_mesh import ControlMesh

_STILL = 1e-4  # blocks: local-global steps stop where no vertex moves farther
_STEPS = 200


class Follower:
    """A mesh of the control mesh's inside, with its border where our map lays it.

    Parameters
    ----------
    mesh : TetMesh
        Folded, working units.
    control : ControlMesh
        The map, working units.
    """

    def __init__(self, mesh: TetMesh, control: ControlMesh) -> None:
        self.mesh = mesh
        self._held: Ints = np.unique(border(mesh).F)
        self._places = border_places(mesh.V[self._held], control)
        self._inside = TetDeformation(mesh.V, mesh.T, self._held)
        self._harmonic: Floats | None = None

    def unfolded(self, interior: str) -> tuple[TetMesh, int]:
        """Return the unfolded mesh, and the local-global steps that it took.

        Raises
        ------
        BackendError
            libigl failed.
        """
        if self._harmonic is None:
            self._harmonic = self._inside.harmonic(self._places)
        if interior == "harmonic":
            return self.mesh.with_vertices(self._harmonic), 0
        V, steps = self._inside.rigid(self._places, self._harmonic, _STILL, _STEPS)
        return self.mesh.with_vertices(V), steps


def border_places(points: Floats, control: ControlMesh) -> Floats:
    """Return where the map lays points (n, 3) that lie on its border, or within rounding of it.

    Each goes with the closest place on the border.
    """
    surface = border(control.folded)
    _, face, closest = SurfaceIndex(surface.V, surface.F).closest(points)
    corners = surface.F[face]
    weights = barycentric_in_triangles(closest, surface.V, corners)
    out: Floats = np.einsum("ij,ijk->ik", weights, control.unfolded.V[corners])
    return out


class Carrier:
    """Points located once in a folded mesh, to be carried to any of its images.

    Attributes
    ----------
    found : (n,) bool
        Whether the mesh holds each point.
    """

    def __init__(self, mesh: TetMesh, points: Floats) -> None:
        element = TetIndex(mesh.V, mesh.T).locate(points)
        self.found = element >= 0
        self._corners = mesh.T[element[self.found]]
        self._weights = barycentric_in_tets(points[self.found], mesh.V, self._corners)

    def carry(self, image: TetMesh) -> Floats:
        """Return the points in an image of the mesh, (n, 3); NaN for those it does not hold."""
        out = np.full((len(self.found), 3), np.nan)
        out[self.found] = np.einsum("ij,ijk->ik", self._weights, image.V[self._corners])
        return out
