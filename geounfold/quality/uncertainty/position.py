"""The standard deviation of every block's place in the flat space, and of other points'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Bools, Floats

_NEAR = 4
"""Blocks from which the value at another point is taken, weighted by one over their distance."""

_DRAWS = 200_000
"""Normal triples from which the 90 % distance is taken, spread evenly over the blocks."""

BAND_ALONG, BAND_ACROSS = float(np.sqrt(-2 * np.log(0.1))), 1.6448536269514722
"""Distance within which 90 % of a normal deviation lies, in standard deviations: in two, and in
one dimension."""


@dataclass(frozen=True, eq=False)
class PositionUncertainty:
    """Standard deviations of places in the flat space, in the data's unit.

    Attributes
    ----------
    points : (m, 3) float
        Blocks at which they were measured, in the data's folded coordinates.
    sd : (m, 2) float
        Along the layers, for each of both axes; and across them.
    members : int
        Number of members that were fitted per body.
    failed : tuple of str
        Kinds of the members that could not be fitted.
    """

    points: Floats
    sd: Floats
    members: int
    failed: tuple[str, ...] = ()

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def at(self, points: Floats) -> Floats:
        """Return both standard deviations at folded points (n, 3), (n, 2)."""
        if not len(points):
            return np.empty((0, 2))
        count = min(_NEAR, len(self.points))
        distance, near = self._tree.query(points, k=np.arange(1, count + 1))
        weight = 1 / np.maximum(distance, 1e-9 * max(1.0, float(np.ptp(self.points))))
        variance = (weight[:, :, None] * self.sd[near] ** 2).sum(axis=1)
        out: Floats = np.sqrt(variance / weight.sum(axis=1)[:, None])
        return out

    def columns(self, points: Floats, placed: Bools) -> dict[str, Floats]:
        """Return the standard deviations at folded points (n, 3) by output column.

        They are NaN if a point has no image, so if it is not ``placed`` (n,).
        """
        sd = self.at(points)
        sd[~placed] = np.nan
        return {"sd_along": sd[:, 0], "sd_across": sd[:, 1]}

    @property
    def mean(self) -> tuple[float, float]:
        """Root mean square of the deviations over the blocks, along and across."""
        along, across = np.sqrt((self.sd**2).mean(axis=0)).tolist()
        return along, across

    def summary(self) -> dict[str, Any]:
        """Return the figures for the summary, in the data's unit.

        ``sd_along`` and ``sd_across`` are root mean squares over the blocks.  ``rms`` is the
        expected root mean square distance from the true places, ``within_90`` the distance within
        which 90 % of the blocks are expected.
        """
        along, across = self.mean
        return {
            "members": self.members,
            "sd_along": along,
            "sd_across": across,
            "rms_along": float(np.sqrt(2) * along),
            "rms_across": float(across),
            "rms": float(np.sqrt(2 * along**2 + across**2)),
            "within_90": within(self.sd, 0.9),
            "failed": sorted(set(self.failed)),
        }


def within(sd: Floats, share: float) -> float:
    """Return the distance within which a share of normal deviations lies.

    Parameters
    ----------
    sd : (n, 2) float
        Standard deviations along each of two axes, and across.
    share : float
        Between 0 and 1.

    Examples
    --------
    >>> round(within(np.array([[0.0, 2.0]]), 0.9), 1)  # one dimension: 1.645 deviations
    3.3
    """
    rows = np.linspace(0, len(sd), _DRAWS, endpoint=False).astype(np.int64)
    draws = np.random.default_rng(0).normal(size=(_DRAWS, 3)) * sd[rows][:, [0, 0, 1]]
    return float(np.sqrt(np.quantile((draws**2).sum(axis=1), share)))


def joined(parts: Sequence[PositionUncertainty]) -> PositionUncertainty:
    """Return the uncertainty of several bodies as one."""
    return PositionUncertainty(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.sd for part in parts]),
        parts[0].members,
        tuple(name for part in parts for name in part.failed),
    )
