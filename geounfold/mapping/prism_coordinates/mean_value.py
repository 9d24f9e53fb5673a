"""Mean value coordinates in prisms with split quadrilaterals, convex or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry.mesh import Bools, Floats
from geounfold.mapping.prism_coordinates._prism import EDGES, TRIANGLES, cross, dot, opposite_edges
from geounfold.mapping.prism_coordinates.wachspress import normalised

_I, _J = (np.array(ends) for ends in zip(*EDGES, strict=True))
_OPPOSITE, _SENSE = opposite_edges()
_FACES = np.array(TRIANGLES)
_NEEDLE = 1e-3  # sine-like height of a spherical triangle below which it counts as a needle
_TINY = 1e-300


def mean_value(points: Floats, corners: Floats) -> Floats:
    """Return mean value coordinates of points inside prisms.

    The triangle with corners at r_i from the point, projected on the unit sphere, has the mean
    vector ``m = sum theta_i n_i / 2``, with the angle theta_i of the edge opposite to i and the
    unit normal n_i of its plane.  Its part of the weights solves ``sum w_i r_i = m``, so ``w_i =
    (r_j x r_k) . m / det(r_i, r_j, r_k)`` (Ju, Schaefer and Warren 2005, "Mean value coordinates
    for closed triangular meshes"; Floater, Kos and Reimers 2005, "Mean value coordinates in 3D").
    The formula cancels if the plane of a distant triangle passes near the point; half-angle
    formulas replace it then.  The coordinates are positive inside convex prisms and may be negative
    in others; they are linear on every triangle of the border.

    Parameters
    ----------
    points : (n, 3) float
        Points inside; on the border the weights are not finite.
    corners : (n, 6, 3) float
        The prism of each point.

    Returns
    -------
    (n, 6) float
        Sum 1.
    """
    W = _gathered(_view(points, corners).share.swapaxes(0, 1))
    return np.ascontiguousarray((W / W.sum(axis=0)).T)


def mean_value_gradients(points: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Return the same with their gradients.

    Differentiating ``sum w_i r_i = m`` gives ``sum dw_i r_i = dm + (sum w_i) dx``, solved like the
    weights.

    Returns
    -------
    values : (n, 6) float
        Sum 1.
    gradients : (n, 6, 3) float
        Per length; sum 0.
    """
    view = _view(points, corners)
    slopes = _slopes(view).transpose(1, 2, 0, 3)
    return normalised(_gathered(view.share.swapaxes(0, 1)), _gathered(slopes))


@dataclass(frozen=True, eq=False)
class _View:
    """Prisms relative to a point in each.

    Attributes
    ----------
    r, d : (3, 6, n), (6, n) float
        Corners from the point, and their distances.
    c, area : (3, 12, n), (12, n) float
        Cross products of EDGES' ends, and their lengths.
    ratio : (12, n) float
        The angle of each edge over that length.
    normal : (3, 8, 3, n) float
        r_j x r_k for every corner of TRIANGLES.
    det : (8, n) float
        Six times the volume under each triangle; 1 if that is 0.
    share : (3, 8, n) float
        The weights.
    """

    r: Floats
    d: Floats
    c: Floats
    area: Floats
    ratio: Floats
    normal: Floats
    det: Floats
    share: Floats


def _view(points: Floats, corners: Floats) -> _View:
    r = np.ascontiguousarray(corners.transpose(2, 1, 0)) - points.T[:, None]
    d = np.sqrt(dot(r, r))
    c = cross(r[:, _I], r[:, _J])
    area = np.sqrt(dot(c, c))
    theta = np.arctan2(area, dot(r[:, _I], r[:, _J]))
    ratio = np.where(area > _TINY, theta / np.maximum(area, _TINY), 1 / (d[_I] * d[_J]))
    normal = _SENSE[..., None] * c[:, _OPPOSITE]
    mean = _around(ratio * c)
    det = dot(r[:, _FACES[:, 0]], normal[:, :, 0])
    flat = det == 0
    safe = np.where(flat, 1.0, det)
    share = np.stack([dot(normal[:, :, k], mean) / safe for k in range(3)])
    share[:, flat] = 0.0
    share = _without_needles(share, det, d, theta, area)
    return _View(r, d, c, area, ratio, normal, safe, share)


def _around(edges: Floats) -> Floats:
    """Return half the sums around TRIANGLES, (3, 8, n), of values on EDGES, (3, 12, n)."""
    a, b, c = (0.5 * _SENSE[:, k, None] * edges[:, _OPPOSITE[:, k]] for k in range(3))
    out: Floats = a + b + c
    return out


def _gathered(parts: Floats) -> Floats:
    """Return the sums (6, ...) over the corners of TRIANGLES of parts (8, 3, ...)."""
    out = np.zeros((6, *parts.shape[2:]))
    for face, part in zip(TRIANGLES, parts, strict=True):
        for corner, one in zip(face, part, strict=True):
            out[corner] += one
    return out


def _without_needles(share: Floats, det: Floats, d: Floats, theta: Floats, area: Floats) -> Floats:
    """Return weights (3, 8, n), recomputed for needle-like spherical triangles.

    With half circumference s and the longest side theta_1, ``s - theta_1`` follows from
    ``det^2 = 4 sin s sin(s - theta_1) sin(s - theta_2) sin(s - theta_3)`` without cancellation,
    and so do the angles; ``2 w_i det = |r_j x r_k| (theta_i - cos C_k theta_j - cos C_j theta_k)``.
    """
    unit = det / (d[_FACES[:, 0]] * d[_FACES[:, 1]] * d[_FACES[:, 2]])
    sides = theta[_OPPOSITE].swapaxes(0, 1)  # (3, 8, n)
    # A flat triangle may cover half of the sphere: the point then lies on the triangle itself.
    around = sides.sum(axis=0)
    needle: Bools = (np.abs(unit) < _NEEDLE) & (around - sides.max(axis=0) < np.pi)
    if not needle.any():
        return share
    order = np.argsort(-sides[:, needle], axis=0)
    a, b, c = np.take_along_axis(sides[:, needle], order, axis=0)
    s, sin = (a + b + c) / 2, np.sin
    near_b, near_c = (a - b + c) / 2, (a + b - c) / 2
    with np.errstate(all="ignore"):
        gap = np.arcsin(np.minimum(unit[needle] ** 2 / (4 * sin(s) * sin(near_b) * sin(near_c)), 1))
        half_b = sin(gap) * sin(near_c) / (sin(a) * sin(c))  # sin^2(B / 2)
        half_c = sin(gap) * sin(near_b) / (sin(a) * sin(b))
        rest = sin(s) * sin(gap) / (sin(b) * sin(c))  # cos^2(A / 2)
        bracket = 2 * np.stack(
            [
                -gap + half_c * b + half_b * c,
                gap + half_c * a - rest * c,
                gap + half_b * a - rest * b,
            ]
        )
    across = np.take_along_axis(area[_OPPOSITE].swapaxes(0, 1)[:, needle], order, axis=0)
    with np.errstate(all="ignore"):
        solved = across * bracket / (2 * det[needle])
    solved = np.where(np.isfinite(solved), solved, 0.0)  # in the plane itself: no weight
    out = share.copy()
    kept = np.empty_like(solved)
    np.put_along_axis(kept, order, solved, axis=0)
    out[:, needle] = kept
    return out


def _slopes(view: _View) -> Floats:
    """Return the gradients of the weights, (3, 8, 3, n): of every corner of TRIANGLES."""
    r, c, normal, square = view.r, view.c, view.normal, view.d**2
    unit = c / np.maximum(view.area, _TINY)
    e = r[:, _I] - r[:, _J]
    turn = cross(unit, r[:, _I]) / square[_I] - cross(unit, r[:, _J]) / square[_J]
    turn -= view.ratio * cross(e, unit)
    drift = _around(view.ratio * e)
    total = view.share.sum(axis=0)
    out = np.empty_like(normal)
    for i in range(3):
        mine = normal[:, :, i]
        row = cross(drift, mine) + total * mine
        for j in range(3):
            edges, sense = _OPPOSITE[:, j], 0.5 * _SENSE[:, j, None]
            row += sense * dot(mine, unit[:, edges]) * turn[:, edges]
        out[:, :, i] = row / view.det
    return out
