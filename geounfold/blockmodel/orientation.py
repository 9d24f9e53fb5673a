"""How a block model is turned: bearing, dip and plunge of its own axes."""

from __future__ import annotations

import numpy as np

from geounfold.errors import OptionError
from geounfold.mesh import Floats


def axes_from_angles(bearing: float, dip: float = 0.0, plunge: float = 0.0) -> Floats:
    """Return a block model's own axes as rows, (3, 3), a right-handed rotation.

    Parameters
    ----------
    bearing : float
        Compass direction of the model's x axis, degrees clockwise from north (world y): 90, east,
        is a model that is not turned.
    dip : float
        Inclination of the y axis about the x axis, degrees, positive up.
    plunge : float
        Inclination of the x axis from the horizontal, degrees, positive up; applied before dip.

    Raises
    ------
    OptionError
        Angles that are not finite, or a dip or plunge beyond 90 degrees.

    Examples
    --------
    >>> bool(np.allclose(axes_from_angles(90.0), np.eye(3)))
    True
    >>> bool(np.allclose(axes_from_angles(180.0)[0], [0, -1, 0]))  # the x axis points south
    True
    """
    angles = np.array([bearing, dip, plunge], dtype=np.float64)
    if not np.isfinite(angles).all():
        raise OptionError("bearing, dip and plunge must be finite numbers of degrees")
    if (np.abs(angles[1:]) > 90).any():
        raise OptionError(f"dip and plunge must lie within 90 degrees, but are {dip:g}, {plunge:g}")
    b, d, p = np.deg2rad(angles)
    x = np.array([np.sin(b) * np.cos(p), np.cos(b) * np.cos(p), np.sin(p)])
    level = np.array([-np.cos(b), np.sin(b), 0.0])  # y before it dips
    y = np.cos(d) * level + np.sin(d) * np.cross(x, level)
    return np.array([x, y, np.cross(x, y)]) + 0.0
