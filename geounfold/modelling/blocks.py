"""The blocks and surfaces of a sheet between its walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.modelling.extent import Grid
from geounfold.modelling.sheet import Sheet

_FINE = 0.5  # of a block's smallest side: distance of the points that find the body's cells
_POINTS = 1 << 20  # points at a time


@dataclass(frozen=True, eq=False)
class Slab:
    """A sheet on a grid: the walls' heights at every node, and which nodes it covers.

    Attributes
    ----------
    sheet : Sheet
    grid : Grid
    middle, half : (n,) float
        Height of the middle above the reference surface, and half thickness, at every node.
    covered : (n,) bool
    """

    sheet: Sheet
    grid: Grid
    middle: Floats
    half: Floats
    covered: Bools

    @property
    def volume(self) -> float:
        """Area covered times thickness; of a folded sheet, as long as its reference surface."""
        return float(2 * self.half[self.covered].sum() * self.grid.step**2)

    @property
    def thickness(self) -> float:
        """Mean thickness at the covered nodes."""
        return float(2 * self.half[self.covered].mean())

    def holds(self, points: Floats) -> Bools:
        """Return which points (n, 3) lie between the walls."""
        local = self.sheet.reference.local(points)
        node, there = self.grid.nearest(local[:, :2])
        middle = self.grid.between(self.middle, local[:, :2])
        half = self.grid.between(self.half, local[:, :2])
        return there & self.covered[node] & (np.abs(local[:, 2] - middle) <= half)

    def wall(self, side: float) -> TriMesh:
        """Return the hanging wall (side 1) or footwall (side -1) over the covered nodes."""
        k = np.arange(len(self.covered)).reshape(self.grid.shape)
        p, q, r, s = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
        F = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
        local = np.column_stack([self.grid.places, self.middle + side * self.half])
        return TriMesh(self.sheet.reference.world(local), F).submesh(self.covered[F].all(axis=1))[0]


def blocks_of(slab: Slab, sides: Floats) -> Floats:
    """Return the centroids (n, 3), in lexicographic order, of the blocks whose centres lie inside.

    Corners of blocks lie at whole multiples of their sides.

    Raises
    ------
    InputError
        No block's centre lies inside.
    OptionError
        The grid of the walls would be too large for so small blocks.
    """
    fine = _FINE * float(sides.min())
    if slab.grid.step > 1.5 * fine:
        raise OptionError(
            f"blocks of {sides.min():g} are too small for a body of this area; give a larger "
            "--block-size"
        )
    cells = np.empty((0, 3), dtype=np.int64)
    nodes = np.flatnonzero(slab.covered & (slab.half > 0))
    count = np.ceil(2 * slab.half[nodes] / fine).astype(np.int64) + 1
    places = slab.grid.places
    parts: list[Ints] = []
    for rows in np.array_split(nodes, max(1, int(count.sum()) // _POINTS + 1)):
        parts.append(_cells(slab, rows, places[rows], fine, sides))
    cells = np.unique(np.concatenate(parts), axis=0)
    centres = (cells + 0.5) * sides
    inside = np.concatenate(
        [slab.holds(part) for part in np.array_split(centres, len(centres) // _POINTS + 1)]
    )
    if not inside.any():
        raise InputError(
            f"no centre of a block of {' x '.join(f'{s:g}' for s in sides)} lies inside; the mean "
            f"thickness is {slab.thickness:.4g}: give a smaller --block-size"
        )
    return np.asarray(centres[inside])


def _cells(slab: Slab, rows: Ints, places: Floats, fine: float, sides: Floats) -> Ints:
    """Return the cells that points between the walls at some nodes lie in."""
    half = slab.half[rows]
    count = np.ceil(2 * half / fine).astype(np.int64) + 1
    node = np.repeat(np.arange(len(rows)), count)
    number = np.arange(len(node)) - np.repeat(np.cumsum(count) - count, count)
    share = 2.0 * number / (count[node] - 1) - 1.0
    height = slab.middle[rows][node] + share * half[node]
    world = slab.sheet.reference.world(np.column_stack([places[node], height]))
    return np.unique(np.floor(world / sides).astype(np.int64), axis=0)
