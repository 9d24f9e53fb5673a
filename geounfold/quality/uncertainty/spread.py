"""How far members spread around an answer: mean squares by kind and block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from geounfold.geometry.mesh import Floats

FARTHEST = 3.0
"""Distance in blocks at which a member's place is cut off: a limb that is lost counts once."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Mean squared distances of members from the answer, after the best rigid motion.

    Attributes
    ----------
    points : (n, 3) float
        Blocks at which they are measured, working units.
    along, across : mapping of (n,) float
        Mean square per kind of member: along the layers, of one axis, and across them; working
        units squared.  A kind of which every member failed is left out.
    failed : tuple of str
        Kinds of the members that could not be fitted.
    """

    points: Floats
    along: Mapping[str, Floats]
    across: Mapping[str, Floats]
    failed: tuple[str, ...]

    @classmethod
    def of(
        cls,
        points: Floats,
        moved: Mapping[str, Sequence[Floats]],
        failed: Sequence[str],
        noise: float = 0.0,
    ) -> Spread:
        """Return the spread of members.

        Parameters
        ----------
        points : (n, 3) float
            Blocks, working units.
        moved : mapping of sequences of (n, 3) float
            By kind, the distances of every member's blocks from the answer's in the flat space.  A
            block that a member does not place is NaN; it counts as far off as the body's others.
        failed : sequence of str
            Kinds of the members that could not be fitted.
        noise : float
            Variance of the blocks' own places along each axis, working units squared.
        """
        same = np.full(len(points), noise)
        along, across = {"noise": same}, {"noise": same}
        for name, members in moved.items():
            squares = [pair for member in members if (pair := _squares(member)) is not None]
            if squares:
                along[name] = np.mean([pair[0] for pair in squares], axis=0)
                across[name] = np.mean([pair[1] for pair in squares], axis=0)
        return cls(points, along, across, tuple(failed))


def _squares(moved: Floats) -> tuple[Floats, Floats] | None:
    """Return squared distances along, per axis, and across; None if no block was placed."""
    placed = np.isfinite(moved).all(axis=1)
    if not placed.any():
        return None
    out = []
    for square in ((moved[:, :2] ** 2).sum(axis=1) / 2, moved[:, 2] ** 2):
        cut = np.minimum(square, FARTHEST**2)
        out.append(np.where(placed, cut, cut[placed].mean()))
    return out[0], out[1]
