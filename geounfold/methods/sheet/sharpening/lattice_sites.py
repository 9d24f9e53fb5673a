"""Lattice sites at the body's surface: blocks inside it, empty places outside."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from geounfold.geometry.measures import bounds, sorted_distinct
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers

PIT = 13
"""Largest number of blocks among the 26 neighbours of a place beyond a plane, in any direction."""

PITS = 0.005
"""Share of empty places with more neighbours from which these count as missing blocks.

Missing blocks are not used as empty sites.  Measured: at most 0.002 if no block is missing (inner
hinges), 0.015 if 5 % are.
"""


_EMPTY = 32  # places of the box per block up to which a table of all of them is used

_Open = tuple[Bools, Ints, Numbers]


@dataclass(frozen=True, eq=False)
class Sites:
    """Blocks with an empty neighbour, and those empty neighbours.

    Attributes
    ----------
    points : (n, 3) float
        Positions, working units.
    occupied : (n,) bool
        True for a block (the body's surface lies beyond it), False for an empty site.
    """

    points: Floats
    occupied: Bools


def surface_sites(cells: Ints, steps: Floats, judged: Bools | None = None) -> Sites:
    """Return the sites at the surface of the blocks, from the 26 neighbours of each.

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cell of every block.
    steps : (3,) float
        Block sides, working units; cell k lies at ``k * steps``.
    judged : (n,) bool, optional
        Distinct blocks whose neighbours are examined; all by default.  The blocks must include
        their neighbours, and the neighbours of empty sites next to them.
    """
    first, last = bounds(cells)
    low = first - 1
    shape = last - low + 2
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    every = sum(column * step for column, step in zip((cells - low).T, stride, strict=True))
    beside = [int(np.array(o) @ stride) for o in product((-1, 0, 1), repeat=3) if any(o)]
    keys = sorted_distinct(every if judged is None else every[judged])
    if float(np.prod(shape.astype(float))) <= _EMPTY * len(every):
        open_, outside, around = _open_in_table(every, keys, beside, int(shape.prod()))
    else:
        open_, outside, around = _open_in_list(sorted_distinct(every), keys, beside)
    pits = around > PIT
    if pits.mean() > PITS:
        outside = outside[~pits]
    found = np.concatenate([keys[open_], outside])
    i, rest = np.divmod(found, stride[0])
    j, k = np.divmod(rest, stride[1])
    points = (np.stack([i, j, k], axis=1) + low) * steps
    return Sites(points, np.arange(len(found)) < int(open_.sum()))


def _open_in_table(every: Ints, keys: Ints, steps: list[int], size: int) -> _Open:
    """Return what `_open_in_list` does, by a table of all ``size`` places of the box."""
    filled = np.zeros(size, dtype=bool)
    filled[every] = True
    open_, around = np.zeros(len(keys), dtype=bool), np.zeros(size, dtype=np.int8)
    for step in steps:
        wanted = keys + step
        missing = ~filled.take(wanted)
        open_ |= missing
        around[wanted[missing]] += 1
    outside = np.flatnonzero(around)
    return open_, outside, around[outside].astype(np.int32)


def _open_in_list(every: Ints, keys: Ints, steps: list[int]) -> _Open:
    """Return which keys have an empty neighbour, those neighbours, and their judged neighbours.

    Parameters
    ----------
    every : (m,) int
        Keys of all blocks, sorted: shifted keys are then looked up in order.
    keys : (n,) int
        Keys of the blocks that are judged, sorted.
    steps : list of int
        Differences between the keys of the 26 neighbours and a block's own.
    """
    open_, empty = np.zeros(len(keys), dtype=bool), []
    for step in steps:
        wanted = keys + step
        at = np.minimum(np.searchsorted(every, wanted), len(every) - 1)
        missing = every[at] != wanted
        open_ |= missing
        empty.append(wanted[missing])
    outside, around = np.unique(np.concatenate(empty), return_counts=True)
    return open_, outside, np.asarray(around, dtype=np.int32)


def scatter(points: Floats) -> Floats:
    """Return an evenly spread number in [0, 1) per point (n,), independent of the rows' order."""
    out: Floats = np.mod(points @ np.array([7.1317, 5.7731, 3.3119]), 1.0)
    return out
