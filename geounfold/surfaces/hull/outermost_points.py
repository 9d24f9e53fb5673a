"""The outermost points of a body, with outward normals: input of the surface reconstructions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import HullError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull.density import density_field, tie_break


@dataclass(frozen=True, eq=False)
class Shell:
    """Points on a body's outside.

    Attributes
    ----------
    points : (k, 3) float
        The outermost points, displaced by 1e-4 so that no four are exactly
        coplanar or on one circle (a lattice would leave its triangulation to rounding).
    normals : (k, 3) float
        Outward unit normals.
    index : (k,) int
        Their place among the points they were taken from.
    """

    points: Floats
    normals: Floats
    index: Ints


def outer_shell(points: Floats, sigma: float, below: float) -> Shell:
    """Return the points where the blurred density falls below a share of its inner value.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in block sides: the spacing is about one along each axis.
    sigma : float
        Standard deviation of the density's blur.
    below : float
        Share of the inner density: 0.75 at the centroids of an outermost plane layer and 0.98
        in the next, so 0.9 takes one layer.

    Raises
    ------
    HullError
        Fewer than four points lie on the outside.
    """
    field = density_field(points, sigma)
    index = np.flatnonzero(field.share < below)
    if len(index) < 4:
        raise HullError("the body has no outer points to wrap; try hull 'density'")
    outer = points[index]
    return Shell(outer + tie_break(outer), field.outward(outer), index)
