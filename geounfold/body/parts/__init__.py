"""Sheet parts of a body, recognised before a sheet is fitted.

Rays across the body give medial points (`rays`), which are joined into regions of like normal,
height and thickness (`regions`). Where regions meet (`meetings`), rules tell one sheet from two
(`rules`, `sheets`). The rays then give every cell its sheet (`labels`).

Medial clouds were segmented into sheets before (Kustra et al., 2015), and the skeletons of thin
voxel plates at their junctions (Michikawa and Suzuki, 2013); both need finer surfaces than blocks.
"""

from __future__ import annotations

import numpy as np

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.merged_blocks import area_and_thickness
from geounfold.body.parts.junctions import find_junctions
from geounfold.body.parts.labels import in_pieces, label_cells
from geounfold.body.parts.rays import medial_points
from geounfold.body.parts.regions import find_regions
from geounfold.body.parts.result import Junction, SheetParts
from geounfold.body.parts.sheets import find_sheets
from geounfold.body.parts.voxels import Voxels
from geounfold.geometry.mesh import Floats, Ints

_LAYERS = 8.0
"""Thickness of a body, in merged cells, from which these decide whether it is one sheet.

The rules' thresholds were set on sheets of 4 to 12 cells. Merged cells find as many sheets as
single ones in six bodies of the field suite whose cells were divided in 8 and in 64. A sheet of
two cells can be found, so one a quarter as thick as the body's mean is not missed.
"""

_MANY, _LAYERS_MANY = 250_000, 5.0
"""Number of cells above which fewer layers of merged cells decide, and how many.

A million blocks in 11 layers are searched in 1.0 s of processor in place of 4.0. With 5 layers for
small bodies too, the parts of all 91 bodies of the field suite stay the same, block by block.
"""

__all__ = ["Junction", "SheetParts", "sheet_parts"]


def sheet_parts(cells: Ints, steps: Floats) -> SheetParts:
    """Return the sheet parts of one body on a lattice.

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cells that the body fills, each once. Its waste lenses, pits and bridges are
        taken for mended: what is left of them makes parts of its own.
    steps : (3,) float
        Sides of a cell along the lattice's axes, working units (product 1).

    Returns
    -------
    SheetParts
        With one part, and no junctions, for a body of one sheet or of none that is recognised.
    """
    merge = _merge(cells, steps)
    if merge > 1:
        merged = sheet_parts(_merged(cells, merge), steps)
        if merged.count == 1 and not merged.junctions:
            return _one(len(cells), merge * float(merged.thickness[0]))
    body = Voxels.of(cells, steps)
    rays = medial_points(body)
    if not len(rays.thickness):
        return _one(len(cells), np.nan)
    regions = find_regions(rays, steps)
    if regions.count < 2:
        return _one(len(cells), float(np.median(rays.thickness)))
    sheets = find_sheets(regions)
    if sheets.count < 2 and not (sheets.count and sheets.rod.any()):
        return _one(len(cells), float(np.median(rays.thickness)))
    table, sheet = in_pieces(label_cells(body, sheets), sheets.count)
    junctions = find_junctions(table, body, sheets, sheet)
    return SheetParts(table[tuple(body.cells.T)], sheets.thickness[sheet], junctions)


def _merge(cells: Ints, steps: Floats) -> int:
    """Return how many cells a side may be one, so that the body is thick enough in them."""
    _, thickness = area_and_thickness(cells * steps, steps)
    layers = _LAYERS if len(cells) <= _MANY else _LAYERS_MANY
    return max(1, int(thickness / float(steps.max()) / layers))


def _merged(cells: Ints, merge: int) -> Ints:
    """Return the merged cells of which at least half is filled, (k, 3)."""
    coarse, row = OccupiedCells.numbered((cells - cells.min(axis=0)) // merge)
    return coarse.cells_of(coarse.keys[2 * np.bincount(row) >= merge**3])


def _one(count: int, thickness: float) -> SheetParts:
    return SheetParts(np.zeros(count, dtype=np.int64), np.array([thickness]), ())
