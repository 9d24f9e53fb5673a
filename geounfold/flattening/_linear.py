"""Sparse symmetric systems over a mesh's vertices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from geounfold.geometry.mesh import Floats, Ints


def factor(matrix: sp.csc_array, ordered: bool = False) -> spl.SuperLU:
    """Return the sparse factors of a symmetric matrix, pivots taken from the diagonal.

    Parameters
    ----------
    matrix : (n, n) sparse
        Symmetric; positive definite for a stable answer.
    ordered : bool
        True if the rows are already in a fill-reducing order.
    """
    return spl.splu(
        matrix,
        permc_spec="NATURAL" if ordered else "MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def incidence(edges: Ints, n: int) -> sp.csr_array:
    """Return the signed incidence matrix of edges, (k, n): -1 at the first end, +1 at the other."""
    k = len(edges)
    rows = np.arange(0, 2 * k + 1, 2)
    return sp.csr_array((np.tile([-1.0, 1.0], k), edges.ravel(), rows), shape=(k, n))


def edge_laplacian(edges: Ints, weights: Floats, n: int) -> sp.csc_array:
    """Return the (n, n) matrix of ``sum w (x_i - x_j)^2`` over the edges, (k, 2), each one once."""
    i, j = edges.T
    diagonal = np.bincount(i, weights, n) + np.bincount(j, weights, n)
    data = np.concatenate([diagonal, -weights, -weights])
    row, column = np.concatenate([np.arange(n), i, j]), np.concatenate([np.arange(n), j, i])
    return sp.csc_array((data, (row, column)), shape=(n, n))


class PinnedSolver:
    """Solves ``L x = b`` (b sums to zero) with x[0] = 0, for a Laplacian L factored once.

    Parameters
    ----------
    laplacian : (n, n) sparse
        Symmetric, its rows sum to zero.

    Attributes
    ----------
    place : (n,) int
        Position of each vertex in a fill-reducing order; vertex 0 comes last.
    """

    place: Ints

    def __init__(self, laplacian: sp.csc_array) -> None:
        n = laplacian.shape[0]
        self._factors = factor(sp.csc_array(laplacian[1:, 1:]))
        self.place = np.empty(n, dtype=np.int64)
        self.place[1:] = self._factors.perm_c
        self.place[0] = n - 1

    def solve(self, b: Floats) -> Floats:
        """Return x for one or several right-hand sides, (n,) or (n, k)."""
        out = np.zeros_like(b)
        out[1:] = self._factors.solve(np.ascontiguousarray(b[1:]))
        return out


def preconditioned_solve(
    matrix: sp.csc_array,
    load: Floats,
    precondition: Callable[[Floats], Floats],
    tol: float = 1e-5,
    max_iter: int = 20,
) -> Floats | None:
    """Return ``matrix^-1 load`` by conjugate gradients, preconditioned by an earlier factoring.

    Returns
    -------
    (n,) float or None
        The solution with a residual of at most ``tol`` of the load's, measured in the
        preconditioner; None if that takes more than ``max_iter`` steps, or if the matrix or the
        preconditioner is not positive definite.
    """
    x, residual = np.zeros_like(load), load.copy()
    z = precondition(residual)
    direction, rho = z, float(residual @ z)
    limit = tol**2 * rho
    for _ in range(max_iter):
        image = matrix @ direction
        curvature = float(direction @ image)
        if not (rho > 0 and curvature > 0):
            return None
        x += (rho / curvature) * direction
        residual -= (rho / curvature) * image
        z = precondition(residual)
        before, rho = rho, float(residual @ z)
        if abs(rho) <= limit:
            return x
        direction = z + (rho / before) * direction
    return None
