"""Hull by screened Poisson reconstruction from the oriented outermost points (Kazhdan 2013)."""

from __future__ import annotations

import numpy as np

from geounfold.backends import meshlab
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull._finish import HullOptions, finish
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.outermost_points import outer_shell

CELL = 1.0  # block sides: side of the octree's smallest cell
DEEPEST = 10


def poisson_hull(points: Floats, sides: Floats, options: HullOptions) -> Hull:
    """Return the hull through the outermost centroids, by Poisson reconstruction.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, working units.
    sides : (3,) float
        Block sides along the axes, working units; the surface is made in ``points / sides``.
    options : HullOptions
        ``shell``, ``sigma``, ``smoothing`` and the remeshing are used.

    Raises
    ------
    HullError
        The surface is not closed (the normals are unreliable) or not manifold.
    """
    shell = outer_shell(points / sides, options.sigma, options.shell)
    V, F = poisson_surface(shell.points, shell.normals)
    return finish(
        V * sides,
        F,
        method="poisson",
        blocks=len(points),
        inset=0.5,
        blur=0.0,
        options=options,
        smoothing=options.smoothing,
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
