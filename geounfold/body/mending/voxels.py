"""A body as voxels: its lattice cells in a box with empty cells around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Ints

MARGIN = 6
"""Layers of empty cells around the body: more than the widest closing reaches."""

LARGEST = 400_000_000
"""Number of cells of a box up to which it is used; a cell takes up to five bytes."""


@dataclass(frozen=True, eq=False)
class VoxelBody:
    """The cells of a body in a box.

    Attributes
    ----------
    full : (i, j, k) bool
        Whether each cell of the box is the body's.
    low : (3,) int
        Lattice cell of the box's first one.
    """

    full: Bools
    low: Ints

    @classmethod
    def of(cls, cells: Ints) -> VoxelBody | None:
        """Return the voxel body of cells (n, 3); None if its box were too large."""
        first, last = bounds(cells)
        low = first - MARGIN
        shape = last - low + 1 + MARGIN
        if float(np.prod(shape.astype(float))) > LARGEST:
            return None
        full = np.zeros(shape, dtype=bool)
        full[tuple((cells - low).T)] = True
        return cls(full, low)

    def at(self, cells: Ints, values: Bools) -> Bools:
        """Return the values (i, j, k) of the box at lattice cells (n, 3), (n,)."""
        out: Bools = values[tuple((cells - self.low).T)]
        return out

    def cells(self, chosen: Bools) -> Ints:
        """Return the lattice cells (m, 3) of those chosen in the box (i, j, k)."""
        out: Ints = np.argwhere(chosen) + self.low
        return out
