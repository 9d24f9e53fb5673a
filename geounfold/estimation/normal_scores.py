"""Normal scores of grades, and the variogram of the grades from that of their scores.

A variogram of skewed grades is the variogram of their few largest values. Scores have none, and the
change of the distribution carries a model of the scores back: with the Hermite coefficients p_n of
the change, the grades' correlation is the sum of p_n^2 rho^n over the sum of p_n^2, where rho is
that of the scores (Chiles and Delfiner 2012, section 6.4.3).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.hermite_e import hermevander
from scipy.optimize import least_squares
from scipy.special import ndtri

from geounfold.estimation.likelihood import Shape
from geounfold.estimation.variogram import correlation
from geounfold.geometry.mesh import Floats

_TERMS = 30  # of the Hermite series
_QUANTILES = 4000  # at which the change of the distribution is integrated
_LAGS = np.geomspace(0.02, 2.0, 24)  # in ranges, at which the model of the grades is fitted


def normal_scores(values: Floats) -> Floats:
    """Return the scores (n,) of values: normal quantiles of their ranks; equal values share one.

    Examples
    --------
    >>> normal_scores(np.array([5.0, 1.0, 900.0])).round(2).tolist()
    [0.0, -0.97, 0.97]
    """
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    middle = np.cumsum(count) - 0.5 * count
    scores: Floats = ndtri(middle[place.ravel()] / len(values))
    return scores


def hermite_shares(values: Floats) -> Floats:
    """Return the shares of the grades' variance in each Hermite term from the first on.

    Examples
    --------
    >>> from scipy.special import ndtri
    >>> normal = ndtri((np.arange(999) + 0.5) / 999)
    >>> float(hermite_shares(normal)[0].round(2))  # normal grades are their scores
    1.0
    """
    at = (np.arange(_QUANTILES) + 0.5) / _QUANTILES
    grades = np.quantile(values, at)
    terms = hermevander(ndtri(at), _TERMS)[:, 1:]
    sizes = np.array([math.factorial(k) for k in range(1, _TERMS + 1)], dtype=np.float64)
    squares = (grades @ terms / _QUANTILES) ** 2 / sizes
    return np.asarray(squares / squares.sum())


def shape_of_grades(shape: Shape, shares: Floats) -> Shape:
    """Return the model of the grades that belongs to a model of their normal scores.

    The nugget is exact: what the grades' correlation lacks to 1 at short distances. Ranges, and
    the sills of several structures, are fitted to it by least squares.

    Parameters
    ----------
    shape : Shape
        Of the scores.
    shares : (terms,) float
        Of the grades, from `hermite_shares`.
    """
    used = np.flatnonzero(shape.shares[1:] > 1e-3)
    if not len(used):
        return shape
    terms = np.concatenate([[0.0], shares])
    nugget = max(0.0, 1 - float(np.polynomial.polynomial.polyval(1 - shape.shares[0], terms)))
    lags = np.concatenate(
        [r * _LAGS[:, None] * np.eye(3)[a] for r in shape.ranges[used] for a in range(3)]
    )
    rho = _correlation(shape.kinds, shape.shares, shape.ranges, lags)
    wanted: Floats = np.polynomial.polynomial.polyval(rho, terms)
    # The nearest lags have most weight in kriging.
    weight = 1 / (0.1 + np.tile(_LAGS, 3 * len(used)))
    others = len(shape.kinds) - 1

    def model(x: Floats) -> tuple[Floats, Floats]:
        raised = np.exp(np.concatenate([[0.0], x[:others]]))
        sills = (1 - nugget) * raised / raised.sum()
        return np.concatenate([[nugget], sills]), shape.ranges * np.exp(x[others:])[:, None]

    def misfit(x: Floats) -> Floats:
        return np.asarray(weight * (_correlation(shape.kinds, *model(x), lags) - wanted))

    start = np.log(np.maximum(shape.shares[1:], 1e-3))
    start = np.concatenate([start[1:] - start[0], np.zeros(others + 1)])
    limit = np.concatenate([np.full(others, 12.0), np.full(others + 1, np.log(4.0))])
    found = least_squares(misfit, np.clip(start, -limit, limit), bounds=(-limit - 1, limit + 1))
    new_shares, ranges = model(found.x)
    return Shape(
        shape.kinds, new_shares, ranges, shape.turn, shape.value, shape.bounds, shape.vector
    )


def _correlation(kinds: tuple[str, ...], shares: Floats, ranges: Floats, lags: Floats) -> Floats:
    out = np.zeros(len(lags))
    for kind, share, r in zip(kinds, shares[1:], ranges, strict=True):
        out += share * correlation(kind, np.linalg.norm(lags / r, axis=1))
    return out
