"""libigl's flattenings without flipped triangles: SLIM, and scaffold maps, one-to-one as well."""

from __future__ import annotations

from typing import Any

import igl
import numpy as np

from geounfold.backends.checks import call_libigl, finite_array
from geounfold.geometry.mesh import Floats, Ints

_SCAFFOLD_AREA = 2.0
"""Folded area to which surfaces are scaled for libigl's scaffold maps.

libigl weighs the scaffold by the symmetric Dirichlet energy less 4, as if the area were 1. Below
that the weight can be negative, and the answer is NaN. At 1 it is zero on an unstrained surface.
"""


class SlimSteps:
    """SLIM (Rabinovich et al. 2017): steps that lower the symmetric Dirichlet energy.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    uv : (n, 2) float
        Start positions without flipped triangles; no step flips one.
    """

    def __init__(self, V: Floats, F: Ints, uv: Floats) -> None:
        self._unit, self._n = _unit(V, F, 1.0), len(V)
        problem = _problem(V, F, uv, self._unit)
        self._data = call_libigl("slim_precompute", igl.slim_precompute, *problem, 0.0)

    def __call__(self) -> Floats:
        """Return the positions after one more step, (n, 2).

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        after = np.array(call_libigl("slim_solve", igl.slim_solve, self._data, 1), order="C")
        return finite_array(after, (self._n, 2), "slim_solve") * self._unit


class ScaffoldSteps:
    """Scaffold maps (Jiang, Schaefer, Panozzo 2017): SLIM steps that also keep the edge apart.

    The steps move the surface and a mesh of the plane around it and in its holes. Neither gets
    flipped triangles, so the surface's border never meets itself. The mesh of the plane is made by
    Triangle, which libigl ships in its module of restricted licence. Triangle ends the process if
    it finds no triangulation, as on a ``uv`` that is not one-to-one.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    uv : (n, 2) float
        Start positions, one-to-one.
    """

    def __init__(self, V: Floats, F: Ints, uv: Floats) -> None:
        import igl.triangle

        self._triangle, self._n = igl.triangle, len(V)
        self._unit = _unit(V, F, _SCAFFOLD_AREA)
        self._data = igl.triangle.SCAFData()
        problem = _problem(V, F, uv, self._unit)
        precompute = igl.triangle.scaf_precompute
        call_libigl("scaf_precompute", precompute, *problem, 0.0, self._data)

    def __call__(self) -> Floats:
        """Return the positions after one more step, (n, 2).

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        after = call_libigl("scaf_solve", self._triangle.scaf_solve, 1, self._data)
        after = np.array(after[: self._n, :2], order="C")
        return finite_array(after, (self._n, 2), "scaf_solve") * self._unit


def _unit(V: Floats, F: Ints, area: float) -> float:
    """Return the unit of length in which the triangles have the given area."""
    normals = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    return float(np.sqrt(np.linalg.norm(normals, axis=1).sum() / 2 / area))


def _problem(V: Floats, F: Ints, uv: Floats, unit: float) -> tuple[Any, ...]:
    """Return the arguments that SLIM and scaffold maps share; no vertex is held."""
    return (
        np.asfortranarray((V - V.mean(axis=0)) / unit, dtype=np.float64),
        np.asfortranarray(F, dtype=np.int32),
        np.asfortranarray(uv / unit, dtype=np.float64),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.zeros(0, dtype=np.int32),
        np.zeros((0, 2), order="F"),
    )


class SlimTets:
    """SLIM on tetrahedra: steps that lower the symmetric Dirichlet energy and invert none.

    Parameters
    ----------
    V : (n, 3) float
        Vertices at rest.
    T : (m, 4) int
        Tetrahedra.
    """

    def __init__(self, V: Floats, T: Ints) -> None:
        self._T = np.asfortranarray(T, dtype=np.int32)
        edges = V[T[:, 1:]] - V[T[:, :1]]
        self._unit = float(np.cbrt(np.linalg.det(edges).sum() / 6))
        self._V = np.asfortranarray((V - V.mean(axis=0)) / self._unit, dtype=np.float64)

    def __call__(self, V: Floats, held: Ints, wanted: Floats, weight: float) -> Floats:
        """Return the vertices after one step, (n, 3).

        Parameters
        ----------
        V : (n, 3) float
            Vertices before the step, no tetrahedron inverted.
        held : (k,) int
            Vertices that are pulled to given positions.
        wanted : (k, 3) float
            Those positions.
        weight : float
            Weight of their mean square distance from there, relative to the mean energy.

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        data = call_libigl(
            "slim_precompute",
            igl.slim_precompute,
            self._V,
            self._T,
            np.asfortranarray(V / self._unit, dtype=np.float64),
            igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
            np.ascontiguousarray(held, dtype=np.int32),
            np.asfortranarray(wanted / self._unit, dtype=np.float64),
            weight * self._unit**2 / len(held),
        )
        after = np.array(call_libigl("slim_solve", igl.slim_solve, data, 1), order="C")
        return finite_array(after, self._V.shape, "slim_solve") * self._unit
