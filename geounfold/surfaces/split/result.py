"""A surface whose faces are told apart as top, bottom and rim."""

from __future__ import annotations

from dataclasses import dataclass, replace

from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh


@dataclass(frozen=True, eq=False)
class SurfaceSplit:
    """A hull's faces labelled as top, bottom or rim.

    Attributes
    ----------
    mesh : TriMesh
        The hull that was split, in working units.
    side : (m,) int
        +1 on the top's half of the hull, -1 on the bottom's, 0 undecided.
    rim : (m,) bool
        True on the rim: no opposite face, or near the change of side, or past a crease.
    opposite : (m,) int
        Face met first by the ray along the inward normal; -1 for none.
    thickness : (m,) float
        Length of that ray, working units; inf for none.
    median_thickness : float
        Median thickness where the opposite face looks back.
    adjacency : (m, 3) int
        Neighbouring face across each edge; -1 for none.
    flipped_up : bool
        True when the caller's ``up`` (or the default) turned the two sides round.
    beyond : (m,) bool
        True on flanks and ends: faces that a ridge parts from top and bottom.
    """

    mesh: TriMesh
    side: Ints
    rim: Bools
    opposite: Ints
    thickness: Floats
    median_thickness: float
    adjacency: Ints
    flipped_up: bool
    beyond: Bools

    def scaled(self, factor: float) -> SurfaceSplit:
        """Return the split in another unit: lengths times a factor."""
        return replace(
            self,
            mesh=self.mesh.with_vertices(self.mesh.V * factor),
            thickness=self.thickness * factor,
            median_thickness=self.median_thickness * factor,
        )
