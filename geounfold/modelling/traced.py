"""Points along holes that tell body from waste."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.drillholes import DrillHoles
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.modelling.intercepts import Intercepts

_MOST = 2_000_000


@dataclass(frozen=True, eq=False)
class Traced:
    """Points along holes, sorted by hole and depth.

    Attributes
    ----------
    hole : (n,) int
    depth : (n,) float
    points : (n, 3) float
    ore : (n,) bool
        Whether the point lies in an intercept.
    step : float
        Depth between points.
    """

    hole: Ints
    depth: Floats
    points: Floats
    ore: Bools
    step: float

    def kept(self, keep: Bools) -> Traced:
        """Return the points to keep."""
        return Traced(
            self.hole[keep], self.depth[keep], self.points[keep], self.ore[keep], self.step
        )

    def near(self, found: Intercepts, reach: float) -> Traced:
        """Return the points in intercepts and within a distance of them along the hole."""
        wide = replace(found, start=found.start - reach, end=found.end + reach)
        return self.kept(_inside(self.hole, self.depth, wide))


def traced(holes: DrillHoles, found: Intercepts, step: float) -> Traced:
    """Return points in the middle of every step of all holes, from collar to end."""
    step = max(step, float(holes.ends.sum()) / _MOST)
    count = np.maximum(np.floor(holes.ends / step).astype(np.int64), 1)
    hole = np.repeat(np.arange(len(holes)), count)
    number = np.arange(len(hole)) - np.repeat(np.cumsum(count) - count, count)
    depth = (number + 0.5) * step
    points = holes.paths.at(hole, depth)[0]
    return Traced(hole, depth, points, _inside(hole, depth, found), step)


def _inside(hole: Ints, depth: Floats, found: Intercepts) -> Bools:
    """Return which depths lie in an intercept of their hole, (n,)."""
    # Sorted by hole and depth, ends before starts: the sum of starts less ends counts intercepts.
    owner = np.r_[found.hole, found.hole, hole]
    place = np.r_[found.start, found.end, depth]
    kind = np.repeat([0, 2, 1], [len(found), len(found), len(hole)])
    order = np.lexsort((kind, place, owner))
    change = np.choose(kind[order], [1, 0, -1])
    inside = np.empty(len(order), dtype=bool)
    inside[order] = np.cumsum(change) > 0
    return inside[2 * len(found) :]
