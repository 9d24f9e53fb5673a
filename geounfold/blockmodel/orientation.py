"""How a block model is turned: bearing, plunge and dip of its own axes."""

from __future__ import annotations

import numpy as np

from geounfold.errors import OptionError
from geounfold.mesh import Floats
from geounfold.synthetic.body import rotation


def axes_from_angles(bearing: float, plunge: float = 0.0, dip: float = 0.0) -> Floats:
    """Return a block model's own axes as rows, (3, 3), a right-handed rotation.

    The same angles turn simulated bodies' lattices, variograms and search ellipsoids.

    Parameters
    ----------
    bearing : float
        Compass direction of the model's y axis, degrees clockwise from north (world y): 0 is a
        model that is not turned.
    plunge : float
        Inclination of the y axis, degrees below the horizontal.
    dip : float
        Degrees by which the x axis then turns downwards about the y axis.

    Raises
    ------
    OptionError
        Angles that are not finite, or a plunge beyond 90 degrees.

    Examples
    --------
    >>> bool(np.allclose(axes_from_angles(0.0), np.eye(3)))
    True
    >>> bool(np.allclose(axes_from_angles(90.0)[1], [1, 0, 0]))  # the y axis points east
    True
    """
    if not np.isfinite([bearing, plunge, dip]).all():
        raise OptionError("bearing, plunge and dip must be finite numbers of degrees")
    if abs(plunge) > 90:
        raise OptionError(f"a plunge must lie within 90 degrees, but is {plunge:g}")
    return rotation(bearing, plunge, dip) + 0.0
