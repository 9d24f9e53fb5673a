"""Point location in the flat space of a body whose fault blocks were joined again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.body.fault_cells import FaultCells
from geounfold.geometry.mesh import Bools, Floats, Ints, TetMesh
from geounfold.mapping.mesh_space import MeshSpace, Place


@dataclass(frozen=True, eq=False)
class JoinedSpace:
    """The flat space of fault blocks that meet along cut-offs, with the interface of MeshSpace.

    The meshes of neighbours overlap by their shells, and by what rigid poses leave. A flat point
    is carried by the mesh through which it comes to lie in that mesh's own fault block; if several
    do, by the one in which it lies nearest to a block's centre.

    Attributes
    ----------
    spaces : sequence of (MeshSpace, (k,) int)
        For each fault block its flat space, and the numbers of its elements among those of all.
    folded : TetMesh
        All elements, folded.
    cells : FaultCells
        What gives a folded point its fault block.
    """

    spaces: tuple[tuple[MeshSpace, Ints], ...]
    folded: TetMesh
    cells: FaultCells

    def walked(self, x: Floats, y: Floats, z: Floats) -> tuple[Ints, Floats]:
        """Return what MeshSpace returns."""
        place = self.locate(np.stack([x, y, z], axis=1))
        return np.where(place.inside, place.element, -1), place.weights.T[1:]

    def locate(self, points: Floats) -> Place:
        """Return where points (n, 3) lie in the mesh and shell that carries them."""
        n = len(points)
        out = Place(np.full(n, -1), np.zeros(n, bool), np.zeros(n), np.zeros((n, 4)))
        best = np.full(n, np.inf)
        for part, (space, elements) in enumerate(self.spaces):
            rows = np.flatnonzero(space.may_hold(points))
            if not len(rows):
                continue
            found = space.locate(points[rows])
            held = found.element >= 0
            rank = np.full(len(rows), 4.0 * np.iinfo(np.int32).max)
            own = elements[np.maximum(found.element, 0)]
            rank[held] = self._rank(own[held], found.weights[held], part)
            rank += ~found.inside
            better = (rank < best[rows]) & held
            some = rows[better]
            best[some] = rank[better]
            out.element[some], out.inside[some] = own[better], found.inside[better]
            out.distance[some], out.weights[some] = found.distance[better], found.weights[better]
        return out

    def _rank(self, element: Ints, weights: Floats, part: int) -> Floats:
        """Return how well fault block ``part`` holds points in its elements; lower is better."""
        corners = self.folded.V[self.folded.T[element]]
        place = np.einsum("ij,ijk->ik", weights, corners)
        strange: Bools = self.cells.of(place) != part
        out: Floats = np.minimum(self.cells.off_centre(place), 0.9) + 2.0 * strange
        return out
