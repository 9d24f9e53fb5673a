"""Blocks as boxes on a hash grid: which of them touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores
from geounfold.geometry.mesh import Floats, Ints

MIXED = np.array([1.0, np.sqrt(2) / 2, np.pi / 6])  # different rows hardly ever share a sum


_EMPTY = 32  # cells of a box per block, up to which parts are told in an array of all


_MARGIN = 2  # blocks, the farthest neighbours that are looked up


SAMPLE = 2000  # blocks that are looked at


@dataclass(frozen=True, eq=False)
class Cells:
    """The distinct occupied lattice cells, hashed so that neighbours are found by bisection."""

    keys: Ints  # (m,) sorted
    strides: Ints  # (3,) key of one step along each axis
    cell: Ints  # (n,) distinct cell of each input row
    shape: Ints  # (3,) cells of the box that the keys count

    @classmethod
    def of(cls, indices: Ints) -> Cells:
        """Hash integer cells (n, 3); offsets of up to _MARGIN cells never collide."""
        low = indices.min(axis=0) - _MARGIN
        size = indices.max(axis=0) - low + 1 + _MARGIN
        strides = np.array([size[1] * size[2], size[2], 1], dtype=np.int64)
        keys, cell = np.unique((indices - low) @ strides, return_inverse=True)
        return cls(keys, strides, cell, size)

    def find(self, which: Ints, offset: Sequence[int]) -> Ints:
        """Return the cell at an offset from each of some cells; -1 where it is empty."""
        wanted = self.keys[which] + int(np.dot(offset, self.strides))
        place = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        out: Ints = np.where(self.keys[place] == wanted, place, -1)
        return out

    def labelled(self) -> Ints | None:
        """Return the face-connected part of each cell, (m,); None where the box is too empty."""
        if float(np.prod(self.shape.astype(float))) > _EMPTY * len(self.keys):
            return None
        held = np.zeros(int(self.shape.prod()), dtype=bool)
        held[self.keys] = True
        labels = ndimage.label(held.reshape(self.shape))[0].ravel()
        out: Ints = labels.take(self.keys).astype(np.int64) - 1
        return out

    def sample(self) -> Ints:
        """Return about _SAMPLE cells spread evenly over the sorted ones."""
        return np.arange(0, len(self.keys), -(-len(self.keys) // SAMPLE))

    def gappy(self) -> bool:
        """Say whether most cells have no neighbour face to face (a sub-blocked model)."""
        some = self.sample()
        touched = np.zeros(len(some), bool)
        for offset in offsets(1):
            touched |= self.find(some, offset) >= 0
        return bool(touched.mean() < 0.8)


def offsets(reach: int) -> list[tuple[int, ...]]:
    """Return the cells up to ``reach`` steps away along each axis, the cell itself left out."""
    span = range(-reach, reach + 1)
    return [offset for offset in product(span, repeat=3) if any(offset)]


def neighbours(tree: cKDTree, points: Floats, count: int) -> tuple[Floats, Ints]:
    """Return distances and numbers of the nearest points, themselves first, (m, count) each."""
    distance, near = tree.query(points, k=min(count, tree.n), workers=cores())
    return np.asarray(distance), np.asarray(near, dtype=np.int64)
