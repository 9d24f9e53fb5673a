"""Blocks that the unfolding separated from a block that they touch when folded."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores
from geounfold.geometry.mesh import Floats, Ints

SUSPECT = 1.0
"""Epsilon from which a block is checked for being torn from its neighbours.

On 28 sound unfoldings with limbs well apart, epsilon is at most 0.52.  If limbs almost touch, some
of a block's 26 neighbours lie on the other limb, and its epsilon rightly exceeds 1.
"""

TORN = 4.0
"""Factor by which the distance to a touching block must grow for a block to count as torn.

Flexural slip alone multiplies the distance by up to the change of heading in radians: 2.2 at 220
degrees between the limbs, 3.3 at a full turn.
"""

_TOUCH = 1.3  # times the nearest block's distance: includes face neighbours, not edge ones (1.41)


def torn_blocks(folded: Floats, unfolded: Floats, sides: Floats | None, suspects: Ints) -> Ints:
    """Return the rows of those suspects that are torn from a block that they touch.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        Blocks in both spaces, in the same unit.  On a lattice, the folded blocks are given along
        the lattice's axes.
    sides : (3,) float or None
        Sides of the blocks, in the same unit; None if unknown.
    suspects : (k,) int
        Rows to check.
    """
    if not len(suspects):
        return suspects
    even = folded if sides is None else folded / sides
    count = min(7, len(even))
    distance, near = cKDTree(even).query(even[suspects], k=count, workers=cores())
    distance, near = np.asarray(distance)[:, 1:], np.asarray(near, dtype=np.int64)[:, 1:]
    touching = distance <= _TOUCH * distance[:, :1]
    before = np.linalg.norm(folded[near] - folded[suspects, None], axis=2)
    after = np.linalg.norm(unfolded[near] - unfolded[suspects, None], axis=2)
    out: Ints = suspects[(touching & (after > TORN * before)).any(axis=1)]
    return out
