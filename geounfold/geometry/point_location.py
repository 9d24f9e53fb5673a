"""Point location in tetrahedra: a walk from a nearby tetrahedron, for many points at a time.

The walk of every point starts in a tetrahedron found by a grid. Each step crosses the face beyond
which the point lies farthest, until there is no such face. Most walks take one or two steps, each a
few multiplications for thousands of points at a time. libigl locates the points whose walk leaves
through the border (as at a fold's inner side) or does not end. libigl is the reference: the answers
agree, except for points on a face, for which either side is right.

A point's answer depends only on the point and the tetrahedra, not on other points in the call.
"""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Floats, Ints, Numbers

ON_FACE = 1e-12
"""Rounding on a face: a barycentric coordinate above minus this counts as not negative."""

STEPS = 24
"""Largest number of tetrahedra that a walk crosses."""

CELLS = 1 << 22  # largest number of cells of the grid
_PER_CELL = 1.5  # mean number of tetrahedra in a grid's cell, over cells that are not empty
_GROWTH = 2  # number of times that tetrahedra are spread into neighbouring empty cells

_LONGEST = 2048  # largest number of cells along an axis

Columns = tuple[Floats, Floats, Floats]


class TetWalk:
    """Tetrahedra indexed for point location.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    T : (m, 4) int
        Tetrahedra, glued face to face; flat ones hold no point.
    """

    def __init__(self, V: Floats, T: Ints) -> None:
        self._corner = [np.ascontiguousarray(column) for column in V[T[:, 0]].T]
        self._rows = [np.ascontiguousarray(row) for row in _inverse_edges(V, T)]
        self._across = [np.ascontiguousarray(column) for column in _across(T).T]
        self._grid = _Grid(V, T)

    def locate(self, x: Floats, y: Floats, z: Floats) -> tuple[Numbers, Floats]:
        """Return the tetrahedron of each point, (k,), -1 if the walk found none.

        Also the barycentric coordinates of the second to fourth corner, (3, k), 0 where
        it found none.
        """
        element = self._grid.start(x, y, z)
        weights = np.zeros((3, len(x)))
        found = np.full(len(x), -1, dtype=np.int32)
        rows = np.flatnonzero(element >= 0)
        every = len(rows) == len(x)
        element = element if every else element[rows]
        for _ in range(STEPS):
            if not len(rows):
                break
            p = (x, y, z) if every else (x[rows], y[rows], z[rows])
            w1, w2, w3 = self.weights(element, *p)
            w0 = 1.0 - (w1 + w2 + w3)
            low = np.minimum(np.minimum(w0, w1), np.minimum(w2, w3))
            held = low >= -ON_FACE
            if every and held.all():
                weights[0], weights[1], weights[2] = w1, w2, w3
                return element, weights
            here = rows[held]
            found[here] = element[held]
            for k, w in enumerate((w1, w2, w3)):
                weights[k, here] = w[held]
            on = ~held
            rows, element, low = rows[on], element[on], low[on]
            w1, w2, w3 = w1[on], w2[on], w3[on]
            a0, a1, a2, a3 = self._across
            element = np.where(
                w1 == low,
                a1[element],
                np.where(w2 == low, a2[element], np.where(w3 == low, a3[element], a0[element])),
            )
            alive = element >= 0
            rows, element = rows[alive], element[alive]
            every = False
        return found, weights

    def weights(self, element: Numbers, x: Floats, y: Floats, z: Floats) -> Columns:
        """Return barycentric coordinates of the second to fourth corner, (k,) each.

        Parameters
        ----------
        element : (k,) int
            The tetrahedron for each point.
        x, y, z : (k,) float
            The points.
        """
        a, b, c = (column.take(element) for column in self._corner)
        np.subtract(x, a, out=a)
        np.subtract(y, b, out=b)
        np.subtract(z, c, out=c)
        out = []
        for k in range(0, 9, 3):
            w = self._rows[k].take(element)
            w *= a
            v = self._rows[k + 1].take(element)
            v *= b
            w += v
            v = self._rows[k + 2].take(element)
            v *= c
            w += v
            out.append(w)
        return out[0], out[1], out[2]


def _inverse_edges(V: Floats, T: Ints) -> Floats:
    """Return, (9, m), the rows that give three barycentric coordinates from ``x - corner``."""
    a, b, c = (V[T[:, k]] - V[T[:, 0]] for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = np.einsum("ij,ij->i", a, bc)
    volume[volume == 0] = np.nan  # NaN fails every comparison, so a flat tetrahedron holds no point
    out: Floats = np.concatenate([bc.T, ca.T, ab.T]) / volume
    return out


def _across(T: Ints) -> Numbers:
    """Return the tetrahedron behind the face opposite each corner, (m, 4); -1 at the border."""
    F = np.sort(T[:, [1, 2, 3, 0, 2, 3, 0, 1, 3, 0, 1, 2]].reshape(-1, 3), axis=1)
    n = int(T.max(initial=0)) + 1
    if n**3 < 2**63:
        keys = (F[:, 0] * n + F[:, 1]) * n + F[:, 2]
        order = np.argsort(keys, kind="stable")
        same = keys[order[1:]] == keys[order[:-1]]
    else:
        order = np.lexsort(F.T[::-1])
        same = (F[order[1:]] == F[order[:-1]]).all(axis=1)
    first = np.flatnonzero(same)
    a, b = order[first], order[first + 1]
    out = np.full(len(F), -1, dtype=np.int32)
    out[a], out[b] = b // 4, a // 4
    return out.reshape(-1, 4)


class _Grid:
    """A nearby tetrahedron for every place: one for each cell of a grid over the vertices."""

    def __init__(self, V: Floats, T: Ints) -> None:
        low, high = V.min(axis=0), V.max(axis=0)
        middle = V[T].mean(axis=1)
        size = self._size(low, high, middle)
        self._low, self._size_inverse = low - _GROWTH * size, 1.0 / size
        self._shape = np.floor((high - self._low) / size).astype(np.int32) + 1 + _GROWTH
        grid = np.full(int(np.prod(self._shape, dtype=np.int64)), -1, dtype=np.int32)
        # The last write to a cell is kept: corners first, so that middles override them.
        for k in range(4):
            grid[self._cell(*V[T[:, k]].T)] = np.arange(len(T), dtype=np.int32)
        grid[self._cell(*middle.T)] = np.arange(len(T), dtype=np.int32)
        grid = grid.reshape(self._shape)
        for _ in range(_GROWTH):
            _spread(grid)
        self._nearest = grid.ravel()

    @staticmethod
    def _size(low: Floats, high: Floats, middle: Floats) -> float:
        """Return the side of the cells: about _PER_CELL middles in a cell that is not empty."""
        extent = np.maximum(high - low, 1e-9 * float((high - low).max()))
        size = float(np.cbrt(extent.prod() * _PER_CELL / len(middle)))
        least = max(float(np.cbrt(extent.prod() / CELLS)), float(extent.max()) / _LONGEST)
        for _ in range(8):  # most of the box around a folded sheet is empty
            cells = np.floor((middle - low) / size).astype(np.int64)
            shape = np.floor(extent / size).astype(np.int64) + 1
            held = len(np.unique((cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]))
            if size <= least or len(middle) < 2 * _PER_CELL * held:
                break
            size *= 0.7
        return max(size, least)

    def _cell(self, x: Floats, y: Floats, z: Floats) -> Numbers:
        """Return the number of the cell that holds each place; places must lie in the grid."""
        number = np.zeros(len(x), dtype=np.int32)
        for axis, column in enumerate((x, y, z)):
            number *= self._shape[axis]
            number += (self._size_inverse * (column - self._low[axis])).astype(np.int32)
        return number

    def start(self, x: Floats, y: Floats, z: Floats) -> Numbers:
        """Return a tetrahedron near each place, (k,); -1 if it is far from all."""
        number = np.zeros(len(x), dtype=np.int32)
        beyond = np.zeros(len(x), dtype=bool)
        for axis, column in enumerate((x, y, z)):
            at = column - self._low[axis]
            at *= self._size_inverse
            beyond |= (at < 0) | (at >= self._shape[axis])
            np.clip(at, 0, self._shape[axis] - 1, out=at)
            number *= self._shape[axis]
            number += at.astype(np.int32)
        near: Numbers = self._nearest.take(number)
        near[beyond] = -1
        return near


def _spread(grid: Numbers) -> None:
    """Set every empty cell of a grid to the largest value of its six neighbours, in place."""
    spread = grid.copy()
    for axis in range(3):
        ahead = tuple(slice(1, None) if k == axis else slice(None) for k in range(3))
        behind = tuple(slice(None, -1) if k == axis else slice(None) for k in range(3))
        np.maximum(spread[ahead], grid[behind], out=spread[ahead])
        np.maximum(spread[behind], grid[ahead], out=spread[behind])
    np.copyto(grid, spread, where=grid < 0)
