"""The blocks of a body as occupied cells of its lattice: which points lie in the body."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from geounfold.errors import InputError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints

_MOST = 1 << 28  # cells of the body's box; more are not kept: 32 MB of bits, 256 MB unpacked
_NEAR = 32  # cells with the nearest centres, among which the one with the nearest face is sought
_FACE = 1e-6  # of a cell: points this near to a face lie in the cells on both sides


@dataclass(frozen=True, eq=False)
class BodyCells:
    """Occupied cells of a lattice.

    Attributes
    ----------
    lowest : (3,) int
        Lowest indices of the cells' box.
    shape : (3,) int
        Number of cells of the box along each axis.
    bits : (k,) uint8
        Whether each cell of the box is occupied, eight to a byte, the last axis fastest.
    steps : (3,) float
        Sides of a cell, working units. Cell i reaches from i - 0.5 to i + 0.5 steps.
    """

    lowest: Ints
    shape: Ints
    bits: np.ndarray
    steps: Floats

    @classmethod
    def of(cls, cells: Ints, steps: Floats) -> BodyCells | None:
        """Return occupied cells (n, 3); None if their box has more than 2**28 cells."""
        lowest, last = bounds(cells)
        shape = last - lowest + 1
        if np.prod(shape.astype(np.float64)) > _MOST:
            return None
        filled = np.zeros(shape, dtype=bool)
        filled[tuple((cells - lowest).T)] = True
        return cls.of_table(filled, lowest, steps)

    @classmethod
    def of_table(cls, filled: Bools, lowest: Ints, steps: Floats) -> BodyCells | None:
        """Return the occupied cells of a box (a, b, c); None if it has more than 2**28 cells."""
        if filled.size > _MOST:
            return None
        return cls(lowest, np.array(filled.shape), np.packbits(filled), steps)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the cells as arrays of a map file."""
        return {"body_lowest": self.lowest, "body_shape": self.shape, "body_bits": self.bits}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Any], steps: Floats | None) -> BodyCells | None:
        """Return the cells in the arrays of a map file; None if it has none.

        Raises
        ------
        InputError
            The arrays do not fit each other.
        """
        lowest, shape = (arrays[n].astype(np.int64) for n in ("body_lowest", "body_shape"))
        bits = arrays["body_bits"]
        if not len(bits):
            return None
        count = float(np.prod(shape.astype(np.float64)))
        if steps is None or not 0 < count <= _MOST or len(bits) != -(-int(count) // 8):
            raise InputError("the map's body cells do not fit its lattice; save it again")
        return cls(lowest, shape, bits, steps)

    @cached_property
    def _filled(self) -> Bools:
        count = int(np.prod(self.shape))
        return np.unpackbits(self.bits, count=count).astype(bool).reshape(self.shape)

    def hold(self, work: Floats) -> Bools:
        """Return which points (n, 3), working units, lie in an occupied cell or on its face."""
        place = work / self.steps + 0.5 - self.lowest
        low, high = (np.floor(place + move).astype(np.int64) for move in (-_FACE, _FACE))
        inside = self._occupied(low)
        near = np.flatnonzero(~inside & (low != high).any(axis=1))
        for corner in itertools.product((False, True), repeat=3):
            if any(corner) and len(near):
                inside[near] |= self._occupied(np.where(corner, high[near], low[near]))
        return inside

    def _occupied(self, cells: Ints) -> Bools:
        there = ((cells >= 0) & (cells < self.shape)).all(axis=1)
        inside = np.zeros(len(cells), dtype=bool)
        inside[there] = self._filled[tuple(cells[there].T)]
        return inside

    @cached_property
    def _tree(self) -> cKDTree:
        """The occupied cells with a free neighbour, in steps."""
        padded = np.pad(self._filled, 1)
        core = padded[1:-1, 1:-1, 1:-1].copy()
        for axis in range(3):
            for move in (-1, 1):
                core &= np.roll(padded, move, axis)[1:-1, 1:-1, 1:-1]
        return cKDTree(np.argwhere(self._filled & ~core) + self.lowest)

    def gap(self, work: Floats) -> Floats:
        """Return the length from points (n, 3), working units, to the body, (n,); 0 inside."""
        cells = self._tree.data * self.steps
        near = cKDTree(cells).query(work, k=min(_NEAR, len(cells)))[1].reshape(len(work), -1)
        apart = np.abs(work[:, None] - cells[near]) - 0.5 * self.steps
        length = np.linalg.norm(np.maximum(apart, 0.0), axis=2).min(axis=1)
        return np.asarray(np.where(self.hold(work), 0.0, length))

    def distance(self, work: Floats) -> Floats:
        """Return how far points (n, 3), working units, lie from the body, in blocks, (n,).

        It is the largest distance from the nearest occupied cell along an axis of the lattice, in
        the cell's sides along it; 0 inside.
        """
        out = np.zeros(len(work))
        apart = np.flatnonzero(~self.hold(work))
        if len(apart):
            far = self._tree.query(work[apart] / self.steps, p=np.inf)[0]
            out[apart] = np.maximum(far - 0.5, 0.0)
        return out
