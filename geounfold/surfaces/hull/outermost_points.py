"""The outermost points of a body, with outward normals, and hulls through them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.errors import HullError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull._finish import finish
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.density import density_field, tie_break

#: Share of the inner density below which a point is outermost: it is 0.75 at the centroids of an
#: outermost plane layer and 0.98 in the next, so this takes one layer.
OUTER = 0.9


@dataclass(frozen=True, eq=False)
class Shell:
    """Points on the outside of a body.

    Attributes
    ----------
    points : (k, 3) float
        The outermost points, displaced by 1e-4 so that no four are exactly
        coplanar or on one circle (a lattice would leave its triangulation to rounding).
    normals : (k, 3) float
        Outward unit normals.
    index : (k,) int
        Rows of these points in the input.
    """

    points: Floats
    normals: Floats
    index: Ints


def outer_shell(points: Floats, blur: float, below: float = OUTER) -> Shell:
    """Return the points at which the blurred density is below a share of its inner value.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in block sides: the spacing is about one along each axis.
    blur : float
        Standard deviation of the density's blur.
    below : float
        Share of the inner density.

    Raises
    ------
    HullError
        Fewer than four points lie on the outside.
    """
    field = density_field(points, blur)
    index = np.flatnonzero(field.share < below)
    if len(index) < 4:
        raise HullError("the body has no outer points to wrap; try hull 'density'")
    outer = points[index]
    return Shell(outer + tie_break(outer), field.outward(outer), index)


def hull_through(
    points: Floats,
    sides: Floats,
    options: HullOptions,
    method: str,
    surface: Callable[[Shell], tuple[Floats, Ints]],
) -> Hull:
    """Return the hull through the outermost centroids by some method.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, working units.
    sides : (3,) float
        Block sides along the axes, working units; the surface is made in ``points / sides``.
    options : HullOptions
        ``blur`` finds the outermost points, ``edge`` is the hull's.
    method : str
        Key in HULLS.
    surface : callable
        ``surface(shell) -> (V, F)``: the triangles, in block sides.

    Raises
    ------
    HullError
        The body has no outermost points, or the surface is not closed or not manifold.
    """
    V, F = surface(outer_shell(points / sides, options.blur))
    hull = finish(V * sides, F, method=method, blocks=len(points), edge=options.edge, smooth=True)
    return replace(hull, inset=0.5)
