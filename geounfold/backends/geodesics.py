"""libigl's geodesic distances on a surface, and its harmonic functions."""

from __future__ import annotations

import igl
import numpy as np

from geounfold.backends.checks import call_libigl, finite_array
from geounfold.geometry.mesh import Floats, Ints

_NONE = np.zeros(0, dtype=np.int64)


class SurfaceDistances:
    """Geodesic distances from one vertex to all vertices, in the vertices' unit.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    exact : bool
        True: shortest paths over the triangles (Mitchell et al. 1987), n^2 log n at worst. False:
        the heat method (Crane et al. 2013), which errs by about an edge length but factors once.

    Raises
    ------
    BackendError
        libigl failed.
    """

    def __init__(self, V: Floats, F: Ints, exact: bool) -> None:
        self._V = np.ascontiguousarray(V, dtype=np.float64)
        self._F = np.ascontiguousarray(F, dtype=np.int64)
        self._exact = exact
        if exact:
            return
        self._data = igl.HeatGeodesicsData()
        name = "heat_geodesics_precompute"
        call_libigl(name, igl.heat_geodesics_precompute, self._V, self._F, self._data)

    def __call__(self, vertex: int) -> Floats:
        """Return the distances from a vertex, (n,).

        Raises
        ------
        BackendError
            libigl failed, or returned distances that are not finite.
        """
        source, n = np.array([vertex], dtype=np.int64), len(self._V)
        if self._exact:
            name, targets = "exact_geodesic", np.arange(n)
            found = call_libigl(
                name, igl.exact_geodesic, self._V, self._F, source, _NONE, targets, _NONE
            )
        else:
            name = "heat_geodesics_solve"
            found = call_libigl(name, igl.heat_geodesics_solve, self._data, source)
        return finite_array(found, (n,), name)


def harmonic(V: Floats, F: Ints, fixed: Ints, values: Floats) -> Floats:
    """Return two harmonic functions on a surface, (n, 2), by cotangent weights.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    fixed : (k,) int
        Vertices where the functions are given.
    values : (k, 2) float
        The functions there.

    Raises
    ------
    BackendError
        libigl failed, or returned values that are not finite.
    """
    arrays = np.ascontiguousarray(V, dtype=np.float64), np.ascontiguousarray(F, dtype=np.int64)
    given = np.ascontiguousarray(fixed), np.array(values, order="C")
    found = call_libigl("harmonic", igl.harmonic, *arrays, *given, 1)
    return finite_array(found, (len(V), 2), "harmonic")
