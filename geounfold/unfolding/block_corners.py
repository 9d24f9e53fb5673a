"""The corners of an unfolding's blocks in both spaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Floats
from geounfold.io.block_sizes import block_model

_HALVES = 0.5 * np.array(
    [
        *([-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]),
        *([-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]),
    ]
)
"""Corners in the order of VTK's hexahedron."""


def block_corners(
    table: pd.DataFrame,
    folded: Floats,
    unfolded: Floats | None = None,
    to_flat: Callable[[Floats], Floats] | None = None,
) -> Floats:
    """Return the corners of every block, (n, 8, 3), in the order of VTK's hexahedron.

    Parameters
    ----------
    table : DataFrame, n rows
        May have columns of the blocks' sides.
    folded : (n, 3) float
        The centroids.
    unfolded, to_flat : (n, 3) float and callable, optional
        The centroids in the flat space, and the map, for the corners there. A block with a corner
        that has no image keeps its sides about its unfolded centre.

    Raises
    ------
    InputError
        The sides are not known.
    """
    blocks = block_model(table, folded)
    corners: Floats = folded[:, None] + (_HALVES * blocks.sizes[:, None]) @ blocks.axes
    if to_flat is None or unfolded is None:
        return corners
    flat = to_flat(corners.reshape(-1, 3)).reshape(corners.shape)
    lost = ~np.isfinite(flat).all(axis=(1, 2))
    flat[lost] = unfolded[lost, None] + _HALVES * blocks.sizes[lost, None]
    return flat
