"""Experimental variograms: bins of pairs of samples by their separation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError
from geounfold.estimation.variogram import KINDS, Triple, numbers
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.rotations import rotation_from_angles as turned

ANISOTROPIES = ("auto", "isotropic", "transverse", "orthotropic")
"""Isotropic: one range; transverse: one in the plane of axes 1 and 2, one along 3; orthotropic:
three, and axes 1 and 2 are turned to the best directions; auto: transverse or orthotropic."""

MOST_SAMPLES = 3000
"""Most samples of experimental variograms: pairs grow with their square. From more, a fixed seed
draws so many."""

FEWEST_SAMPLES = 20
"""Fewest samples of which a variogram is fitted."""

PAIRS = 10
"""Fewest pairs in a bin that is used."""

_BINS = {1: 24, 2: 12, 3: 7}  # bins along each axis
_FINER = 1.5  # exponent of the bins' edges: bins are narrower at short distances
_SHARE = 0.5  # longest lag, as a share of the samples' extent
_ROWS = 256  # samples whose pairs are held in memory at a time
_DOWN_HOLE = 3  # down-hole lags from which the nugget is extrapolated


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
    P, v, _ = checked(points, values, None, "transverse", KINDS)
    P, v = thinned(P, v)
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


def down_hole(points: Floats, values: Floats, holes: Ints) -> pd.DataFrame:
    """Return the variogram along the holes, by lags of the holes' own sample spacing.

    Parameters
    ----------
    points : (n, 3) float
        Samples.
    values : (n,) float
        Grades.
    holes : (n,) int
        Number of each sample's hole.

    Returns
    -------
    DataFrame
        Columns lag (1, 2, ... samples), distance (mean), gamma and pairs, for lags with pairs. Two
        samples are one lag apart if their distance is nearest to the median distance between
        neighbouring samples of a hole.
    """
    from scipy.spatial import cKDTree

    apart = 4 * float(np.linalg.norm(np.ptp(points, axis=0))) + 1.0
    tree = cKDTree(np.column_stack([points, apart * holes]))
    k = min(2 * _DOWN_HOLE + 1, len(points))
    found = tree.query(tree.data, k=max(k, 2), distance_upper_bound=0.5 * apart)
    far, other = np.asarray(found[0]), np.asarray(found[1])
    own = np.arange(len(points))[:, None]
    used = np.isfinite(far) & (other > own) & (far > 0)
    columns = ["lag", "distance", "gamma", "pairs"]
    nearest = np.where(np.isfinite(far) & (far > 0), far, np.inf).min(axis=1)
    if not used.any() or not np.isfinite(nearest).any():
        return pd.DataFrame(columns=columns)
    step = float(np.median(nearest[np.isfinite(nearest)]))
    i, j = np.nonzero(used)[0], other[used]
    lag = np.rint(far[used] / step).astype(np.int64)
    rows = []
    for number in range(1, _DOWN_HOLE + 1):
        some = lag == number
        if some.sum() < PAIRS:
            continue
        gamma = 0.5 * float(((values[i] - values[j])[some] ** 2).mean())
        rows.append([number, float(far[used][some].mean()), gamma, int(some.sum())])
    return pd.DataFrame(rows, columns=columns)


def down_hole_nugget(table: pd.DataFrame) -> float | None:
    """Return the semivariance at distance 0 of a line through the down-hole lags; None of one lag.

    Each lag weighs by its pairs over its squared number: the first ones decide.
    """
    if len(table) < 2:
        return None
    weight = np.sqrt(table["pairs"].to_numpy(dtype=np.float64)) / table["lag"].to_numpy(float)
    slope, start = np.polyfit(
        table["distance"].to_numpy(float), table["gamma"].to_numpy(float), 1, w=weight
    )
    first = float(table["gamma"].iloc[0])
    return float(np.clip(start, 0.0, first)) if slope > 0 else first


def checked(
    points: Floats, values: Floats, holes: Ints | None, anisotropy: str, kinds: Sequence[str]
) -> tuple[Floats, Floats, Ints | None]:
    """Return the finite samples sorted by place; raise if no variogram can be fitted to them."""
    if anisotropy not in ANISOTROPIES:
        raise OptionError(f"anisotropy {anisotropy!r} is not one of: {', '.join(ANISOTROPIES)}")
    if not kinds:
        raise OptionError(f"no kinds of structures are given; valid are: {', '.join(KINDS)}")
    for kind in kinds:
        if kind not in KINDS:
            raise OptionError(f"structure {kind!r} is not one of: {', '.join(KINDS)}")
    P, v = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or v.shape != (len(P),):
        raise InputError(f"samples need points (n, 3) and values (n,), not {P.shape}, {v.shape}")
    if holes is not None and np.shape(holes) != v.shape:
        raise InputError(f"{len(P)} samples need as many holes, not {np.shape(holes)}")
    good = np.isfinite(P).all(axis=1) & np.isfinite(v)
    P, v = P[good], v[good]
    if len(v) < FEWEST_SAMPLES:
        raise InputError(f"only {len(v)} samples: a variogram needs at least {FEWEST_SAMPLES}")
    if not np.ptp(v) > 0:
        raise InputError("all samples have the same value: no variogram can be fitted")
    if holes is None:
        order = np.lexsort((v, *P.T))
        return P[order], v[order], None
    own = np.asarray(holes, dtype=np.int64)[good]
    order = np.lexsort((own, v, *P.T))
    return P[order], v[order], own[order]


def thinned(P: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Return at most `MOST_SAMPLES` samples, drawn by a fixed seed."""
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


def cells_of(local: Floats, v: Floats, anisotropy: str) -> pd.DataFrame:
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
    there = total[0] >= PAIRS
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
