"""Wachspress coordinates in convex prisms with split quadrilaterals."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.mapping.prism_coordinates._prism import TRIANGLES, cross, dot, face_normals, fans

_VOLUMES = [
    (corner, base, j, k)
    for corner, (base, *around) in enumerate(fans())
    for j, k in pairwise(around)
]


def wachspress(points: Floats, corners: Floats) -> Floats:
    """Return Wachspress coordinates of points inside convex prisms.

    Let p = n / h be the outward normal of a face divided by the point's distance from it.  The
    weight of a corner is the volume under a facet of the polar dual, spanned by the p of the faces
    around the corner: ``sum det(p_1, p_j, p_j+1)`` (Ju, Schaefer, Warren and Desbrun 2005, "A
    geometric construction of coordinates for convex polyhedra using polar duals"; Floater, Gillette
    and Sukumar 2014, "Gradient bounds for Wachspress coordinates on polytopes").  They are
    rational, positive inside, and linear on every triangle of a strictly convex border.

    Parameters
    ----------
    points : (n, 3) float
        Points inside; on the border the weights are not finite.
    corners : (n, 6, 3) float
        The prism of each point, strictly convex.

    Returns
    -------
    (n, 6) float
        Sum 1.
    """
    p = _duals(points, corners)
    W = np.zeros((6, len(points)))
    for corner, base, j, k in _VOLUMES:
        W[corner] += dot(p[:, base], cross(p[:, j], p[:, k]))
    return np.ascontiguousarray((W / W.sum(axis=0)).T)


def wachspress_gradients(points: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Return Wachspress coordinates with their gradients, from ``dp = p (p . dx)``.

    Returns
    -------
    values : (n, 6) float
        Sum 1.
    gradients : (n, 6, 3) float
        Per length; sum 0.
    """
    p = _duals(points, corners)
    W, G = np.zeros((6, len(points))), np.zeros((6, 3, len(points)))
    for corner, base, j, k in _VOLUMES:
        volume = dot(p[:, base], cross(p[:, j], p[:, k]))
        W[corner] += volume
        G[corner] += volume * (p[:, base] + p[:, j] + p[:, k])
    return normalised(W, G)


def _duals(points: Floats, corners: Floats) -> Floats:
    """Return p of every triangle of the border, (3, 8, n)."""
    C = np.ascontiguousarray(corners.transpose(2, 1, 0))
    x = np.ascontiguousarray(points.T)
    normal = face_normals(C)
    first = [face[0] for face in TRIANGLES]
    out: Floats = normal / dot(normal, C[:, first] - x[:, None])
    return out


def normalised(W: Floats, G: Floats) -> tuple[Floats, Floats]:
    """Return weights (6, n) and their gradients (6, 3, n) as coordinates (n, 6), (n, 6, 3)."""
    total = W.sum(axis=0)
    values = W / total
    slopes = (G - values[:, None] * G.sum(axis=0)) / total
    return np.ascontiguousarray(values.T), np.ascontiguousarray(slopes.transpose(2, 0, 1))
