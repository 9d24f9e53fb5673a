"""The lattice cells that a block model fills: sub-blocks in their parents, missing blocks.

A sub-blocked model lists centroids of blocks of several sides: parents, and parents split in
2, 4 or 8 along an axis where the body's surface cuts them.  On the lattice of the finest blocks
most positions hold no centroid, though nearly all of them lie in a block.  Here the sides are
inferred from the centroids alone and every block becomes the fine cells that it fills, so that
the stages after this see one full lattice of equal blocks.  In models of equal blocks, places
that blocks surround are taken for missing blocks and filled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.body.lattice import Lattice
from geounfold.geometry.measures import sorted_distinct
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers

MOST_CELLS = 250_000
"""Cells beyond which parents are filled by coarser ones; about ten seconds' work."""

SURROUNDED = 22
"""Of a place's 26 neighbours, the least number of blocks that make it a missing block.

Beside a plane of any direction a place outside has 13 at most, in a gap one block wide 18;
inside, with 5 % of the blocks missing at random, 24.7 in the mean.  Where more are missing, blocks
inside have fewer neighbours themselves, and the number is lowered in proportion, to FEWEST.
"""

FEWEST = 16
"""Upper quartile of the blocks' neighbours below which no block counts as missing; and the least
number of blocks around a missing one.

Measured: 8 to 14 in sheets of one block and to 17 in a block and a half, whose blocks touch along
edges and which so have parts and corners of their own; 17 to 20 in two, 17 with 5 % missing.
"""

_EMPTY = 32  # cells of a box per block, up to which each is looked up in a table of all
_LARGE = 0.01  # share of the blocks from which a part of the body counts
_ROUNDS = 2  # of filling: more would run along a gap from its end, where a place has 21
_DOUBLINGS = 5  # of the finest side, tried for the parents' side
_ODD = 0.01  # share of the blocks that may contradict the sides inferred
_SEEN = 0.002  # share of the aligned differences that a side must make up


@dataclass(frozen=True, eq=False)
class Solid:
    """Cells of one regular lattice, all inside the body.

    Attributes
    ----------
    lattice : Lattice
        Of the cells: its origin is a cell's centre, its steps their sides.
    points : (m, 3) float
        Centres of the cells, world coordinates.
    home : (n,) int
        For every input point, a cell at or in its block.
    sub_blocked : bool
        Whether blocks of several sides were found.
    """

    lattice: Lattice
    points: Floats
    home: Ints
    sub_blocked: bool


def solid_cells(points: Floats, lattice: Lattice | None) -> Solid | None:
    """Return the cells that blocks fill, or None where they are the points themselves.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, world coordinates.
    lattice : Lattice or None
        Theirs, as measured.

    Returns
    -------
    Solid or None
        None without a lattice, and for equal blocks of which none is missing.

    Examples
    --------
    >>> k = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5
    >>> split = k[:, 0] < 2
    >>> blocks = np.concatenate([k[split], np.unique(k[~split] // 2, axis=0) * 2 + 1])
    >>> found = solid_cells(blocks, Lattice(np.eye(3), np.full(3, 0.5), 1.0))
    >>> len(blocks), len(found.points), found.lattice.steps.tolist()
    (90, 216, [1.0, 1.0, 1.0])
    """
    if lattice is None:
        return None
    halves = np.rint((points - lattice.origin) @ lattice.axes.T / (lattice.steps / 2))
    q = halves.astype(np.int64)
    sides = _block_sides(q)
    if sides is None:
        return None
    fine, first, half = sides
    if (half == fine // 2).all():
        return _with_missing(points, lattice, q, fine, first)
    return _filled(lattice, q, fine, first, half)


def _block_sides(q: Ints) -> tuple[Ints, Ints, Ints] | None:
    """Return the finest side (3,), a corner of all blocks (3,) and the blocks' half sides (n, 3).

    All in half steps of the lattice.  None where no splitting into halves explains the centroids.
    """
    gaps = np.stack([_aligned_gap(q, axis) for axis in range(3)], axis=1)
    fine, first, half = np.zeros(3, np.int64), np.zeros(3, np.int64), np.zeros_like(q)
    for axis in range(3):
        found = _axis_sides(q[:, axis], gaps[:, axis])
        if found is None:
            return None
        fine[axis], first[axis], half[:, axis] = found
    return fine, first, half


def _aligned_gap(q: Ints, axis: int) -> Ints:
    """Return each centroid's distance to the nearest on its own line along an axis, (n,).

    Zero where there is none.
    """
    others = [i for i in range(3) if i != axis]
    first, last = (q[:, [*others, axis]].min(axis=0), q[:, [*others, axis]].max(axis=0))
    size = (last - first + 1).astype(float)
    if size.prod() < 2.0**62:
        a, b, c = ((q[:, k] - f) for k, f in zip([*others, axis], first, strict=True))
        shape = last - first + 1
        order = np.argsort((a * shape[1] + b) * shape[2] + c, kind="stable")
    else:
        order = np.lexsort((q[:, axis], q[:, others[1]], q[:, others[0]]))
    line = q[order]
    step = np.diff(line, axis=0)
    same = (step[:, others] == 0).all(axis=1) & (step[:, axis] > 0)
    gap = np.where(same, step[:, axis], np.iinfo(np.int64).max)
    ends = np.array([np.iinfo(np.int64).max])
    nearest = np.minimum(np.concatenate([ends, gap]), np.concatenate([gap, ends]))
    out = np.empty(len(q), np.int64)
    out[order] = np.where(nearest == ends[0], 0, nearest)
    return out


def _axis_sides(q: Ints, gap: Ints) -> tuple[int, int, Ints] | None:
    """Return the finest side, a corner of all blocks and every half side along one axis.

    Blocks of side 2 L lie at ``corner + (2 i + 1) L``, so that a centroid's place tells its side
    once the corner is known; the right corner is the one that the gaps between neighbours on one
    line, never below a side and mostly equal to it, agree with best.
    """
    sizes, count = np.unique(gap[gap > 0], return_counts=True)
    common = sizes[count >= max(2, _SEEN * count.sum())] if len(sizes) else sizes
    if not len(common) or common[0] % 2:
        return None
    fine = int(common[0])
    widest = fine << _DOUBLINGS
    kinds, number = np.unique(q % widest * (gap.max() + 1) + gap, return_counts=True)
    place, kind_gap = np.divmod(kinds, gap.max() + 1)
    best, most = None, 0
    for parent in (fine << np.arange(_DOUBLINGS + 1)).tolist():
        for corner in range(parent):
            half = _half_side((place - corner) % parent, fine, parent)
            agree = int(number[(kind_gap == 2 * half) & (half > 0)].sum())
            if agree <= most:
                continue
            odd = (half == 0) | ((kind_gap > 0) & (kind_gap < 2 * half))
            if number[odd].sum() <= _ODD * len(q):
                best, most = (parent, corner), agree
    if best is None:
        return None
    half = _half_side((q - best[1]) % best[0], fine, best[0])
    odd = (half == 0) | ((gap > 0) & (gap < 2 * half))
    return fine, best[1], np.where(odd, fine // 2, half)


def _half_side(place: Ints, fine: int, parent: int) -> Ints:
    """Return the half side of blocks at places (n,) in a parent; 0 where no block can lie."""
    out = np.zeros(len(place), np.int64)
    half = fine // 2
    while 2 * half <= parent:
        out[place % (2 * half) == half] = half
        half *= 2
    return out


def _filled(lattice: Lattice, q: Ints, fine: Ints, first: Ints, half: Ints) -> Solid | None:
    """Return every block as the finest cells it holds, or as coarser ones where those are many.

    None where blocks overlap, so that the sides inferred are wrong.
    """
    low = (q - half - first) // fine
    count = 2 * half // fine
    total = int(count.prod(axis=1).sum())
    merge = 1
    while total / merge**3 > MOST_CELLS and 2 * merge <= count.max():
        merge *= 2
    if total > 64 * MOST_CELLS:
        return None
    cells, share = _merged(low, count, merge)
    if (share > 1 + 1e-9).mean() > _ODD:
        return None
    cells = cells[share >= 0.5]
    side = fine * merge
    steps = side * lattice.steps / 2
    at = first + side / 2
    origin = lattice.origin + (at * lattice.steps / 2) @ lattice.axes
    home = _nearest_cell(cells, (q - at) / side)
    moved = Lattice(lattice.axes, steps, lattice.share, origin)
    return Solid(moved, _centres(cells, moved), home, True)


def _merged(low: Ints, count: Ints, merge: int) -> tuple[Ints, Floats]:
    """Return the cells of ``merge`` fine cells a side that blocks touch, and how full they are.

    ``low`` (n, 3) is each block's first fine cell, ``count`` (n, 3) its number of them.
    """
    parts, weights = [], []
    for extent in np.unique(count, axis=0):
        mine = low[(count == extent).all(axis=1)]
        apart = np.minimum(extent, merge)
        inner = product(*(range(0, e, a) for e, a in zip(extent, apart, strict=True)))
        cells = (mine[:, None] + np.array(list(inner))).reshape(-1, 3) // merge
        parts.append(cells)
        weights.append(np.full(len(cells), apart.prod() / merge**3))
    every = np.concatenate(parts)
    start = every.min(axis=0)
    shape = tuple(every.max(axis=0) - start + 1)
    keys = np.ravel_multi_index(tuple((every - start).T), shape)
    distinct, row = np.unique(keys, return_inverse=True)
    merged = np.stack(np.unravel_index(distinct, shape), axis=1) + start
    share: Floats = np.bincount(row, np.concatenate(weights)).astype(np.float64)
    return merged, share


def _nearest_cell(cells: Ints, places: Floats) -> Ints:
    """Return the row of a cell at each place (in cells), (n,): the nearest one."""
    return np.asarray(cKDTree(cells).query(places)[1], dtype=np.int64)


def _centres(cells: Ints, lattice: Lattice) -> Floats:
    out: Floats = (cells * lattice.steps) @ lattice.axes + lattice.origin
    return out


def _with_missing(
    points: Floats, lattice: Lattice, q: Ints, fine: Ints, first: Ints
) -> Solid | None:
    """Return the blocks and the places they surround; None where there is no such place."""
    at = first + fine // 2
    cells = (q - at) // fine
    missing = _missing(cells)
    if not len(missing):
        return None
    side = fine * lattice.steps / 2
    origin = lattice.origin + (at * lattice.steps / 2) @ lattice.axes
    moved = Lattice(lattice.axes, side, lattice.share, origin)
    every = np.concatenate([points, _centres(missing, moved)])
    return Solid(moved, every, np.arange(len(points)), False)


def _missing(cells: Ints) -> Ints:
    """Return the places of blocks that are missing at random or in a slab, (m, 3)."""
    filled = _Cells.of(cells)
    if filled.usual < FEWEST:
        return np.zeros((0, 3), np.int64)
    alone = _surrounded(filled)
    if len(alone):
        cells = np.concatenate([cells, alone])
        filled = _Cells.of(cells)
    slab = _parting(filled)
    if not len(slab):
        return alone
    rest = surrounded(np.concatenate([cells, slab]))
    return np.concatenate([alone, slab, rest])


@dataclass(frozen=True, eq=False)
class _Cells:
    """Occupied cells as sorted distinct keys, and which keys are among them.

    Attributes
    ----------
    keys : (n,) int
        Of the cells, sorted.
    low : (3,) int
        The cell of key 0.
    shape : (3,) int
        Cells of the box along each axis, a margin included.
    """

    keys: Ints
    low: Ints
    shape: Ints

    @classmethod
    def of(cls, cells: Ints, margin: int = 3) -> _Cells:
        """Return the cells (n, 3) with so many empty ones around."""
        low = cells.min(axis=0) - margin
        shape = cells.max(axis=0) - low + 1 + margin
        stride = np.array([shape[1] * shape[2], shape[2], 1])
        return cls(sorted_distinct((cells - low) @ stride), low, shape)

    def with_keys(self, keys: Ints) -> _Cells:
        """Return these and further cells of the same box."""
        return _Cells(sorted_distinct(np.concatenate([self.keys, keys])), self.low, self.shape)

    @property
    def stride(self) -> Ints:
        """The key of one step along each axis, (3,)."""
        return np.array([self.shape[1] * self.shape[2], self.shape[2], 1])

    @property
    def around(self) -> list[int]:
        """What the keys of a cell's 26 neighbours are away from its own."""
        return [int(np.array(o) @ self.stride) for o in product((-1, 0, 1), repeat=3) if any(o)]

    @cached_property
    def usual(self) -> float:
        """The upper quartile of the number of blocks among a block's 26 neighbours."""
        return float(np.percentile(self.neighbours(self.keys), 75))

    @cached_property
    def table(self) -> Bools | None:
        """Whether each key of the box is occupied; None where the box is far larger than that."""
        count = int(self.shape.prod())
        if count > _EMPTY * len(self.keys):
            return None
        table = np.zeros(count, dtype=bool)
        table[self.keys] = True
        return table

    def held(self, wanted: Ints) -> Bools:
        """Return which keys (m,) are occupied."""
        if self.table is not None:
            return np.asarray(self.table.take(wanted))
        at = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        out: Bools = self.keys[at] == wanted
        return out

    def neighbours(self, keys: Ints) -> Numbers:
        """Return how many of the 26 cells around each are occupied, (m,)."""
        count = np.zeros(len(keys), dtype=np.int32)
        for step in self.around:
            count += self.held(keys + step)
        return count

    def parts(self) -> Ints:
        """Return the face-connected part of each cell, (n,)."""
        if self.table is not None:
            labels = ndimage.label(self.table.reshape(self.shape))[0].ravel()
            out: Ints = labels.take(self.keys).astype(np.int64) - 1
            return out
        first, second = [], []
        for step in self.stride.tolist():
            held = self.held(self.keys + step)
            first.append(np.flatnonzero(held))
            second.append(np.searchsorted(self.keys, self.keys[held] + step))
        ends = (np.concatenate(first), np.concatenate(second))
        graph = coo_array((np.ones(len(ends[0]), np.int8), ends), shape=(len(self.keys),) * 2)
        found: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
        return found

    def places(self, keys: Ints) -> Ints:
        """Return the cells of keys, (m, 3)."""
        i, rest = np.divmod(keys, self.stride[0])
        j, k = np.divmod(rest, self.stride[1])
        return np.stack([i, j, k], axis=1) + self.low


def parting(cells: Ints) -> Ints:
    """Return the empty places of slabs, one or two blocks wide, that part the body, (m, 3).

    They lie on a lattice line between blocks of two large parts that nowhere share a face, and
    that lie one block apart somewhere.  Limbs that nearly touch are one part, about the hinge.

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cell of every block.
    """
    return _parting(_Cells.of(cells))


def _parting(filled: _Cells) -> Ints:
    keys, part = filled.keys, filled.parts()
    sizes = np.bincount(part)
    if (sizes >= _LARGE * len(keys)).sum() < 2:
        return np.zeros((0, 3), np.int64)
    part = np.where(sizes[part] >= _LARGE * len(keys), part, -1)
    found, joined = [np.zeros(0, np.int64)], np.zeros(0, np.int64)
    for width in (1, 2):
        for step in filled.stride.tolist():
            at = np.searchsorted(keys, keys + (width + 1) * step)
            at = np.minimum(at, len(keys) - 1)
            across = (keys[at] == keys + (width + 1) * step) & (part[at] != part)
            across &= (part >= 0) & (part[at] >= 0)
            pair = np.minimum(part, part[at]) * len(sizes) + np.maximum(part, part[at])
            if width == 1:
                joined = np.union1d(joined, pair[across])
            across &= np.isin(pair, joined)
            found += [keys[across] + i * step for i in range(1, width + 1)]
    between = sorted_distinct(np.concatenate(found))
    return filled.places(between[~filled.held(between)])


def surrounded(cells: Ints) -> Ints:
    """Return the empty places that blocks surround on nearly all sides, (m, 3).

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cell of every block.
    """
    return _surrounded(_Cells.of(cells))


def _surrounded(filled: _Cells) -> Ints:
    added, fresh = [np.zeros(0, np.int64)], filled.keys
    for _ in range(_ROUNDS):
        least = max(SURROUNDED * filled.usual / len(filled.around), FEWEST)
        beside = [part[~filled.held(part)] for part in (fresh + s for s in filled.around)]
        place = sorted_distinct(np.concatenate(beside))
        fresh = place[filled.neighbours(place) >= least]
        if not len(fresh):
            break
        added.append(fresh)
        filled = filled.with_keys(fresh)
    return filled.places(np.concatenate(added))
