"""The top and bottom surfaces of a body, for the viewer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.report.arrays import encoded, floating_points

if TYPE_CHECKING:
    from geounfold.methods import SurfacePair

MOST_TRIANGLES = 30_000
"""Triangles above which a surface is left out: 0.7 MB of the page."""

Horizons = Mapping[str, "SurfacePair"]
"""Surfaces in both spaces, the data's unit, by name: ``top`` and ``bottom``."""


def horizons_data(
    horizons: Horizons | None, folded: Floats, unfolded: Floats
) -> dict[str, dict[str, Any]]:
    """Return the top and bottom surfaces relative to the body's corners; empty without both.

    Parameters
    ----------
    horizons : Horizons, optional
        The surfaces.
    folded, unfolded : (3,) float
        The body's lowest corner in each space.
    """
    if horizons is None or not {"top", "bottom"} <= set(horizons):
        return {}
    out = {}
    for name in ("top", "bottom"):
        pair = horizons[name]
        whole = np.isfinite(pair.unfolded.V[pair.unfolded.F]).all(axis=(1, 2))
        F = pair.folded.F[whole]
        if not 0 < len(F) <= MOST_TRIANGLES:
            return {}
        out[name] = {
            "triangles": encoded(F.ravel(), "u4"),
            "folded": floating_points(pair.folded.V, folded),
            "unfolded": floating_points(np.nan_to_num(pair.unfolded.V), unfolded),
        }
    return out
