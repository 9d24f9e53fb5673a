"""The curve of a fold in its profile plane, from body and waste along holes."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints

_CELL = 0.2  # of the thickness: one point of the body is kept in each such square
_CHECKS = 5  # places along a link at which the nearest point is the body's or waste's
_WASTE = 4.0  # how many times more a link through waste costs
_WIDER = 1.25  # growth of the links' greatest length until the body hangs together
_TOGETHER = 0.98  # share of the body's points that must hang together
_TIMES = 12  # most growths: 15 times the first length
_ROUNDS = 6  # of moving the curve into the middle of its points
_SMOOTH = 0.5  # thicknesses over which the curve is smoothed
_CUT = 0.5  # thicknesses cut off its ends, where its points lie on one side; it goes on straight


def profile_curve(ore: Floats, waste: Floats, thickness: float) -> Floats:
    """Return the vertices (k, 2) of the curve through the middle of a folded layer.

    Points of the body are linked with those around, and links through waste cost more. Their
    distance along these links from one end of the layer sorts them: limbs that lie above each other
    are far apart then. Their means in steps of that distance are the first curve; it is then moved
    to the means of the points nearest to each of its parts.

    Parameters
    ----------
    ore, waste : (n, 2), (m, 2) float
        Points along holes in the profile plane.
    thickness : float
        Thickness of the layer, roughly.

    Raises
    ------
    InputError
        The points do not hang together.
    """
    some = _one_each(ore, _CELL * thickness)
    links, own = _hanging(some, waste, thickness)
    some = some[own]
    start = int(np.argmax(dijkstra(links, directed=False, indices=[0])[0]))
    along = dijkstra(links, directed=False, indices=[start])[0]
    step = 0.5 * thickness
    curve = _cut(_means(some, np.floor(along / step).astype(np.int64)), thickness)
    for _ in range(_ROUNDS):
        curve = _smoothed(curve, step, thickness)
        place, _, _ = on_curve(curve, some)
        curve = _means(some, np.floor(place / step).astype(np.int64))
    return _cut(_smoothed(curve, 0.25 * thickness, thickness), thickness)


def _one_each(points: Floats, cell: float) -> Floats:
    """Return the first point in every square of a side."""
    _, first = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)]


def _hanging(ore: Floats, waste: Floats, thickness: float) -> tuple[csr_matrix, Ints]:
    """Return costs of links between points that hang together, and which points do."""
    trees = cKDTree(ore), cKDTree(waste) if len(waste) else None
    longest = 0.5 * thickness
    for _ in range(_TIMES):
        longest *= _WIDER
        pairs = trees[0].query_pairs(longest, output_type="ndarray")
        size = (len(ore), len(ore))
        graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=size)
        _, part = connected_components(graph, directed=False)
        own = np.flatnonzero(part == np.argmax(np.bincount(part)))
        if len(own) >= _TOGETHER * len(ore):
            break
    else:
        raise InputError(
            "the body falls apart in the fold's profile; drill closer, give --axis, or take "
            "--shape plane"
        )
    i, j = pairs.T
    length = np.linalg.norm(ore[i] - ore[j], axis=1)
    through = np.zeros(len(i))
    for share in (np.arange(_CHECKS) + 1) / (_CHECKS + 1):
        between = ore[i] + share * (ore[j] - ore[i])
        if trees[1] is not None:
            through += np.asarray(trees[0].query(between)[0]) > np.asarray(
                trees[1].query(between)[0]
            )
    cost = length * (1 + _WASTE * through / _CHECKS)
    links = coo_matrix((cost, (i, j)), shape=size).tocsr()
    return links[own][:, own], own


def _cut(curve: Floats, thickness: float) -> Floats:
    """Return a curve without a share of the thickness at its ends."""
    length = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    cut = min(_CUT * thickness, 0.2 * length[-1])
    inner = curve[(length > cut) & (length < length[-1] - cut)]
    ends = [
        [np.interp(at, length, curve[:, k]) for k in range(2)] for at in (cut, length[-1] - cut)
    ]
    return np.concatenate([ends[:1], inner, ends[1:]])


def _means(points: Floats, step: Ints) -> Floats:
    """Return the mean points of every step that has some."""
    _, group = np.unique(step, return_inverse=True)
    count = np.bincount(group)
    return np.column_stack([np.bincount(group, points[:, k]) / count for k in range(2)])


def _smoothed(curve: Floats, step: float, thickness: float) -> Floats:
    """Return a curve at even steps, smoothed along its length, its ends kept."""
    length = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    count = max(8, int(np.ceil(length[-1] / step)))
    even = np.linspace(0, length[-1], count + 1)
    P = np.column_stack([np.interp(even, length, curve[:, k]) for k in range(2)])
    width = _SMOOTH * thickness / (length[-1] / count)
    # Mirrored through the ends, so that these stay in place.
    ahead = min(int(4 * width) + 1, count)
    long = np.concatenate([2 * P[0] - P[ahead:0:-1], P, 2 * P[-1] - P[-2 : -ahead - 2 : -1]])
    smooth = gaussian_filter1d(long, width, axis=0)
    return np.asarray(smooth[ahead : ahead + count + 1])


def on_curve(curve: Floats, points: Floats) -> tuple[Floats, Floats, Ints]:
    """Return the place along a curve nearest to points (n, 2), the height left of it, the segment.

    The first and last segments go on straight.
    """
    a, b = curve[:-1], curve[1:]
    length = np.linalg.norm(b - a, axis=1)
    start = np.r_[0.0, np.cumsum(length)]
    way = (b - a) / length[:, None]
    near = np.asarray(cKDTree(0.5 * (a + b)).query(points, k=min(3, len(a)))[1])
    near = near.reshape(len(points), -1)
    best = np.full(len(points), np.inf)
    place, height = np.zeros(len(points)), np.zeros(len(points))
    segment = np.zeros(len(points), dtype=np.int64)
    for k in near.T:
        off = points - a[k]
        t = (off * way[k]).sum(axis=1)
        low = np.where(k == 0, -np.inf, 0.0)
        high = np.where(k == len(a) - 1, np.inf, length[k])
        t = np.clip(t, low, high)
        rest = off - t[:, None] * way[k]
        gap = (rest**2).sum(axis=1)
        closer = gap < best
        side = way[k, 0] * rest[:, 1] - way[k, 1] * rest[:, 0]
        best = np.where(closer, gap, best)
        place = np.where(closer, start[k] + t, place)
        height = np.where(closer, np.copysign(np.sqrt(gap), side), height)
        segment = np.where(closer, k, segment)
    return place, height, segment
