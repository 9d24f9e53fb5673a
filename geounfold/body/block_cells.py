"""The lattice cells that blocks occupy, and which of them are neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from geounfold.geometry.measures import bounds, sorted_distinct
from geounfold.geometry.mesh import Bools, Ints, Numbers

_MARGIN = 3  # empty cells around the box: offsets of up to 3 cells never wrap into another row
_EMPTY = 32  # cells of the box per occupied one, up to which a table of all of them is used
_DENSE = 8  # the same for the table of whole numbers in `numbered`
_SAMPLE = 2000  # cells that `gappy` looks at
_TOUCHING = 0.8  # share of them with a neighbour in a full lattice


@dataclass(frozen=True, eq=False)
class OccupiedCells:
    """The distinct cells of a lattice that blocks occupy, by sorted keys.

    Attributes
    ----------
    keys : (m,) int
        One number per cell, sorted.
    low : (3,) int
        The cell of key 0.
    shape : (3,) int
        Cells of the box along each axis, an empty margin included.
    """

    keys: Ints
    low: Ints
    shape: Ints

    @classmethod
    def of(cls, cells: Ints) -> OccupiedCells:
        """Return the distinct ones of cells (n, 3)."""
        box = cls._box(cells)
        every = box.keys_of(cells)
        if box.size > _DENSE * len(every):
            return cls(sorted_distinct(every), box.low, box.shape)
        taken = np.zeros(int(box.size), dtype=bool)
        taken[every] = True
        return cls(np.flatnonzero(taken), box.low, box.shape)

    @classmethod
    def numbered(cls, cells: Ints) -> tuple[OccupiedCells, Ints]:
        """Return the distinct ones of cells (n, 3), and for each input its row among them, (n,)."""
        box = cls._box(cells)
        every = box.keys_of(cells)
        if box.size > _DENSE * len(every):
            keys, row = np.unique(every, return_inverse=True)
        else:
            taken = np.zeros(int(box.size), dtype=bool)
            taken[every] = True
            keys = np.flatnonzero(taken)
            number = np.empty(len(taken), dtype=np.int32 if len(keys) < 2**31 else np.int64)
            number[keys] = np.arange(len(keys))
            row = number[every].astype(np.int64)
        return cls(keys, box.low, box.shape), row

    @classmethod
    def _box(cls, cells: Ints) -> OccupiedCells:
        """Return the box around cells, none of them occupied."""
        first, last = bounds(cells)
        low = first - _MARGIN
        return cls(np.zeros(0, np.int64), low, last - low + 1 + _MARGIN)

    @property
    def size(self) -> float:
        """Number of cells in the box; a float, because it may exceed every integer."""
        return float(np.prod(self.shape.astype(float)))

    @property
    def stride(self) -> Ints:
        """Key of one step along each axis, (3,)."""
        return np.array([self.shape[1] * self.shape[2], self.shape[2], 1])

    @property
    def around(self) -> list[int]:
        """Differences between the keys of a cell's 26 neighbours and its own."""
        return [int(np.array(offset) @ self.stride) for offset in offsets(1)]

    @cached_property
    def table(self) -> Bools | None:
        """Whether each key of the box is occupied; None if few of them are."""
        if self.size > _EMPTY * len(self.keys):
            return None
        table = np.zeros(int(self.shape.prod()), dtype=bool)
        table[self.keys] = True
        return table

    def keys_of(self, cells: Ints) -> Ints:
        """Return the keys of cells (k, 3) in the box, (k,)."""
        i, j, k = cells.T
        low, (far, wide, _) = self.low, self.stride.tolist()
        out: Ints = (i - low[0]) * far + (j - low[1]) * wide + (k - low[2])
        return out

    def cells_of(self, keys: Ints) -> Ints:
        """Return the cells of keys (k,), (k, 3)."""
        i, rest = np.divmod(keys, self.stride[0])
        j, k = np.divmod(rest, self.stride[1])
        return np.stack([i, j, k], axis=1) + self.low

    def with_keys(self, keys: Ints) -> OccupiedCells:
        """Return these and further cells of the same box."""
        return OccupiedCells(
            sorted_distinct(np.concatenate([self.keys, keys])), self.low, self.shape
        )

    def rows(self, wanted: Ints) -> Ints:
        """Return the row of each key (k,); -1 for one that is not occupied."""
        row = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        out: Ints = np.where(self.keys[row] == wanted, row, -1)
        return out

    def beside(self, rows: Ints, offset: Sequence[int]) -> Ints:
        """Return the row of the cell at an offset from each of some rows; -1 if it is empty."""
        return self.rows(self.keys[rows] + int(np.dot(offset, self.stride)))

    def occupied(self, wanted: Ints) -> Bools:
        """Return whether each key (k,) is occupied."""
        if self.table is not None:
            return np.asarray(self.table.take(wanted))
        return np.asarray(self.rows(wanted) >= 0)

    def neighbour_counts(self, keys: Ints) -> Numbers:
        """Return how many of the 26 cells around each key are occupied, (k,)."""
        count = np.zeros(len(keys), dtype=np.int32)
        for step in self.around:
            count += self.occupied(keys + step)
        return count

    @cached_property
    def usual_neighbours(self) -> float:
        """Upper quartile of the number of occupied cells among a cell's 26 neighbours."""
        return float(np.percentile(self.neighbour_counts(self.keys), 75))

    def face_counts(self, keys: Ints) -> Numbers:
        """Return how many of the six cells that share a face with each key are occupied, (k,)."""
        count = np.zeros(len(keys), dtype=np.int32)
        for step in self.stride.tolist():
            count += self.occupied(keys + step)
            count += self.occupied(keys - step)
        return count

    def parts(self) -> Ints:
        """Return the face-connected part of each cell, (m,), numbered from 0."""
        if self.table is not None:
            labels = ndimage.label(self.table.reshape(self.shape))[0].ravel()
            out: Ints = labels.take(self.keys).astype(np.int64) - 1
            return out
        first, second = [], []
        for step in self.stride.tolist():
            row = self.rows(self.keys + step)
            first.append(np.flatnonzero(row >= 0))
            second.append(row[row >= 0])
        return connected(np.concatenate(first), np.concatenate(second), len(self.keys))

    def gappy(self) -> bool:
        """Return whether a fifth of the cells or more have none of their 26 neighbours.

        So it is in sub-blocked models on the lattice of their finest blocks.
        """
        some = self.keys[:: -(-len(self.keys) // _SAMPLE)]
        return bool((self.neighbour_counts(some) > 0).mean() < _TOUCHING)


def offsets(reach: int) -> list[tuple[int, ...]]:
    """Return the offsets of up to ``reach`` steps along each axis, without (0, 0, 0)."""
    span = range(-reach, reach + 1)
    return [offset for offset in product(span, repeat=3) if any(offset)]


def connected(first: Ints, second: Ints, count: int) -> Ints:
    """Return the component of each of ``count`` vertices of a graph given by its edges."""
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    labels: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels
