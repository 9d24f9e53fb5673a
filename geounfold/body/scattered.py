"""Scattered points: whether points follow a grid, and their spacing from place to place."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores
from geounfold.body.lattice import distinct
from geounfold.geometry.mesh import Floats, Ints

UNEVEN = 0.22
"""Unevenness above which points count as scattered.

Measured: 0.27 for points thrown at random, whatever their density; 0 on folded grids, 0.15 on
grids with noise of 0.2 blocks, 0.19 where their blocks have sides of 4 to 1.
"""

QUIET = 0.02
"""Unevenness below which points are a grid, folded or not: noise of 0.05 blocks gives 0.03."""

_NEAR = 12  # neighbours compared, and those whose distance gives the spacing
_WIDE = 40  # neighbours among which the density inside the body is looked for
_INNER = 85  # percentile of the density: balls around points near the surface are half empty
_JUDGED, _ANCHORS = 500, 3000  # points at which unevenness, and spacing, are measured
_SHARED = 8  # nearest anchors over which a point's spacing is averaged
_BALL = (3 / (4 * np.pi)) ** (1 / 3)


def unevenness(points: Floats) -> float:
    """Return how much the distance to the nearest other point differs between neighbours.

    It is the median over some of the points of the absolute difference between the logarithm of a
    point's distance and its mean over the point's twelve neighbours. Slow variations cancel.
    """
    X = distinct(points)
    if len(X) < 2 * _NEAR:
        return 0.0
    tree = cKDTree(X, balanced_tree=False, compact_nodes=False)
    near = np.asarray(tree.query(X[_some(X, _JUDGED)], k=_NEAR + 1)[1])
    log = np.log(np.asarray(tree.query(X[near].reshape(-1, 3), k=2)[0])[:, 1])
    log = log.reshape(near.shape)
    return float(np.median(np.abs(log[:, 0] - log[:, 1:].mean(axis=1))))


def local_spacing(points: Floats) -> Floats:
    """Return the typical spacing of the points around each point, (n,), in their unit.

    It is the side of the cube that holds one point, at the density inside the body there.
    """
    X = distinct(points)
    tree = cKDTree(X, balanced_tree=False, compact_nodes=False)
    anchors = X[_some(X, _ANCHORS)]
    count = min(_NEAR, len(X) - 1)
    wide = np.asarray(tree.query(anchors, k=min(_WIDE, len(X)))[1])
    used = np.unique(wide)
    reach = np.empty(len(X))
    reach[used] = np.asarray(tree.query(X[used], k=[count + 1])[0])[:, 0]
    inner = np.percentile(-reach[wide], _INNER, axis=1)  # densest: shortest distances
    spacing = -inner / (_BALL * count ** (1 / 3))
    near = np.asarray(cKDTree(anchors).query(points, k=min(_SHARED, len(anchors)))[1])
    out: Floats = np.exp(np.log(spacing)[near.reshape(len(points), -1)].mean(axis=1))
    return out


def scattered(points: Floats) -> bool:
    """Return whether points follow no grid, folded or disturbed by noise."""
    return unevenness(points) > UNEVEN


def scattered_spacing(points: Floats) -> float:
    """Return the side of the cube that a scattered point fills in the mean, in the points' unit."""
    return float(np.cbrt(np.mean(local_spacing(points) ** 3)))


def nearest_points(tree: cKDTree, points: Floats, count: int) -> tuple[Floats, Ints]:
    """Return distances and rows of the ``count`` nearest points of a tree, (m, count) each.

    A point of the tree is its own nearest one.
    """
    distance, near = tree.query(points, k=min(count, tree.n), workers=cores())
    return np.asarray(distance), np.asarray(near, dtype=np.int64)


def _some(points: Floats, count: int) -> Ints:
    """Return about ``count`` rows: every m-th in the order of distance from the mean."""
    X = points - points.mean(axis=0)
    rank = np.argsort(np.einsum("ij,ij->i", X, X), kind="stable")
    out: Ints = rank[:: -(-len(points) // count)]
    return out
