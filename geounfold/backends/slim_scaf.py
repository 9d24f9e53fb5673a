"""libigl's flattenings that never fold: SLIM, and scaffold maps whose border stays apart."""

from __future__ import annotations

from typing import Any

import igl
import numpy as np

from geounfold.errors import BackendError
from geounfold.geometry.mesh import Floats, Ints

#: Folded area that libigl's scaffold maps are given.  They weigh the scaffold by the symmetric
#: Dirichlet energy less 4, as if the area were 1: below that the weight can be negative, and the
#: answer is NaN; at 1 it is zero where nothing is strained.
_SCAFFOLD_AREA = 2.0


class SlimSteps:
    """SLIM (Rabinovich et al. 2017): steps of the symmetric Dirichlet energy without flips.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    uv : (n, 2) float
        Where to start: no triangle turned over.
    """

    def __init__(self, V: Floats, F: Ints, uv: Floats) -> None:
        self._unit, self._n = _unit(V, F, 1.0), len(V)
        self._data = _guarded(
            "slim_precompute", igl.slim_precompute, *_problem(V, F, uv, self._unit), 0.0
        )

    def __call__(self) -> Floats:
        """Return the positions after one more step, (n, 2).

        Raises
        ------
        BackendError
            libigl refused, or returned something that is not finite.
        """
        after = _guarded("slim_solve", igl.slim_solve, self._data, 1)
        return _finite(after, self._n, "slim_solve") * self._unit


class ScaffoldSteps:
    """Scaffold maps (Jiang, Schaefer, Panozzo 2017): SLIM steps on the surface and on a mesh
    of the plane around it and in its holes, so that neither folds and the border never meets
    itself.

    The mesh around is made by Triangle, which libigl ships in its module of restricted licence.
    ``uv`` must be one-to-one: Triangle ends the process where it finds no triangulation.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    uv : (n, 2) float
        Where to start: one-to-one.
    """  # noqa: D205

    def __init__(self, V: Floats, F: Ints, uv: Floats) -> None:
        import igl.triangle

        self._triangle, self._n = igl.triangle, len(V)
        self._unit = _unit(V, F, _SCAFFOLD_AREA)
        self._data = igl.triangle.SCAFData()
        _guarded(
            "scaf_precompute",
            igl.triangle.scaf_precompute,
            *_problem(V, F, uv, self._unit),
            0.0,
            self._data,
        )

    def __call__(self) -> Floats:
        """Return the positions after one more step, (n, 2).

        Raises
        ------
        BackendError
            libigl refused, or returned something that is not finite.
        """
        after = _guarded("scaf_solve", self._triangle.scaf_solve, 1, self._data)
        return _finite(after[: self._n, :2], self._n, "scaf_solve") * self._unit


def _unit(V: Floats, F: Ints, area: float) -> float:
    """Return the length that gives the triangles the given area when it is taken for one."""
    normals = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    return float(np.sqrt(np.linalg.norm(normals, axis=1).sum() / 2 / area))


def _problem(V: Floats, F: Ints, uv: Floats, unit: float) -> tuple[Any, ...]:
    """Return the arguments that both take: no vertex is held."""
    return (
        np.asfortranarray((V - V.mean(axis=0)) / unit, dtype=np.float64),
        np.asfortranarray(F, dtype=np.int32),
        np.asfortranarray(uv / unit, dtype=np.float64),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.zeros(0, dtype=np.int32),
        np.zeros((0, 2), order="F"),
    )


def _guarded(name: str, function: Any, *arguments: Any) -> Any:
    """Return what a function of libigl returns, its refusal renamed."""
    try:
        return function(*arguments)
    except RuntimeError as err:
        msg = f"libigl's {name} failed: {err}"
        raise BackendError(msg) from err


def _finite(uv: Any, n: int, name: str) -> Floats:
    """Return a copy of uv, or BackendError where it is not (n, 2) and finite."""
    out = np.array(uv, dtype=np.float64, order="C")
    if out.shape != (n, 2) or not np.isfinite(out).all():
        msg = f"libigl's {name} returned positions that are not finite"
        raise BackendError(msg)
    return out


class SlimTets:
    """SLIM on tetrahedra: steps of the symmetric Dirichlet energy that invert none.

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
        """Return the places after one step from V (n, 3), (n, 3).

        Parameters
        ----------
        V : (n, 3) float
            Where to start: no tetrahedron inverted.
        held : (k,) int
            Vertices that are drawn somewhere.
        wanted : (k, 3) float
            Where to.
        weight : float
            Of their mean square distance from there against the mean energy.

        Raises
        ------
        BackendError
            libigl refused, or returned something that is not finite.
        """
        data = _guarded(
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
        after = np.array(_guarded("slim_solve", igl.slim_solve, data, 1), order="C")
        if after.shape != self._V.shape or not np.isfinite(after).all():
            msg = "libigl's slim_solve returned positions that are not finite"
            raise BackendError(msg)
        return after * self._unit
