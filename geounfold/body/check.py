"""Checks that points can be a body: enough of them, extended in three directions."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.lattice import (
    Lattice,
    distinct,
    lattice_indices,
    measure_lattice,
    point_spacing,
)
from geounfold.body.scattered import nearest_points
from geounfold.errors import InputError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Floats

MIN_POINTS = 50
"""Fewest distinct points of a body: a sheet of 5 x 5 blocks, two thick."""

_FLAT = 0.05  # extent, in point spacings, below which points lie on a line or plane
_SCATTER = 0.38  # rms off the local surface per nearest distance: one layer 0.27, two 0.5
_AROUND = 101  # nearest points in which three directions are looked for, the point itself included
_SAMPLE = 2000  # points whose neighbourhoods are looked at
_DEGREES = 10.0  # largest extent of a body in degrees, 1,100 km
_TALL = 50.0  # z over x and y, of extents or of sides of blocks; in degrees 5,000 and more
_UNEVEN = 300.0  # longest over shortest side of a block; of seam models 200, of mixed units 1,000
_MIXED = np.array([1.0, np.sqrt(2) / 2, np.pi / 6])  # different rows hardly ever share a sum


def count_duplicates(points: Floats) -> int:
    """Return how many rows have the coordinates of an earlier row.

    >>> count_duplicates(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]]))
    2
    """
    key = points[:, 0] * _MIXED[0] + points[:, 1] * _MIXED[1] + points[:, 2] * _MIXED[2]
    ordered = np.sort(key)
    same = ordered[1:][ordered[1:] == ordered[:-1]]
    if not len(same):  # equal rows have equal keys
        return 0
    some = points[np.isin(key, same)]
    return len(some) - len(distinct(some))


def check_points(points: Floats, lattice: Lattice | None = None) -> None:
    """Raise InputError unless the points fill a body that can have a top and a bottom.

    A folded sheet one block thick is valid on a lattice, because its blocks have a top and a
    bottom.

    Parameters
    ----------
    points : (n, 3) float
        Finite world coordinates; duplicates are allowed.
    lattice : Lattice, optional
        The points' lattice; measured here by default.

    Raises
    ------
    InputError
        The distinct points are too few, all in one column, on one line or in one plane, or all on
        one surface and on no lattice.
    """
    if len(distinct(points[:: len(points) // _SAMPLE + 1])) < MIN_POINTS:
        _check_count(len(points) - count_duplicates(points), len(points))
    if lattice is None:
        _check_extent(points, point_spacing(points))
        lattice = measure_lattice(distinct(points))
    else:
        _check_extent(points, float(np.cbrt(lattice.steps.prod())))
    if lattice is not None and not OccupiedCells.of(lattice_indices(points, lattice)).gappy():
        return
    X = distinct(points)
    if _one_layer_of_points(X) and not _in_three_directions(X):
        raise InputError(
            f"the {len(X)} points lie on one surface, on no lattice of touching blocks: a sheet "
            "one block thick, whose thickness the points do not show; give at least two layers "
            "of blocks (smaller blocks across the sheet)"
        )


def check_units(points: Floats, lattice: Lattice | None) -> None:
    """Raise InputError if the axes are not in one unit, such as degrees beside metres.

    Parameters
    ----------
    points : (n, 3) float
        Finite world coordinates.
    lattice : Lattice or None
        Their lattice.
    """
    low, high = bounds(points)
    extent = high - low
    far = np.maximum(np.abs(low), np.abs(high))
    tall = float(extent[2] / extent[:2].max()) if extent[:2].any() else 0.0
    steps = None if lattice is None else np.abs(lattice.steps @ np.abs(lattice.axes))
    if steps is not None:
        tall = max(tall, float(steps[2] / steps[:2].max()))
    on_the_globe = far[:2].max() <= 180 and far[:2].min() <= 90 and extent[:2].max() < _DEGREES
    if on_the_globe and tall > _TALL:
        raise InputError(
            f"x and y look like degrees ({_range(low, high, 0)}, {_range(low, high, 1)}) beside "
            f"z in a unit of length ({_range(low, high, 2)}); a body needs one unit along all "
            "axes: project longitude and latitude to metres (UTM or the mine's grid)"
        )
    uneven = 0.0 if lattice is None else float(lattice.steps.max() / lattice.steps.min())
    if max(uneven, tall) > _UNEVEN:
        sides = extent if steps is None else steps
        names = "the body's extents" if steps is None else "blocks' sides"
        along = ", ".join(
            f"{size:.4g} along {axis}" for size, axis in zip(sides, "xyz", strict=True)
        )
        raise InputError(
            f"{names} are {along}: the axes are in different units, such as kilometres beside "
            "metres; convert all coordinates to one unit"
        )


def _range(low: Floats, high: Floats, axis: int) -> str:
    return f"{'xyz'[axis]} {low[axis]:.8g} to {high[axis]:.8g}"


def _check_count(count: int, rows: int) -> None:
    if count < MIN_POINTS:
        same = f" ({rows} rows with duplicates)" if rows > count else ""
        raise InputError(
            f"only {count} distinct points{same}, but a body needs at least {MIN_POINTS}; "
            "give the centroids of all its blocks"
        )


def _check_extent(X: Floats, spacing: float) -> None:
    """Raise InputError if the points lie in a column, on a line or in a plane.

    ``spacing`` is their typical distance.
    """
    limit = _FLAT * spacing
    low, high = bounds(X)
    constant = high - low < limit
    if constant.sum() == 2:
        fixed = " and ".join(f"{'xyz'[i]} = {X[0, i]:.10g}" for i in np.flatnonzero(constant))
        raise InputError(
            f"all {_count(X)} points are in one column ({fixed}); "
            "give a body that extends in all three directions"
        )
    centred = X - X.mean(axis=0)
    least = np.linalg.eigh(centred.T @ centred)[1][:, :2]
    if (np.ptp(centred[:: -(-len(X) // _SAMPLE)] @ least, axis=0) >= limit).all():
        return  # points that some of them span are not flat
    across, second = np.ptp(centred @ least, axis=0)
    if second < limit:
        raise InputError(
            f"all {_count(X)} points are on one line; "
            "give a body that extends in all three directions"
        )
    if across < limit:
        raise InputError(
            f"all {_count(X)} points are in one plane, so the body's thickness is not known "
            "(and it is unfolded already); give at least two layers of blocks"
        )


def _count(X: Floats) -> int:
    """Return the number of distinct points."""
    return len(X) - count_duplicates(X)


def _one_layer_of_points(X: Floats) -> bool:
    """Return whether scattered points lie on one surface, within their noise.

    A paraboloid is fitted to each point and its 24 nearest neighbours, as a height along their
    direction of least variance. The rms distance from it, over the median distance of the nearest
    neighbour, is 0 on a surface and 0.5 for two layers. Neighbourhoods along a line (columns of
    flat blocks) count as thick.
    """
    some = X[:: -(-len(X) // _SAMPLE)]
    distance, near = nearest_points(cKDTree(X), some, 25)
    local = X[near] - X[near].mean(axis=1, keepdims=True)
    spread, turn = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local))
    w, v, u = np.moveaxis(local @ turn, 2, 0)
    scale = np.sqrt(spread[:, 2:] / 25)
    u, v = u / scale, v / scale
    basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
    q = np.linalg.qr(basis)[0]
    rest = w - (q @ (q.transpose(0, 2, 1) @ w[:, :, None]))[:, :, 0]
    rms = np.sqrt(np.einsum("nk,nk->n", rest, rest) / (25 - 6))
    rms[spread[:, 1] < 0.05 * spread[:, 2]] = np.inf
    return bool(np.median(rms) < _SCATTER * np.median(distance[:, 1]))


def _in_three_directions(X: Floats) -> bool:
    """Return whether most points have neighbours in three directions, as blocks in layers have.

    The first direction is that of the nearest other point, the second that of the nearest one
    across the first. The third is more than 60 degrees out of the plane of both; a sheet of one
    layer has no neighbour there. Folded grids of flat or long blocks, whose nearest points all lie
    on one line or two, have one and count as thick.
    """
    some = X[:: -(-len(X) // _SAMPLE)]
    near = nearest_points(cKDTree(X), some, _AROUND)[1]
    D = X[near[:, 1:]] - some[:, None]
    length = np.linalg.norm(D, axis=2)
    first = D[:, 0] / length[:, :1]
    across = np.abs(np.einsum("nki,ni->nk", D, first)) < 0.3 * length
    second = D[np.arange(len(D)), across.argmax(axis=1)]
    normal = np.cross(first, second)
    size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    out = np.abs(np.einsum("nki,ni->nk", D, normal)) > 0.87 * length * size[:, None]
    return bool((across.any(axis=1) & out.any(axis=1)).mean() > 0.5)
