"""Blocks that came to lie far from a block that they touch."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores
from geounfold.geometry.mesh import Floats, Ints

SUSPECT = 1.0
"""Neighbour distance error from which a block is looked at for being torn from its neighbours.

Measured: at most 0.52 on 28 sound unfoldings whose limbs keep apart.  Where limbs all but touch,
blocks have some of their 26 neighbours on the other limb and go above it, rightly.
"""


TORN = 4.0
"""A block is torn from one that it touches where they come to lie so many times farther apart.

Flexural slip alone draws neighbours apart by up to the change of heading in radians: 2.2 times at
220 degrees between the limbs, 3.3 at a full turn.
"""


_TOUCH = 1.3  # times the distance to the nearest: blocks face to face, not edge to edge (1.41)


def torn_blocks(folded: Floats, unfolded: Floats, sides: Floats | None, suspects: Ints) -> Ints:
    """Return those of some blocks that came to lie far from a block that they touch.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        Blocks in both spaces, the former along the lattice's axes where it has one; same unit.
    sides : (3,) float or None
        Sides of the blocks, in that unit; None where they are not known.
    suspects : (k,) int
        Rows to look at.
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
