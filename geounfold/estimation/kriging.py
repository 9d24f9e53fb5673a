"""Estimates at points from samples around them: kriging and inverse distance.

Everything here is in one space; `geounfold.estimation.estimate` carries samples and blocks there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from geounfold.backends import gstlearn
from geounfold.backends.blas import one_thread
from geounfold.errors import InputError, OptionError
from geounfold.estimation.neighbourhood import Neighbourhood, Search
from geounfold.estimation.variogram import Variogram
from geounfold.estimation.worker import apart
from geounfold.geometry.mesh import Bools, Floats, Ints

Method = Literal["ordinary", "simple", "inverse_distance"]
METHODS: tuple[str, ...] = get_args(Method)

ESTIMATED, TOO_FEW, OUTSIDE, UNSOLVABLE = (
    "estimated",
    "too_few_samples",
    "outside_map",
    "unsolvable",
)
FLAGS = (ESTIMATED, TOO_FEW, OUTSIDE, UNSOLVABLE)
"""What became of a target."""

_CHUNK = 8_192  # targets looked up at a time; a multiple of the islands of a call
_LIFE = 16  # chunks that one process solves


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of targets, in their order.

    Attributes
    ----------
    estimate : (m,) float
        NaN where there is none: see `flag`.
    variance : (m,) float
        Kriging variance, in the values' unit squared; NaN for inverse distance.
    samples : (m,) int
        How many were found.
    flag : (m,) str
        estimated, too_few_samples, outside_map or unsolvable.
    """

    estimate: Floats
    variance: Floats
    samples: Ints
    flag: np.ndarray

    def counts(self) -> dict[str, int]:
        """Return how many targets have each flag."""
        return {flag: int(np.count_nonzero(self.flag == flag)) for flag in FLAGS}


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples in an order of their own, no two in one place.

    Attributes
    ----------
    points : (n, 3) float
    values : (n,) float
        Means of those in one place.
    holes : (n,) int or None
        Numbers of the holes, in the order of their names; of those in one place the lowest.
    merged : int
        How many were merged into others.
    """

    points: Floats
    values: Floats
    holes: Ints | None
    merged: int


def gathered(points: Floats, values: Floats, holes: Ints | None = None) -> Samples:
    """Return samples sorted by their place, those in one place as one.

    Raises
    ------
    InputError
        No samples, arrays of unequal lengths, or values that are not finite.
    """
    P, v = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or v.shape != (len(P),):
        raise InputError(f"samples need points (n, 3) and values (n,), not {P.shape}, {v.shape}")
    if holes is not None and np.shape(holes) != v.shape:
        raise InputError(f"{len(P)} samples need as many holes, not {np.shape(holes)}")
    if not len(P):
        raise InputError("there are no samples to estimate from")
    if not (np.isfinite(P).all() and np.isfinite(v).all()):
        raise InputError("samples must have finite coordinates and values; leave the others out")
    places, group = np.unique(P, axis=0, return_inverse=True)
    group = group.ravel()
    order = np.lexsort((v, group))  # sums of equal bits, however the rows came
    count = np.bincount(group)
    mean = np.bincount(group[order], v[order]) / count
    mean = np.where(count == 1, v[order][np.cumsum(count) - 1], mean)
    lowest = None
    if holes is not None:
        lowest = np.full(len(places), np.iinfo(np.int64).max)
        np.minimum.at(lowest, group, np.asarray(holes, dtype=np.int64))
    return Samples(places, mean, lowest, len(P) - len(places))


def krige(  # 11 arguments: the samples, the targets, and six choices by keyword
    points: Floats,
    values: Floats,
    targets: Floats,
    variogram: Variogram | None,
    near: Neighbourhood,
    *,
    method: Method = "ordinary",
    holes: Ints | None = None,
    leave_out: Ints | None = None,
    mean: float | None = None,
    power: float = 2.0,
    workers: int = 1,
) -> Estimates:
    """Estimate targets from the samples around each.

    Parameters
    ----------
    points : (n, 3) float
        The samples; those in one place are taken as one, of their mean.
    values : (n,) float
    targets : (m, 3) float
        Estimated as points.  Rows of NaN are outside_map.
    variogram : Variogram or None
        None for inverse distance only.
    near : Neighbourhood
        Inverse distances are measured in its radii.
    method : {"ordinary", "simple", "inverse_distance"}
        Ordinary kriging leaves the mean unknown; simple kriging takes it as given.
    holes : (n,) int, optional
        The hole of each sample, for `max_per_hole` and `leave_out`.
    leave_out : (m,) int, optional
        A hole whose samples do not estimate the target.
    mean : float, optional
        Of simple kriging; the samples' mean without.
    power : float
        Of inverse distance.
    workers : int
        Processes at a time.  More than 131,072 targets go to other processes in any case.

    Returns
    -------
    Estimates

    Raises
    ------
    InputError
        Samples that cannot be used.
    OptionError
        A method that does not exist, or one that lacks what it needs.
    MissingDependencyError
        gstlearn is not installed.
    """
    _check(method, variogram, near, holes, leave_out, power, workers)
    gstlearn.library()
    given = gathered(points, values, holes)
    if method == "simple" and mean is None:
        mean = float(given.values.mean())
    T = np.asarray(targets, dtype=np.float64).reshape(-1, 3)
    there = np.flatnonzero(np.isfinite(T).all(axis=1))
    # In an order of their own: the same bits, however the rows came.
    there = there[np.lexsort(T[there].T)]
    job = _Job(given, variogram, near, method, mean if method == "simple" else None, power)
    parts = _run(job, T[there], None if leave_out is None else leave_out[there], workers)
    out = Estimates(
        np.full(len(T), np.nan),
        np.full(len(T), np.nan),
        np.zeros(len(T), dtype=np.int64),
        np.full(len(T), OUTSIDE, dtype=object),
    )
    for start, (value, variance, count, flag) in zip(
        range(0, len(there), _CHUNK), parts, strict=True
    ):
        rows = there[start : start + _CHUNK]
        out.estimate[rows], out.variance[rows] = value, variance
        out.samples[rows], out.flag[rows] = count, flag
    return out


def cross_validate(
    points: Floats,
    values: Floats,
    holes: Ints,
    variogram: Variogram | None,
    near: Neighbourhood,
    **how: object,
) -> Estimates:
    """Estimate every sample from the other holes' samples (whole-hole cross-validation).

    Parameters are those of `krige`.
    """
    holes = np.asarray(holes, dtype=np.int64)
    return krige(points, values, points, variogram, near, holes=holes, leave_out=holes, **how)  # type: ignore[arg-type]


def hole_numbers(names: Sequence[object] | np.ndarray) -> Ints:
    """Return a number for each name, in the names' order as texts.

    >>> hole_numbers(["B", "A", "B"]).tolist()
    [1, 0, 1]
    """
    texts = np.array([str(name) for name in names], dtype=object)
    number: Ints = np.unique(texts, return_inverse=True)[1].ravel().astype(np.int64)
    return number


Part = tuple[Floats, Floats, Ints, np.ndarray]


@dataclass(frozen=True, eq=False)
class _Job:
    """All that a process needs to estimate targets."""

    given: Samples
    variogram: Variogram | None
    near: Neighbourhood
    method: str
    mean: float | None
    power: float

    def estimate(self, search: Search, targets: Floats, own: Ints | None) -> Part:
        """Return values, variances, counts and flags of targets (m, 3)."""
        with one_thread():
            found = search.find(targets, own)
        flag = np.full(len(targets), TOO_FEW, dtype=object)
        value, variance = np.full(len(targets), np.nan), np.full(len(targets), np.nan)
        enough = np.flatnonzero(found.counts >= self.near.min_samples)
        if len(enough):
            rows, counts = found.rows[enough], found.counts[enough]
            offset = self.given.points[rows] - targets[enough, None]
            value[enough], variance[enough] = self._solved(offset, self.given.values[rows], counts)
            flag[enough] = np.where(np.isnan(value[enough]), UNSOLVABLE, ESTIMATED)
        return value, variance, found.counts, flag

    def _solved(self, offset: Floats, values: Floats, counts: Ints) -> tuple[Floats, Floats]:
        if self.variogram is None or self.method == "inverse_distance":
            measured = self.near.measured(offset.reshape(-1, 3)).reshape(offset.shape)
            answer = gstlearn.inverse_distance(measured, values, counts, self.power)
            return answer, np.full(len(answer), np.nan)
        model = self.variogram
        offset = offset @ model.axes.T
        # Mean and sill of 1: what the library takes for nothing does not depend on the unit.
        scale, sill = float(np.sqrt(model.sill)), model.sill
        centre = float(self.given.values.mean()) if self.mean is None else self.mean
        answer, variance = gstlearn.krige(
            offset,
            (values - centre) / scale,
            counts,
            model.nugget / sill,
            [(s.kind, s.sill / sill, s.ranges) for s in model.structures],
            None if self.mean is None else 0.0,
        )
        wrong = ~(variance <= _WORST)
        answer[wrong], variance[wrong] = np.nan, np.nan
        return answer * scale + centre, variance * sill


_WORST = 20.0  # sills: far above what ordinary kriging can have, so its system was not solved


def _run(job: _Job, targets: Floats, own: Ints | None, workers: int) -> list[Part]:
    """Return the answers for chunks of targets, in their order."""
    chunks = [slice(i, i + _CHUNK) for i in range(0, len(targets), _CHUNK)]
    pieces = [(targets[c], None if own is None else own[c]) for c in chunks]
    if len(pieces) <= 1 or (workers == 1 and len(pieces) <= _LIFE):
        return solve(job, pieces)
    size = min(_LIFE, -(-len(pieces) // workers))
    jobs = [(job, pieces[i : i + size]) for i in range(0, len(pieces), size)]
    return [part for parts in apart(solve, jobs, workers) for part in parts]


def solve(job: _Job, pieces: Sequence[tuple[Floats, Ints | None]]) -> list[Part]:
    """Return the answers for pieces of targets, in this process."""
    search = Search(job.given.points, job.given.holes, job.near)
    return [job.estimate(search, *piece) for piece in pieces]


def _check(
    method: str,
    variogram: Variogram | None,
    near: Neighbourhood,
    holes: Ints | None,
    leave_out: Ints | None,
    power: float,
    workers: int,
) -> None:
    """Raise OptionError where what is asked for does not go together."""
    if method not in METHODS:
        raise OptionError(f"method {method!r} is not one of: {', '.join(METHODS)}")
    if variogram is None and method != "inverse_distance":
        raise OptionError(f"{method} kriging needs a variogram")
    if holes is None and (near.max_per_hole is not None or leave_out is not None):
        raise OptionError("a limit per hole needs the samples' holes")
    if not (np.isfinite(power) and power > 0):
        raise OptionError(f"the power of inverse distance must be above 0, not {power}")
    if not isinstance(workers, int) or workers < 1:
        raise OptionError(f"workers must be a whole number of 1 or more, not {workers!r}")


def estimated(flag: np.ndarray) -> Bools:
    """Return which flags say that there is an estimate."""
    return np.asarray(flag == ESTIMATED, dtype=bool)
