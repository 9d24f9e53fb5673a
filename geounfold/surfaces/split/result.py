"""A surface whose faces are told apart as top, bottom and rim."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh


@dataclass(frozen=True)
class Candidate:
    """A pair of opposite sides among which a split chose.

    Attributes
    ----------
    name : str
        Its place among the body's pairs by area, or the whole hull.
    extent : float
        Area of its smaller side over the squared thickness between its sides.
    plane : bool
        Whether both sides are plane.
    measure : float
        What it was judged by (`geounfold.surfaces.split.pairs`); the largest is taken.
    taken : bool
        Whether the sheet's top and bottom are this pair.
    """

    name: str
    extent: float
    plane: bool
    measure: float
    taken: bool = False

    def row(self) -> dict[str, object]:
        """Return its figures for the summary."""
        return asdict(self)


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
    candidates : tuple of Candidate
        The pairs of opposite sides among which top and bottom were chosen, by area; empty if
        nothing was chosen (method ``normal``, given surfaces).
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
    candidates: tuple[Candidate, ...] = ()

    def scaled(self, factor: float) -> SurfaceSplit:
        """Return the split in another unit: lengths times a factor."""
        return replace(
            self,
            mesh=self.mesh.with_vertices(self.mesh.V * factor),
            thickness=self.thickness * factor,
            median_thickness=self.median_thickness * factor,
        )
