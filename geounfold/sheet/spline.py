"""Uniform bicubic B-splines on a plane grid: values, derivatives, energies, solvers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from geounfold.mesh import Floats, Ints

_CHUNK = 65536


class Jet(NamedTuple):
    """A spline's value and its derivatives to second order, each (n, d)."""

    value: Floats
    u: Floats
    v: Floats
    uu: Floats
    uv: Floats
    vv: Floats


def _weights(f: Floats, step: float, order: int) -> Floats:
    """Return the four B-spline weights (n, 4) of a derivative at cell fractions f (n,)."""
    g = 1 - f
    if order == 0:
        rows = [g**3 / 6, (3 * f**3 - 6 * f**2 + 4) / 6, (3 * g**3 - 6 * g**2 + 4) / 6, f**3 / 6]
        scale = 1.0
    elif order == 1:
        rows = [-(g**2) / 2, (3 * f**2 - 4 * f) / 2, (4 * g - 3 * g**2) / 2, f**2 / 2]
        scale = step
    else:
        rows = [g, 3 * f - 2, 3 * g - 2, f]
        scale = step**2
    return np.stack(rows, axis=1) / scale


def _differences(n: int, order: int) -> sp.csr_array:
    """Return the (n - order, n) matrix of forward differences of an order."""
    D = sp.eye_array(n, format="csr")
    for _ in range(order):
        D = (D[1:] - D[:-1]).tocsr()
    return D


@dataclass(frozen=True, eq=False)
class SplineGrid:
    """A uniform cubic B-spline basis over the rectangle ``low``..``high`` of the plane.

    Attributes
    ----------
    origin : (2,) float
        Position of the first coefficient.
    step : float
        Knot spacing, working units.
    shape : (int, int)
        Number of coefficients along each axis.
    """

    origin: Floats
    step: float
    shape: tuple[int, int]

    @staticmethod
    def over(low: Floats, high: Floats, step: float) -> SplineGrid:
        """Return the grid whose splines are complete over a rectangle."""
        n = np.ceil((high - low) / step).astype(int) + 5
        return SplineGrid(low - 2 * step, step, (int(n[0]), int(n[1])))

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.shape[0] * self.shape[1]

    @cached_property
    def nodes(self) -> Floats:
        """Position of every coefficient (its Greville point), (size, 2)."""
        i, j = np.indices(self.shape)
        return self.origin + self.step * np.stack([i.ravel(), j.ravel()], axis=1)

    def _cells(self, U: Floats) -> tuple[Ints, Floats]:
        q = (U - self.origin) / self.step
        i = np.clip(np.floor(q).astype(np.int64), 1, np.array(self.shape) - 3)
        return i, q - i

    def _columns(self, i: Ints) -> Ints:
        reach = np.arange(-1, 3)
        rows = i[:, :1] + reach
        cols = i[:, 1:] + reach
        return (rows[:, :, None] * self.shape[1] + cols[:, None, :]).reshape(len(i), 16)

    def basis(self, U: Floats, du: int = 0, dv: int = 0) -> sp.csr_array:
        """Return the (n, size) matrix of the basis' derivatives at plane points U (n, 2)."""
        i, f = self._cells(U)
        bu, bv = _weights(f[:, 0], self.step, du), _weights(f[:, 1], self.step, dv)
        w = (bu[:, :, None] * bv[:, None, :]).reshape(-1)
        pointer = np.arange(0, 16 * len(U) + 1, 16)
        return sp.csr_array((w, self._columns(i).ravel(), pointer), shape=(len(U), self.size))

    def value(self, C: Floats, U: Floats) -> Floats:
        """Return the spline of coefficients C (size,) or (size, d) at U (n, 2)."""
        return self._evaluate(C, U, ((0, 0),))[0]

    def jet(self, C: Floats, U: Floats) -> Jet:
        """Return value and derivatives to second order of coefficients C (size, d) at U."""
        return Jet(*self._evaluate(C, U, ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))))

    def gradient(self, C: Floats, U: Floats) -> tuple[Floats, Floats, Floats]:
        """Return value and both first derivatives of coefficients C at U."""
        value, u, v = self._evaluate(C, U, ((0, 0), (1, 0), (0, 1)))
        return value, u, v

    def _evaluate(self, C: Floats, U: Floats, orders: tuple[tuple[int, int], ...]) -> list[Floats]:
        columns = C.reshape(self.size, -1)
        out = [np.empty((len(U), columns.shape[1])) for _ in orders]
        for k in range(0, len(U), _CHUNK):
            i, f = self._cells(U[k : k + _CHUNK])
            local = columns[self._columns(i)].reshape(len(i), 4, 4, -1)
            rows = {
                d: np.einsum("npqd,nq->npd", local, _weights(f[:, 1], self.step, d))
                for d in {dv for _, dv in orders}
            }
            for target, (du, dv) in zip(out, orders, strict=True):
                w = _weights(f[:, 0], self.step, du)
                target[k : k + _CHUNK] = np.einsum("npd,np->nd", rows[dv], w)
        return [a[:, 0] for a in out] if C.ndim == 1 else out

    def energy(self, order: int) -> sp.csc_array:
        """Return the quadratic form of all mixed differences of an order (rotation-weighted)."""
        total = sp.csc_array((self.size, self.size))
        for k in range(order + 1):
            M = sp.kron(_differences(self.shape[0], k), _differences(self.shape[1], order - k))
            total = total + comb(order, k) * (M.T @ M)
        return sp.csc_array(total)


def spd_solver(A: sp.csr_array | sp.csc_array | sp.coo_array) -> Callable[[Floats], Floats]:
    """Factor a symmetric positive definite matrix once; the result solves ``A x = b``."""
    options = {"SymmetricMode": True}
    lu = spl.splu(
        sp.csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
    )
    solve: Callable[[Floats], Floats] = lu.solve
    return solve


def density_weights(U: Floats, cell: float) -> Floats:
    """Return one over the number of points in each point's square cell, (n,)."""
    k = np.floor((U - U.min(axis=0)) / cell).astype(np.int64)
    key = k[:, 0] * (k[:, 1].max() + 1) + k[:, 1]
    _, index, count = np.unique(key, return_inverse=True, return_counts=True)
    return 1.0 / count[index]
