"""Normal equations of spline fits: symmetric matrices stored by stencils, with banded solvers.

Every matrix of a fit couples a coefficient of the grid with those a few places away, so it is
stored as one array per offset.  Assembly, sums and the banded factorisation are then dense, and
linear in the number of points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import comb

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from geounfold.backends.blas import one_thread
from geounfold.geometry.measures import unique_edges
from geounfold.geometry.mesh import Floats, Ints

Solve = Callable[[Floats], Floats]

_LARGEST_BAND = 60_000_000  # entries (half a gigabyte); a larger matrix is factored as sparse
_SLAB = 32  # points of one cell multiplied at once
_CHUNK = 16384  # points assembled at once, so that products stay in the cache


@dataclass(frozen=True, eq=False)
class Stencils:
    """A symmetric matrix over a grid of coefficients, by offsets.

    Attributes
    ----------
    shape : (int, int)
        Number of coefficients along each axis.
    values : mapping of (du, dv) to (size,) float
        For offsets with du > 0, or du = 0 and dv >= 0: the entry between the coefficients at (i, j)
        and (i + du, j + dv), zero if the latter is off the grid.
    """

    shape: tuple[int, int]
    values: Mapping[tuple[int, int], Floats]

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.shape[0] * self.shape[1]

    def __add__(self, other: Stencils) -> Stencils:
        """Return the sum of two matrices."""
        out = dict(self.values)
        for offset, value in other.values.items():
            out[offset] = out[offset] + value if offset in out else value
        return Stencils(self.shape, out)

    def __rmul__(self, factor: float) -> Stencils:
        """Return the matrix times a number."""
        return Stencils(self.shape, {o: factor * v for o, v in self.values.items()})

    def __matmul__(self, x: Floats) -> Floats:
        """Return the matrix times vectors x, (size,) or (size, d)."""
        out = np.zeros_like(x, dtype=np.float64)
        for step, value in self._steps():
            v = value if x.ndim == 1 else value[:, None]
            out[step:] += (v * x)[: self.size - step] if step else v * x
            if step:
                out[:-step] += v[:-step] * x[step:]
        return out

    def _steps(self) -> Iterator[tuple[int, Floats]]:
        for (du, dv), value in self.values.items():
            yield du * self.shape[1] + dv, value

    def between(self, nodes: Floats) -> Stencils:
        """Return an energy of surfaces as one of displacements along the normals (size, 3)."""
        x = np.ascontiguousarray(nodes.T)
        out = {}
        for (du, dv), value in self.values.items():
            step = du * self.shape[1] + dv
            turned = value.copy()
            cos = sum(c[step:] * c[: self.size - step] for c in x)
            turned[: self.size - step] *= cos
            out[du, dv] = turned
        return Stencils(self.shape, out)

    def sparse(self) -> sp.csc_array:
        """Return the whole matrix."""
        total = sp.csc_array((self.size, self.size))
        for step, value in self._steps():
            lower = sp.diags_array(value[: self.size - step], offsets=-step)
            total = total + (lower + lower.T if step else lower)
        return sp.csc_array(total)

    def solver(self, ridge: float = 0.0) -> Solve:
        """Factor the positive definite matrix plus ``ridge`` on its diagonal, once."""
        width = max(step for step, _ in self._steps())
        if (width + 1) * self.size > _LARGEST_BAND:
            return spd_solver(sp.csc_array(self.sparse() + ridge * sp.eye_array(self.size)))
        band = np.zeros((width + 1, self.size), order="F")
        for step, value in self._steps():
            band[step] += value
        band[0] += ridge
        try:
            return banded_solver(band)
        except LinAlgError:  # not positive definite, to rounding
            return spd_solver(sp.csc_array(self.sparse() + ridge * sp.eye_array(self.size)))


def banded_solver(band: Floats) -> Solve:
    """Factor a symmetric positive definite matrix given by its lower band, which is overwritten.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is not positive definite.
    """
    with one_thread():
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)

    def solve(b: Floats) -> Floats:
        with one_thread():
            out: Floats = cho_solve_banded((factor, True), b, check_finite=False)
        return out

    return solve


def spd_solver(A: sp.csr_array | sp.csc_array | sp.coo_array) -> Solve:
    """Factor a symmetric positive definite matrix once; the result solves ``A x = b``."""
    options = {"SymmetricMode": True}
    lu = spl.splu(
        sp.csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
    )
    solve: Solve = lu.solve
    return solve


def graph_laplacian(F: Ints, n: int) -> sp.csr_array:
    """Return the Laplacian (n, n) of the graph of a triangulation's edges."""
    E = unique_edges(F)
    half = sp.coo_array((np.ones(len(E)), (E[:, 0], E[:, 1])), shape=(n, n)).tocsr()
    A = sp.csr_array(half + half.T)
    return sp.csr_array(sp.diags_array(np.asarray(A.sum(axis=1)).ravel()) - A)


def coupled_solver(first: Stencils, second: Stencils, cross: sp.csr_array, ridge: float) -> Solve:
    """Factor ``[[first, cross], [cross.T, second]]`` plus a ridge, for vectors (2 size,).

    Coefficients of the two fields alternate, so that the matrix is banded.
    """
    n = first.size
    entries = cross.tocoo()
    row, column = 2 * entries.row.astype(np.int64), 2 * entries.col.astype(np.int64) + 1
    low, high = np.minimum(row, column), np.maximum(row, column)
    steps = [step for s in (first, second) for step, _ in s._steps()]
    width = max(2 * max(steps), int((high - low).max(initial=0)))
    if (width + 1) * 2 * n > _LARGEST_BAND:
        whole = sp.block_array(
            [[first.sparse(), sp.csc_array(cross)], [sp.csc_array(cross.T), second.sparse()]]
        )
        return spd_solver(sp.csc_array(whole + ridge * sp.eye_array(2 * n)))
    band = np.zeros((width + 1, 2 * n), order="F")
    for field, matrix in enumerate((first, second)):
        for step, value in matrix._steps():
            band[2 * step, field::2] += value
    band[high - low, low] += entries.data
    band[0] += ridge
    solve = banded_solver(band)

    def alternate(b: Floats) -> Floats:
        x = solve(b.reshape(2, n).T.ravel())
        out: Floats = x.reshape(n, 2).T.ravel()
        return out

    return alternate


def energy(shape: tuple[int, int], order: int) -> Stencils:
    """Return the quadratic form of all mixed differences of an order (rotation-weighted)."""
    values: dict[tuple[int, int], Floats] = {}
    for k in range(order + 1):
        along_u, along_v = _squared(shape[0], k), _squared(shape[1], order - k)
        for du in range(k + 1):
            for dv in range(-(order - k), order - k + 1):
                if du == 0 and dv < 0:
                    continue
                v = np.roll(along_v[-dv], -dv) if dv < 0 else along_v[dv]
                term = comb(order, k) * np.multiply.outer(along_u[du], v).ravel()
                values[du, dv] = values[du, dv] + term if (du, dv) in values else term
    return Stencils(shape, values)


def _squared(n: int, order: int) -> Floats:
    """Return the lower diagonals of D^T D, D the n - order differences of an order.

    Row d holds the entries between coefficients j and j + d, (order + 1, n), zero past the end.
    """
    stencil = np.array([(-1.0) ** (order - i) * comb(order, i) for i in range(order + 1)])
    out = np.zeros((order + 1, n))
    for d in range(order + 1):
        for i in range(order + 1 - d):
            out[d, i : i + n - order] += stencil[i] * stencil[i + d]
    return out


def gram(B: sp.csr_array, w: Floats, shape: tuple[int, int]) -> Stencils:
    """Return ``B.T @ diag(w) @ B`` of basis rows (SplineGrid.basis), w (n,) not negative.

    Points are grouped by cell: all rows of a cell have the same 16 columns.
    """
    rows, first = B.data.reshape(-1, 16), B.indices[::16].astype(np.int64)
    order = np.argsort(first, kind="stable")
    width, size = shape[1], shape[0] * shape[1]
    place = (np.arange(4)[:, None] * width + np.arange(4)).ravel()
    pairs = [(a, b) for a in range(16) for b in range(a, 16)]
    offsets = [(b // 4 - a // 4, b % 4 - a % 4) for a, b in pairs]
    values = {offset: np.zeros(size) for offset in offsets}
    for k in range(0, len(order), _CHUNK):
        part = order[k : k + _CHUNK]
        cells, products = _cell_products(rows[part], np.sqrt(w[part]), first[part])
        for (a, b), offset in zip(pairs, offsets, strict=True):
            values[offset][cells + place[a]] += products[:, a, b]
    return Stencils(shape, values)


def _cell_products(rows: Floats, weight: Floats, cell: Ints) -> tuple[Ints, Floats]:
    """Return the cells of rows sorted by cell, and the sum over each of (w r)(w r)^T."""
    new = np.flatnonzero(np.diff(cell, prepend=-1))
    count = np.diff(new, append=len(cell))
    slabs = -(-count // _SLAB)
    start = np.concatenate([[0], np.cumsum(slabs)])
    within = np.arange(len(cell)) - np.repeat(new, count)
    padded = np.zeros((start[-1] * _SLAB, 16))
    padded[np.repeat(start[:-1] * _SLAB, count) + within] = rows * weight[:, None]
    stack = padded.reshape(-1, _SLAB, 16)
    products = np.matmul(stack.transpose(0, 2, 1), stack)
    return cell[new], np.add.reduceat(products, start[:-1], axis=0)
