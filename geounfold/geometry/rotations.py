"""Rotations of points and of directions."""

from __future__ import annotations

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats


def axis_angle_rotation(from_vec: Floats, to_vec: Floats) -> Floats:
    """Return the rotation (3, 3) by the least angle that turns one direction to another.

    Rodrigues' formula ``R = I + sin(theta) K + (1 - cos(theta)) K^2`` with K the cross-product
    matrix of the *unit* axis ``from x to`` (see the module's note on the thesis's own code).
    Beyond a right angle it is composed of a half turn and a small turn about the same axis, which
    keeps it exact up to opposite directions; for these any axis across them is correct.

    Parameters
    ----------
    from_vec, to_vec : (3,) float
        Directions, of any length but zero; ``R @ from_vec`` is along ``to_vec``.

    Raises
    ------
    OptionError
        A vector is zero or not finite.

    Examples
    --------
    >>> axis_angle_rotation(np.array([0, 0, 2.0]), np.array([3.0, 0, 0])) @ [0, 0, 1.0]
    array([1., 0., 0.])
    """
    a, b = _direction(from_vec), _direction(to_vec)
    if a @ b >= 0:
        return _small_turn(a, b)
    axis = np.cross(a, b)
    if np.linalg.norm(axis) < 1e-12:
        axis = np.cross(a, np.eye(3)[(a * a).argmin()])
    axis = axis / np.linalg.norm(axis)
    half_turn = 2 * np.outer(axis, axis) - np.eye(3)
    out: Floats = _small_turn(-a, b) @ half_turn
    return out


def _direction(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    if not np.isfinite(length) or length == 0:
        raise OptionError(f"a direction must be finite and not zero, but is {vector}")
    out: Floats = np.asarray(vector, dtype=np.float64) / length
    return out


def _small_turn(a: Floats, b: Floats) -> Floats:
    """Return Rodrigues' rotation of unit a to unit b, at most a right angle apart."""
    x, y, z = np.cross(a, b)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    out: Floats = np.eye(3) + K + K @ K / (1 + a @ b)
    return out


def rotate(points: Floats, matrix: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a matrix times each point (n, 3), by columns, (n,) each.

    The linear algebra library is not used, because its rounding depends on a row's position.
    """
    x, y, z = points.T
    a, b, c = (x * row[0] + y * row[1] + z * row[2] for row in matrix)
    return a, b, c


def rotation_from_angles(bearing: float, plunge: float, dip: float) -> Floats:
    """Return axes (3, 3) rotated like a block model's: rows x, y, z in world coordinates.

    Parameters
    ----------
    bearing : float
        Direction of the y axis, degrees clockwise from north (world +y).
    plunge : float
        Slope of the y axis, degrees below the horizontal.
    dip : float
        Rotation of the x axis downwards about the y axis, degrees, applied last.

    Examples
    --------
    >>> rotation_from_angles(90, 0, 0).round(12)[1].tolist()
    [1.0, 0.0, 0.0]
    """
    (a, b, c), (sa, sb, sc) = (f(np.radians([bearing, plunge, dip])) for f in (np.cos, np.sin))
    turn = np.array([[a, -sa, 0.0], [sa, a, 0.0], [0.0, 0.0, 1.0]])
    tip = np.array([[1.0, 0.0, 0.0], [0.0, b, -sb], [0.0, sb, b]])
    roll = np.array([[c, 0.0, -sc], [0.0, 1.0, 0.0], [sc, 0.0, c]])
    out: Floats = roll @ tip @ turn
    return out


def angles_of(axes: Floats) -> tuple[float, float, float]:
    """Return the bearing, plunge and dip, degrees, of axes (3, 3): see `rotation_from_angles`.

    If the y axis is vertical, bearing and dip turn about one axis, and the dip is 0.

    Examples
    --------
    >>> [round(angle, 9) for angle in angles_of(rotation_from_angles(30, 20, 10))]
    [30.0, 20.0, 10.0]
    """
    plunge = float(np.degrees(-np.arcsin(np.clip(axes[1, 2], -1, 1))))
    if np.isclose(abs(axes[1, 2]), 1):
        return float(np.degrees(np.arctan2(-axes[0, 1], axes[0, 0]))), plunge, 0.0
    bearing = float(np.degrees(np.arctan2(axes[1, 0], axes[1, 1])))
    dip = float(np.degrees(np.arctan2(-axes[0, 2], axes[2, 2])))
    return bearing, plunge, dip
