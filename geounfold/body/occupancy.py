"""A body's blocks as a table of its lattice: one byte per cell of the box, whatever the rows.

A table is filled from batches of blocks in any order. It gives what the fit of a large body takes:
the blocks merged into cells, and the blocks within two of the surface. The memory depends on the
box around the body, not on the number of rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from geounfold.backends.threads import over_slices
from geounfold.body.lattice import Lattice
from geounfold.body.merged_blocks import SLANT, MergedBlocks, sizes_for
from geounfold.body.working_frame import CellSums, Frame
from geounfold.errors import StreamError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers

MOST_CELLS = 1 << 30
"""Number of cells of a box up to which it is kept: 1 GiB."""

_LAYERS = 16  # layers of the box at once
_AHEAD = 0.5  # share by which a side of the box that has to grow grows further
_HALO = 2  # layers around those whose surface is sought
_LONELY = 0.01  # share of blocks without a neighbour across a face, above which sizes differ


@dataclass(frozen=True, eq=False)
class Skin:
    """The blocks of a body within two of its surface.

    Attributes
    ----------
    cells : (k, 3) int
        Their lattice cells, in lexicographic order.
    surface : (k,) bool
        Whether one of the 26 cells around each is empty.
    """

    cells: Ints
    surface: Bools


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Occupied cells of a lattice.

    Attributes
    ----------
    filled : (a, b, c) bool
        Whether each cell of the box holds a block.
    low : (3,) int
        Lattice cell of the box's first one.
    """

    filled: Bools
    low: Ints

    @cached_property
    def count(self) -> int:
        """Number of occupied cells."""
        return int(np.count_nonzero(self.filled))

    @property
    def shape(self) -> Ints:
        """Number of cells of the box along each axis, (3,)."""
        return np.array(self.filled.shape)

    def sums(self, sides: Floats) -> CellSums:
        """Return the sums over the occupied cells that fix the working frame.

        Parameters
        ----------
        sides : (3,) float
            Sides of a cell.
        """
        x, y, z = zip(*over_slices(self._marginals, *self._slabs()), strict=True)
        along = [np.concatenate(x), np.sum(y, axis=0), np.sum(z, axis=0)]
        index = [np.arange(n, dtype=np.float64) for n in self.shape]
        total = np.array([round(float(m @ i)) for m, i in zip(along, index, strict=True)])
        mean = total / self.count
        X = [(i - m) * s for i, m, s in zip(index, mean, sides, strict=True)]
        variance = np.array([m @ x**2 for m, x in zip(along, X, strict=True)])
        return CellSums.of(self.count, total + self.count * self.low, variance, X, self._moments)

    def _slabs(self) -> tuple[int, int]:
        return len(self.filled), _LAYERS

    def _marginals(self, rows: slice) -> tuple[Ints, Ints, Ints]:
        """Return how many cells of some layers are occupied along each axis."""
        own = self.filled[rows]
        plane = np.count_nonzero(own, axis=0)
        return np.count_nonzero(own, axis=(1, 2)), plane.sum(axis=1), plane.sum(axis=0)

    def _moments(self, powers: list[Floats]) -> Floats:
        """Return the sums of products of powers over the occupied cells, (p, p, p)."""
        x, y, z = powers

        def work(rows: slice) -> Floats:
            own = self.filled[rows]
            along = own.reshape(-1, own.shape[2]).astype(np.float64) @ z.T
            square = np.einsum("qj,ijr->iqr", y, along.reshape(*own.shape[:2], -1))
            out: Floats = np.einsum("pi,iqr->pqr", x[:, rows], square)
            return out

        out: Floats = np.sum(over_slices(work, *self._slabs()), axis=0)
        return out

    def turned(self, lattice: Lattice, frame: Frame) -> Occupancy:
        """Return the same cells, counted on a lattice, along the axes of a frame of it."""
        if frame.steps is None:
            raise ValueError("the frame has no lattice")
        turn = np.rint(frame.rotation @ lattice.axes.T).astype(np.int64)
        apart = (frame.origin - lattice.origin) @ frame.rotation.T
        middle = np.rint(apart / (frame.scale * frame.steps)).astype(np.int64)
        source = np.abs(turn).argmax(axis=1)
        ahead = turn.sum(axis=1) > 0
        last = self.low + self.shape - 1
        low = np.where(ahead, self.low[source], -last[source]) - middle
        way = tuple(slice(None) if forward else slice(None, None, -1) for forward in ahead)
        return Occupancy(np.ascontiguousarray(self.filled.transpose(source)[way]), low)

    def counts(self, merge: int) -> tuple[Numbers, Ints]:
        """Return how many blocks each cell of ``merge`` blocks a side holds, and the first cell."""
        first, starts = self._groups(merge)
        out = np.empty([len(s) for s in starts], np.int32)

        def work(rows: slice) -> None:
            for row in range(rows.start, rows.stop):
                plane = self._layers(starts[0], row).sum(axis=0, dtype=np.int32)
                out[row] = self._pooled(plane, starts)

        over_slices(work, len(out), _LAYERS)
        return out, first

    def coarsened(self, side: int) -> Occupancy:
        """Return the cells of ``side`` blocks a side that are at least half filled."""
        if side == 1:
            return self
        counts, first = self.counts(side)
        return Occupancy(2 * counts >= side**3, first)

    def merged(self, merge: int, steps: Floats, skin: Skin) -> MergedBlocks:
        """Return the blocks merged into cells, as `merged_blocks.merge_blocks` merges them.

        Parameters
        ----------
        merge : int
            Blocks along a cell's side.
        steps : (3,) float
            Sides of a block, working units.
        skin : Skin
            The blocks that ``border`` and ``beside`` are of.
        """
        _, starts = self._groups(merge)
        _, y, z = (np.arange(n) + low for n, low in zip(self.shape, self.low, strict=True))

        def work(rows: slice) -> list[tuple[Floats, Ints]]:
            found = []
            for row in range(rows.start, rows.stop):
                own = self._layers(starts[0], row)
                x = np.arange(len(own)) + starts[0][row] + self.low[0]
                plane = own.sum(axis=0, dtype=np.int64)
                across = np.einsum("i,ijk->jk", x, own.astype(np.int64))
                count = self._pooled(plane, starts)
                there = count > 0
                sums = (across, plane * y[:, None], plane * z)
                middle = [self._pooled(s, starts)[there] / count[there] for s in sums]
                found.append((np.stack(middle, axis=1), count[there]))
            return found

        parts = [part for slab in over_slices(work, len(starts[0]), _LAYERS) for part in slab]
        middle = np.concatenate([m for m, _ in parts])
        share = np.concatenate([c for _, c in parts]) / merge**3
        whole = np.ones(len(skin.cells), dtype=bool)
        return MergedBlocks(merge, middle * steps / merge, share, skin.surface, whole)

    def _groups(self, merge: int) -> tuple[Ints, list[Ints]]:
        """Return the first merged cell (3,), and the first layer of each along every axis."""
        first = self.low // merge
        last = (self.low + self.shape - 1) // merge
        return first, [
            np.maximum(np.arange(a, b + 1) * merge - low, 0)
            for a, b, low in zip(first, last, self.low, strict=True)
        ]

    def _layers(self, starts: Ints, row: int) -> Bools:
        """Return the layers of a row of merged cells."""
        stop = starts[row + 1] if row + 1 < len(starts) else len(self.filled)
        return self.filled[starts[row] : stop]

    @staticmethod
    def _pooled(plane: Numbers, starts: list[Ints]) -> Ints:
        out: Ints = np.add.reduceat(np.add.reduceat(plane, starts[1], axis=0), starts[2], axis=1)
        return out

    def area_and_thickness(self, steps: Floats) -> tuple[float, float]:
        """Return area and thickness, as `merged_blocks.area_and_thickness` measures them."""
        share, _ = self.counts(2)
        total = 0.0
        for axis, face in enumerate((1 / steps).tolist()):
            ends = share.take(0, axis).sum(dtype=np.int64) + share.take(-1, axis).sum(
                dtype=np.int64
            )
            inner = sum(
                int(np.abs(np.diff(part, axis=axis)).sum(dtype=np.int64))
                for part in _along(share, axis)
            )
            total += face * float(ends + inner) / 8
        area = 4 * total / SLANT
        return area, 2 * self.count / area

    def skin(self) -> Skin:
        """Return the blocks within two of the surface."""

        def work(rows: slice) -> tuple[Ints, Bools]:
            start, stop = max(rows.start - _HALO, 0), rows.stop + _HALO
            own = np.pad(self.filled[start:stop], _HALO)
            surface = own & ~_spread(own, np.logical_and)
            near = own & _spread(surface, np.logical_or)
            first = rows.start - start + _HALO
            some = slice(first, first + rows.stop - rows.start)
            at = np.argwhere(near[some, _HALO:-_HALO, _HALO:-_HALO])
            flag = surface[some, _HALO:-_HALO, _HALO:-_HALO][tuple(at.T)]
            return at + self.low + [rows.start, 0, 0], flag

        parts = over_slices(work, *self._slabs())
        return Skin(np.concatenate([a for a, _ in parts]), np.concatenate([b for _, b in parts]))

    def lonely(self) -> bool:
        """Return whether so many blocks have no neighbour across a face that sizes differ."""

        def work(rows: slice) -> int:
            own = np.pad(self.filled[max(rows.start - 1, 0) : rows.stop + 1], 1)
            near = np.zeros_like(own)
            for axis in range(3):
                for move in (-1, 1):
                    near |= np.roll(own, move, axis)
            first = 1 + min(rows.start, 1)
            some = slice(first, first + rows.stop - rows.start)
            return int(np.count_nonzero(own[some] & ~near[some]))

        return sum(over_slices(work, *self._slabs())) > _LONELY * self.count

    def parts(self, merge: int = 2) -> tuple[Numbers, Ints, Ints]:
        """Return the connected parts of the cells of ``merge`` blocks a side.

        Returns
        -------
        labels : (a, b, c) int
            Part of each cell, from 1; 0 for empty ones.
        size : (p + 1,) int
            Number of blocks of each part.
        first : (3,) int
            The merged cell of the first label.
        """
        counts, first = self.counts(merge)
        labels, number = ndimage.label(counts > 0, np.ones((3, 3, 3)))
        size = np.bincount(labels.ravel(), counts.ravel(), number + 1).astype(np.int64)
        return np.asarray(labels, dtype=np.int32), size, first

    def holds(self, cells: Ints) -> Bools:
        """Return whether cells (n, 3) are occupied."""
        at = cells - self.low
        out: Bools = np.asarray(((at >= 0) & (at < self.shape)).all(axis=1))
        out[out] = self.filled[tuple(at[out].T)]
        return out

    def within(self, chosen: Bools, first: Ints, merge: int) -> Occupancy:
        """Return the cells that lie in some merged cells, (a, b, c) bool from ``first``."""
        index = [
            (np.arange(n) + low) // merge - f
            for n, low, f in zip(self.shape, self.low, first, strict=True)
        ]
        out = np.empty_like(self.filled)
        for row, layer in enumerate(self.filled):
            plane = chosen[index[0][row]][np.ix_(index[1], index[2])]
            np.logical_and(layer, plane, out=out[row])
        return Occupancy(out, self.low)


@dataclass(frozen=True, eq=False)
class HollowBody:
    """A body whose blocks away from the surface are known by its occupied cells alone.

    Attributes
    ----------
    cells : Occupancy
        All of its cells.
    skin : Skin
        The blocks that are held one by one.
    steps : (3,) float
        Sides of a block, working units.
    """

    cells: Occupancy
    skin: Skin
    steps: Floats

    def merge_sizes(self, above: int) -> tuple[int, ...]:
        """Return what `merged_blocks.merge_sizes` returns for all blocks."""
        if self.cells.count <= above:
            return ()
        return sizes_for(*self.cells.area_and_thickness(self.steps))

    def merged(self, merge: int) -> MergedBlocks:
        """Return the blocks merged into cells of ``merge`` blocks a side."""
        return self.cells.merged(merge, self.steps, self.skin)


def _along(table: Numbers, axis: int) -> list[Numbers]:
    """Return a table in parts whose differences along an axis are those of the whole."""
    size = max(1, (1 << 24) // max(1, table[0].size))
    if axis:
        return [table[i : i + size] for i in range(0, len(table), size)]
    return [table[i : i + size + 1] for i in range(0, len(table) - 1, size)]


def _spread(table: Bools, join: np.ufunc) -> Bools:
    """Return each cell joined with the 26 around it; those at the border of the table as given."""
    out = table
    for axis in range(3):
        fresh = out.copy()
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(1, None), slice(None, -1)
        join(fresh[tuple(low)], out[tuple(high)], out=fresh[tuple(low)])
        join(fresh[tuple(high)], out[tuple(low)], out=fresh[tuple(high)])
        out = fresh
    return out


class OccupancyBuilder:
    """Collects occupied cells batch by batch, in a box that grows with them."""

    def __init__(self) -> None:
        self._table: Bools = np.zeros((0, 0, 0), dtype=bool)
        self._low = np.zeros(3, np.int64)
        self._ends: tuple[Ints, Ints] | None = None

    def add(self, cells: Ints) -> None:
        """Add cells (n, 3).

        Raises
        ------
        StreamError
            The box around all cells has too many cells.
        """
        if not len(cells):
            return
        low, high = bounds(cells)
        if self._ends is not None:
            low, high = np.minimum(low, self._ends[0]), np.maximum(high, self._ends[1])
        self._grow(low, high)
        self._ends = low, high
        _, b, c = self._table.shape
        i, j, k = (cells - self._low).T
        self._table.reshape(-1)[(i * b + j) * c + k] = True

    def _grow(self, low: Ints, high: Ints) -> None:
        shape = np.array(self._table.shape)
        last = self._low + shape - 1
        if shape.all() and (low >= self._low).all() and (high <= last).all():
            return
        if float(np.prod((high - low + 1).astype(float))) > MOST_CELLS:
            raise StreamError(
                f"the box around the blocks has more than {MOST_CELLS:,} cells of their lattice"
            )
        if shape.all():
            ahead = np.ceil(_AHEAD * (high - low + 1)).astype(np.int64)
            wide_low = np.where(low < self._low, low - ahead, self._low)
            wide_high = np.where(high > last, high + ahead, last)
            if float(np.prod((wide_high - wide_low + 1).astype(float))) <= MOST_CELLS:
                low, high = wide_low, wide_high
            else:
                low, high = np.minimum(low, self._low), np.maximum(high, last)
        fresh = np.zeros(high - low + 1, dtype=bool)
        at = self._low - low
        fresh[tuple(slice(a, a + n) for a, n in zip(at, shape, strict=True))] = self._table
        self._table, self._low = fresh, low

    def made(self) -> Occupancy:
        """Return all cells added, in the smallest box around them."""
        if self._ends is None:
            raise ValueError("there are no cells")
        low, high = self._ends
        some = tuple(
            slice(a, b + 1) for a, b in zip(low - self._low, high - self._low, strict=True)
        )
        return Occupancy(np.ascontiguousarray(self._table[some]), low)
