"""The lattice cells that a block model fills: sub-blocks in their parents, missing blocks.

A sub-blocked model lists centroids of blocks of several sides: parents, and parts of parents that
are split in 2, 4 or 8 along an axis where the body's surface cuts them. On the lattice of the
finest blocks most positions hold no centroid, although nearly all of them lie in a block. This
module infers the sides from the centroids alone and replaces every block by the fine cells that it
fills, so that later stages get one full lattice of equal blocks. In models of equal blocks, empty
positions that blocks surround count as missing blocks and are filled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.lattice import Lattice, lattice_indices
from geounfold.geometry.measures import bounds, sorted_distinct
from geounfold.geometry.mesh import Bools, Floats, Ints

MOST_CELLS = 250_000
"""Number of cells above which parents are filled by coarser ones; about ten seconds' work."""

SURROUNDED = 22
"""Least number of blocks among an empty position's 26 neighbours that make it a missing block.

Beside a plane of any direction a position outside has 13 at most, in a gap one block wide 18.
Inside, with 5 % of the blocks missing at random, it has 24.7 in the mean. If more are missing,
blocks inside have fewer neighbours themselves, and the number is lowered in proportion, down to
FEWEST.
"""

FEWEST = 16
"""Least number of blocks around a missing one, and least upper quartile of the blocks' neighbours.

If the quartile is lower, no block counts as missing. Measured quartiles: 8 to 14 in sheets one
block thick and up to 17 in a block and a half, whose blocks touch along edges, so that their gaps
are no missing blocks; 17 to 20 in two blocks, 17 with 5 % missing.
"""

_LARGE = 0.01  # least share of the blocks in a part of the body that counts
_ROUNDS = 2  # of filling: more would fill a gap from its end, where a position has 21 neighbours
_DOUBLINGS = 5  # of the finest side that are tried as the parents' side
_PARTS = 3  # halvings of a common gap that are tried as the finest side
_CLEAR = 0.2  # share of the blocks that only parts in 3 or 5 explain, to take these
_ODD = 0.01  # share of the blocks that may contradict the sides inferred
_SEEN = 0.002  # least share of the aligned differences that equal a side


@dataclass(frozen=True, eq=False)
class FilledCells:
    """The cells of one regular lattice that blocks fill.

    Attributes
    ----------
    lattice : Lattice
        Its origin is a cell's centre, its steps are the cells' sides.
    points : (m, 3) float
        Centres of the cells, world coordinates.
    home : (n,) int
        For every input point, the row of a cell at or in its block.
    sub_blocked : bool
        Whether blocks of several sides were found.
    joined : int
        How many cells of the points' own lattice a cell has along every axis.
    """

    lattice: Lattice
    points: Floats
    home: Ints
    sub_blocked: bool
    joined: int = 1


def filled_cells(points: Floats, lattice: Lattice | None) -> FilledCells | None:
    """Return the cells that blocks fill; None if those are the points themselves.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, world coordinates.
    lattice : Lattice or None
        The centroids' lattice.

    Returns
    -------
    FilledCells or None
        None without a lattice, and for equal blocks of which none is missing.

    Examples
    --------
    >>> k = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5
    >>> split = k[:, 0] < 2
    >>> blocks = np.concatenate([k[split], np.unique(k[~split] // 2, axis=0) * 2 + 1])
    >>> found = filled_cells(blocks, Lattice(np.eye(3), np.full(3, 0.5), 1.0))
    >>> len(blocks), len(found.points), found.lattice.steps.tolist()
    (90, 216, [1.0, 1.0, 1.0])
    """
    if lattice is None:
        return None
    q = lattice_indices(points, replace(lattice, steps=lattice.steps / 2))
    sides = _block_sides(q)
    if sides is None:
        return None
    fine, first, half = sides
    if (half == fine // 2).all():
        return _with_missing(points, lattice, q, fine, first)
    return _filled(lattice, q, fine, first, half)


def _block_sides(q: Ints) -> tuple[Ints, Ints, Ints] | None:
    """Return the finest side (3,), a corner of all blocks (3,) and the blocks' half sides (n, 3).

    All are in half steps of the lattice. None if no splitting into halves explains the centroids.
    """
    ends = bounds(q)
    gaps = np.stack([_aligned_gap(q, axis, ends) for axis in range(3)], axis=1)
    fine, first, half = np.zeros(3, np.int64), np.zeros(3, np.int64), np.zeros_like(q)
    for axis in range(3):
        found = _axis_sides(q[:, axis], gaps[:, axis])
        if found is None:
            return None
        fine[axis], first[axis], half[:, axis] = found
    return fine, first, half


def _aligned_gap(q: Ints, axis: int, ends: tuple[Ints, Ints]) -> Ints:
    """Return each centroid's distance to the nearest one on its line along an axis, (n,).

    It is zero for a centroid that is alone on its line. ``ends`` are the least and greatest
    coordinates of all.
    """
    others = [i for i in range(3) if i != axis]
    first, last = (side[[*others, axis]] for side in ends)
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
    none = np.array([np.iinfo(np.int64).max])
    nearest = np.minimum(np.concatenate([none, gap]), np.concatenate([gap, none]))
    out = np.empty(len(q), np.int64)
    out[order] = np.where(nearest == none[0], 0, nearest)
    return out


def _axis_sides(q: Ints, gap: Ints) -> tuple[int, int, Ints] | None:
    """Return the finest side, a corner of all blocks and every half side along one axis.

    The finest side is the shortest common gap. If that explains too few blocks, as for one row of
    sub-blocks, which have no neighbours of their size along the axis, it is the largest half or
    quarter of a common gap that explains them.
    """
    sizes, count = np.unique(gap[gap > 0], return_counts=True)
    common = sizes[count >= max(2, _SEEN * count.sum())] if len(sizes) else sizes
    if not len(common):
        return None
    parts = {
        int(size) >> k for size in common for k in range(1, _PARTS + 1) if size % (1 << k) == 0
    }
    for fine in [int(common[0]), *sorted(parts, reverse=True)]:
        found = None if fine % 2 else _sides_from(q, gap, fine)
        if found is not None:
            return fine, *found
    return None


def _sides_from(q: Ints, gap: Ints, fine: int) -> tuple[int, Ints] | None:
    """Return a corner of all blocks and every half side along one axis, given the finest side.

    Blocks of side 2 L lie at ``corner + (2 i + 1) L``, so the corner and a centroid determine the
    side. The gap between neighbours on one line is mostly equal to a side, and never below the mean
    of the two; the corner chosen is the one with which most gaps agree. First no gap below a side
    is allowed, as if blocks of two sides never lay on one line.
    """
    widest = fine << _DOUBLINGS
    kinds, number = np.unique(q % widest * (gap.max() + 1) + gap, return_counts=True)
    place, kind_gap = np.divmod(kinds, gap.max() + 1)
    for least in (0, fine // 2):  # half the side of the smallest neighbour; 0: equal sides
        best, most = None, 0
        for parent in (fine << np.arange(_DOUBLINGS + 1)).tolist():
            for corner in range(parent):
                half = _half_side((place - corner) % parent, fine, parent)
                agree = int(number[(kind_gap == 2 * half) & (half > 0)].sum())
                if agree > most and number[_odd(half, kind_gap, least)].sum() <= _ODD * len(q):
                    best, most = (parent, corner), agree
        thirds = _in_thirds(q, gap, fine, most)
        if thirds is not None:
            return thirds
        if best is not None:
            half = _half_side((q - best[1]) % best[0], fine, best[0])
            return best[1], np.where(_odd(half, gap, least), fine // 2, half)
    return None


def _odd(half: Ints, gap: Ints, least: int) -> Bools:
    """Return whether blocks cannot have half sides (n,), by the gaps to their neighbours (n,)."""
    narrow = half + least if least else 2 * half
    odd: Bools = (half == 0) | ((gap > 0) & (gap < narrow))
    return odd


def _in_thirds(q: Ints, gap: Ints, fine: int, agreeing: int) -> tuple[int, Ints] | None:
    """Return a corner and every half side if parents are split in 3 or 5; None if they are not.

    The middle one of an odd number of parts lies where its parent would. It is a part if its
    neighbour on the line is as near as a part's. ``agreeing`` blocks agree with equal blocks or
    with halves; thirds must explain clearly more.
    """
    if agreeing + _CLEAR * len(q) > len(q):
        return None  # no blocks are left that thirds could explain
    for count in (3, 5):
        parent = count * fine
        for corner in range(parent):
            place = (q - corner) % parent
            whole = (place == parent // 2) & (gap != fine) & (parent % 2 == 0)
            half = np.where(whole, parent // 2, np.where(place % fine == fine // 2, fine // 2, 0))
            agree = int(((gap == 2 * half) & (half > 0)).sum())
            odd = _odd(half, gap, fine // 2)
            if agree >= agreeing + _CLEAR * len(q) and odd.mean() <= _ODD:
                return corner, np.where(odd, fine // 2, half)
    return None


def _half_side(place: Ints, fine: int, parent: int) -> Ints:
    """Return the half side of blocks at positions (n,) in a parent; 0 if no block can lie there."""
    out = np.zeros(len(place), np.int64)
    half = fine // 2
    while 2 * half <= parent:
        out[place % (2 * half) == half] = half
        half *= 2
    return out


def _filled(lattice: Lattice, q: Ints, fine: Ints, first: Ints, half: Ints) -> FilledCells | None:
    """Return every block as the finest cells it holds, or as coarser ones if those are too many.

    None if blocks overlap, because then the inferred sides are wrong.
    """
    low = (q - half - first) // fine
    count = 2 * half // fine
    total = int(count.prod(axis=1).sum())
    merge = 1
    halves = bool((count & (count - 1) == 0).all())  # else cells of 2 would cut across parents
    while halves and total / merge**3 > MOST_CELLS and 2 * merge <= count.max():
        merge *= 2
    if total > (64 if halves else 4) * MOST_CELLS:
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
    return FilledCells(moved, _centres(cells, moved), home, True)


def _merged(low: Ints, count: Ints, merge: int) -> tuple[Ints, Floats]:
    """Return the cells of ``merge`` fine cells a side that blocks touch, and their filled shares.

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
    """Return the row of the cell nearest to each position (in cells), (n,)."""
    return np.asarray(cKDTree(cells).query(places)[1], dtype=np.int64)


def _centres(cells: Ints, lattice: Lattice) -> Floats:
    out: Floats = (cells * lattice.steps) @ lattice.axes + lattice.origin
    return out


def _with_missing(
    points: Floats, lattice: Lattice, q: Ints, fine: Ints, first: Ints
) -> FilledCells | None:
    """Return the blocks and the missing ones among them; None if no block is missing."""
    at = first + fine // 2
    cells = (q - at) // fine
    missing = _missing(cells)
    if not len(missing):
        return None
    side = fine * lattice.steps / 2
    origin = lattice.origin + (at * lattice.steps / 2) @ lattice.axes
    moved = Lattice(lattice.axes, side, lattice.share, origin)
    every = np.concatenate([points, _centres(missing, moved)])
    return FilledCells(moved, every, np.arange(len(points)), False)


def _missing(cells: Ints) -> Ints:
    """Return the cells of blocks that are missing one by one or in a slab, (m, 3)."""
    filled = OccupiedCells.of(cells)
    if filled.usual_neighbours < FEWEST:
        return np.zeros((0, 3), np.int64)
    single = surrounded_gaps(filled)
    if len(single):
        cells = np.concatenate([cells, single])
        filled = OccupiedCells.of(cells)
    slab = missing_slabs(filled)
    if not len(slab):
        return single
    rest = surrounded_gaps(OccupiedCells.of(np.concatenate([cells, slab])))
    return np.concatenate([single, slab, rest])


def missing_slabs(filled: OccupiedCells) -> Ints:
    """Return the empty positions of slabs, one or two blocks wide, that divide the body, (m, 3).

    They lie on a lattice line between blocks of two large parts. The two parts share no face, and
    somewhere lie one block apart. Limbs that nearly touch are one part, joined around the hinge.
    """
    keys, part = filled.keys, filled.parts()
    sizes = np.bincount(part)
    if (sizes >= _LARGE * len(keys)).sum() < 2:
        return np.zeros((0, 3), np.int64)
    part = np.where(sizes[part] >= _LARGE * len(keys), part, -1)
    found, joined = [np.zeros(0, np.int64)], np.zeros(0, np.int64)
    for width in (1, 2):
        for step in filled.stride.tolist():
            at = filled.rows(keys + (width + 1) * step)
            across = (at >= 0) & (part[at] != part)
            across &= (part >= 0) & (part[at] >= 0)
            pair = np.minimum(part, part[at]) * len(sizes) + np.maximum(part, part[at])
            if width == 1:
                joined = np.union1d(joined, pair[across])
            across &= np.isin(pair, joined)
            found += [keys[across] + i * step for i in range(1, width + 1)]
    between = sorted_distinct(np.concatenate(found))
    return filled.cells_of(between[~filled.occupied(between)])


def surrounded_gaps(filled: OccupiedCells) -> Ints:
    """Return the empty positions that blocks surround on nearly all sides, (m, 3)."""
    around = filled.around
    added, fresh = [np.zeros(0, np.int64)], filled.keys
    for _ in range(_ROUNDS):
        least = max(SURROUNDED * filled.usual_neighbours / len(around), FEWEST)
        beside = [part[~filled.occupied(part)] for part in (fresh + s for s in around)]
        place = sorted_distinct(np.concatenate(beside))
        fresh = place[filled.neighbour_counts(place) >= least]
        if not len(fresh):
            break
        added.append(fresh)
        filled = filled.with_keys(fresh)
    return filled.cells_of(np.concatenate(added))
