"""Restricted maximum likelihood of variogram models on subsets of holes.

The likelihood of all samples together needs a matrix of all pairs, so subsets of 100 to 500 samples
are used, each with a mean of its own (composite likelihood: Curriero and Lele 1999, Journal of
Agricultural, Biological and Environmental Statistics 4: 9-28; restricted likelihood: Kitanidis
1983, Water Resources Research 19: 909-921). Half of the subsets are neighbouring holes, whose
composites in a row show the nugget; the other half are spread over all holes, which shows the
ranges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs
from scipy.optimize import minimize

from geounfold.estimation.neighbourhood import Neighbourhood, Search, turn_of
from geounfold.estimation.variogram import SMOOTHNESS, correlation, matern_scale
from geounfold.geometry.mesh import Floats, Ints

SIZES = 100, 500
"""Fewest and most samples of a subset; between, as many as `_WORK` allows: one of all is best."""

MOST_SUBSETS = 60
_WORK = 6e7  # samples times the squared size of their subsets: a fit then takes a second or less
_OF_A_HOLE = 12, 4  # most samples of a hole in a subset of neighbours, and in one spread out
_JITTER = 1e-6  # on the diagonal, as a share of the sill
_STEPS = 60  # of the optimiser; fits take 10 to 50 (measured)
_LOGIT = -9.0, 14.0  # bounds of the shares' logits: sills from 1e-4 of the nugget, nugget 1e-6
_LEFT = float(np.log(20.0))

AXES = {"isotropic": (0, 0, 0), "transverse": (0, 0, 1), "orthotropic": (0, 1, 2)}
"""For each axis the number of its range."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A fitted model of sill 1.

    Attributes
    ----------
    kinds : tuple of str
    shares : (1 + structures,) float
        Of the nugget and of each structure; their sum is 1.
    ranges : (structures, 3) float
    turn : float
        Angle, radians, by which axes 1 and 2 are turned about the third.
    value : float
        Minus the logarithm of the restricted likelihood, but for a constant.
    bounds : tuple of str
        Names of the parameters that ended on a bound.
    vector : float array
        The parameters, as a start of another fit.
    """

    kinds: tuple[str, ...]
    shares: Floats
    ranges: Floats
    turn: float
    value: float
    bounds: tuple[str, ...]
    vector: Floats


class Subsets:
    """Pairs of samples in subsets, and the likelihood of models of them.

    Parameters
    ----------
    points : (n, 3) float
        Samples along the axes, sorted by place, each place once.
    values : (n,) float
        Grades, or their normal scores.
    holes : (n,) int or None
        Number of each sample's hole.
    """

    def __init__(self, points: Floats, values: Floats, holes: Ints | None) -> None:
        self.rows = chosen_subsets(points, holes)
        count, size = self.rows.shape
        self.values = values[self.rows]
        self._lower = np.tril_indices(size, -1)
        i, j = self._lower
        gaps = points[self.rows][:, i] - points[self.rows][:, j]
        self.gaps = np.ascontiguousarray(gaps.reshape(-1, 3).T)
        self.shape = count, size
        self._places = i * size + j
        self._sides = np.stack([self.values, np.ones(self.values.shape)], axis=2)
        # Subsets repeat samples: a likelihood counts each sample once.
        self.weight = min(1.0, len(points) / self.rows.size)

    def fit(
        self,
        kinds: Sequence[str],
        anisotropy: str,
        start: Floats,
        low: Floats,
        high: Floats,
    ) -> Shape:
        """Return the model of the largest likelihood.

        Parameters
        ----------
        kinds : names
            Of the structures.
        anisotropy : {"isotropic", "transverse", "orthotropic"}
        start : float array
            Logits of the shares, logarithms of each structure's ranges, and the turn.
        low, high : (3,) float
            Bounds of the ranges along the axes.
        """
        which = AXES[anisotropy]
        first = [which.index(k) for k in range(max(which) + 1)]
        bounds = [_LOGIT] * len(kinds)
        bounds += list(zip(np.log(low[first]), np.log(high[first]), strict=True)) * len(kinds)
        bounds += [(-np.inf, np.inf)]
        x = np.clip(start, *np.array(bounds).T)
        found = minimize(
            self.objective, x, args=(tuple(kinds), anisotropy), jac=True,
            method="L-BFGS-B", bounds=bounds, options={"maxiter": _STEPS},
        )  # fmt: skip
        return self._shape(found.x, float(found.fun), kinds, anisotropy, bounds)

    def _shape(
        self,
        x: Floats,
        value: float,
        kinds: Sequence[str],
        anisotropy: str,
        bounds: Sequence[tuple[float, float]],
    ) -> Shape:
        shares, logs, turn = _unpacked(x, len(kinds), anisotropy)
        names = ["axis 1", "axis 2", "axis 3"] if anisotropy == "orthotropic" else []
        names = names or ["along", "across"][: max(AXES[anisotropy]) + 1]
        hit = []
        for k in range(len(kinds)):
            for place, name in enumerate(names):
                at = len(kinds) + k * len(names) + place
                if (
                    min(x[at] - bounds[at][0], bounds[at][1] - x[at]) < 1e-3
                    and shares[k + 1] > 0.01
                ):
                    side = "shortest" if x[at] - bounds[at][0] < 1e-3 else "longest"
                    hit.append(f"range {name} of the {kinds[k]} structure ({side})")
        return Shape(tuple(kinds), shares, np.exp(logs), turn, value, tuple(hit), x)

    def objective(self, x: Floats, kinds: tuple[str, ...], anisotropy: str) -> tuple[float, Floats]:
        """Return minus the logarithm of the restricted likelihood, and its gradient.

        The overall variance is the one of the largest likelihood for these parameters.
        """
        shares, logs, turn = _unpacked(x, len(kinds), anisotropy)
        U, V, W = self._turned(turn) if anisotropy == "orthotropic" else self.gaps
        squares = U**2, V**2, W**2
        inverse = np.exp(-2 * logs)
        parts = []
        total = np.zeros(len(W))
        for k, kind in enumerate(kinds):
            h = np.sqrt(sum(s * r for s, r in zip(squares, inverse[k], strict=True)))
            parts.append(_correlation_and_slope(kind, h))
            total += shares[k + 1] * parts[k][0]
        value, weights, _ = self._reml(total)
        by_share = np.array([weights @ f for f, _ in parts])
        which = AXES[anisotropy]
        count = max(which) + 1
        gradient = np.zeros(len(x))
        for k in range(len(kinds)):
            own = np.arange(len(kinds)) == k
            gradient[k] = (by_share * shares[1:] * (own - shares[k + 1])).sum()
            slope = weights * parts[k][1] * shares[k + 1]
            for axis in range(3):
                place = len(kinds) + k * count + which[axis]
                gradient[place] -= (slope @ squares[axis]) * inverse[k, axis]
            if anisotropy == "orthotropic":
                gradient[-1] += (slope @ (U * V)) * (inverse[k, 0] - inverse[k, 1])
        return self.weight * value, self.weight * gradient

    def variance(self, shape: Shape, anisotropy: str) -> float:
        """Return the overall variance of the largest likelihood for a shape."""
        shares, logs, turn = _unpacked(shape.vector, len(shape.kinds), anisotropy)
        places = self._turned(turn) if anisotropy == "orthotropic" else self.gaps
        total = np.zeros(len(places[2]))
        for share, log, kind in zip(shares[1:], logs, shape.kinds, strict=True):
            h = np.sqrt(sum(p**2 * r for p, r in zip(places, np.exp(-2 * log), strict=True)))
            total += share * correlation(kind, h)
        return self._reml(total)[2]

    def _turned(self, turn: float) -> tuple[Floats, Floats, Floats]:
        c, s = np.cos(turn), np.sin(turn)
        x, y, z = self.gaps
        return c * x + s * y, c * y - s * x, z

    def _reml(self, pairs: Floats) -> tuple[float, Floats, float]:
        """Return minus the log likelihood of correlations, its derivative by each, the variance."""
        count, size = self.shape
        C = np.zeros((count, size * size))
        C[:, self._places] = pairs.reshape(count, -1)
        C[:, :: size + 1] = 1.0 + _JITTER
        raw = np.empty((count, size, 2))
        value = 0.0
        for k in range(count):
            # LAPACK reads columns, so the lower triangle of these rows is its upper one.
            factor, failed = dpotrf(C[k].reshape(size, size).T, lower=0, overwrite_a=1)
            if failed:
                raise np.linalg.LinAlgError(f"subset {k} has a singular matrix")
            value += float(np.log(np.diagonal(factor)).sum())
            raw[k] = dpotrs(factor, self._sides[k], lower=0)[0]
            C[k] = dpotri(factor, lower=0, overwrite_c=1)[0].T.ravel()
        ones, total = raw[:, :, 1], raw[:, :, 1].sum(axis=1)
        left = raw[:, :, 0] - ones * (raw[:, :, 0].sum(axis=1) / total)[:, None]
        free = count * (size - 1)
        variance = float((left * self.values).sum()) / free
        value += 0.5 * float(np.log(total).sum()) + 0.5 * free * float(np.log(variance))
        i, j = self._lower
        slope = C[:, self._places]
        slope -= ones[:, i] * (ones / total[:, None])[:, j]
        slope -= left[:, i] * (left / variance)[:, j]
        return value, slope.ravel(), variance


def chosen_subsets(points: Floats, holes: Ints | None) -> Ints:
    """Return rows of the samples of each subset, (subsets, size); a fixed seed draws them.

    Raises
    ------
    InputError
        There are too few samples apart from each other.
    """
    n = len(points)
    size = int(np.clip(np.sqrt(_WORK / n), *SIZES))
    if size >= n:
        return np.arange(n)[None]
    rng = np.random.default_rng(0)
    count = int(np.clip(-(-2 * n // size), 2, MOST_SUBSETS))
    seeds = rng.choice(n, count, replace=False)
    extent = 4 * float(np.linalg.norm(np.ptp(points, axis=0)))
    near = Neighbourhood(
        radii=(extent,) * 3, min_samples=1, max_samples=size,
        max_per_hole=None if holes is None else _OF_A_HOLE[0],
    )  # fmt: skip
    rows = Search(points, holes, near).find(points[seeds[::2]])
    found = [np.sort(r) for r, k in zip(rows.rows, rows.counts, strict=True) if k == size]
    for seed in seeds[1::2]:
        far = ((points - points[seed]) ** 2).sum(axis=1) * rng.random(n)
        order = np.argsort(far, kind="stable")
        if holes is not None:
            order = order[turn_of(holes[order][None])[0] < _OF_A_HOLE[1]]
        if len(order) >= size:
            found.append(np.sort(order[:size]))
    if not found:  # few holes with many samples each: their limits cannot be kept
        return chosen_subsets(points, None)
    return np.array(found)


def first_shape(
    subsets: Subsets, anisotropy: str, low: Floats, high: Floats
) -> tuple[Floats, float]:
    """Return the start of a fit of one structure, and its value: the best of a few.

    Ranges are tried at the median distances of the pairs in the subsets, and half and twice these;
    turns, of axes with unequal ranges, at every 45 degrees.
    """
    x, y, z = np.abs(subsets.gaps)
    flat = float(np.median(np.hypot(x, y))) or 1.0
    middle = np.clip([flat, flat, float(np.median(z)) or flat], low, high)
    if anisotropy == "isotropic":
        middle[:] = float(np.median(np.linalg.norm(subsets.gaps, axis=0)))
    tried = []
    turns = np.arange(4) * np.pi / 4 if anisotropy == "orthotropic" else (0.0,)
    for factor in (0.5, 1.0, 2.0):
        for turn in turns:
            ranges = factor * middle
            if anisotropy == "orthotropic":
                ranges = ranges * [1.5, 1 / 1.5, 1.0]
            x0 = packed(np.array([0.3, 0.7]), ranges[None], turn, anisotropy)
            tried.append((subsets.objective(x0, ("exponential",), anisotropy)[0], x0))
    best = min(tried, key=lambda pair: pair[0])
    return best[1], best[0]


def turned_start(subsets: Subsets, level: Shape, low: Floats, high: Floats) -> Floats:
    """Return the start of a fit with two directions in the plane, from a fit with one.

    Of eight turns and two ratios of the ranges the best is taken.
    """
    tried = []
    for ratio in (1.5, 3.0):
        root = np.sqrt(ratio)
        ranges = np.clip(level.ranges * [root, 1 / root, 1.0], 1.01 * low, 0.99 * high)
        for turn in np.arange(8) * np.pi / 8:
            x = packed(level.shares, ranges, float(turn), "orthotropic")
            tried.append((subsets.objective(x, level.kinds, "orthotropic")[0], x))
    return min(tried, key=lambda pair: pair[0])[1]


def packed(shares: Floats, ranges: Floats, turn: float, anisotropy: str) -> Floats:
    """Return the parameters of a model as one vector, for `Subsets.fit`."""
    which = AXES[anisotropy]
    first = [which.index(k) for k in range(max(which) + 1)]
    shares = np.maximum(shares, 1e-3)
    return np.concatenate([
        np.log(shares[1:] / shares[0]), np.log(ranges[:, first]).ravel(), [turn]
    ])  # fmt: skip


def _unpacked(x: Floats, structures: int, anisotropy: str) -> tuple[Floats, Floats, float]:
    """Return shares (nugget first), logarithms of the ranges (structures, 3), and the turn."""
    raised = np.exp(np.concatenate([[0.0], x[:structures]]))
    which = AXES[anisotropy]
    logs = x[structures:-1].reshape(structures, max(which) + 1)[:, which]
    return raised / raised.sum(), logs, float(x[-1])


def _correlation_and_slope(kind: str, h: Floats) -> tuple[Floats, Floats]:
    """Return the correlation at distances in ranges, and its derivative over the distance."""
    f = correlation(kind, h)
    near = np.maximum(h, 1e-9)
    if kind == "spherical":
        return f, np.where(h < 1, -1.5 * (1 - h**2) / near, 0.0)
    if kind == "exponential":
        return f, -_LEFT * f / near
    if kind == "gaussian":
        return f, -2 * _LEFT * f
    scale = matern_scale(SMOOTHNESS)
    return f, -(scale**2) * np.exp(-scale * h)
