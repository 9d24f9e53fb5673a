"""Mean value coordinates in prisms with split quadrilaterals, convex or not."""

from __future__ import annotations

import numpy as np

from geounfold.coordinates._prism import EDGES, TRIANGLES, cross, dot, opposite_edges
from geounfold.coordinates.wachspress import normalised
from geounfold.mesh import Bools, Floats

_I, _J = (np.array(ends) for ends in zip(*EDGES, strict=True))
_OPPOSITE, _SENSE = opposite_edges()
_FACES = np.array(TRIANGLES)
_NEEDLE = 1e-3  # sine-like height of a spherical triangle below which it is taken for a needle
_TINY = 1e-300


def mean_value(points: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Return mean value coordinates of points inside prisms, and their gradients.

    The triangle with corners at r_i from the point, seen as a spherical one, has the mean vector
    ``m = sum theta_i n_i / 2`` with the angle theta_i of the edge opposite to i and the unit
    normal n_i of its plane; its share in the weights solves ``sum w_i r_i = m``, so
    ``w_i = (r_j x r_k) . m / det(r_i, r_j, r_k)`` (Ju, Schaefer and Warren 2005, "Mean value
    coordinates for closed triangular meshes"; Floater, Kos and Reimers 2005, "Mean value
    coordinates in 3D").  Triangles whose plane passes near the point far from themselves are
    solved by half-angle formulas, where the above cancels.  Positive inside convex prisms; in
    others they may be negative; linear on every triangle of the border.

    Parameters
    ----------
    points : (n, 3) float
        Inside; on the border the weights have no finite value.
    corners : (n, 6, 3) float
        The prism of each point.

    Returns
    -------
    values : (n, 6) float
        Sum 1.
    gradients : (n, 6, 3) float
        Per length; sum 0.
    """
    r = np.ascontiguousarray(corners.transpose(2, 1, 0)) - points.T[:, None]
    d = np.sqrt(dot(r, r))
    c = cross(r[:, _I], r[:, _J])
    area = np.sqrt(dot(c, c))
    theta = np.arctan2(area, dot(r[:, _I], r[:, _J]))
    ratio = np.where(area > _TINY, theta / np.maximum(area, _TINY), 1 / (d[_I] * d[_J]))
    normal = _SENSE[..., None] * c[:, _OPPOSITE]  # (3, 8, 3, n): r_j x r_k
    pull = _SENSE[..., None] * ratio[_OPPOSITE]  # theta over area, signed
    mean = (ratio * c)[:, _OPPOSITE]
    mean = 0.5 * np.einsum("tk,atkn->atn", _SENSE, mean)
    det = dot(r[:, _FACES[:, 0]], normal[:, :, 0])
    safe = np.where(det == 0, 1.0, det)
    share = np.where(det == 0, 0.0, dot(normal, mean[:, :, None]).swapaxes(0, 1) / safe)
    share = _without_needles(share, det, d, theta, area)
    slopes = _slopes(r, d, c, area, ratio, pull, normal, share.sum(axis=0), safe)
    W, G = np.zeros((6, len(points))), np.zeros((6, 3, len(points)))
    for t, face in enumerate(TRIANGLES):
        for k, corner in enumerate(face):
            W[corner] += share[k, t]
            G[corner] += slopes[:, t, k]
    return normalised(W, G)


def _without_needles(share: Floats, det: Floats, d: Floats, theta: Floats, area: Floats) -> Floats:
    """Return weights (3, 8, n) with those of needle-like spherical triangles anew.

    With half circumference s and the longest side theta_1, ``s - theta_1`` follows from
    ``det^2 = 4 sin s sin(s - theta_1) sin(s - theta_2) sin(s - theta_3)`` without cancellation,
    and so do the angles; ``2 w_i det = |r_j x r_k| (theta_i - cos C_k theta_j - cos C_j theta_k)``.
    """
    unit = det / (d[_FACES[:, 0]] * d[_FACES[:, 1]] * d[_FACES[:, 2]])
    sides = theta[_OPPOSITE].swapaxes(0, 1)  # (3, 8, n)
    # A flat one may cover half of the sphere instead: the point lies over the triangle itself.
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
    solved = np.where(np.isfinite(solved), solved, 0.0)  # in the plane itself: no share
    out = share.copy()
    kept = np.empty_like(solved)
    np.put_along_axis(kept, order, solved, axis=0)
    out[:, needle] = kept
    return out


def _slopes(
    r: Floats,
    d: Floats,
    c: Floats,
    area: Floats,
    ratio: Floats,
    pull: Floats,
    normal: Floats,
    total: Floats,
    det: Floats,
) -> Floats:
    """Return the gradients of the weights, (3, 8, 3, n).

    Differentiating ``sum w_i r_i = m`` gives ``sum dw_i r_i = dm + (sum w_i) dx``, solved as the
    weights were.
    """
    unit = c / np.maximum(area, _TINY)
    e = r[:, _I] - r[:, _J]
    turn = cross(unit, r[:, _I]) / d[_I] ** 2 - cross(unit, r[:, _J]) / d[_J] ** 2
    turn -= ratio * cross(e, unit)
    drift = 0.5 * (pull * e[:, _OPPOSITE]).sum(axis=2)  # (3, 8, n)
    out = np.empty_like(normal)
    for i in range(3):
        mine = normal[:, :, i]
        row = cross(drift, mine) + total * mine
        for j in range(3):
            edges, sense = _OPPOSITE[:, j], 0.5 * _SENSE[:, j, None]
            row += sense * dot(mine, unit[:, edges]) * turn[:, edges]
        out[:, :, i] = row / det
    return out
