"""Distortion of a flattened surface: one figure per surface and measure.

Parameters of each function: V (n, 3) folded vertices in any unit, F (m, 3) faces and uv (n, 2) flat
positions in the same unit.  Stretches are the singular values s1 >= s2 of the map's Jacobian on
each face, s2 negative if the face is flipped; means are weighted by folded area.
"""

from __future__ import annotations

import numpy as np

from geounfold.flattening._problem import edge_of_side, flip_count, lay_out, relative_area_error
from geounfold.geometry.measures import lengths, triangle_areas, unique_edges
from geounfold.geometry.mesh import Floats, Ints


def stretches(V: Floats, F: Ints, uv: Floats) -> tuple[Floats, Floats]:
    """Return the principal stretches of each face, two (m,) arrays; the lesser is signed.

    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> s1, s2 = stretches(V, np.array([[0, 1, 2]]), V[:, :2] * [3.0, 2.0])
    >>> round(float(s1[0]), 12), round(float(s2[0]), 12)
    (3.0, 2.0)
    """
    edges = unique_edges(F)
    rest = lay_out(lengths(V, edges)[edge_of_side(F, edges, len(V))])
    w = uv[:, 0] + 1j * uv[:, 1]
    first, second = w[F[:, 1]] - w[F[:, 0]], w[F[:, 2]] - w[F[:, 0]]
    along = first / rest[:, 1].real
    across = (second - rest[:, 2].real * along) / rest[:, 2].imag
    similar = np.abs(along - 1j * across) / 2
    anti = np.abs(along + 1j * across) / 2
    return similar + anti, similar - anti


def area_error(V: Floats, F: Ints, uv: Floats) -> float:
    """Return E_s = sum |A - A'| / sum A (Wang et al. 2002; thesis section 2.2.4), A' signed."""
    return relative_area_error(uv, F, triangle_areas(V, F))


def edge_strain(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the root mean square over the edges of flat length / folded length - 1."""
    edges = unique_edges(F)
    strain = lengths(uv, edges) / lengths(V, edges) - 1
    return float(np.sqrt(np.mean(strain * strain)))


def area_distortion(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the mean of (s1 s2 + 1/(s1 s2)) / 2: 1 if areas are kept, inf with a flip."""
    s1, s2 = stretches(V, F, uv)
    if not (s2 > 0).all():
        return float("inf")
    area = s1 * s2
    return _mean((area + 1 / area) / 2, V, F)


def angle_distortion(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the mean of (s1/s2 + s2/s1) / 2: 1 if angles are kept, inf with a flip."""
    s1, s2 = stretches(V, F, uv)
    if not (s2 > 0).all():
        return float("inf")
    return _mean((s1 / s2 + s2 / s1) / 2, V, F)


def symmetric_dirichlet(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the mean of s1^2 + s2^2 + 1/s1^2 + 1/s2^2: 4 for an isometry, inf with a flip.

    The symmetric Dirichlet energy of Smith & Schaefer (2015) over the folded area.
    """
    s1, s2 = stretches(V, F, uv)
    if not (s2 > 0).all():
        return float("inf")
    return _mean(s1**2 + s2**2 + s1**-2 + s2**-2, V, F)


def _mean(values: Floats, V: Floats, F: Ints) -> float:
    """Return the mean over the faces, weighted by folded area."""
    return float(np.average(values, weights=triangle_areas(V, F)))


def arap_energy(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the sum of A ((s1 - 1)^2 + (s2 - 1)^2) (Liu et al. 2008), in square units."""
    s1, s2 = stretches(V, F, uv)
    return float((triangle_areas(V, F) * ((s1 - 1) ** 2 + (s2 - 1) ** 2)).sum())


def conformal_energy(V: Floats, F: Ints, uv: Floats) -> float:
    """Return the sum of A (s1 - s2)^2 / 2 (Levy et al. 2002), in square units."""
    s1, s2 = stretches(V, F, uv)
    return float((triangle_areas(V, F) * (s1 - s2) ** 2).sum() / 2)


def flips(F: Ints, uv: Floats) -> int:
    """Return the number of faces whose signed flat area is not positive."""
    return flip_count(uv, F)
