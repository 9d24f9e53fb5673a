"""Flattening by distances along the surface and classical scaling (Zigelman et al. 2002)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.geodesics import SurfaceDistances
from geounfold.errors import BackendError, FlatteningError, OptionError
from geounfold.flattening._classical_scaling import by_distances, to_landmarks
from geounfold.flattening._problem import Problem
from geounfold.flattening._result import Flattening
from geounfold.geometry.mesh import Floats

DISTANCES = ("auto", "exact", "heat")

#: Most vertices for which ``auto`` takes exact distances: their time grows with n^2 log n.
EXACT_UP_TO = 600

#: Least height of a triangle, as a share of the surface's median edge, for exact distances: on
#: needles libigl's exact_geodesic never returns (seen with an edge of 1 mm among edges of 1 km).
NEEDLE = 1e-3


@dataclass(frozen=True, kw_only=True)
class MdsOptions:
    """Options of ``mds``.

    Parameters
    ----------
    landmarks : int
        Vertices from which distances are measured, spread as far apart as can be; all vertices
        where there are no more than that.
    distances : str
        ``exact`` shortest paths, the ``heat`` method, or ``auto``: exact up to 600 vertices
        and where no triangle is a needle.
    """

    landmarks: int = 100
    distances: str = "auto"

    def __post_init__(self) -> None:
        if self.landmarks < 3:
            raise OptionError(f"mds: landmarks must be at least 3, but is {self.landmarks}")
        if self.distances not in DISTANCES:
            raise OptionError(
                f"mds: distances must be one of {', '.join(DISTANCES)}, but is {self.distances}"
            )


def mds(problem: Problem, start: Floats | None, options: MdsOptions) -> Flattening:
    """Flatten by classical scaling of distances along the surface (``_landmarks`` says how).

    Exact where the surface is developable and
    its flat image convex: elsewhere shortest paths bend round the border, and distances are
    shorter than in the plane.  Nothing bars triangles from folding.  A direct solve, so a start
    changes nothing.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Not used.
    options : MdsOptions
        See there.

    Returns
    -------
    Flattening
        ``energy`` is the mean squared error of the distances to the landmarks, in square units.
    """
    V, F = problem.mesh.V, problem.mesh.F
    needles = _needles(problem)
    if needles and options.distances == "exact":
        raise FlatteningError(
            f"mds: exact distances cannot be had over {needles} triangles that are needles; "
            "remesh the surface, or take distances by heat"
        )
    exact = options.distances != "heat" and not needles
    exact &= options.distances == "exact" or len(V) <= EXACT_UP_TO
    try:
        field = SurfaceDistances((V - V.mean(axis=0)) / problem.size, F, exact)
        chosen, D = to_landmarks(field, V, options.landmarks)
    except BackendError as err:
        raise FlatteningError(f"mds: {err}") from err
    return by_distances(problem, chosen, D * problem.size, "mds", "exact" if exact else "heat")


def _needles(problem: Problem) -> int:
    """Return the number of triangles too thin for exact distances."""
    sides = np.abs(problem.corners - np.roll(problem.corners, 1, axis=1))
    height = 2 * problem.areas / sides.max(axis=1)
    return int(np.count_nonzero(height < NEEDLE * np.median(problem.rest)))
