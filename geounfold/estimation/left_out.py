"""Whole-hole cross-validation of variogram models, for choosing among them.

`kriging.cross_validate` has the same neighbours and answers.
"""

from __future__ import annotations

import numpy as np

from geounfold.estimation.neighbourhood import Neighbourhood, Search
from geounfold.estimation.systems import solve_systems
from geounfold.estimation.variogram import Variogram
from geounfold.geometry.mesh import Floats, Ints

TARGETS = 1500
"""Most samples that are estimated: their mean squared error then has a standard error of 4 %."""

_NEAREST, _PER_HOLE = 24, 6


class LeftOut:
    """Samples that are estimated from the other holes.

    Parameters
    ----------
    points : (n, 3) float
        Samples, sorted by place, each place once.
    values : (n,) float
        Grades, or their normal scores.
    holes : (n,) int or None
        Number of each sample's hole; without, each sample is left out alone.
    """

    def __init__(self, points: Floats, values: Floats, holes: Ints | None) -> None:
        self._points, self._values = points, values
        self._holes = np.arange(len(points)) if holes is None else holes
        count = min(TARGETS, len(points))
        some = np.random.default_rng(0).choice(len(points), count, replace=False)
        self.targets = np.sort(some)

    def errors(self, model: Variogram) -> Floats:
        """Return the error of ordinary kriging with a model at each target, (m,)."""
        reach = np.array(model.reach) if model.structures else np.ones(3)
        radii = 4 * np.linalg.norm(np.ptp(self._points, axis=0)) * reach / reach.min()
        near = Neighbourhood(
            radii=tuple(radii.tolist()), rotation=model.rotation, min_samples=1,
            max_samples=_NEAREST, max_per_hole=_PER_HOLE,
        )  # fmt: skip
        targets = self._points[self.targets]
        found = Search(self._points, self._holes, near).find(targets, self._holes[self.targets])
        used = np.arange(found.rows.shape[1]) < found.counts[:, None]
        places = self._points[found.rows] - targets[:, None]
        at = np.zeros((len(targets), 1, 3))
        solved = solve_systems(model, places, used, self._values[found.rows], at, None)
        return np.asarray(solved.estimate - self._values[self.targets])

    def better(self, new: Floats, old: Floats) -> bool:
        """Return whether squared errors are smaller by two standard errors of their sum over holes.

        Parameters
        ----------
        new, old : (m,) float
            Errors of two models, from `errors`.
        """
        _, hole = np.unique(self._holes[self.targets], return_inverse=True)
        gain = np.bincount(hole.ravel(), old**2 - new**2)
        return bool(gain.sum() > 2 * np.sqrt((gain**2).sum()))
