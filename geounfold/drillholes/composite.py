"""Composites: grades averaged over equal lengths along each hole, weighted by length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from geounfold.errors import OptionError, check_number, check_one_of
from geounfold.geometry.mesh import Floats, Ints

Residual = Literal["merge", "drop", "keep"]
RESIDUALS = get_args(Residual)

_MOST_PARTS = 5e7  # most parts of intervals after the cut by windows
_SLIVER = 1e-9  # overlaps below this share of the composite length are rounding


@dataclass(frozen=True, kw_only=True)
class CompositeOptions:
    """Rules by which intervals become composites.

    Parameters
    ----------
    length : float
        Length along the hole, in the tables' unit. Composites begin at whole multiples of it from
        the collar, so they do not depend on the depth at which sampling began.
    residual : {"merge", "drop", "keep"}
        Treatment of the last composite of a hole if it is shorter than half the length: joined
        to the one above (no metal is lost), left out, or kept.
    min_coverage : float
        Smallest assayed share of a composite's length; below it the grade is missing. A
        composite without any grade is left out.

    Raises
    ------
    OptionError
        A value is outside its valid range.
    """

    length: float
    residual: Residual = "merge"
    min_coverage: float = 0.5

    def __post_init__(self) -> None:
        check_number("length", self.length, 0, low_open=True)
        check_one_of("residual", self.residual, RESIDUALS)
        check_number("min_coverage", self.min_coverage, 0, 1)


@dataclass(frozen=True, eq=False)
class Composites:
    """Composites, sorted by hole and depth.

    Attributes
    ----------
    hole : (c,) int
        Index of the hole of each composite.
    start, end : (c,) float
        Lengths along the hole.
    covered : (c,) float
        Length covered by intervals, assayed or not.
    grades : (c, g) float
        Means weighted by assayed length; NaN below the minimum coverage.
    words : (c, w) object
        Value of each text column that covers most of the length.
    """

    hole: Ints
    start: Floats
    end: Floats
    covered: Floats
    grades: Floats
    words: np.ndarray


def composite(
    hole: Ints,
    start: Floats,
    end: Floats,
    grades: Floats,
    words: np.ndarray,
    options: CompositeOptions,
) -> Composites:
    """Return composites of intervals that are sorted by hole and depth and do not overlap.

    Parameters
    ----------
    hole : (n,) int
        Index of the hole of each interval.
    start, end : (n,) float
        Lengths along the hole.
    grades : (n, g) float
        Grades; NaN if not assayed, which the mean leaves out and never counts as zero.
    words : (n, w) object
        Values of the text columns; empty if missing.
    options : CompositeOptions
        Length and rules.

    Raises
    ------
    OptionError
        The length is so short that there are over 50 million parts.
    """
    window, interval, weight, lower = _parts(hole, start, end, options)
    keys, group = np.unique(np.column_stack([hole[interval], window]), axis=0, return_inverse=True)
    group = group.ravel()
    owner, number = keys[:, 0], keys[:, 1]
    count = len(keys)
    covered = np.bincount(group, weight, minlength=count).astype(np.float64)
    top = np.asarray(number * options.length, dtype=np.float64)
    last = np.r_[owner[1:] != owner[:-1], True] if count else np.zeros(0, dtype=bool)
    bottom = np.full(count, -np.inf)
    np.maximum.at(bottom, group, lower)
    bottom = np.where(last, bottom, top + options.length)
    mean = np.empty((count, grades.shape[1]))
    for j in range(grades.shape[1]):
        value = grades[interval, j]
        known = ~np.isnan(value)
        length = np.bincount(group[known], weight[known], minlength=count)
        metal = np.bincount(group[known], (weight * value)[known], minlength=count)
        least = np.maximum(options.min_coverage * (bottom - top) * (1 - _SLIVER), 0.0)
        enough = (length > 0) & (length >= least)
        mean[:, j] = np.where(enough, metal / np.where(length > 0, length, 1.0), np.nan)
    texts = [_most(words[interval, j], group, weight, count) for j in range(words.shape[1])]
    text = np.column_stack(texts) if texts else np.empty((count, 0), dtype=object)
    keep = np.ones(count, dtype=bool)
    if grades.shape[1]:
        keep &= ~np.isnan(mean).all(axis=1)
    if options.residual == "drop":
        keep &= ~(last & (bottom - top < 0.5 * options.length))
    return Composites(owner[keep], top[keep], bottom[keep], covered[keep], mean[keep], text[keep])


def _parts(
    hole: Ints, start: Floats, end: Floats, options: CompositeOptions
) -> tuple[Ints, Ints, Floats, Floats]:
    """Cut intervals by windows; return each part's window, interval, length and lower end."""
    size = options.length
    if ((end - start) / size).sum() > _MOST_PARTS:
        raise OptionError(f"composites of {size:g} are too many to hold; take a greater length")
    low = np.floor(start / size).astype(np.int64)
    high = np.maximum(np.ceil(end / size).astype(np.int64), low + 1)
    interval = np.repeat(np.arange(len(start)), high - low)
    within = np.arange(len(interval)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
    window = low[interval] + within
    upper = np.maximum(start[interval], window * size)
    lower = np.minimum(end[interval], (window + 1) * size)
    weight = lower - upper
    some = weight > _SLIVER * size
    window, interval, weight, lower = window[some], interval[some], weight[some], lower[some]
    if options.residual == "merge":
        window = _merged(hole[interval], window, lower, size)
    return window, interval, weight, lower


def _merged(hole: Ints, window: Ints, lower: Floats, size: float) -> Ints:
    """Return the windows; a short last window of a hole is joined to the one above it."""
    count = int(hole.max(initial=-1)) + 1
    last = np.full(count, -1, dtype=np.int64)
    np.maximum.at(last, hole, window)
    deepest = np.full(count, -np.inf)
    np.maximum.at(deepest, hole, lower)
    short = deepest - last * size < 0.5 * size
    above = np.zeros(count, dtype=bool)
    above[hole[window == last[hole] - 1]] = True
    join = (window == last[hole]) & (short & above)[hole]
    return np.where(join, window - 1, window)


def _most(values: np.ndarray, group: Ints, weight: Floats, count: int) -> np.ndarray:
    """Return for each group the text of most weight; of equal ones, the first in the alphabet."""
    texts, code = np.unique(values.astype(str), return_inverse=True)
    pairs, index = np.unique(np.column_stack([group, code]), axis=0, return_inverse=True)
    sums = np.bincount(index.ravel(), weight)
    order = np.lexsort((pairs[:, 1], -sums, pairs[:, 0]))
    _, first = np.unique(pairs[order, 0], return_index=True)
    out = np.full(count, "", dtype=object)
    out[pairs[order[first], 0]] = texts[pairs[order[first], 1]]
    return out
