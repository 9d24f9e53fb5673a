"""One flat body laid on another by a rigid motion that outlying blocks do not pull."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Floats

_ROUNDS = 12
"""Rounds of reweighting.

If a sixth of the blocks at one end lies 15 blocks off, the others are left 2.8 blocks off after
one round, 0.5 after six and 0.03 after twelve.
"""


def laid_on(Y: Floats, W: Floats) -> Floats:
    """Return Y, (n, 3), moved rigidly onto W, (n, 3), row by row; never mirrored.

    The sum of distances is made small, not that of their squares, so a limb that lies elsewhere
    does not turn the rest.  Rows of which either is NaN are NaN, and do not count.

    Examples
    --------
    >>> W = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [9, 9, 1], [4, 4, 0]])
    >>> Y = W @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + 5
    >>> bool(abs(laid_on(Y, W) - W).max() < 1e-9)
    True
    """
    rows = np.isfinite(Y).all(axis=1) & np.isfinite(W).all(axis=1)
    out = np.full(W.shape, np.nan)
    if not rows.any():
        return out
    A, B = Y[rows], W[rows]
    weight = np.ones(len(A))
    for _ in range(_ROUNDS):
        moved = _moved(A, B, weight / weight.sum())
        apart = np.linalg.norm(moved - B, axis=1)
        usual = float(np.median(apart))
        if usual <= 0:
            break
        weight = 1 / np.maximum(apart, usual)
    out[rows] = moved
    return out


def _moved(A: Floats, B: Floats, weight: Floats) -> Floats:
    """Return A moved onto B by weighted least squares (Kabsch 1976); the weights sum to 1."""
    a, b = weight @ A, weight @ B
    left, _, right = np.linalg.svd(((A - a) * weight[:, None]).T @ (B - b))
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    out: Floats = (A - a) @ (left @ proper @ right) + b
    return out
