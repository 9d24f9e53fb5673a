"""Neighbours of blocks on a lattice, found by cell number instead of by a search tree.

A block's nearest neighbours are the occupied cells at the shortest offsets.  The offsets are sorted
once by length into shells of equal length.  Most blocks find all their neighbours in the first
shells; blocks at the body's surface need further ones.  If a shell holds more blocks than there is
room for among the k nearest, the mean over the shell counts, so the answer does not depend on which
of them would be taken.

Blocks are processed in the order of their cells, some thousands at a time, with a table of only the
cells around them, so memory does not grow with the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from geounfold.backends.threads import over_slices
from geounfold.geometry.measures import bounds, lengths_between
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers

_OFFSETS = 640  # offsets tried; 26 neighbours at the edge of a sheet one block thick need some 110
_SLICE = 1 << 14  # blocks processed at once
_WINDOW = 1 << 26  # cells of a table at most: 256 MB


def offsets_by_length(sides: Floats, count: int = _OFFSETS) -> list[Ints]:
    """Return the shortest offsets between lattice cells, in shells of equal length.

    Parameters
    ----------
    sides : (3,) float
        Sides of a cell.
    count : int
        Number of offsets; the last shell is kept whole, so there may be a few more.

    Returns
    -------
    list of (s, 3) int
        The shells, shortest first.

    Examples
    --------
    >>> [o.tolist() for o in offsets_by_length(np.array([1.0, 2.0, 0.5]), 3)]
    [[[0, 0, -1], [0, 0, 1]], [[-1, 0, 0], [0, 0, -2], [0, 0, 2], [1, 0, 0]]]
    """
    radius = float(np.cbrt(count * np.prod(sides)))  # a ball of this radius holds 4.2 * count
    reach = np.ceil(radius / sides).astype(np.int64)
    every = np.array([o for o in product(*(range(-r, r + 1) for r in reach)) if any(o)])
    square = np.round(((every * sides) ** 2).sum(axis=1) / radius**2, 9)
    order = np.argsort(square, kind="stable")
    fresh = np.flatnonzero(np.diff(square[order])) + 1
    shells = np.split(every[order], fresh)
    size = np.cumsum([len(shell) for shell in shells])
    return shells[: int(np.searchsorted(size, count)) + 1]


def lattice_nmd(
    cells: Ints, sides: Floats, clouds: tuple[Floats, ...], k: int
) -> tuple[Floats, ...] | None:
    """Return the mean distance to the k nearest neighbours on a lattice, in several spaces.

    Neighbours are found by cell, so neither the order of the rows nor rounding of the coordinates
    changes them.

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cell of each block; no two blocks share one.
    sides : (3,) float
        Sides of a cell.
    clouds : tuple of (n, 3) float
        The blocks in each space.
    k : int
        Number of neighbours.

    Returns
    -------
    tuple of (n,) float, or None
        In the unit of each cloud; NaN for a block with fewer than k neighbours at the offsets
        tried.  None if two blocks share a cell, or if the body fills too little of its bounding
        box for a table.
    """
    shells = offsets_by_length(sides)
    offsets = np.concatenate(shells)
    if k > len(offsets) or not len(cells):
        return None
    first, last = bounds(cells)
    low = first - np.abs(offsets).max(axis=0)
    shape = last + np.abs(offsets).max(axis=0) - low + 1
    turn = np.argsort(-shape, kind="stable")  # the longest axis varies slowest: narrow windows
    shape, low = shape[turn], low[turn]
    if float(np.prod(shape.astype(float))) > 2.0**62:
        return None
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    keys = np.zeros(len(cells), np.int64)
    for column, first_cell, step in zip(cells.T[turn], low, stride.tolist(), strict=True):
        keys += (column - first_cell) * step
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    if (keys[1:] == keys[:-1]).any():
        return None
    steps = [shell[:, turn] @ stride for shell in shells]
    margin = int(max(step.max() for step in steps))
    ends = np.minimum(np.arange(0, len(keys), _SLICE) + _SLICE, len(keys)) - 1
    spans = keys[ends] - keys[::_SLICE] + 1 + 2 * margin
    if spans.max() > _WINDOW:
        return None
    axes = [[column[order] for column in cloud.T] for cloud in clouds]
    out = tuple(np.empty(len(keys)) for _ in clouds)

    def work(rows: slice) -> None:
        first = keys[rows.start] - margin
        last = keys[rows.stop - 1] + margin
        a, b = np.searchsorted(keys, [first, last + 1])
        table = np.full(last - first + 1, -1, dtype=np.int32)
        table[keys[a:b] - first] = np.arange(b - a, dtype=np.int32)
        near = [[c[a:b] for c in cloud] for cloud in axes]
        at = keys[rows] - first
        for values, result in zip(out, _means(table, at, steps, near, k), strict=True):
            values[order[rows]] = result

    over_slices(work, len(keys), _SLICE)
    return out


def _means(
    table: Numbers, at: Ints, steps: list[Ints], near: list[list[Floats]], k: int
) -> list[Floats]:
    """Return the mean distances of the blocks at some table positions, (m,) per space.

    Parameters
    ----------
    table : (t,) int
        Row of the block in each cell; -1 for an empty cell.
    at : (m,) int
        Table positions of the blocks.
    steps : list of (s,) int
        Shells of offsets, as differences of table positions.
    near : list of lists of (r,) float
        For each space, the three coordinates of the table's rows.
    k : int
        Number of neighbours.
    """
    own = table[at]
    here = [[c[own] for c in cloud] for cloud in near]
    sums = [np.zeros(len(at)) for _ in near]
    whole: Bools = np.ones(len(at), dtype=bool)
    taken = 0
    for shell in steps:
        weight = min(1.0, (k - taken) / len(shell))
        for step in shell:
            other = table.take(at + step)
            whole &= other >= 0
            for total, mine, theirs in zip(sums, here, near, strict=True):
                length = lengths_between(mine, [c.take(other, mode="wrap") for c in theirs])
                total += length if weight == 1 else weight * length
        taken += len(shell)
        if taken >= k:
            break
    lacking = np.flatnonzero(~whole)
    for total in sums:
        total[lacking] = 0.0
    count = np.zeros(len(lacking), dtype=np.int64)
    for shell in steps:
        other = table[at[lacking, None] + shell]
        row, column = np.nonzero(other >= 0)
        block, other = lacking[row], other[row, column]
        there = np.bincount(row, minlength=len(lacking))
        share = np.minimum(k - count, there) / np.maximum(there, 1)
        for total, mine, theirs in zip(sums, here, near, strict=True):
            length = lengths_between([c[block] for c in mine], [c[other] for c in theirs])
            total[lacking] += share * np.bincount(row, length, len(lacking))
        count += there
        lacking, count = lacking[count < k], count[count < k]
        if not len(lacking):
            break
    for total in sums:
        total[lacking] = np.nan
        total /= k
    return sums


@dataclass(frozen=True, eq=False)
class LatticeWindow:
    """Some blocks of a lattice, sorted by cell, for the neighbours of a part of them.

    Attributes
    ----------
    keys : (n,) int
        A number per block, sorted: (x * shape[1] + y) * shape[2] + z of its cell.
    shape : (3,) int
        Sides of the box of the numbers, with an empty margin as wide as the longest offset.
    """

    keys: Ints
    shape: Ints

    def mean_distances(
        self, sides: Floats, cloud: Floats, k: int, rows: slice
    ) -> tuple[Floats, Floats]:
        """Return the mean distance to the k nearest neighbours on the lattice and in a cloud.

        Parameters
        ----------
        sides : (3,) float
            Sides of a cell.
        cloud : (n, 3) float
            The blocks elsewhere, in the same unit.
        k : int
            Number of neighbours.
        rows : slice
            The blocks whose neighbours are wanted, (m,).

        Returns
        -------
        before, after : (m,) float
            NaN for a block with fewer than k neighbours at the offsets tried.
        """
        shells = offsets_by_length(sides)
        stride = np.array([self.shape[1] * self.shape[2], self.shape[2], 1])
        steps = [shell @ stride for shell in shells]
        lengths = [float(np.linalg.norm(shell[0] * sides)) for shell in shells]
        margin = int(max(step.max() for step in steps))
        columns = [np.ascontiguousarray(column) for column in cloud.T]
        count = rows.stop - rows.start
        before, after = np.empty(count), np.empty(count)

        def work(part: slice) -> None:
            own = self.keys[rows.start + part.start : rows.start + part.stop]
            first, last = int(own[0]) - margin, int(own[-1]) + margin
            a, b = np.searchsorted(self.keys, [first, last + 1])
            table = np.full(last - first + 1, -1, dtype=np.int32)
            table[self.keys[a:b] - first] = np.arange(b - a, dtype=np.int32)
            near = [column[a:b] for column in columns]
            before[part], after[part] = _both_means(table, own - first, (steps, lengths), near, k)

        over_slices(work, count, _SLICE)
        return before, after


def margin_of(sides: Floats) -> Ints:
    """Return how many cells the longest offset reaches along each axis, (3,)."""
    out: Ints = np.abs(np.concatenate(offsets_by_length(sides))).max(axis=0)
    return out


def _both_means(
    table: Numbers,
    at: Ints,
    shells: tuple[list[Ints], list[float]],
    near: list[Floats],
    k: int,
) -> tuple[Floats, Floats]:
    """Return what `_means` does for the lattice itself and one cloud.

    Parameters
    ----------
    table, at, k
        As `_means` takes them.
    shells : (list of (s,) int, list of float)
        Shells of offsets, as differences of table positions, and their lengths.
    near : list of (r,) float
        The three coordinates of the table's rows in the cloud.
    """
    own = table[at]
    here = [c[own] for c in near]
    after, before = np.zeros(len(at)), 0.0
    whole: Bools = np.ones(len(at), dtype=bool)
    taken = 0
    for shell, far in zip(*shells, strict=True):
        weight = min(1.0, (k - taken) / len(shell))
        for step in shell:
            other = table.take(at + step)
            whole &= other >= 0
            after += weight * lengths_between(here, [c.take(other, mode="wrap") for c in near])
        before += weight * len(shell) * far
        taken += len(shell)
        if taken >= k:
            break
    mean = np.full(len(at), before)
    lacking = np.flatnonzero(~whole)
    after[lacking] = mean[lacking] = 0.0
    count = np.zeros(len(lacking), dtype=np.int64)
    for shell, far in zip(*shells, strict=True):
        if not len(lacking):
            break
        other = table[at[lacking, None] + shell]
        row, column = np.nonzero(other >= 0)
        block, other = lacking[row], other[row, column]
        there = np.bincount(row, minlength=len(lacking))
        share = np.minimum(k - count, there) / np.maximum(there, 1)
        length = lengths_between([c[block] for c in here], [c[other] for c in near])
        after[lacking] += share * np.bincount(row, length, len(lacking))
        mean[lacking] += share * there * far
        count += there
        lacking, count = lacking[count < k], count[count < k]
    after[lacking] = mean[lacking] = np.nan
    return mean / k, after / k
