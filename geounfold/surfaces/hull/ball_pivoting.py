"""Hull by ball pivoting over the oriented outermost points (Bernardini et al. 1999)."""

from __future__ import annotations

import numpy as np

from geounfold.backends import meshlab
from geounfold.backends.igl import boundary_loops
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull._finish import compact, largest_component
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.density import tie_break
from geounfold.surfaces.hull.outermost_points import hull_through

# Block sides, tried in this order.  None passes a gap of a lattice's surface, whose holes are 0.87
# wide; which one closes the surface depends on ties among cospherical points.
RADII = (1.2, 1.35, 1.05, 1.5)
LONGEST_HOLE = 400  # largest number of edges of a hole that is closed


def ball_pivoting_hull(points: Floats, sides: Floats, options: HullOptions) -> Hull:
    """Return the hull through the outermost centroids, by ball pivoting.

    Raises
    ------
    HullError
        The surface is not closed or not manifold after its holes were closed.
    """
    return hull_through(
        points,
        sides,
        options,
        "ball_pivoting",
        lambda s: ball_pivoting_surface(s.points, s.normals),
    )


def ball_pivoting_surface(points: Floats, normals: Floats) -> tuple[Floats, Ints]:
    """Return the triangles (V, F) on which a ball rests, repaired, with their holes closed.

    Parameters
    ----------
    points, normals : (n, 3) float
        Points on the outside of a body, block sides, and outward unit normals.
    """
    shaken = points + tie_break(points)
    for radius in RADII:
        V, F = meshlab.ball_pivoting(shaken, normals, radius)
        for _ in range(3):
            V, F = meshlab.repair_manifold(V, F)
            V, F = meshlab.orient_coherently(V, F)
            V, F = meshlab.close_holes(V, F, LONGEST_HOLE)
        V, F = compact(V, F[largest_component(F)])
        if not boundary_loops(F):
            break
    return V, np.ascontiguousarray(F)
