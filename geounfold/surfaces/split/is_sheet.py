"""Checks that a split surface is a sheet with two sides."""

from __future__ import annotations

from geounfold.errors import NoSheetError
from geounfold.geometry.measures import triangle_areas
from geounfold.geometry.mesh import Bools
from geounfold.surfaces.split.result import SurfaceSplit

MIN_EXTENT = 4.5
"""Area of a side away from the rim, over the squared thickness, from which there is a sheet.

Measured: flat ball 4.0, lens 20 across and 8 thick 5.4, acceptance bodies 27 to 640.
"""

MIN_PARTED = 2.5
"""The same with the rim, if flanks are told from the sides.

Measured: box of 40 x 20 x 20 2.0, pierced sheet of 4,000 blocks 3.9.
"""

FLANKED = 0.15
"""Share of the hull's area that is flanks, from which they are told from the sides.

Measured: flat ball 0.04, which passes for a sheet at 0; strips of extent below MIN_EXTENT 0.41 on.
"""


def side_extent(result: SurfaceSplit) -> tuple[float, float]:
    """Return the area of top and of bottom away from the rim, over the squared thickness."""
    return _extent(result, ~result.rim)


def _extent(result: SurfaceSplit, faces: Bools) -> tuple[float, float]:
    """Return the area of top and of bottom among faces (m,), over the squared thickness."""
    area = triangle_areas(result.mesh.V, result.mesh.F) / result.median_thickness**2
    top, bottom = (float(area[(result.side == s) & faces].sum()) for s in (1, -1))
    return top, bottom


def check_sheet(result: SurfaceSplit) -> None:
    """Raise NoSheetError if a side is too small for its thickness: a ball, a cube.

    If ridges part the sides from flanks, the least extent is MIN_PARTED, flanks left out.
    """
    extent = min(side_extent(result))
    if extent >= MIN_EXTENT:
        return
    area = triangle_areas(result.mesh.V, result.mesh.F)
    flanked = area[result.beyond].sum() > FLANKED * area.sum()
    if flanked and min(_extent(result, ~result.beyond)) >= MIN_PARTED:
        return
    raise NoSheetError(
        "the body has no two opposite surfaces to flatten: each covers only "
        f"{extent:.1f} times its thickness squared (a sheet has at least {MIN_EXTENT:g})"
    )
