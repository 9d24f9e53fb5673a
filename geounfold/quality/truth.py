"""Comparison of an unfolding with a known truth."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.measures import lengths
from geounfold.geometry.mesh import Floats, Ints
from geounfold.quality.neighbour_distances import (
    NEIGHBOURS,
    check_same_rows,
    epsilon,
    finite_points,
    neighbours,
)
from geounfold.quality.statistics import Statistics

_PAIRS = 100_000  # random pairs by which distances between far points are sampled
_ALONG = 0.95  # cosine from which a pair of neighbours counts as parallel to an axis (18 degrees)


def aligned_rms(Y: Floats, W: Floats) -> float:
    """Return the root mean square distance of Y from W after the best rigid motion.

    The motion is a proper rotation and a translation (Kabsch 1976), so a mirrored answer has a
    large distance.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth: the same points row by row, in the same unit.

    Returns
    -------
    float
        In the points' unit.

    Raises
    ------
    InputError
        Shapes differ, there are no points, or values are not finite.

    Examples
    --------
    >>> W = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3]])
    >>> bool(aligned_rms(W @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + 5, W) < 1e-12)
    True
    >>> round(aligned_rms(W * [1, 1, -1], W), 2)
    0.67
    """
    Y, W = finite_points(Y, "Y"), finite_points(W, "W")
    check_same_rows(Y, W, "Y and W")
    if not len(Y):
        raise InputError("there are no points to align")
    a, b = Y - Y.mean(axis=0), W - W.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return float(np.sqrt(((a @ (left @ proper @ right) - b) ** 2).sum(axis=1).mean()))


def random_pairs(n: int, count: int = _PAIRS, seed: int = 0) -> Ints:
    """Return `count` pairs of different row numbers below n, (count, 2) int; n is at least 2."""
    if n < 2:
        raise InputError(f"pairs need at least 2 points, but there are {n}")
    rng = np.random.default_rng(seed)
    first = rng.integers(0, n, count)
    return np.stack([first, (first + rng.integers(1, n, count)) % n], axis=1)


def distance_ratios(A: Floats, B: Floats, pairs: Ints) -> Floats:
    """Return the distance between paired points in B over their distance in A.

    Over far pairs (`random_pairs`) this ratio reveals a fold that near neighbours do not.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference points and the same points elsewhere, in the same unit.
    pairs : (m, 2) int
        Row numbers.

    Returns
    -------
    (m,) float
        1 for a distance that is kept; pairs that coincide in A are left out.

    Raises
    ------
    InputError
        Shapes differ, or all pairs coincide in A.
    """
    A, B = finite_points(A, "A"), finite_points(B, "B")
    check_same_rows(A, B, "A and B")
    before, after = lengths(A, pairs), lengths(B, pairs)
    apart = before > 0
    if not apart.any():
        raise InputError("all pairs of points coincide: there is no distance to compare with")
    return after[apart] / before[apart]


def spacing_ratios(
    Y: Floats, W: Floats, k: int = NEIGHBOURS
) -> tuple[float | None, float | None, float | None]:
    """Return how much the spacing along each axis of the truth is stretched.

    For each axis, neighbours in W are taken whose line lies within 18 degrees of it.  The stretch
    is the median of their distance in Y over that in W.  It does not depend on Y's rotation.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth, in the same unit.
    k : int
        Number of neighbours of each point.

    Returns
    -------
    tuple of 3
        1 for a true spacing; None for an axis along which no neighbours lie (across a body one
        block thick).
    """
    Y, W = finite_points(Y, "Y"), finite_points(W, "W")
    check_same_rows(Y, W, "Y and W")
    ids = neighbours(W, k)
    pairs = np.stack([np.repeat(np.arange(len(W)), k), ids.ravel()], axis=1)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    step = W[pairs[:, 1]] - W[pairs[:, 0]]
    along = np.abs(step) > _ALONG * np.linalg.norm(step, axis=1, keepdims=True)

    def median(axis: int) -> float | None:
        chosen = pairs[along[:, axis]]
        return float(np.median(distance_ratios(W, Y, chosen))) if len(chosen) else None

    return median(0), median(1), median(2)


@dataclass(frozen=True)
class TruthQuality:
    """Figures of the unfolded body Y beside those of the folded body X, against the truth W.

    Attributes
    ----------
    epsilon_truth : Statistics
        epsilon(W, Y), with the neighbours found in the truth W.
    epsilon_folded : Statistics
        epsilon(X, Y), with the neighbours found in the folded body X; needs no truth.
    epsilon_nothing : Statistics
        epsilon(W, X): epsilon of the folded body itself.
    rms, rms_nothing : float
        Root mean square distance of Y, and of X, from W after the best rotation and translation.
    spacing : tuple of 3 float or None
        Stretch of the spacing along each axis of W (`spacing_ratios`).
    distances : Statistics
        |ratio - 1| of distances between far points, Y over W.
    distances_nothing : Statistics
        |ratio - 1| of distances between far points, X over W.
    """

    epsilon_truth: Statistics
    epsilon_folded: Statistics
    epsilon_nothing: Statistics
    rms: float
    rms_nothing: float
    spacing: tuple[float | None, float | None, float | None]
    distances: Statistics
    distances_nothing: Statistics

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain dicts and numbers."""
        return asdict(self)


def compare_with_truth(X: Floats, Y: Floats, W: Floats, k: int = NEIGHBOURS) -> TruthQuality:
    """Compare the unfolded body Y with its truth W, and with the folded body X.

    Parameters
    ----------
    X, Y, W : (n, 3) float
        Folded, unfolded and true points: the same points row by row, in the same unit.
    k : int
        Number of neighbours.

    Returns
    -------
    TruthQuality
        Figures of Y beside those of X.

    Raises
    ------
    InputError
        Shapes differ, there are too few points, or values are not finite.
    """
    far = random_pairs(len(W))
    return TruthQuality(
        epsilon_truth=Statistics.of(epsilon(W, Y, k)),
        epsilon_folded=Statistics.of(epsilon(X, Y, k)),
        epsilon_nothing=Statistics.of(epsilon(W, X, k)),
        rms=aligned_rms(Y, W),
        rms_nothing=aligned_rms(X, W),
        spacing=spacing_ratios(Y, W, k),
        distances=Statistics.of(np.abs(distance_ratios(W, Y, far) - 1)),
        distances_nothing=Statistics.of(np.abs(distance_ratios(W, X, far) - 1)),
    )
