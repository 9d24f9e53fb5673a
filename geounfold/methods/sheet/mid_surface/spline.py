"""Uniform bicubic B-splines on a plane grid: values, derivatives, energies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.mesh import Floats, Ints
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils, energy, gram

_CHUNK = 4096  # points evaluated at once, so that coefficients stay in the cache

_POWERS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6
"""Matrix from a cell's four B-spline coefficients to the coefficients of 1, f, f^2, f^3."""


class Jet(NamedTuple):
    """A spline's value and its derivatives to second order, each (n, d)."""

    value: Floats
    u: Floats
    v: Floats
    uu: Floats
    uv: Floats
    vv: Floats


def _weights(f: Floats, step: float, order: int) -> list[Floats]:
    """Return the four B-spline weights (n,) of a derivative at cell fractions f (n,)."""
    g = 1 - f
    if order == 0:
        ff, gg = f * f, g * g
        third, first = ff * f / 6, gg * g / 6
        return [first, 2 / 3 - ff + 3 * third, 2 / 3 - gg + 3 * first, third]
    if order == 1:
        ff, gg = f * f, g * g
        rows = [-gg / 2, 1.5 * ff - 2 * f, 2 * g - 1.5 * gg, ff / 2]
    else:
        rows = [g, 3 * f - 2, 3 * g - 2, f]
    return [row / step**order for row in rows]


def _horner(c: Floats, f: Floats, order: int) -> list[Floats]:
    """Return value and derivatives up to an order (at most 2) of cubics c (4, ..., n) at f (n,)."""
    value = c[3] * f
    slope, bend = (value.copy() if order >= 1 else value), c[3] * f if order == 2 else value
    value += c[2]
    out = [value]
    if order >= 1:
        slope += value
        out.append(slope)
    if order == 2:
        bend += slope
        bend *= 2
        out.append(bend)
    value *= f
    value += c[1]
    if order >= 1:
        slope *= f
        slope += value
    value *= f
    value += c[0]
    return out


def _cubics(grid: Floats, axis: int) -> Floats:
    """Return the cubics of all cells along an axis of B-spline coefficients, powers first."""
    n = grid.shape[axis] - 3
    windows = [grid.take(np.arange(q, q + n), axis=axis) for q in range(4)]
    return np.stack([sum(m * w for m, w in zip(row, windows, strict=True)) for row in _POWERS])


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

    def scaled(self, factor: float) -> SplineGrid:
        """Return the grid in another unit: lengths times a factor."""
        return SplineGrid(self.origin * factor, self.step * factor, self.shape)

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
        i = np.clip(q.astype(np.int64), 1, np.array(self.shape) - 3)
        return i, q - i

    def basis(self, U: Floats, du: int = 0, dv: int = 0) -> sp.csr_array:
        """Return the (n, size) matrix of the basis' derivatives at plane points U (n, 2)."""
        n, width = len(U), self.shape[1]
        near = (np.arange(4)[:, None] * width + np.arange(4)).astype(np.int32).ravel()
        data, columns = np.empty((n, 16)), np.empty((n, 16), dtype=np.int32)
        for k in range(0, n, _CHUNK):
            part = slice(k, k + _CHUNK)
            i, f = self._cells(U[part])
            bu, bv = _weights(f[:, 0], self.step, du), _weights(f[:, 1], self.step, dv)
            for q in range(16):
                np.multiply(bu[q // 4], bv[q % 4], out=data[part, q])
            first = ((i[:, 0] - 1) * width + i[:, 1] - 1).astype(np.int32)
            np.add(first[:, None], near, out=columns[part])
        pointer = np.arange(0, 16 * n + 1, 16, dtype=np.int32)
        return sp.csr_array((data.ravel(), columns.ravel(), pointer), shape=(n, self.size))

    def value(self, C: Floats, U: Floats) -> Floats:
        """Return the spline of coefficients C (size,) or (size, d) at U (n, 2)."""
        return self._evaluate(C, U, 0)[0]

    def jet(self, C: Floats, U: Floats) -> Jet:
        """Return value and derivatives to second order of coefficients C (size, d) at U."""
        return Jet(*self._evaluate(C, U, 2))

    def gradient(self, C: Floats, U: Floats) -> tuple[Floats, Floats, Floats]:
        """Return value and both first derivatives of coefficients C at U."""
        value, u, v = self._evaluate(C, U, 1)
        return value, u, v

    def _evaluate(self, C: Floats, U: Floats, order: int) -> list[Floats]:
        """Return value, u, v, uu, uv, vv up to an order, (n,) or (n, d) each, d outermost."""
        columns = C.reshape(self.size, -1)
        d = columns.shape[1]
        cubics = self._bicubics(columns)
        out = np.empty(((1, 3, 6)[order], d, len(U)))
        for k in range(0, len(U), _CHUNK):
            i, f = self._cells(U[k : k + _CHUNK])
            cell = (i[:, 0] - 1) * (self.shape[1] - 3) + i[:, 1] - 1
            fu, fv = np.ascontiguousarray(f.T)
            part = out[:, :, k : k + _CHUNK]
            in_v = _horner(cubics.take(cell, axis=-1), fv, order)
            for dv, c in enumerate(in_v):
                for du, values in enumerate(_horner(c, fu, order - dv)):
                    part[(du + dv) * (du + dv + 1) // 2 + dv] = values
        out[1:3] /= self.step
        out[3:] /= self.step**2
        return [a[0] for a in out] if C.ndim == 1 else [a.T for a in out]

    def _bicubics(self, C: Floats) -> Floats:
        """Return the bicubics of all cells for coefficients C (size, d), (4, 4, d, cells).

        The first index is the power of the cell's fraction along v, the second along u.
        """
        grid = C.T.reshape(-1, *self.shape)
        both = _cubics(_cubics(grid, 1), 3)
        return np.ascontiguousarray(both).reshape(4, 4, C.shape[1], -1)

    def energy(self, order: int) -> Stencils:
        """Return the quadratic form of all mixed differences of an order (rotation-weighted)."""
        return energy(self.shape, order)

    def gram(self, B: sp.csr_array, w: Floats) -> Stencils:
        """Return ``B.T @ diag(w) @ B`` of rows of the basis, w (n,) not negative."""
        return gram(B, w, self.shape)


def density_weights(U: Floats, cell: float) -> Floats:
    """Return one over the number of points in each point's square cell, (n,)."""
    k = np.floor((U - U.min(axis=0)) / cell).astype(np.int64)
    key = k[:, 0] * (k[:, 1].max() + 1) + k[:, 1]
    _, index, count = np.unique(key, return_inverse=True, return_counts=True)
    return 1.0 / count[index]
