"""Prisms between stacked copies of a triangulation, cut into tetrahedra."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Bools, Ints


def prism_tets(F: Ints, n: int, layers: int) -> Ints:
    """Return the tetrahedra between stacked layers of a triangulation.

    Layer k holds vertices ``k n .. (k + 1) n - 1``, each above the same vertex of the layer below
    it, on the side of the faces' normals.  Every prism is cut by the order of its vertices (a < b <
    c), so that neighbours share their diagonals.

    Parameters
    ----------
    F : (m, 3) int
        Faces, counter-clockwise seen from above.
    n : int
        Vertices per layer.
    layers : int
        Number of layers, at least two.

    Returns
    -------
    (3 m (layers - 1), 4) int
        Tetrahedra, layer by layer; right-handed if the prisms are upright.

    Examples
    --------
    >>> prism_tets(np.array([[0, 1, 2]]), 3, 2).tolist()
    [[0, 1, 2, 5], [1, 0, 4, 5], [0, 3, 4, 5]]
    """
    order = np.argsort(F, axis=1)
    a, b, c = np.take_along_axis(F, order, axis=1).T
    odd = ~np.isin(order @ [9, 3, 1], [5, 15, 19])[:, None]
    tets = [
        np.stack([a, b, c, c + n], axis=1),
        np.stack([b, a, b + n, c + n], axis=1),
        np.stack([a, a + n, b + n, c + n], axis=1),
    ]
    slab = np.concatenate([np.where(odd, t[:, [1, 0, 2, 3]], t) for t in tets])
    return np.concatenate([slab + k * n for k in range(layers - 1)])


def whole_prisms(T: Ints) -> tuple[Ints, Ints]:
    """Return the prisms among tetrahedra made by ``prism_tets``, in any position.

    Rows may be left out, or moved as long as those of one prism keep their order.  A prism that
    lost a row is not returned.

    Parameters
    ----------
    T : (m, 4) int
        Tetrahedra.

    Returns
    -------
    rows : (p, 3) int
        The tetrahedra of each prism, in the order of ``prism_tets``; sorted by the first.
    corners : (p, 6) int
        Vertices a, b, c of each prism (a < b < c when it was cut) and those above them.

    Examples
    --------
    >>> rows, corners = whole_prisms(prism_tets(np.array([[0, 1, 2]]), 3, 2))
    >>> rows.tolist(), corners.tolist()
    ([[0, 1, 2]], [[0, 1, 2, 3, 4, 5]])
    """
    if not len(T):
        return np.empty((0, 3), np.int64), np.empty((0, 6), np.int64)
    # (b, a, b', c') or, turned, (a, b, b', c') follows (a, b, c, c') or (b, a, c, c') ...
    first = np.arange(len(T))
    second = _matching(T[:, [0, 1, 3]], T[:, [1, 0, 3]])
    first, second = first[second > first], second[second > first]
    # ... and is followed by (a, a', b', c') or (a', a, b', c').
    found = []
    for at in (0, 1):
        wanted = np.column_stack([T[first, at], T[second, 2:]])
        third = _matching(wanted, T[:, [at, 2, 3]])
        here = third > second
        rows = np.stack([first[here], second[here], third[here]], axis=1)
        x, y, z = T[rows[:, 0]], T[rows[:, 1]], T[rows[:, 2]]
        base = np.stack([x[:, at], x[:, 1 - at], x[:, 2]], axis=1)
        found.append(np.column_stack([rows, base, z[:, 1 - at], y[:, 2:]]))
    table = np.concatenate(found)
    table = table[_distinct(table[:, 3:])]
    # The neighbour's second tetrahedron may look like a third; its first one distinguishes it.
    table = table[~np.isin(table[:, 2], table[:, 1])]
    uneven = np.abs(table[:, 2] - 2 * table[:, 1] + table[:, 0])
    table = table[np.lexsort((uneven, table[:, 0]))]
    table = table[np.unique(table[:, 0], return_index=True)[1]]
    table = table[_unshared(table[:, :3], len(T))]
    return table[:, :3], table[:, 3:]


def _matching(wanted: Ints, offered: Ints) -> Ints:
    """Return the first row of (m, 3) that equals each wanted row (k, 3); -1 if none does."""
    both = np.concatenate([offered, wanted])
    key = np.zeros(len(both), np.int64)
    for column in both.T:  # renumbered each time, so that no product of three overflows
        key = np.unique(key * (int(both.max()) + 1) + column, return_inverse=True)[1]
    order = np.argsort(key[: len(offered)], kind="stable")
    there = key[: len(offered)][order]
    place = np.minimum(np.searchsorted(there, key[len(offered) :]), len(there) - 1)
    return np.where(there[place] == key[len(offered) :], order[place], -1)


def _distinct(corners: Ints) -> Bools:
    """Return which rows hold no number twice."""
    ordered = np.sort(corners, axis=1)
    out: Bools = (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
    return out


def _unshared(rows: Ints, count: int) -> Bools:
    """Return which rows hold no number below count that another row holds too."""
    used = np.bincount(rows.ravel(), minlength=count)
    out: Bools = (used[rows] == 1).all(axis=1)
    return out
