"""Estimates at points from the samples around them: kriging and inverse distance.

Samples and targets lie in one space; `geounfold.estimation.estimate` carries them there.
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
from geounfold.estimation.systems import solve_systems
from geounfold.estimation.variogram import Variogram
from geounfold.estimation.worker import apart
from geounfold.geometry.mesh import Bools, Floats, Ints

Method = Literal["ordinary", "simple", "inverse_distance", "nearest"]
METHODS: tuple[str, ...] = get_args(Method)

ESTIMATED, TOO_FEW, OUTSIDE, UNSOLVABLE, OUTSIDE_BODY = (
    "estimated",
    "too_few_samples",
    "outside_map",
    "unsolvable",
    "outside_body",
)
FLAGS = (ESTIMATED, TOO_FEW, OUTSIDE, UNSOLVABLE, OUTSIDE_BODY)
"""Outcome of a target: estimated, or the reason why not."""

_CHUNK = 8_192  # targets looked up at a time; a multiple of the targets of one call
_LIFE = 16  # chunks that one process solves before it ends, which frees its memory


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of targets, in their order.

    Attributes
    ----------
    estimate : (m,) float
        Estimates in the values' unit; NaN if `flag` is not estimated.
    variance : (m,) float
        Kriging variance, in the values' unit squared; NaN for inverse distance.
    samples : (m,) int
        Number of samples found around each target.
    flag : (m,) str
        estimated, too_few_samples, outside_map, unsolvable or outside_body.
    efficiency, slope : (m,) float or None
        Kriging efficiency and slope of the regression of true on estimated grades
        (`systems.Solved`); None unless blocks were given.
    """

    estimate: Floats
    variance: Floats
    samples: Ints
    flag: np.ndarray
    efficiency: Floats | None = None
    slope: Floats | None = None

    def counts(self) -> dict[str, int]:
        """Return how many targets have each flag."""
        return {flag: int(np.count_nonzero(self.flag == flag)) for flag in FLAGS}


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples sorted by place, each place once.

    Attributes
    ----------
    points : (n, 3) float
    values : (n,) float
        Mean of the samples in each place.
    holes : (n,) int or None
        Number of the hole, in the order of the holes' names; the lowest of those in one place.
    merged : int
        Number of samples merged into others.
    """

    points: Floats
    values: Floats
    holes: Ints | None
    merged: int


def gathered(points: Floats, values: Floats, holes: Ints | None = None) -> Samples:
    """Return the samples sorted by place, with those in one place merged into their mean.

    Raises
    ------
    InputError
        There are no samples, arrays have unequal lengths, or a value is not finite.
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
    order = np.lexsort((v, group))  # so that sums do not depend on the order of the input rows
    count = np.bincount(group)
    mean = np.bincount(group[order], v[order]) / count
    mean = np.where(count == 1, v[order][np.cumsum(count) - 1], mean)
    lowest = None
    if holes is not None:
        lowest = np.full(len(places), np.iinfo(np.int64).max)
        np.minimum.at(lowest, group, np.asarray(holes, dtype=np.int64))
    return Samples(places, mean, lowest, len(P) - len(places))


def krige(  # 12 arguments: the samples, the targets, and seven choices by keyword
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
    blocks: tuple[Floats, Floats] | None = None,
) -> Estimates:
    """Estimate targets from the samples around each.

    Parameters
    ----------
    points : (n, 3) float
        Samples; those in one place are merged into their mean.
    values : (n,) float
        Grades.
    targets : (m, 3) float
        Points to estimate. Rows of NaN get the flag outside_map.
    variogram : Variogram or None
        Model; None for inverse distance only.
    near : Neighbourhood
        Search neighbourhood. Inverse distances are measured in units of its radii.
    method : {"ordinary", "simple", "inverse_distance", "nearest"}
        Ordinary kriging has an unknown mean, simple kriging a given one; nearest takes the value of
        the nearest sample in units of the radii.
    holes : (n,) int, optional
        Number of each sample's hole, needed by `max_per_hole` and `leave_out`.
    leave_out : (m,) int, optional
        For each target, the hole whose samples are not used.
    mean : float, optional
        Mean of simple kriging; the default is the mean of the samples.
    power : float
        Power of inverse distance, above 0.
    workers : int
        Number of processes at a time. Above 131,072 targets other processes are used in any case.
    blocks : ((q, 3) float, (m, 3, 3) float), optional
        Block support for kriging: the points that each target is the mean of, from its centre
        (`support.discretised`), and the images of the axes at each target (`support.local_axes`).
        The answer then has efficiencies and slopes.

    Returns
    -------
    Estimates
        In the targets' order.

    Raises
    ------
    InputError
        The samples cannot be used.
    OptionError
        The method is not a valid one, or needs a variogram or holes that are not given.
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
    # Sorted, so that the answer does not depend on the order of the input rows.
    there = there[np.lexsort(T[there].T)]
    kriged = method in ("ordinary", "simple")
    points_of = None if blocks is None or not kriged else np.asarray(blocks[0], dtype=np.float64)
    known = mean if method == "simple" else None
    job = _Job(given, variogram, near, method, known, power, points_of)
    axes = None if points_of is None or blocks is None else np.asarray(blocks[1])[there]
    own = None if leave_out is None else leave_out[there]
    parts = _run(job, T[there], own, axes, workers)
    more = 0 if points_of is None else 2
    columns = [np.full(len(T), np.nan) for _ in range(2 + more)]
    samples = np.zeros(len(T), dtype=np.int64)
    flags = np.full(len(T), OUTSIDE, dtype=object)
    for start, (found, count, flag) in zip(range(0, len(there), _CHUNK), parts, strict=True):
        rows = there[start : start + _CHUNK]
        for column, answer in zip(columns, found, strict=True):
            column[rows] = answer
        samples[rows], flags[rows] = count, flag
    return Estimates(columns[0], columns[1], samples, flags, *columns[2:])


def cross_validate(
    points: Floats,
    values: Floats,
    holes: Ints,
    variogram: Variogram | None,
    near: Neighbourhood,
    **how: object,
) -> Estimates:
    """Estimate every sample from the samples of the other holes (whole-hole cross-validation).

    The parameters are those of `krige`.
    """
    holes = np.asarray(holes, dtype=np.int64)
    return krige(points, values, points, variogram, near, holes=holes, leave_out=holes, **how)  # type: ignore[arg-type]


def hole_numbers(names: Sequence[object] | np.ndarray) -> Ints:
    """Return a number for each name, from 0 in the alphabetical order of the names.

    >>> hole_numbers(["B", "A", "B"]).tolist()
    [1, 0, 1]
    """
    texts = np.array([str(name) for name in names], dtype=object)
    number: Ints = np.unique(texts, return_inverse=True)[1].ravel().astype(np.int64)
    return number


Part = tuple[list[Floats], Ints, np.ndarray]
Piece = tuple[Floats, Ints | None, Floats | None]


@dataclass(frozen=True, eq=False)
class _Job:
    """Samples, model and rules by which a process estimates targets."""

    given: Samples
    variogram: Variogram | None
    near: Neighbourhood
    method: str
    mean: float | None
    power: float
    inside: Floats | None = None

    def estimate(
        self, search: Search, targets: Floats, own: Ints | None, axes: Floats | None
    ) -> Part:
        """Return values and variances (and more, of blocks), counts and flags of targets (m, 3)."""
        with one_thread():
            found = search.find(targets, own)
        flag = np.full(len(targets), TOO_FEW, dtype=object)
        columns = [np.full(len(targets), np.nan) for _ in range(2 if self.inside is None else 4)]
        enough = np.flatnonzero(found.counts >= self.near.min_samples)
        if len(enough):
            rows, counts = found.rows[enough], found.counts[enough]
            offset = self.given.points[rows] - targets[enough, None]
            values = self.given.values[rows]
            if self.inside is None or axes is None or self.variogram is None:
                answers = self._solved(offset, values, counts)
            else:
                inside, used = (
                    self.inside @ axes[enough],
                    np.arange(rows.shape[1]) < counts[:, None],
                )
                with one_thread():
                    got = solve_systems(self.variogram, offset, used, values, inside, self.mean)
                answers = got.estimate, got.variance, got.efficiency, got.slope
            for column, answer in zip(columns, answers, strict=True):
                column[enough] = answer
            flag[enough] = np.where(np.isnan(columns[0][enough]), UNSOLVABLE, ESTIMATED)
        return columns, found.counts, flag

    def _solved(self, offset: Floats, values: Floats, counts: Ints) -> tuple[Floats, ...]:
        if self.method == "nearest":  # the first of each row
            return values[:, 0], np.full(len(values), np.nan)
        if self.variogram is None or self.method == "inverse_distance":
            measured = self.near.measured(offset.reshape(-1, 3)).reshape(offset.shape)
            answer = gstlearn.inverse_distance(measured, values, counts, self.power)
            return answer, np.full(len(answer), np.nan)
        model = self.variogram
        offset = offset @ model.axes.T
        # Scaled to a mean of 0 and a sill of 1: the library's thresholds do not depend on the unit.
        scale, sill = float(np.sqrt(model.sill)), model.sill
        centre = float(self.given.values.mean()) if self.mean is None else self.mean
        answer, variance = gstlearn.krige(
            offset,
            (values - centre) / scale,
            counts,
            model.nugget / sill,
            [(kind, part / sill, lengths, s) for kind, part, lengths, s in model.parts],
            None if self.mean is None else 0.0,
        )
        wrong = ~(variance <= _WORST)
        answer[wrong], variance[wrong] = np.nan, np.nan
        return answer * scale + centre, variance * sill


_WORST = 20.0  # sills; a variance above it shows that the kriging system was not solved


def _run(
    job: _Job, targets: Floats, own: Ints | None, axes: Floats | None, workers: int
) -> list[Part]:
    """Return the answers for chunks of targets, in their order."""
    chunks = [slice(i, i + _CHUNK) for i in range(0, len(targets), _CHUNK)]
    pieces: list[Piece] = [
        (targets[c], None if own is None else own[c], None if axes is None else axes[c])
        for c in chunks
    ]
    if len(pieces) <= 1 or (workers == 1 and len(pieces) <= _LIFE):
        return solve(job, pieces)
    size = min(_LIFE, -(-len(pieces) // workers))
    jobs = [(job, pieces[i : i + size]) for i in range(0, len(pieces), size)]
    return [part for parts in apart(solve, jobs, workers) for part in parts]


def solve(job: _Job, pieces: Sequence[Piece]) -> list[Part]:
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
    """Raise OptionError if the method lacks something that it needs."""
    if method not in METHODS:
        raise OptionError(f"method {method!r} is not one of: {', '.join(METHODS)}")
    if variogram is None and method in ("ordinary", "simple"):
        raise OptionError(f"{method} kriging needs a variogram")
    if holes is None and (near.max_per_hole is not None or leave_out is not None):
        raise OptionError("max_per_hole needs the hole of each sample")
    if holes is None and near.min_holes > 1:
        raise OptionError("min_holes needs the hole of each sample")
    if not (np.isfinite(power) and power > 0):
        raise OptionError(f"the power of inverse distance must be above 0, not {power}")
    if not isinstance(workers, int) or workers < 1:
        raise OptionError(f"workers must be a whole number of 1 or more, not {workers!r}")


def estimated(flag: np.ndarray) -> Bools:
    """Return which targets have an estimate, by their flags."""
    return np.asarray(flag == ESTIMATED, dtype=bool)
