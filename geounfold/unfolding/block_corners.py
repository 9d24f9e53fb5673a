"""The corners of an unfolding's blocks in both spaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Floats, Space
from geounfold.io.block_sizes import block_model

if TYPE_CHECKING:
    from geounfold.unfolding.result import Unfolding

_HALVES = 0.5 * np.array(
    [
        *([-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]),
        *([-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]),
    ]
)
"""Corners in the order of VTK's hexahedron."""


def block_corners(result: Unfolding, space: Space, table: pd.DataFrame) -> Floats:
    """Return the corners of every block, (n, 8, 3), in the order of VTK's hexahedron.

    Parameters
    ----------
    result : Unfolding
        Of the blocks.
    space : {"folded", "unfolded"}
        In the unfolded space the map carries the corners; a block with a corner that has no image
        keeps its sides about its unfolded centre.
    table : DataFrame, n rows
        May have columns of the blocks' sides.

    Raises
    ------
    InputError
        The sides are not known.
    """
    blocks = block_model(table, result.folded)
    offsets = (_HALVES * blocks.sizes[:, None]) @ blocks.axes
    folded: Floats = result.folded[:, None] + offsets
    if space == "folded":
        return folded
    flat = result.to_flat(folded.reshape(-1, 3)).reshape(folded.shape)
    lost = ~np.isfinite(flat).all(axis=(1, 2))
    flat[lost] = result.points[lost, None] + _HALVES * blocks.sizes[lost, None]
    return flat
