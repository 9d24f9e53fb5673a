"""A body as a table of occupied lattice cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints

_PAD = 4  # empty cells around the body: room for the blur


@dataclass(frozen=True, eq=False)
class Voxels:
    """Occupied cells of a lattice, with an empty margin.

    Attributes
    ----------
    occupied : (a, b, c) bool
        Whether each cell of the box holds a block.
    cells : (n, 3) int
        Index of each given cell in the box.
    steps : (3,) float
        Sides of a cell, working units.
    low : (3,) int
        Lattice index of the box's first cell.
    """

    occupied: Bools
    cells: Ints
    steps: Floats
    low: Ints

    @classmethod
    def of(cls, cells: Ints, steps: Floats) -> Voxels:
        """Return the box around lattice cells (n, 3)."""
        first, last = bounds(cells)
        low = first - _PAD
        inside = cells - low
        occupied = np.zeros(last - low + 1 + _PAD, dtype=bool)
        occupied[tuple(inside.T)] = True
        return cls(occupied, inside, steps, low)

    @property
    def stride(self) -> Ints:
        """Difference between the flat indices of neighbours along each axis, (3,)."""
        _, b, c = self.occupied.shape
        return np.array([b * c, c, 1])

    def flat(self, places: Floats) -> Ints:
        """Return the flat index of the cell that holds each place (k, 3), box coordinates."""
        cells = np.rint(places / self.steps).astype(np.int64)
        np.clip(cells, 0, np.array(self.occupied.shape) - 1, out=cells)
        out: Ints = cells @ self.stride
        return out
