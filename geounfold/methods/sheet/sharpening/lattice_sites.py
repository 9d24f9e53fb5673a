"""Lattice sites at the body's surface: blocks inside it, empty places outside."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from geounfold.geometry.measures import bounds, sorted_distinct
from geounfold.geometry.mesh import Bools, Floats, Ints

PIT = 13
"""Largest number of blocks among the 26 neighbours of a place beyond a plane, in any direction."""

PITS = 0.005
"""Share of empty places with more neighbours from which these count as missing blocks.

Missing blocks are not used as empty sites.  Measured: at most 0.002 if no block is missing (inner
hinges), 0.015 if 5 % are.
"""


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
    keys = among = sorted_distinct(every)  # sorted, so that shifted keys are looked up in order
    if judged is not None:
        keys = sorted_distinct(every[judged])
    open_ = np.zeros(len(keys), dtype=bool)
    empty = []
    for offset in product((-1, 0, 1), repeat=3):
        if not any(offset):
            continue
        wanted = keys + np.array(offset) @ stride
        at = np.minimum(np.searchsorted(among, wanted), len(among) - 1)
        missing = among[at] != wanted
        open_ |= missing
        empty.append(wanted[missing])
    outside, around = np.unique(np.concatenate(empty), return_counts=True)
    pits = around > PIT
    if pits.mean() > PITS:
        outside = outside[~pits]
    found = np.concatenate([keys[open_], outside])
    i, rest = np.divmod(found, stride[0])
    j, k = np.divmod(rest, stride[1])
    points = (np.stack([i, j, k], axis=1) + low) * steps
    return Sites(points, np.arange(len(found)) < int(open_.sum()))


def scatter(points: Floats) -> Floats:
    """Return an evenly spread number in [0, 1) per point (n,), independent of the rows' order."""
    out: Floats = np.mod(points @ np.array([7.1317, 5.7731, 3.3119]), 1.0)
    return out
