"""libigl's distances along a surface and its harmonic functions."""

from __future__ import annotations

import igl
import numpy as np

from geounfold.errors import BackendError
from geounfold.geometry.mesh import Floats, Ints

_NONE = np.zeros(0, dtype=np.int64)


class SurfaceDistances:
    """Distances along a surface from a vertex to all vertices.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    exact : bool
        Shortest paths over the triangles (Mitchell et al. 1987; n^2 log n at worst), or the heat
        method (Crane et al. 2013), which errs by about an edge length but factors once.
    """

    def __init__(self, V: Floats, F: Ints, exact: bool) -> None:
        self._V = np.ascontiguousarray(V, dtype=np.float64)
        self._F = np.ascontiguousarray(F, dtype=np.int64)
        self._exact = exact
        if exact:
            return
        self._data = igl.HeatGeodesicsData()
        try:
            igl.heat_geodesics_precompute(self._V, self._F, self._data)
        except RuntimeError as err:
            msg = f"libigl's heat_geodesics_precompute failed: {err}"
            raise BackendError(msg) from err

    def __call__(self, vertex: int) -> Floats:
        """Return the distances from a vertex, (n,).

        Raises
        ------
        BackendError
            libigl refused, or returned distances that are not finite.
        """
        source, n = np.array([vertex], dtype=np.int64), len(self._V)
        name = "exact_geodesic" if self._exact else "heat_geodesics_solve"
        try:
            if self._exact:
                found = igl.exact_geodesic(self._V, self._F, source, _NONE, np.arange(n), _NONE)
            else:
                found = igl.heat_geodesics_solve(self._data, source)
        except RuntimeError as err:
            msg = f"libigl's {name} failed: {err}"
            raise BackendError(msg) from err
        return _finite(np.asarray(found, dtype=np.float64), (n,), name)


def harmonic(V: Floats, F: Ints, fixed: Ints, values: Floats) -> Floats:
    """Return the harmonic functions (n, 2), cotangent weights, with given values on ``fixed``.

    Raises
    ------
    BackendError
        libigl refused, or returned something that is not finite.
    """
    arrays = np.ascontiguousarray(V, dtype=np.float64), np.ascontiguousarray(F, dtype=np.int64)
    try:
        found = igl.harmonic(*arrays, np.ascontiguousarray(fixed), np.array(values, order="C"), 1)
    except RuntimeError as err:
        msg = f"libigl's harmonic failed: {err}"
        raise BackendError(msg) from err
    return _finite(np.asarray(found, dtype=np.float64), (len(V), 2), "harmonic")


def _finite(values: Floats, shape: tuple[int, ...], name: str) -> Floats:
    """Return the values, or BackendError where they are not finite or of another shape."""
    if values.shape != shape or not np.isfinite(values).all():
        msg = f"libigl's {name} returned values that are not finite"
        raise BackendError(msg)
    return values
