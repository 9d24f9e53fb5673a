"""Where carried points lie: in the control mesh, around it, or beyond the map's reach."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.io.result_columns import UNFOLDED, result_columns

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats
    from geounfold.mapping.mesh_map import UnfoldingMap
    from geounfold.methods import PointwiseMap
    from geounfold.quality.uncertainty import PositionUncertainty


def flat_columns(
    saved: UnfoldingMap | PointwiseMap, uncertainty: PositionUncertainty | None = None
) -> Callable[[Floats], dict[str, Any]]:
    """Return the function from folded points, (n, 3), to the output columns of the unfolded.

    With ``uncertainty`` these include the standard deviations of their places.
    """

    def columns(points: Floats) -> dict[str, Any]:
        carried = saved.carry(points)
        found = result_columns(UNFOLDED, carried)
        if uncertainty is not None:
            found |= uncertainty.columns(points, carried.placed)
        return found

    return columns


def place_counts(columns: dict[str, Any]) -> dict[str, int]:
    """Return how many points there are, and how many are extrapolated and outside."""
    location = columns["location"]
    words = ("extrapolated", "outside")
    return {"carried": len(location), **{w: int(np.count_nonzero(location == w)) for w in words}}


def outside_warnings(source: str, counts: dict[str, int]) -> list[str]:
    """Return the warnings of points outside the control mesh.

    Parameters
    ----------
    source : str
        The points' file.
    counts : dict
        See `place_counts`.
    """
    total, extrapolated, outside = (counts[w] for w in ("carried", "extrapolated", "outside"))
    found = []
    if extrapolated:
        found.append(
            f"{source}: {extrapolated} of {total} points lie outside the control mesh and "
            "were carried by its continuation; they are marked extrapolated"
        )
    if outside:
        found.append(
            f"{source}: {outside} of {total} points lie farther from the control mesh than "
            "the map reaches; they were left empty and are marked outside"
        )
    return found
