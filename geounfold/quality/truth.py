"""Distance of an unfolding from a known truth."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.measures import lengths
from geounfold.geometry.mesh import Floats, Ints
from geounfold.quality.neighbour_distances import (
    NEIGHBOURS,
    epsilon,
    neighbour_cloud,
    neighbours,
    same_rows,
)
from geounfold.quality.statistics import Statistics

_PAIRS = 100_000  # pairs that the far distances are sampled with


_ALONG = 0.95  # cosine from which a pair of neighbours counts as lying along an axis (18 degrees)


def aligned_rms(Y: Floats, W: Floats) -> float:
    """Return the root mean square distance of Y from W after the best rigid motion.

    The motion is a proper rotation and a translation (Kabsch 1976), so that a mirrored answer
    scores badly, as it should.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth, row by row the same points, in the same unit.

    Returns
    -------
    float
        In the points' unit.

    Raises
    ------
    InputError
        Unequal shapes, no points, or values that are not finite.

    Examples
    --------
    >>> W = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3]])
    >>> bool(aligned_rms(W @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + 5, W) < 1e-12)
    True
    >>> round(aligned_rms(W * [1, 1, -1], W), 2)
    0.67
    """
    Y, W = neighbour_cloud(Y, "Y"), neighbour_cloud(W, "W")
    same_rows(Y, W, "Y and W")
    if not len(Y):
        raise InputError("there are no points to align")
    a, b = Y - Y.mean(axis=0), W - W.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return float(np.sqrt(((a @ (left @ proper @ right) - b) ** 2).sum(axis=1).mean()))


def random_pairs(n: int, count: int = _PAIRS, seed: int = 0) -> Ints:
    """Return `count` random pairs of different row numbers below n >= 2, (count, 2) int."""
    if n < 2:
        raise InputError(f"pairs need at least 2 points, but there are {n}")
    rng = np.random.default_rng(seed)
    first = rng.integers(0, n, count)
    return np.stack([first, (first + rng.integers(1, n, count)) % n], axis=1)


def distance_ratios(A: Floats, B: Floats, pairs: Ints) -> Floats:
    """Return the distance between paired points in B over that in A.

    Over far pairs (`random_pairs`) this sees a fold that near neighbours hide.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference and other cloud, in the same unit.
    pairs : (m, 2) int
        Row numbers.

    Returns
    -------
    (m,) float
        1 where the distance is kept; pairs that coincide in A are left out.

    Raises
    ------
    InputError
        Unequal shapes, or no pair with a distance in A.
    """
    A, B = neighbour_cloud(A, "A"), neighbour_cloud(B, "B")
    same_rows(A, B, "A and B")
    before, after = lengths(A, pairs), lengths(B, pairs)
    apart = before > 0
    if not apart.any():
        raise InputError("no pair of points has a distance to compare with")
    return after[apart] / before[apart]


def spacing_ratios(
    Y: Floats, W: Floats, k: int = NEIGHBOURS
) -> tuple[float | None, float | None, float | None]:
    """Return how much the spacing along each axis of the truth was stretched.

    The median, over neighbours in W whose line lies within 18 degrees of the axis, of their
    distance in Y over that in W.  It does not depend on how Y is turned.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth, in the same unit.
    k : int
        Number of neighbours looked at.

    Returns
    -------
    tuple of 3
        1 where the spacing is true; None for an axis that no neighbours lie along (a body one
        block thick has none across).
    """
    Y, W = neighbour_cloud(Y, "Y"), neighbour_cloud(W, "W")
    same_rows(Y, W, "Y and W")
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
    """An unfolding compared with the truth, and what doing nothing would have scored.

    Attributes
    ----------
    epsilon_truth : Statistics
        epsilon(W, Y): neighbours of the truth W, kept in the answer Y.
    epsilon_folded : Statistics
        epsilon(X, Y): neighbours of the folded body X; needs no truth, and 0 for doing nothing.
    epsilon_nothing : Statistics
        epsilon(W, X): the score of leaving the body folded.
    rms, rms_nothing : float
        Root mean square distance of Y, and of X, from W after the best proper rotation.
    spacing : tuple of 3 float or None
        See `spacing_ratios`.
    distances : Statistics
        |ratio - 1| of distances between far points, answer over truth.
    distances_nothing : Statistics
        The same for the folded body.
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
        Folded, unfolded and true points, row by row the same, in the same unit.
    k : int
        Number of neighbours.

    Returns
    -------
    TruthQuality
        Figures of the answer beside those of doing nothing.

    Raises
    ------
    InputError
        Unequal shapes, too few points, values that are not finite.
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
