"""Hull as an alpha shape of the outermost points, with the smallest alpha that holds all of them.

The alpha shape is taken on the shell of outermost points, a fifth to a third of all.  A ball of
radius alpha rolls in from outside and removes the Delaunay tetrahedra that it reaches through
triangles it can pass.  The rest, the hollow of the shell included, is the solid (its boundary is
the outer one of Edelsbrunner and Muecke's alpha shape).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, QhullError

from geounfold.errors import HullError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.outermost_points import hull_through

MARGIN = 1.05  # factor on the smallest alpha, past lengths that a lattice repeats
LARGEST = 20.0  # block sides: a larger alpha bridges every gap
HELD = 0.99  # least share of the points in the solid's largest piece
REPAIRS = 30  # rounds of repair of edges at which the solid touches itself
WIDEST = 3.0  # block sides: at such edges larger facets are cut away, not filled
_FACETS = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])  # outward if right-handed


@dataclass(frozen=True, eq=False)
class _Complex:
    """Delaunay tetrahedra of the shell; ``n`` of them, and n as the outside's number."""

    points: Floats
    T: Ints
    neighbours: Ints
    radius: Floats  # (n, 4): circumradius of the facet opposite each corner

    @property
    def n(self) -> int:
        return len(self.T)


def alpha_hull(points: Floats, sides: Floats, options: HullOptions) -> Hull:
    """Return the hull through the outermost centroids, by an alpha shape.

    ``options.alpha`` is measured in ``points / sides``.

    Raises
    ------
    HullError
        No alpha holds the points, or the result cannot be mended.
    """
    return hull_through(
        points, sides, options, "alpha", lambda s: alpha_solid(s.points, options.alpha)[:2]
    )


def alpha_solid(points: Floats, alpha: float | None) -> tuple[Floats, Ints, float]:
    """Return the boundary (V, F), outward and manifold, of an alpha shape, and its alpha.

    Parameters
    ----------
    points : (n, 3) float
        Points on the outside of a body, in general position, block sides.
    alpha : float or None
        Radius of the rolling ball; None for the smallest that leaves 99 % of the points on one
        solid.  Blocks connected by an edge only are not part of it.

    Raises
    ------
    HullError
        No alpha up to 20 block sides holds the points, or the given one does not.
    """
    shape = _delaunay(points)
    if alpha is None:
        alpha = MARGIN * _smallest_alpha(shape)
    solid, held = _largest_piece(shape, _solid(shape, alpha))
    if held < HELD:
        raise HullError(
            f"an alpha of {alpha:.3g} blocks holds {held:.1%} of the outer points; raise alpha"
        )
    V, F = _manifold_boundary(shape, solid)
    return V, F, alpha


def _delaunay(points: Floats) -> _Complex:
    try:
        triangulation = Delaunay(points)
    except QhullError as error:
        raise HullError("the points are too few or too flat for an alpha shape") from error
    T = triangulation.simplices.astype(np.int64)
    neighbours = triangulation.neighbors.astype(np.int64)
    left = _signed_volumes(points, T) < 0
    T[left] = T[left][:, [1, 0, 2, 3]]
    neighbours[left] = neighbours[left][:, [1, 0, 2, 3]]
    neighbours[neighbours < 0] = len(T)
    corners = points[T[:, _FACETS]]
    a, b = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    twice_area = np.linalg.norm(np.cross(a, b), axis=-1)
    product = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    product *= np.linalg.norm(a - b, axis=-1)
    radius = product / np.maximum(2 * twice_area, 1e-12)
    return _Complex(points, T, neighbours, radius)


def _signed_volumes(points: Floats, T: Ints) -> Floats:
    edges = points[T[:, 1:]] - points[T[:, :1]]
    out: Floats = np.linalg.det(edges)
    return out


def _solid(shape: _Complex, alpha: float) -> Bools:
    """Return which tetrahedra the ball cannot reach from outside, (n,)."""
    tet, facet = np.nonzero(shape.radius > alpha)
    n = shape.n + 1
    ones = np.ones(len(tet), dtype=np.int8)
    passages = coo_array((ones, (tet, shape.neighbours[tet, facet])), (n, n))
    component = connected_components(passages, directed=False)[1]
    out: Bools = component[:-1] != component[-1]
    return out


def _largest_piece(shape: _Complex, solid: Bools) -> tuple[Bools, float]:
    """Return the largest piece (across facets) of a solid and its share of the points."""
    number = np.append(np.where(solid, np.cumsum(solid) - 1, -1), -1)
    tet, facet = np.nonzero(solid[:, None] & (number[shape.neighbours] >= 0))
    n = int(solid.sum())
    if n == 0:
        return solid, 0.0
    pairs = number[tet], number[shape.neighbours[tet, facet]]
    graph = coo_array((np.ones(len(tet), dtype=np.int8), pairs), (n, n))
    piece = connected_components(graph, directed=False)[1]
    kept = solid.copy()
    kept[solid] = piece == np.bincount(piece).argmax()
    return kept, len(np.unique(shape.T[kept])) / len(shape.points)


def _smallest_alpha(shape: _Complex) -> float:
    """Return the smallest facet radius whose solid holds the points, by bisection."""
    radii = np.unique(shape.radius[shape.radius < LARGEST].round(4)) + 1e-4

    def holds(k: int) -> bool:
        return _largest_piece(shape, _solid(shape, float(radii[k])))[1] >= HELD

    low, high = 0, len(radii) - 1
    if high < 0 or not holds(high):
        raise HullError("no alpha holds all points in one solid; try hull 'density'")
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle + 1, high)
    return float(radii[low])


def _manifold_boundary(shape: _Complex, solid: Bools) -> tuple[Floats, Ints]:
    """Return the solid's boundary, mended at edges and vertices in which it touches itself.

    Narrow wedges at such an edge are filled; if there are none, the edge is cut free.
    """
    narrow = shape.radius.max(axis=1) < WIDEST
    for _ in range(REPAIRS):
        F = _boundary(shape, solid)
        ends = np.sort(np.stack([F, F[:, [1, 2, 0]]], axis=-1).reshape(-1, 2), axis=1)
        key = ends[:, 0] * len(shape.points) + ends[:, 1]
        edge, count = np.unique(key, return_counts=True)
        bad = edge[count > 2]
        if not len(bad):
            return _split_fans(shape.points, F)
        around = _around_edges(shape, bad)
        wedge = around & narrow & ~solid
        solid = solid | wedge if wedge.any() else solid & ~around
    raise HullError("the alpha shape touches itself in too many edges; try hull 'density'")


def _boundary(shape: _Complex, solid: Bools) -> Ints:
    """Return the facets between the solid and the rest, outward."""
    inside = np.append(solid, False)
    tet, facet = np.nonzero(solid[:, None] & ~inside[shape.neighbours])
    out: Ints = shape.T[tet[:, None], _FACETS[facet]]
    return out


def _around_edges(shape: _Complex, edges: Ints) -> Bools:
    """Return which tetrahedra have one of the edges (as low * points + high), (n,)."""
    out = np.zeros(shape.n, dtype=bool)
    for i in range(4):
        for j in range(i):
            low = np.minimum(shape.T[:, i], shape.T[:, j])
            high = np.maximum(shape.T[:, i], shape.T[:, j])
            out |= np.isin(low * len(shape.points) + high, edges)
    return out


def _split_fans(points: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Give each fan of faces around a vertex a vertex of its own, if fans touch in one."""
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    n = len(points)
    order, back = np.argsort(start * n + end), np.argsort(end * n + start)
    twin = np.empty_like(order)
    twin[order] = back
    around = twin.reshape(-1, 3)[:, [2, 0, 1]].ravel()
    half = np.arange(len(start))
    graph = coo_array((np.ones(len(half), dtype=np.int8), (half, around)), (len(half), len(half)))
    fan = connected_components(graph, directed=False)[1]
    first = np.unique(fan, return_index=True)[1]
    return points[start[first]], fan.reshape(-1, 3).astype(np.int64)
