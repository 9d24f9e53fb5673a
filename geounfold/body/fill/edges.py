"""Edges of triangles that bound no solid, corners joined to close them, and small holes filled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Floats, Ints


def border_edges(F: Ints) -> Ints:
    """Return the directed edges that no triangle meets the other way, (k, 2).

    An edge that several triangles pass in both directions is left over as often as one direction
    outnumbers the other.

    >>> border_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [[0, 1], [1, 3], [2, 0], [3, 2]]
    """
    E = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    low, high = E.min(axis=1), E.max(axis=1)
    n = int(F.max(initial=0)) + 1
    key, first, back = np.unique(low * n + high, return_index=True, return_inverse=True)
    excess = np.bincount(back.ravel(), np.where(E[:, 0] == low, 1.0, -1.0), len(key))
    pair = np.column_stack([low[first], high[first]])
    pair = np.where((excess < 0)[:, None], pair[:, ::-1], pair)
    out = np.repeat(pair, np.abs(np.rint(excess)).astype(np.int64), axis=0)
    return np.asarray(out[np.lexsort(out.T[::-1])], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Holes:
    """The holes of a surface: its border edges, grouped where they meet.

    Attributes
    ----------
    edges : (k, 2) int
        Directed border edges.
    hole : (k,) int
        Hole of each edge, from 0.
    centre : (h, 3) float
        Mean of each hole's edges, weighted by their lengths.
    area : (h,) float
        Size of each hole's vector area: of a flat hole its area.
    length : (h,) float
        Length around each hole.
    """

    edges: Ints
    hole: Ints
    centre: Floats
    area: Floats
    length: Floats

    @property
    def largest(self) -> int:
        """Number of the hole of the longest border."""
        return int(self.length.argmax())


def holes_of(V: Floats, F: Ints) -> Holes:
    """Return the holes of coherently oriented triangles."""
    E = border_edges(F)
    used, at = np.unique(E, return_inverse=True)
    at = at.reshape(-1, 2)
    graph = coo_array((np.ones(len(E)), (at[:, 0], at[:, 1])), (len(used), len(used)))
    count, label = connected_components(graph, directed=False)
    hole = np.asarray(label[at[:, 0]], dtype=np.int64)
    a, b = V[E[:, 0]], V[E[:, 1]]
    size = np.linalg.norm(b - a, axis=1)
    length = np.bincount(hole, size, count).astype(np.float64)
    centre = (
        np.stack([np.bincount(hole, size * (a + b)[:, k] / 2, count) for k in range(3)], axis=1)
        / np.maximum(length, np.finfo(float).tiny)[:, None]
    )
    cross = np.cross(a - centre[hole], b - centre[hole]) / 2
    area = np.stack([np.bincount(hole, cross[:, k], count) for k in range(3)], axis=1)
    return Holes(E, hole, centre, np.linalg.norm(area, axis=1), length)


def fanned(V: Floats, F: Ints, holes: Holes) -> tuple[Floats, Ints]:
    """Return the surface with every hole closed by triangles around its centre."""
    a, b = holes.edges.T
    fans = np.column_stack([b, a, len(V) + holes.hole])
    return np.concatenate([V, holes.centre]), np.concatenate([F, fans])


def joined_corners(V: Floats, F: Ints, tolerance: float) -> tuple[Floats, Ints]:
    """Return the surface with corners on its border joined that lie at most ``tolerance`` apart.

    Only corners of border edges move, each to the first of those it is joined with.
    """
    border = np.unique(border_edges(F))
    pairs = cKDTree(V[border]).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), (len(border), len(border)))
    label = connected_components(graph, directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    target = np.arange(len(V))
    target[border] = border[first[label]]
    return V, without_slivers(target[F])


def without_slivers(F: Ints) -> Ints:
    """Return triangles of three different corners, one of each set of equal ones.

    Two equal triangles that face opposite ways bound nothing, so both are left out.
    """
    F = F[(np.roll(F, 1, axis=1) != F).all(axis=1)]
    turn = np.argmin(F, axis=1)[:, None]
    F = np.take_along_axis(F, (turn + np.arange(3)) % 3, axis=1)  # least corner first
    even = F[:, 1] < F[:, 2]
    corners = np.sort(F, axis=1)
    _, first, back = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    balance = np.bincount(back.ravel(), np.where(even, 1, -1), len(first))
    rows = first[balance != 0]
    wrong = (balance[balance != 0] > 0) != even[rows]
    rows, wrong = rows[np.argsort(rows)], wrong[np.argsort(rows)]
    kept = F[rows]
    return np.asarray(np.where(wrong[:, None], kept[:, [0, 2, 1]], kept), dtype=np.int64)


def single_fans(V: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Return a closed surface with a vertex of its own for every fan of triangles.

    Parts that meet in a vertex alone then no longer share it.
    """
    n = int(F.max()) + 1
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    order, back = np.argsort(start * n + end), np.argsort(end * n + start)
    twin = np.empty_like(order)
    twin[order] = back
    around = twin.reshape(-1, 3)[:, [2, 0, 1]].ravel()  # the next edge out of its start
    half = np.arange(len(start))
    graph = coo_array((np.ones(len(half), dtype=np.int8), (half, around)), (len(half), len(half)))
    fan = connected_components(graph, directed=False)[1]
    first = np.unique(fan, return_index=True)[1]
    return V[start[first]], np.asarray(fan.reshape(-1, 3), dtype=np.int64)


def manifold_edges(F: Ints) -> bool:
    """Return whether every edge has two triangles, which pass it in opposite directions."""
    n = int(F.max(initial=0)) + 1
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    once = np.sort(start * n + end)
    return bool((once[1:] != once[:-1]).all() and np.array_equal(once, np.sort(end * n + start)))
