"""Unfolded positions of points by a mesh of which only the border is taken from the map.

The inside follows the border in one of two ways, both computed on the folded shape.  Either each
unfolded coordinate is harmonic (cotangent weights), or the inside is as rigid as possible (Sorkine
and Alexa 2007; over tetrahedra, Chao et al. 2010).
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

_STILL = 1e-4  # blocks: local-global steps stop when no vertex moves farther
_STEPS = 200  # local-global steps at most


class Follower:
    """A mesh of the control mesh's inside, unfolded by its border alone.

    Parameters
    ----------
    mesh : TetMesh
        The folded mesh, in working units.
    control : ControlMesh
        The map that gives the border's unfolded positions, in working units.
    """

    def __init__(self, mesh: TetMesh, control: ControlMesh) -> None:
        self.mesh = mesh
        self._held: Ints = np.unique(border(mesh).F)
        self._places = border_places(mesh.V[self._held], control)
        self._inside = TetDeformation(mesh.V, mesh.T, self._held)
        self._harmonic: Floats | None = None

    def unfolded(self, interior: str) -> tuple[TetMesh, int]:
        """Return the unfolded mesh and the number of local-global steps.

        Parameters
        ----------
        interior : {"harmonic", "arap"}
            How the inside follows the border.

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
    """Return the unfolded positions of points (n, 3) on the map's border, to within rounding.

    Each point moves with the closest point of the border.
    """
    surface = border(control.folded)
    _, face, closest = SurfaceIndex(surface.V, surface.F).closest(points)
    corners = surface.F[face]
    weights = barycentric_in_triangles(closest, surface.V, corners)
    out: Floats = np.einsum("ij,ijk->ik", weights, control.unfolded.V[corners])
    return out


class Carrier:
    """Points located once in a folded mesh, and then carried to any image of it.

    Attributes
    ----------
    found : (n,) bool
        Whether each point lies inside the mesh.
    """

    def __init__(self, mesh: TetMesh, points: Floats) -> None:
        element = TetIndex(mesh.V, mesh.T).locate(points)
        self.found = element >= 0
        self._corners = mesh.T[element[self.found]]
        self._weights = barycentric_in_tets(points[self.found], mesh.V, self._corners)

    def carry(self, image: TetMesh) -> Floats:
        """Return the points in an image of the mesh, (n, 3); NaN for points outside the mesh."""
        out = np.full((len(self.found), 3), np.nan)
        out[self.found] = np.einsum("ij,ijk->ik", self._weights, image.V[self._corners])
        return out
