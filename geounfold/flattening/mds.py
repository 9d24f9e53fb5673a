"""Flattening by distances along the surface and classical scaling (Zigelman et al. 2002)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.geodesics import SurfaceDistances
from geounfold.errors import BackendError, FlatteningError, check_whole
from geounfold.flattening._classical_scaling import by_distances, to_landmarks
from geounfold.flattening._problem import Problem
from geounfold.flattening._result import Flattening
from geounfold.geometry.mesh import Floats

#: Largest number of vertices with exact shortest paths, whose time grows with n^2 log n; above it
#: the heat method computes the distances.
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
        Number of vertices from which distances are measured, spread as far apart as possible; all
        vertices if there are fewer.
    """

    landmarks: int = 100

    def __post_init__(self) -> None:
        check_whole("flattener_options.landmarks", self.landmarks, 3)


def mds(problem: Problem, start: Floats | None, options: MdsOptions) -> Flattening:
    """Flatten by classical scaling of distances along the surface (see ``_classical_scaling``).

    Exact if the surface is developable and its flat image is convex.  If the image is not convex,
    shortest paths bend around the border and are longer than in the plane.  Triangles may fold.  It
    is a direct solve, so a start has no effect.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Not used.
    options : MdsOptions
        Number of landmarks.

    Returns
    -------
    Flattening
        ``energy`` is the mean squared error of the distances to the landmarks, in square units.
    """
    V, F = problem.mesh.V, problem.mesh.F
    exact = len(V) <= EXACT_UP_TO and not _has_needles(problem)
    try:
        field = SurfaceDistances((V - V.mean(axis=0)) / problem.size, F, exact)
        chosen, D = to_landmarks(field, V, options.landmarks)
    except BackendError as err:
        raise FlatteningError(f"mds: {err}") from err
    return by_distances(problem, chosen, D * problem.size, "mds", "exact" if exact else "heat")


def _has_needles(problem: Problem) -> bool:
    """Return whether a triangle is too thin for exact distances."""
    sides = np.abs(problem.corners - np.roll(problem.corners, 1, axis=1))
    height = 2 * problem.areas / sides.max(axis=1)
    return bool((height < NEEDLE * np.median(problem.rest)).any())
