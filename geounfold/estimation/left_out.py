"""Whole-hole cross-validation of variogram models, for choosing among them.

Systems are solved here, all targets together, because a few hundred of them are solved sooner than
a call of the library is set up. `kriging.cross_validate` has the same neighbours and answers.
"""

from __future__ import annotations

import numpy as np

from geounfold.estimation.neighbourhood import Neighbourhood, Search
from geounfold.estimation.variogram import Variogram
from geounfold.geometry.mesh import Floats, Ints

TARGETS = 1500
"""Most samples that are estimated: their mean squared error then has a standard error of 4 %."""

_NEAREST, _PER_HOLE = 24, 6
_ROWS = 500  # systems in memory at a time


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
        own = self._holes[self.targets]
        found = Search(self._points, self._holes, near).find(targets, own)
        out = np.empty(len(targets))
        for start in range(0, len(targets), _ROWS):
            rows = slice(start, start + _ROWS)
            estimate = self._kriged(targets[rows], found.rows[rows], found.counts[rows], model)
            out[rows] = estimate - self._values[self.targets[rows]]
        return out

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

    def _kriged(self, targets: Floats, rows: Ints, counts: Ints, model: Variogram) -> Floats:
        """Return ordinary kriging estimates of targets from the samples of each."""
        count, most = rows.shape
        places = self._points[rows]
        used = np.arange(most) < counts[:, None]
        between = (places[:, :, None] - places[:, None]).reshape(-1, 3)
        C = model.sill - model.gamma(between).reshape(count, most, most)
        both = used[:, :, None] & used[:, None]
        C = np.where(both, C, 0.0) + np.eye(most) * np.where(used, 1e-6 * model.sill, 1.0)[:, None]
        c = model.sill - model.gamma((places - targets[:, None]).reshape(-1, 3))
        c = np.where(used, c.reshape(count, most), 0.0)
        sides = np.stack([c, used.astype(np.float64)], axis=2)
        solved = np.linalg.solve(C, sides)
        total = solved.sum(axis=1)
        weights = solved[:, :, 0] + solved[:, :, 1] * ((1 - total[:, 0]) / total[:, 1])[:, None]
        return np.asarray((weights * self._values[rows]).sum(axis=1))
