"""The coarsest lattice whose cells fill exactly the same solid.

A model whose blocks all were split (in 2, 8, 27 ...) is the same solid as before, and is to unfold
as it did. So cells are joined again, as long as every joined cell is full.
"""

from __future__ import annotations

import numpy as np

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.lattice import Lattice, lattice_indices
from geounfold.body.sub_blocks import FilledCells
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Floats, Ints

_PRIMES = (2, 3, 5, 7)  # cells joined along every axis; one after the other for 4, 6, 8 ...

LEAST_RUN = 5.0
"""Least mean number of joined cells in a row, along the axis of the shortest rows.

A body of 4,005 blocks, nine in a row, is refused if all are split in 8 (3,983 blocks not reached)
and unfolds as before if they are joined. Sheets of two or three blocks in a row unfold with either.
"""

_SAMPLE = 1000  # cells that are tried before all are


def coarsest_cells(
    points: Floats, lattice: Lattice | None, filled: FilledCells | None
) -> FilledCells | None:
    """Return the cells of the coarsest lattice with the same solid; ``filled`` if it is that.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, world coordinates.
    lattice : Lattice or None
        The centroids' lattice.
    filled : FilledCells or None
        The cells that blocks fill, as `filled_cells` returns them.

    Examples
    --------
    >>> k = np.stack(np.meshgrid(*[np.arange(12)] * 3, indexing="ij"), -1).reshape(-1, 3)
    >>> found = coarsest_cells(k * 5.0, Lattice(np.eye(3), np.full(3, 5.0), 1.0), None)
    >>> len(found.points), found.lattice.steps.tolist(), found.joined
    (216, [10.0, 10.0, 10.0], 2)
    """
    if lattice is None:
        return None
    centres, own = (points, lattice) if filled is None else (filled.points, filled.lattice)
    cells = lattice_indices(centres, own)
    low = bounds(cells)[0]
    cells = cells - low
    joined = 1
    while (more := _joinable(cells // joined)) is not None:
        joined *= more
    if joined == 1:
        return filled
    box, row = OccupiedCells.numbered(cells // joined)
    origin = own.origin + ((low + (joined - 1) / 2) * own.steps) @ own.axes
    coarse = Lattice(own.axes, own.steps * joined, own.share, origin)
    home = row if filled is None else row[filled.home]
    places = (box.cells_of(box.keys) * coarse.steps) @ coarse.axes + origin
    sub_blocked = filled is not None and filled.sub_blocked
    return FilledCells(coarse, places, home, sub_blocked, joined)


def _joinable(cells: Ints) -> int | None:
    """Return how many cells to join along every axis; None if no more can be joined."""
    box = OccupiedCells.of(cells)
    run = min(_mean_run(box, axis) for axis in range(3))
    for count in _PRIMES:
        if run >= count * LEAST_RUN and all(_full(box, axis, count) for axis in range(3)):
            return count
    return None


def _mean_run(box: OccupiedCells, axis: int) -> float:
    """Return the mean number of cells in a row along an axis."""
    starts = np.count_nonzero(~box.occupied(box.keys - int(box.stride[axis])))
    return len(box.keys) / max(int(starts), 1)


def _full(box: OccupiedCells, axis: int, count: int) -> bool:
    """Return whether cells, counted from 0, fill groups of ``count`` along an axis."""
    stride = int(box.stride[axis])
    for keys in (box.keys[:: -(-len(box.keys) // _SAMPLE)], box.keys):
        place = box.cells_of(keys)[:, axis] % count
        first = keys - place * stride
        if not all(box.occupied(first + k * stride).all() for k in range(count)):
            return False
    return True
