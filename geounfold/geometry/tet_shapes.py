"""Shapes of tetrahedra: dihedral angles and radius ratios, on plain arrays."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import Floats, Ints

# Of each corner, the face opposite to it, seen counter-clockwise from outside.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
_PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def _face_vectors(V: Floats, T: Ints) -> Floats:
    """Return twice the area of the face opposite to each corner, along its outward normal."""
    P = V[T]
    a, b, c = (P[:, _FACES[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def dihedral_angles(V: Floats, T: Ints) -> Floats:
    """Return the six dihedral angles of each tetrahedron, degrees, (m, 6).

    The k-th is between the faces opposite to the corners of the k-th of the pairs 01, 02, 03, 12,
    13, 23.  All are 70.53 if it is regular, and 0 or 180 if it is flat.

    Examples
    --------
    >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> dihedral_angles(corner, np.array([[0, 1, 2, 3]])).round(2).tolist()
    [[54.74, 54.74, 54.74, 90.0, 90.0, 90.0]]
    """
    N = _face_vectors(V, T)
    length = np.linalg.norm(N, axis=2, keepdims=True)
    N = np.divide(N, length, out=np.zeros_like(N), where=length > 0)
    cosine = np.einsum("mpk,mpk->mp", N[:, _PAIRS[:, 0]], N[:, _PAIRS[:, 1]])
    out: Floats = 180 - np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return out


def radius_ratios(V: Floats, T: Ints) -> Floats:
    """Return three times the inscribed over the circumscribed sphere's radius, (m,).

    1 if a tetrahedron is regular, 0 if it is flat, negative if it is inverted.

    Inscribed: r = 3 v / (sum of the faces' areas).  Circumscribed: R = |a² (b x c) + b² (c x a)
    + c² (a x b)| / (12 v), a, b, c the edges from one corner and v the volume.

    Examples
    --------
    >>> V = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> radius_ratios(V, np.array([[0, 1, 2, 3], [1, 0, 2, 3]])).round(12).tolist()
    [-1.0, 1.0]
    """
    volume = tet_volumes(V, T)
    area = np.linalg.norm(_face_vectors(V, T), axis=2).sum(axis=1) / 2
    a, b, c = (V[T[:, k]] - V[T[:, 0]] for k in (1, 2, 3))
    sq = [np.einsum("ij,ij->i", e, e)[:, None] for e in (a, b, c)]
    centre = sq[0] * np.cross(b, c) + sq[1] * np.cross(c, a) + sq[2] * np.cross(a, b)
    below = area * np.linalg.norm(centre, axis=1)
    above = 108 * np.sign(volume) * volume**2
    out: Floats = np.divide(above, below, out=np.zeros_like(volume), where=below > 0)
    return out
