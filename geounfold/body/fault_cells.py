"""Fault blocks in space: a point belongs to the nearest blocks on its side of the faults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.fault_surface import FaultSurface
from geounfold.body.scattered import nearest_points
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers

_OWN = 1e-6  # blocks: a point nearer than that to a block's centre is that block

_REACH = 3.0
"""Distance from a fault, in the longest side of a block, within which its sides decide."""

_NEAREST = 40  # blocks near a point that are tried
_PER_BLOCK = 0.01  # weight of one block's distance beside one fault between


@dataclass(frozen=True, eq=False)
class FaultCells:
    """The blocks of every fault block, and the faults between them.

    A point near a fault belongs to the fault block of that near block which the fewest faults part
    from it, and among these to the nearest. Elsewhere the nearest block decides.

    Attributes
    ----------
    points : (n, 3) float
        Blocks that decide, working units.
    part : (n,) int
        Fault block of each.
    surfaces : tuple of FaultSurface
        The faults, working units.
    side : float
        Longest side of a block, working units.
    """

    points: Floats
    part: Ints
    surfaces: tuple[FaultSurface, ...]
    side: float

    @property
    def count(self) -> int:
        """Number of fault blocks."""
        return int(self.part.max()) + 1

    @cached_property
    def tree(self) -> cKDTree:
        """The blocks by place."""
        return cKDTree(self.points)

    @cached_property
    def _sides(self) -> list[tuple[Numbers, Floats]]:
        """For every fault, the side of each block and its distance."""
        seen = (surface.sides(self.points) for surface in self.surfaces)
        return [(np.sign(s.signed).astype(np.int32), s.distance) for s in seen]

    @cached_property
    def _near(self) -> Bools:
        """Whether a fault is so near each block that it may part a point from it."""
        out = np.zeros(len(self.points), dtype=bool)
        for _, distance in self._sides:
            out |= distance < 2 * _REACH * self.side
        return out

    def off_centre(self, points_work: Floats) -> Floats:
        """Return how far points (n, 3) lie from the nearest block's centre."""
        return nearest_points(self.tree, points_work, 1)[0]

    def of(self, points_work: Floats) -> Ints:
        """Return the fault block of points (n, 3), working units."""
        distance, nearest = self.tree.query(points_work)
        out: Ints = self.part[nearest].copy()
        rows = np.flatnonzero((distance > _OWN) & self._near[nearest])
        for start in range(0, len(rows), 1 << 15):
            some = rows[start : start + (1 << 15)]
            out[some] = self._by_side(points_work[some])
        return out

    @cached_property
    def _trees(self) -> list[tuple[cKDTree, Ints]]:
        """The blocks of each fault block by place, and their rows."""
        rows = [np.flatnonzero(self.part == k) for k in range(self.count)]
        return [(cKDTree(self.points[own]), own) for own in rows]

    def _by_side(self, points: Floats) -> Ints:
        count = min(_NEAREST, len(self.points))
        found = [nearest_points(self.tree, points, count)]
        for tree, own in self._trees:  # on a fault's other side a fault block may be far
            far, row = nearest_points(tree, points, 1)
            found.append((far[:, None], own[row][:, None]))
        distance = np.concatenate([d for d, _ in found], axis=1)
        near = np.concatenate([row for _, row in found], axis=1)
        parted = _PER_BLOCK * distance
        for surface, (sides, _) in zip(self.surfaces, self._sides, strict=True):
            seen = surface.sides(points)
            rows = np.flatnonzero(seen.distance < _REACH * self.side)
            parted[rows] += sides[near[rows]] != np.sign(seen.signed[rows])[:, None]
        best = near[np.arange(len(points)), parted.argmin(axis=1)]
        out: Ints = self.part[best]
        return out
