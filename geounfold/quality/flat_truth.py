"""Comparison with the truth that leaves free what nothing decides in flat coordinates.

Flat coordinates may be turned about z and shifted. The pin line, where layers do not slip, may lie
anywhere: another one shears the whole body, x and y in proportion to z. And either side of the
layer may be up. All other differences are errors.
"""

from __future__ import annotations

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.quality.neighbour_distances import check_same_rows, finite_points

_ROUNDS = 300  # of turn and shear in turn; folded bodies against their truth need at most 210
_STOP = 1e-10  # change of the shear


def aligned_flat(Y: Floats, W: Floats) -> Floats:
    """Return flat points Y moved as near to the true ones W as freedom allows.

    The motion is a turn about z, a shift and one shear ``x, y += g z`` of the whole body, after a
    half turn about x if that is nearer.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth: the same points row by row, in the same unit; z across the layers.

    Raises
    ------
    InputError
        Shapes differ, there are no points, or values are not finite.

    Examples
    --------
    >>> W = np.array([[0.0, 0, 0], [20, 0, 1], [0, 10, 2], [30, 10, 0]])
    >>> sheared = W + np.outer(W[:, 2], [0.3, -0.1, 0])
    >>> Y = sheared @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + 5
    >>> bool(abs(aligned_flat(Y, W) - W).max() < 1e-9)
    True
    """
    Y, W = finite_points(Y, "Y"), finite_points(W, "W")
    check_same_rows(Y, W, "Y and W")
    if not len(Y):
        raise InputError("there are no points to align")
    middle = W.mean(axis=0)
    aim = W - middle
    sides = [_turned(Y * side, aim) for side in ([1.0, 1.0, 1.0], [1.0, -1.0, -1.0])]
    out: Floats = min(sides, key=lambda Z: float(((Z - aim) ** 2).sum())) + middle
    return out


def flat_rms(Y: Floats, W: Floats) -> float:
    """Return the root mean square distance of flat points Y, (n, 3), from W after `aligned_flat`.

    Raises
    ------
    InputError
        As `aligned_flat`.
    """
    return float(np.sqrt(((aligned_flat(Y, W) - W) ** 2).sum(axis=1).mean()))


def _turned(Y: Floats, aim: Floats) -> Floats:
    """Return Y, (n, 3), centred, sheared and turned about z towards centred points."""
    Z = Y - Y.mean(axis=0)
    thick = float((Z[:, 2] ** 2).sum())
    shear = np.zeros(2)
    for _ in range(_ROUNDS):
        plan = Z[:, :2] + np.outer(Z[:, 2], shear)
        H = plan.T @ aim[:, :2]
        angle = np.arctan2(H[0, 1] - H[1, 0], H[0, 0] + H[1, 1])
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, s], [-s, c]])
        if not thick:
            break
        left = aim[:, :2] @ turn.T - Z[:, :2]
        new = (left * Z[:, 2:]).sum(axis=0) / thick
        moved = float(np.abs(new - shear).max())
        shear = new
        if moved < _STOP:
            break
    plan = Z[:, :2] + np.outer(Z[:, 2], shear)
    return np.column_stack([plan @ turn, Z[:, 2]])
