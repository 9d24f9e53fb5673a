"""Hull by screened Poisson reconstruction from the oriented outermost points (Kazhdan 2013)."""

from __future__ import annotations

import numpy as np

from geounfold.backends import meshlab
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.outermost_points import hull_through

CELL = 1.0  # block sides: side of the octree's smallest cell
DEEPEST = 10


def poisson_hull(points: Floats, sides: Floats, options: HullOptions) -> Hull:
    """Return the hull through the outermost centroids, by Poisson reconstruction.

    Raises
    ------
    HullError
        The surface is not closed (the normals are unreliable) or not manifold.
    """
    return hull_through(
        points, sides, options, "poisson", lambda s: poisson_surface(s.points, s.normals)
    )


def poisson_surface(points: Floats, normals: Floats) -> tuple[Floats, Ints]:
    """Return the zero surface (V, F) of the indicator whose gradient fits the normals.

    Parameters
    ----------
    points, normals : (n, 3) float
        Points on the outside of a body, block sides, and outward unit normals.
    """
    extent = 1.1 * float(np.ptp(points, axis=0).max())
    depth = int(np.clip(np.ceil(np.log2(extent / CELL)), 4, DEEPEST))
    return meshlab.poisson(points, normals, depth)
