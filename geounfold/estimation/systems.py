"""Kriging systems of many targets, solved together: point or block support, with diagnostics.

gstlearn (`backends.gstlearn`) estimates points. The systems here are for blocks of points that are
not on a grid, as unfolded blocks are, and for the weights that diagnostics need.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.estimation.variogram import Variogram, correlation
from geounfold.geometry.mesh import Bools, Floats

_ENTRIES = 1_500_000  # covariances of one kind in memory at a time
_JITTER = 1e-9  # of the sill, on the diagonal: samples at almost one place leave systems solvable


@dataclass(frozen=True, eq=False)
class Solved:
    """Kriging estimates of targets.

    Attributes
    ----------
    estimate, variance : (m,) float
        Estimate and kriging variance.
    block_variance : (m,) float
        Variance of the targets' own grades: the sill for points, less for blocks.
    slope : (m,) float
        Slope of the regression of true on estimated grades, from the weights: the covariance of
        both over the variance of the estimate. 1 without conditional bias.
    """

    estimate: Floats
    variance: Floats
    block_variance: Floats
    slope: Floats

    @property
    def efficiency(self) -> Floats:
        """Kriging efficiency: 1 less kriging variance over block variance (Krige 1996)."""
        return np.asarray(1 - self.variance / self.block_variance)


def solve_systems(
    model: Variogram,
    samples: Floats,
    used: Bools,
    values: Floats,
    inside: Floats,
    mean: float | None,
) -> Solved:
    """Return kriging estimates of points or blocks.

    Parameters
    ----------
    model : Variogram
        Model; its axes turn all places.
    samples : (m, k, 3) float
        From each target to its samples.
    used : (m, k) bool
        Which of them are used.
    values : (m, k) float
        The samples' values.
    inside : (m, q, 3) float
        From each target to the points that it is the mean of: one, at 0, for a point.
    mean : float, optional
        Known mean, for simple kriging; ordinary kriging if None.

    Notes
    -----
    A block's mean has no nugget, as that of a point has. Systems that cannot be solved give NaN.
    """
    count, most = used.shape
    step = max(1, _ENTRIES // max(most * most, most * inside.shape[1], inside.shape[1] ** 2))
    parts = [
        _solved(model, samples[r], used[r], values[r], inside[r], mean)
        for r in (slice(i, i + step) for i in range(0, count, step))
    ]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Solved(*columns)


def _solved(
    model: Variogram,
    samples: Floats,
    used: Bools,
    values: Floats,
    inside: Floats,
    mean: float | None,
) -> tuple[Floats, Floats, Floats, Floats]:
    count, most = used.shape
    structured = model.sill - model.nugget
    C = np.where(used[:, :, None] & used[:, None], _between(model, samples, samples), 0.0)
    c = _between(model, samples, inside).mean(axis=2)
    if inside.shape[1] == 1:
        here = (np.abs(samples - inside) < 1e-300).all(axis=2)
        c = c + np.where(here, model.nugget, 0.0)
        own = np.full(count, model.sill)
    else:
        own = _between(model, inside, inside).mean(axis=(1, 2))
    c = np.where(used, c, 0.0)
    diagonal = np.where(used, structured + model.nugget + _JITTER * model.sill, 1.0)
    C[:, np.arange(most), np.arange(most)] = diagonal
    sides = np.stack([c, used.astype(np.float64)], axis=2)
    try:
        solved = np.linalg.solve(C, sides)
    except np.linalg.LinAlgError:
        solved = np.full(sides.shape, np.nan)
        for k in range(count):
            try:
                solved[k] = np.linalg.solve(C[k], sides[k])
            except np.linalg.LinAlgError:
                continue
    simple = solved[:, :, 0]
    if mean is None:
        multiplier = (1 - simple.sum(axis=1)) / solved[:, :, 1].sum(axis=1)
        weights = simple + multiplier[:, None] * solved[:, :, 1]
        estimate = (weights * values).sum(axis=1)
        variance = own - (weights * c).sum(axis=1) + multiplier
    else:
        weights = simple
        estimate = mean + (weights * (values - mean)).sum(axis=1)
        variance = own - (weights * c).sum(axis=1)
    of_estimate = np.einsum("mi,mij,mj->m", weights, C, weights)
    shared = (weights * c).sum(axis=1)
    slope = np.where(of_estimate > 0, shared / np.where(of_estimate > 0, of_estimate, 1.0), np.nan)
    # At a sample the variance is 0, but for rounding.
    variance = np.where(np.abs(variance) < 1e-8 * model.sill, 0.0, variance)
    return estimate, variance, own, slope


def _between(model: Variogram, one: Floats, other: Floats) -> Floats:
    """Return the covariance without nugget between places (m, a, 3) and (m, b, 3): (m, a, b)."""
    out = np.zeros((one.shape[0], one.shape[1], other.shape[1]))
    for s in model.structures:
        turn = model.axes.T / s.ranges
        a, b = one @ turn, other @ turn
        square = (a**2).sum(axis=2)[:, :, None] + (b**2).sum(axis=2)[:, None]
        square -= 2 * (a @ b.transpose(0, 2, 1))
        h = np.sqrt(np.maximum(square, 0.0))
        out += s.sill * correlation(s.kind, h, s.smoothness)
    return out
