"""Wang's spring energy over a mesh's edges, its force and its Hessian."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.mesh import Floats, Ints


def spring_energy(uv: Floats, edges: Ints, rest: Floats) -> float:
    """Return E = sum over edges of C/2 (|P_i P_j| - d_j)^2, C = 1 (thesis section 2.2.4).

    Each edge counts once; the thesis's sum over vertices counts it twice.  C scales the energy
    and changes no minimum.
    """
    stretch = np.linalg.norm(uv[edges[:, 1]] - uv[edges[:, 0]], axis=1) - rest
    return float((stretch @ stretch) / 2)


def spring_forces(uv: Floats, edges: Ints, rest: Floats) -> Floats:
    """Return f(P_i) = sum_j (|P_i P_j| - d_j) n_ij, (n, 2): minus the energy's gradient.

    An edge of no length exerts no force.
    """
    along, length = _directions(uv, edges)
    pull = (length - rest)[:, None] * along
    n = len(uv)
    columns = [
        np.bincount(edges[:, 0], pull[:, k], n) - np.bincount(edges[:, 1], pull[:, k], n)
        for k in range(2)
    ]
    return np.column_stack(columns)


def spring_blocks(uv: Floats, edges: Ints, rest: Floats, convex: bool) -> Floats:
    """Return the second derivative of each spring, (k, 2, 2), for C = 1.

    ``e e' + (1 - d/l)(I - e e')``; with ``convex`` the negative part of shortened springs is left
    out.
    """
    e, length = _directions(uv, edges)
    across = 1 - rest / np.maximum(length, np.finfo(float).tiny)
    across = np.maximum(across, 0 if convex else -1e3)
    out: Floats = (1 - across)[:, None, None] * (e[:, :, None] * e[:, None, :])
    out[:, [0, 1], [0, 1]] += across[:, None]
    return out


def _directions(uv: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """Return unit vectors along the edges (zero for no length) and their lengths."""
    D = uv[edges[:, 1]] - uv[edges[:, 0]]
    length = np.hypot(D[:, 0], D[:, 1])
    return D / np.maximum(length, np.finfo(float).tiny)[:, None], length


class BlockPattern:
    """The sparsity of a (2n, 2n) matrix with 2 x 2 blocks at vertices and edges.

    Vertices are numbered in a fill-reducing order, so factors need no further ordering.

    Parameters
    ----------
    edges : (k, 2) int
        Vertex pairs.
    place : (n,) int
        Position of each vertex's block in the fill-reducing order.
    """

    def __init__(self, edges: Ints, place: Ints) -> None:
        n, k = len(place), len(edges)
        i, j = place[edges[:, 0]], place[edges[:, 1]]
        row = np.concatenate([np.arange(n), i, j])
        column = np.concatenate([np.arange(n), j, i])
        slot = np.empty(n + 2 * k, dtype=np.int64)
        # Converted by rows, then by columns, so that both are in order without a sort.
        entries = sp.coo_array((np.arange(n + 2 * k), (row, column)), shape=(n, n))
        slot[entries.tocsr().tocsc().data] = np.arange(n + 2 * k)
        count = np.bincount(column, minlength=n)
        start = np.concatenate([[0], np.cumsum(count)])
        inside = slot - start[column]
        # Place of entry (a, b) of every block in the data of the compressed columns.
        self._entry = {
            (a, b): 4 * start[column] + 2 * b * count[column] + 2 * inside + a
            for a in range(2)
            for b in range(2)
        }
        self._indptr = np.concatenate([[0], np.cumsum(np.repeat(2 * count, 2))]).astype(np.int32)
        self._rows = np.empty(4 * (n + 2 * k), dtype=np.int32)
        for (a, _), at in self._entry.items():
            self._rows[at] = 2 * row + a
        self._edges, self._place, self._n = edges, place, n

    def matrix(self, vertex: Floats, edge: Floats) -> sp.csc_array:
        """Return the symmetric matrix with blocks (n, 2, 2) and symmetric blocks (k, 2, 2)."""
        data = np.empty(len(self._rows))
        n, k = self._n, len(self._edges)
        for (a, b), at in self._entry.items():
            data[at[self._place]] = vertex[:, a, b]
            data[at[n : n + k]] = edge[:, a, b]
            data[at[n + k :]] = edge[:, b, a]
        return sp.csc_array((data, self._rows, self._indptr), shape=(2 * n, 2 * n))

    def stiffness(self, blocks: Floats) -> tuple[Floats, Floats]:
        """Return vertex and edge blocks of springs with second derivatives (k, 2, 2)."""
        n, E = self._n, self._edges
        vertex = np.empty((n, 2, 2))
        for a in range(2):
            for b in range(2):
                w = blocks[:, a, b]
                vertex[:, a, b] = np.bincount(E[:, 0], w, n) + np.bincount(E[:, 1], w, n)
        return vertex, -blocks

    def scatter(self, x: Floats) -> Floats:
        """Return vertex vectors (n, 2) as one (2n,) vector in the matrix's order."""
        out = np.empty((self._n, 2))
        out[self._place] = x
        return out.ravel()

    def gather(self, x: Floats) -> Floats:
        """Return a (2n,) vector of the matrix's order as vertex vectors (n, 2)."""
        out: Floats = x.reshape(-1, 2)[self._place]
        return out
