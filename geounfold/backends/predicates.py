"""libigl's exact predicate in the plane: the side of a line on which a point lies."""

from __future__ import annotations

import igl.predicates
import numpy as np

from geounfold.geometry.mesh import Floats, Ints

_CERTAIN = (3 + 16 * 2.0**-53) * 2.0**-53
"""Shewchuk's bound on the determinant's rounding error, as a share of its terms' sizes.

It is (3 + 16 u) u with u = 2^-53. A larger determinant has the right sign.
"""

_SAFE = 1e-290
"""Least size of the terms for which the bound holds; below it products may underflow."""


def orientations(a: Floats, b: Floats, c: Floats) -> Ints:
    """Return the exact orientation of the triangles (a, b, c), (k,).

    Floating-point arithmetic decides if the determinant exceeds its error bound (Shewchuk 1997).
    Otherwise libigl's adaptive ``orient2d`` decides, one triangle at a time.

    Parameters
    ----------
    a, b, c : (k, 2) float
        Corners, finite.

    Returns
    -------
    (k,) int
        1 counter-clockwise, -1 clockwise, 0 on one line.

    Examples
    --------
    >>> origin, right = np.zeros((2, 2)), np.array([[1.0, 1.0], [1.0, 1.0]])
    >>> orientations(origin, right, np.array([[0.5, 0.5], [0.5, np.nextafter(0.5, 1)]])).tolist()
    [0, 1]
    """
    left = (a[:, 0] - c[:, 0]) * (b[:, 1] - c[:, 1])
    right = (a[:, 1] - c[:, 1]) * (b[:, 0] - c[:, 0])
    value, size = left - right, np.abs(left) + np.abs(right)
    out: Ints = np.sign(value).astype(np.int64)
    for k in np.flatnonzero(~((np.abs(value) > _CERTAIN * size) & (size > _SAFE))):
        out[k] = igl.predicates.orient2d(a[k], b[k], c[k]).value
    return out
