"""Points in an outline."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Bools, Floats


def in_polygon(points: Floats, corners: Floats) -> Bools:
    """Return which points (n, 2) lie in a polygon of corners (k, 2), by the even-odd rule.

    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> in_polygon(np.array([[1.0, 1.0], [3.0, 1.0]]), square).tolist()
    [True, False]
    """
    inside = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (a, b), (c, d) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if b != d:
            crosses = (y < b) != (y < d)
            inside ^= crosses & (x < a + (y - b) / (d - b) * (c - a))
    return inside
