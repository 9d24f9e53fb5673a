"""Experimental variograms of samples, and a model fitted to them automatically.

Pairs of samples are binned by their separation along and across the axes, so that every pair is
used in whatever direction the holes run. The model is fitted to the bins by weighted least squares.
A bin's weight is its number of pairs over the square of the model (Cressie 1985, Mathematical
Geology 17: 563-586) and over the square of the distance in ranges, because the nearest samples
have most weight in kriging.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import pandas as pd
from scipy.optimize import least_squares, nnls

from geounfold.errors import InputError, OptionError
from geounfold.estimation.variogram import KINDS, Structure, Triple, Variogram, correlation, numbers
from geounfold.geometry.mesh import Floats
from geounfold.geometry.rotations import rotation_from_angles as turned

Anisotropy = Literal["isotropic", "transverse", "orthotropic"]
ANISOTROPIES: tuple[str, ...] = get_args(Anisotropy)
"""Isotropic: one range; transverse: one in the plane of axes 1 and 2, one along 3; else three."""

MOST_SAMPLES = 3000
"""Most samples used: pairs grow with their square. From more, a fixed seed draws so many."""

FEWEST_SAMPLES = 20
"""Fewest samples of which a variogram is fitted."""

_BINS = {1: 24, 2: 12, 3: 7}  # bins along each axis
_FINER = 1.5  # exponent of the bins' edges: bins are narrower at short distances
_PAIRS = 10  # fewest pairs in a bin that is used
_SHARE = 0.5  # longest lag, as a share of the samples' extent
_NUGGET = 1e-3  # smallest nugget beside a gaussian structure, as a share of the sill
_STARTS = (0.15, 0.5)  # starting ranges, as shares of the longest lags
_NEAR = 0.1  # squared ranges, added to a bin's squared distance to limit the weight of near bins
_ROUNDS = 3  # fits: one with equal weights, the others with weights of the last model
_ROWS = 256  # samples whose pairs are held in memory at a time


@dataclass(frozen=True, eq=False)
class FittedVariogram:
    """A fitted model and the bins that it was fitted to.

    Attributes
    ----------
    model : Variogram
        The fitted model.
    cells : DataFrame
        The bins: columns h1, h2, h3, gamma, pairs and model. h1 to h3 are mean distances along
        the axes. With transverse anisotropy h1 is the distance in the plane; with none it is the
        whole distance.
    misfit : float
        Root mean square of gamma over the model's gamma, less 1, weighted by pairs.
    anisotropy : str
        isotropic, transverse or orthotropic.
    """

    model: Variogram
    cells: pd.DataFrame
    misfit: float
    anisotropy: str


def fit_variogram(
    points: Floats,
    values: Floats,
    *,
    anisotropy: Anisotropy = "transverse",
    rotation: Triple = (0.0, 0.0, 0.0),
    kinds: Sequence[str] = KINDS,
) -> FittedVariogram:
    """Fit a nugget and one structure to samples.

    Parameters
    ----------
    points : (n, 3) float
        Samples in the unfolded space.
    values : (n,) float
        Grades.
    anisotropy : {"transverse", "isotropic", "orthotropic"}
        Transverse: one range along the layer (the first two axes) and one across it.
    rotation : (float, float, float)
        Bearing, plunge and dip of the axes, degrees, as in `Variogram`.
    kinds : names
        Structures to try; the one with the smallest misfit is returned.

    Returns
    -------
    FittedVariogram
        The model of the smallest misfit, with its bins.

    Raises
    ------
    InputError
        There are fewer than 20 samples or too few pairs, or all values are equal.
    OptionError
        The anisotropy or a kind is not a valid one.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> fitted = fit_variogram(rng.random((500, 3)), rng.normal(size=500))
    >>> fitted.model.nugget > 0.7  # noise has no correlation
    True
    """
    P, v = _checked(points, values, anisotropy, kinds)
    P, v = _thinned(P, v)
    rotation = numbers("the rotation", rotation, 3)
    local = P @ turned(*rotation).T
    cells = _cells(local, v, anisotropy)
    if len(cells) < 6:
        raise InputError(
            f"only {len(cells)} bins of {_PAIRS} pairs or more: too few samples for a variogram; "
            "give a variogram model"
        )
    best = min((_fitted(cells, kind, anisotropy, v) for kind in kinds), key=lambda f: f[0])
    misfit, kind, nugget, sill, ranges = best
    structures = (Structure(kind, sill, _three(ranges, anisotropy)),) if sill > 0 else ()
    model = Variogram(nugget, structures, rotation)
    H = cells[["h1", "h2", "h3"]].to_numpy()
    unturned = Variogram(nugget, structures)
    return FittedVariogram(model, cells.assign(model=unturned.gamma(H)), misfit, anisotropy)


def directional(
    points: Floats,
    values: Floats,
    *,
    lags: int = 15,
    rotation: Triple = (0.0, 0.0, 0.0),
    tolerance: float = 22.5,
) -> pd.DataFrame:
    """Return experimental variograms along each axis, in the plane of axes 1 and 2, and in all.

    Parameters
    ----------
    points : (n, 3) float
        Samples.
    values : (n,) float
        Grades.
    lags : int
        Number of lags in half the extent along each direction.
    rotation : (float, float, float)
        Bearing, plunge and dip of the axes, degrees, as in `Variogram`.
    tolerance : float
        Largest angle between a pair and the direction, degrees. A pair in the plane lies at most
        one lag of the third axis off it. A pair along that axis lies at most one lag of the plane
        off it.

    Returns
    -------
    DataFrame
        Columns direction (axis_1, axis_2, along, across, all), distance (mean), gamma, pairs.

    Raises
    ------
    InputError
        There are fewer than 20 samples, or all values are equal.
    """
    P, v = _checked(points, values, "transverse", KINDS)
    P, v = _thinned(P, v)
    local = P @ turned(*numbers("the rotation", rotation, 3)).T
    longest = _SHARE * np.ptp(local, axis=0)
    plane = float(max(longest[0], longest[1]))
    width = {"along": plane / lags, "across": float(longest[2]) / lags}
    slope = np.tan(np.radians(tolerance))
    reach = {
        **dict.fromkeys(("axis_1", "axis_2", "along"), plane),
        "across": float(longest[2]),
        "all": plane,
    }
    sums = {name: np.zeros((3, lags)) for name in reach}
    for h, square in _pairs(local, v):
        flat = np.hypot(h[:, 0], h[:, 1])
        level = (h[:, 2] <= slope * flat) & (h[:, 2] <= width["across"])
        upright = (flat <= slope * h[:, 2]) & (flat <= width["along"])
        chosen = {
            "axis_1": (level & (h[:, 1] <= slope * h[:, 0]), flat),
            "axis_2": (level & (h[:, 0] <= slope * h[:, 1]), flat),
            "along": (level, flat),
            "across": (upright, h[:, 2]),
            "all": (np.ones(len(h), dtype=bool), np.linalg.norm(h, axis=1)),
        }
        for name, (some, distance) in chosen.items():
            lag = np.floor(distance / reach[name] * lags) if reach[name] > 0 else distance
            some = some & (lag < lags)
            index = lag[some].astype(np.int64)
            for row, weight in enumerate((np.ones(len(index)), distance[some], square[some])):
                sums[name][row] += np.bincount(index, weight, minlength=lags)
    frames = []
    for name, (pairs, distance, square) in sums.items():
        there = pairs > 0
        frames.append(
            pd.DataFrame(
                {
                    "direction": name,
                    "distance": distance[there] / pairs[there],
                    "gamma": 0.5 * square[there] / pairs[there],
                    "pairs": pairs[there].astype(np.int64),
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def _checked(
    points: Floats, values: Floats, anisotropy: str, kinds: Sequence[str]
) -> tuple[Floats, Floats]:
    """Return the finite samples sorted by place; raise if no variogram can be fitted to them."""
    if anisotropy not in ANISOTROPIES:
        raise OptionError(f"anisotropy {anisotropy!r} is not one of: {', '.join(ANISOTROPIES)}")
    for kind in kinds:
        if kind not in KINDS:
            raise OptionError(f"structure {kind!r} is not one of: {', '.join(KINDS)}")
    P, v = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or v.shape != (len(P),):
        raise InputError(f"samples need points (n, 3) and values (n,), not {P.shape}, {v.shape}")
    good = np.isfinite(P).all(axis=1) & np.isfinite(v)
    P, v = P[good], v[good]
    if len(v) < FEWEST_SAMPLES:
        raise InputError(f"only {len(v)} samples: a variogram needs at least {FEWEST_SAMPLES}")
    if not np.ptp(v) > 0:
        raise InputError("all samples have the same value: no variogram can be fitted")
    order = np.lexsort((v, *P.T))
    return P[order], v[order]


def _thinned(P: Floats, v: Floats) -> tuple[Floats, Floats]:
    if len(v) <= MOST_SAMPLES:
        return P, v
    some = np.sort(np.random.default_rng(0).choice(len(v), MOST_SAMPLES, replace=False))
    return P[some], v[some]


def _pairs(local: Floats, v: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Yield distances along the axes (p, 3) and squared differences (p,) of all pairs, in parts."""
    n = len(v)
    for start in range(0, n - 1, _ROWS):
        stop = min(start + _ROWS, n - 1)
        i = np.repeat(np.arange(start, stop), n - 1 - np.arange(start, stop))
        j = np.concatenate([np.arange(k + 1, n) for k in range(start, stop)])
        yield np.abs(local[i] - local[j]), (v[i] - v[j]) ** 2


def _cells(local: Floats, v: Floats, anisotropy: str) -> pd.DataFrame:
    """Return the bins that hold enough pairs."""
    axes = {"isotropic": 1, "transverse": 2, "orthotropic": 3}[anisotropy]
    bins = _BINS[axes]
    extent = np.ptp(local, axis=0)
    if anisotropy == "isotropic":
        longest = np.array([_SHARE * np.linalg.norm(extent)])
    elif anisotropy == "transverse":
        longest = _SHARE * np.array([np.hypot(extent[0], extent[1]), extent[2]])
    else:
        longest = _SHARE * extent
    longest = np.where(longest > 0, longest, 1.0)
    total = np.zeros((5, bins**axes))
    for h, square in _pairs(local, v):
        lag = _lags(h, anisotropy)
        inside = (lag < longest).all(axis=1)
        where = ((lag[inside] / longest) ** (1 / _FINER) * bins).astype(np.int64)
        index = np.ravel_multi_index(tuple(where.T), (bins,) * axes)
        weights = [
            np.ones(len(index)),
            square[inside],
            *np.pad(lag[inside], ((0, 0), (0, 3 - axes))).T,
        ]
        for row, weight in enumerate(weights):
            total[row] += np.bincount(index, weight, minlength=bins**axes)
    there = total[0] >= _PAIRS
    pairs = total[0, there]
    h = total[2:, there] / pairs
    if anisotropy == "transverse":
        h = h[[0, 2, 1]]
    return pd.DataFrame(
        {
            **dict(zip(("h1", "h2", "h3"), h, strict=True)),
            "gamma": 0.5 * total[1, there] / pairs,
            "pairs": pairs.astype(np.int64),
        }
    )


def _lags(h: Floats, anisotropy: str) -> Floats:
    """Return the distances (p, axes) by which pairs are binned."""
    if anisotropy == "isotropic":
        return np.asarray(np.linalg.norm(h, axis=1)[:, None])
    if anisotropy == "transverse":
        return np.column_stack([np.hypot(h[:, 0], h[:, 1]), h[:, 2]])
    return h


def _three(ranges: Floats, anisotropy: str) -> Triple:
    """Return one range per axis."""
    which = {"isotropic": [0, 0, 0], "transverse": [0, 0, 1], "orthotropic": [0, 1, 2]}[anisotropy]
    a, b, c = np.asarray(ranges)[which].tolist()
    return a, b, c


def _fitted(
    cells: pd.DataFrame, kind: str, anisotropy: str, v: Floats
) -> tuple[float, str, float, float, Floats]:
    """Return misfit, kind, nugget, sill and ranges of the best model of a kind."""
    H = cells[["h1", "h2", "h3"]].to_numpy()
    gamma, pairs = cells["gamma"].to_numpy(), cells["pairs"].to_numpy(dtype=np.float64)
    used = {"isotropic": [0], "transverse": [0, 2], "orthotropic": [0, 1, 2]}[anisotropy]
    longest = H[:, used].max(axis=0)
    longest = np.where(longest > 0, longest, 1.0)
    low, high = np.log(0.02 * longest), np.log(3.0 * longest)
    tries = []
    for start in _STARTS:
        x = np.log(start * longest)
        root = np.sqrt(pairs / _fading(H, _STARTS[0] * np.maximum(H.max(axis=0), 1e-300)))
        for _ in range(_ROUNDS):

            def residual(x: Floats, root: Floats = root) -> Floats:
                model = _best_sills(H, gamma, root, kind, x, anisotropy)[2]
                return np.asarray(root * (model - gamma) / gamma.mean())

            x = least_squares(residual, x, bounds=(low, high), diff_step=[1e-4]).x
            nugget, sill, model = _best_sills(H, gamma, root, kind, x, anisotropy)
            model = np.maximum(model, 1e-3 * gamma.mean())
            root = np.sqrt(pairs / _fading(H, _three(np.exp(x), anisotropy))) * gamma.mean() / model
        misfit = float(np.sqrt((pairs * (gamma / model - 1) ** 2).sum() / pairs.sum()))
        tries.append((misfit, nugget, sill, x))
    misfit, nugget, sill, x = min(tries, key=lambda t: t[0])
    if kind == "gaussian" and nugget < _NUGGET * (nugget + sill):
        nugget = _NUGGET * (nugget + sill)
    if nugget + sill <= 0:
        nugget = float(v.var())
    return misfit, kind, nugget, sill, np.exp(x)


def _fading(H: Floats, ranges: Floats | Triple) -> Floats:
    """Return the divisors of the bins' weights: squared distances in ranges, plus `_NEAR`."""
    return np.asarray(_NEAR + ((H / np.asarray(ranges)) ** 2).sum(axis=1))


def _best_sills(
    H: Floats, gamma: Floats, root: Floats, kind: str, x: Floats, anisotropy: str
) -> tuple[float, float, Floats]:
    """Return the nugget and sill by least squares for given ranges, and the model's gamma."""
    ranges = np.asarray(_three(np.exp(x), anisotropy))
    shape = 1 - correlation(kind, np.linalg.norm(H / ranges, axis=1))
    A = np.column_stack([np.ones(len(shape)), shape])
    (nugget, sill), _ = nnls(A * root[:, None], gamma * root)
    return float(nugget), float(sill), np.asarray(nugget + sill * shape)
