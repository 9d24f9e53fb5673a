"""Blocks merged into cells, so that large models cost no more than their shape needs.

Hull, split and mid surface follow folds, outline and thickness. Blocks much smaller than those
would cost more and change nothing. So the blocks of every ``merge x merge x merge`` positions
become one cell with the share of it that they fill. The blocks near the body's surface are marked,
because they alone locate it to a fraction of a block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.threads import over_slices
from geounfold.body.block_cells import OccupiedCells, offsets
from geounfold.geometry.mesh import Bools, Floats, Ints

MERGE_ABOVE = 60_000
"""Number of blocks up to which none are merged."""

LEAST_SURFACE = 12_000.0
"""Area of the body's surface, in faces of a cell, below which merging does not take it."""

LEAST_LAYERS = 1.0
"""Thickness of the body, in cells, below which merging does not take it."""

SLANT = 1.5
"""Mean over all directions of |nx| + |ny| + |nz|: faces of blocks per unit of a smooth surface."""

_FILLED = 0.5  # least share of an inner cell off a lattice, because blocks per cell vary
_OFF = np.array([0.3711, 0.6173, 0.1437])  # of a cell: no grid point lies on a border of cells
_SLICE = 1 << 14  # blocks at once
_AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@dataclass(frozen=True, eq=False)
class MergedBlocks:
    """A body's blocks merged into cells.

    Attributes
    ----------
    merge : int
        Blocks along a cell's side.
    points : (k, 3) float
        Mean position of the blocks in each cell, in working units divided by ``merge``.
    share : (k,) float
        Share of each cell that its blocks fill; 1 is full.
    border : (n,) bool
        For every block: whether its cell or one of the 26 around that cell is not full.
    beside : (n,) bool
        For every block: whether its cell or one of the 26 around that cell holds border blocks.
    """

    merge: int
    points: Floats
    share: Floats
    border: Bools
    beside: Bools


def merge_sizes(points: Floats, steps: Floats | None, above: int = MERGE_ABOVE) -> tuple[int, ...]:
    """Return the numbers of blocks along a cell's side to try, the largest first.

    The first is the largest that leaves LEAST_SURFACE and LEAST_LAYERS; each next one is three
    quarters of the one before. The tuple is empty if no blocks are to be merged.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    steps : (3,) float or None
        Block sides, if the blocks lie on a lattice at whole multiples of them.
    above : int
        Number of blocks up to which none are merged.
    """
    if len(points) <= above:
        return ()
    return sizes_for(*area_and_thickness(points, steps))


def sizes_for(area: float, thickness: float) -> tuple[int, ...]:
    """Return the sizes of `merge_sizes` for a body's area and thickness, working units."""
    wanted = np.ceil(np.sqrt(area / LEAST_SURFACE))
    found, merge = [], int(max(1, min(wanted, thickness // LEAST_LAYERS)))
    while merge > 1:
        found.append(merge)
        merge = 3 * merge // 4
    return tuple(found)


def merge_blocks(points: Floats, steps: Floats | None, merge: int) -> MergedBlocks:
    """Return the blocks merged into cells of ``merge`` blocks a side.

    Parameters
    ----------
    points, steps
        As merge_sizes takes them.
    merge : int
        Blocks along a cell's side, 2 or more.
    """
    cells, row = OccupiedCells.numbered(_places(points, steps, merge))
    count = np.bincount(row)
    share = count / merge**3
    middle = [np.bincount(row, x) / count / merge for x in points.T]
    full = share >= (_FILLED if steps is None else 1.0)
    inner = _least(cells, full.astype(np.float64))
    deep = _least(cells, inner)
    return MergedBlocks(merge, np.stack(middle, axis=1), share, (inner < 1)[row], (deep < 1)[row])


def area_and_thickness(points: Floats, steps: Floats | None) -> tuple[float, float]:
    """Return the area of a body's surface and its mean thickness, working units.

    They are measured on cells of two blocks a side.

    Parameters
    ----------
    points, steps
        As merge_sizes takes them.
    """
    cells, row = OccupiedCells.numbered(_places(points, steps, 2))
    sides = np.ones(3) if steps is None else steps
    area = 4 * _surface_area(cells, np.bincount(row) / 8, 1 / sides) / SLANT
    return area, 2 * len(points) / area


def _places(points: Floats, steps: Floats | None, merge: int) -> Ints:
    """Return the cell of every block, (n, 3)."""
    out = np.empty((len(points), 3), np.int64)

    def work(rows: slice) -> None:
        own = points[rows]
        at = own / merge + _OFF if steps is None else (np.rint(own / steps) + 0.5) / merge
        out[rows] = np.floor(at)

    over_slices(work, len(points), _SLICE)
    return out


def _at(cells: OccupiedCells, values: Floats, step: tuple[int, ...]) -> Floats:
    """Return the values (k,) of the cells a step away from each cell; 0 for empty cells."""
    found = cells.rows(cells.keys + int(np.dot(step, cells.stride)))
    return np.where(found >= 0, values[found], 0.0)


def _least(cells: OccupiedCells, values: Floats) -> Floats:
    """Return the least value of each cell and the 26 around it, (k,); empty cells have 0."""
    out = values
    for step in offsets(1):
        out = np.minimum(out, _at(cells, values, step))
    return out


def _surface_area(cells: OccupiedCells, share: Floats, faces: Floats) -> float:
    """Return the area of the surface of partly filled cells, steps of its stairs included.

    It is the total variation of their shares (k,): by the co-area formula, the mean area over all
    levels of the share. ``faces`` (3,) is the area of a cell's face across each axis.
    """
    total = 0.0
    for step, face in zip(_AXES, faces.tolist(), strict=True):
        last = _at(cells, np.ones(len(share)), tuple(-s for s in step)) == 0
        total += face * float(np.abs(share - _at(cells, share, step)).sum() + share[last].sum())
    return total
