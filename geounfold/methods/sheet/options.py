"""Options of the sheet method."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.body.merged_blocks import MERGE_ABOVE
from geounfold.errors import check_number, check_whole
from geounfold.methods.sheet.meshing.build import CELL
from geounfold.methods.sheet.mid_surface.fit import SMOOTH
from geounfold.methods.sheet.mid_surface.medial_points import CORE


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """Options of the sheet method.

    Parameters
    ----------
    smoothing : float
        Length, in blocks, below which the mid surface is smoothed; less follows tighter hinges.
    core : float
        Least cosine between opposite faces' normals, one reversed, to be top and bottom.
    mesh_cell : float
        Side of the control mesh's cells along the sheet, in blocks.
    merge_above : int
        Number of blocks above which they are merged into cells to fit the sheet.
    """

    smoothing: float = SMOOTH
    core: float = CORE
    mesh_cell: float = CELL
    merge_above: int = MERGE_ABOVE

    def __post_init__(self) -> None:
        check_number("sheet_options.smoothing", self.smoothing, 0, low_open=True)
        check_number("sheet_options.core", self.core, 0, 1)
        check_number("sheet_options.mesh_cell", self.mesh_cell, 0, low_open=True)
        check_whole("sheet_options.merge_above", self.merge_above, 1)
