"""The lattice of a block model, measured from its centroids: axes, and the step along each.

A block model lists the centroids of equal boxes: positions ``origin + (k * steps) @ axes``
with whole ``k``. The boxes' sides may differ and the model may be turned about any axis.
Folded grids, noisy points and scattered points have no such lattice.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import permutations, product

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores, over_slices
from geounfold.errors import InputError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints

SHARE = 0.97
"""Least share of the points on a lattice that counts as theirs."""

TOLERANCE = 0.03
"""Distance from a lattice position, in steps along each axis, within which a point lies on it.

Coordinates written with 2 decimals for 2.5 m blocks are off by up to 0.003 steps; noise of
0.12 steps keeps 1 % of the points inside, chance alone 0.02 %.
"""

_DIVISORS = (1, 2, 3, 4, 5, 6, 8, 10)  # finer steps tried: sub-blocks in a parent block
_PARTS = (1, 2, 4)  # by which the steps found first are divided, tried in turn
_SEEDS, _BALL, _CENTRAL = 6, 1000, 30  # groups of points, points in each, points compared
_LOOSE = 0.15  # in steps: as TOLERANCE, for the points of all fits but the last
_FITTED = 200_000  # points that the last fits use if there are more than twice as many
_MIXED = np.array([7.0, 11.0, 13.0]) * np.sqrt([2.0, 3.0, 5.0])  # no regular lattice aligns with it
_SLICE = 1 << 14  # points at once
_SAMPLED = 200_000  # points above which point_spacing uses a part of them


@dataclass(frozen=True, eq=False)
class Lattice:
    """A regular lattice on which (nearly all) centroids lie.

    Attributes
    ----------
    axes : (3, 3) float
        Unit lattice directions as rows, a right-handed rotation of the world's axes; of the
        24 ways to name them, the one nearest to the world's axes (x, y, z in that order).
    steps : (3,) float
        Block size along each axis, in the input's unit.
    share : float
        Share of the points that lie on the lattice, within ``TOLERANCE`` steps.
    origin : (3,) float
        World coordinates of one lattice position, in the middle of the points.
    """

    axes: Floats
    steps: Floats
    share: float
    origin: Floats = field(default_factory=lambda: np.zeros(3))


def proper_permutations() -> Floats:
    """Return the 24 rotations that map the axes onto each other, (24, 3, 3), identity first.

    >>> bool(np.allclose(np.linalg.det(proper_permutations()), 1))
    True
    """
    signed = [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return np.array([turn + 0.0 for turn in signed if np.linalg.det(turn) > 0])


def measure_lattice(points: Floats) -> Lattice | None:
    """Return the lattice of centroids; None if they have none.

    The directions are the shortest difference vectors that many points share, in six groups of
    points spread over the model. A fit (orthogonal Procrustes on whole indices) starts from one
    group, grows to all of them and then uses every point. If fewer than 97 % of the points lie on
    the lattice, finer steps are tried (sub-blocks: a half, a third, ... of the parent's step). The
    lattice returned is the coarsest on which 97 % of the points lie.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in world coordinates, any order, any orientation; duplicates do no harm.

    Returns
    -------
    Lattice or None
        The same, to rounding, for every order of the rows. The time is linear in n.

    Examples
    --------
    >>> k = np.stack(np.meshgrid(*map(np.arange, (9, 8, 7)), indexing="ij"), -1).reshape(-1, 3)
    >>> measure_lattice(5e6 + k * [20, 20, 5.0]).steps.tolist()
    [20.0, 20.0, 5.0]
    """
    if len(points) < 8:
        return None
    low, high = bounds(points)
    reference = (low + high) / 2
    X = points - reference
    balls = _balls(X)
    guess = _directions(balls)
    if guess is None:
        return None
    for part in _PARTS:  # steps of parents, where sub-blocks are too few to show theirs
        axes, steps = guess[0], guess[1] / part
        fit: Fit | None = Fit(axes, steps, _anchor(balls[0], axes, steps))
        for sample in _growing(balls):
            fit = refit(sample, fit, _LOOSE) if fit else None
        found = _accepted(X, fit, reference) if fit else None
        if found is not None:
            return found
    return None


def lattice_indices(points: Floats, lattice: Lattice, origin: Floats | None = None) -> Ints:
    """Return the integer lattice cell of every point, (n, 3).

    Parameters
    ----------
    points : (n, 3) float
        World coordinates.
    lattice : Lattice
        The points' lattice; a point off it gets the nearest cell.
    origin : (3,) float, optional
        Lattice position of the cell (0, 0, 0); the lattice's own by default.
    """
    start = lattice.origin if origin is None else origin
    cells = np.empty((len(points), 3), np.int64)

    def work(rows: slice) -> None:
        cells[rows] = np.rint((points[rows] - start) @ lattice.axes.T / lattice.steps)

    over_slices(work, len(points), _SLICE)
    return cells


def refined(points: Floats, lattice: Lattice) -> Lattice:
    """Return the finer lattice on which all points lie, if a few lie off theirs; else the lattice.

    So it is in models with few sub-blocks: less than 3 % of the centroids are theirs.

    Parameters
    ----------
    points : (n, 3) float
        World coordinates.
    lattice : Lattice
        The lattice of nearly all of them.
    """
    if lattice.share == 1:
        return lattice
    cells = (points - lattice.origin) @ lattice.axes.T / lattice.steps
    steps = lattice.steps.copy()
    for axis in range(3):
        divisors = [d for d in _DIVISORS if _whole(cells[:, axis] * d, TOLERANCE).all()]
        if not divisors:
            return lattice
        steps[axis] /= divisors[0]
    return Lattice(lattice.axes, steps, 1.0, lattice.origin)


def distinct(points: Floats) -> Floats:
    """Return the distinct points, (m, 3), in lexicographic order.

    Points that are distinct and in order already are returned unchanged, without sorting.
    """
    if in_order(points):
        return points
    ordered = points[np.lexsort(points.T[::-1])]
    fresh = np.ones(len(points), bool)
    fresh[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    out: Floats = ordered[fresh]
    return out


def in_order(points: Floats) -> bool:
    """Return whether every row comes after the one before it, lexicographically."""
    x, y, z = (points[:-1] < points[1:]).T
    same_x, same_y, _ = (points[:-1] == points[1:]).T
    return bool((x | (same_x & (y | (same_y & z)))).all())


def point_spacing(points: Floats) -> float:
    """Return the typical spacing of points, in their unit.

    It is the median over the points of the mean distance to the six nearest others; duplicates
    count once. Above 200,000 points the median is over every m-th one in the order of distance
    from the mean, an order that no rigid motion changes.

    Raises
    ------
    InputError
        Fewer than two distinct points.
    """
    X = distinct(points)
    if len(X) < 2:
        raise InputError(f"the {len(points)} points have no spacing: all are at one place")
    X = X - X.mean(axis=0)
    tree = cKDTree(X, balanced_tree=False, compact_nodes=False)
    if len(X) > _SAMPLED:
        rank = np.argsort(np.einsum("ij,ij->i", X, X), kind="stable")
        X = X[rank[:: -(-len(X) // (_SAMPLED // 4))]]
    nearest = np.asarray(tree.query(X, k=min(7, tree.n), workers=cores())[0])
    return float(np.median(nearest[:, 1:].mean(axis=1)))


@dataclass(frozen=True, eq=False)
class Fit:
    """A lattice under construction: its positions are ``origin + (k * steps) @ axes``."""

    axes: Floats
    steps: Floats
    origin: Floats

    def cells(self, X: Floats) -> Floats:
        """Return positions in steps, (n, 3), not rounded."""
        out: Floats = (X - self.origin) @ self.axes.T / self.steps
        return out


def _balls(X: Floats) -> list[Floats]:
    """Return compact groups of points around centres far apart, nearest to the centre first.

    The first centre is the point nearest to the mean, each next one the farthest from those
    before. Groups close to the first one come first.
    """
    distance = _squared(X, X.mean(axis=0))
    place = _extreme(-distance, X)
    places, apart = [place], _squared(X, place)
    balls = [_nearest(X, apart, _BALL)]
    for _ in range(_SEEDS - 1):
        place = _extreme(apart, X)
        to_place = _squared(X, place)
        places.append(place)
        balls.append(_nearest(X, to_place, _BALL))
        apart = np.minimum(apart, to_place)
    order = np.argsort(_squared(np.array(places), places[0]), kind="stable")
    return [balls[i] for i in order]


def _squared(X: Floats, place: Floats) -> Floats:
    out = np.empty(len(X))

    def work(rows: slice) -> None:
        D = X[rows] - place
        np.einsum("ij,ij->i", D, D, out=out[rows])

    over_slices(work, len(X), _SLICE)
    return out


def _extreme(value: Floats, X: Floats) -> Floats:
    """Return the point of greatest value; of equal ones, the first in lexicographic order."""
    best = X[value == value.max()]
    out: Floats = best[np.lexsort(best.T[::-1])[0]]
    return out


def _nearest(X: Floats, distance: Floats, count: int) -> Floats:
    """Return the points of the ``count`` least distances and equal ones, nearest first."""
    if len(X) > count:
        kept = distance <= np.partition(distance, count - 1)[count - 1]
        X, distance = X[kept], distance[kept]
    out: Floats = X[np.lexsort((*X.T[::-1], distance))]
    return out


def _growing(balls: list[Floats]) -> list[Floats]:
    """Return nested samples, each reaching a little farther than the one before."""
    inner = [balls[0][:60], balls[0][:250]]
    return inner + [np.concatenate(balls[: i + 1]) for i in range(len(balls))]


def _directions(balls: list[Floats]) -> tuple[Floats, Floats] | None:
    """Return rough lattice axes (rows) and steps from the points' shortest differences."""
    first = _peak([_shortest(ball, []) for ball in balls])
    if first is None:
        return None
    a = first / np.linalg.norm(first)
    second = _peak([_shortest(ball, [first]) for ball in balls])
    if second is None:
        return None
    b = second - (second @ a) * a
    b = b / np.linalg.norm(b)
    third = _peak([_shortest(ball, [first, second]) for ball in balls])
    c = np.cross(a, b)
    if third is None:
        return None
    steps = np.array([first @ a, second @ b, np.sign(third @ c) * (third @ c)])
    return np.array([a, b, c]), steps


def _shortest(ball: Floats, across: list[Floats]) -> Floats:
    """Return each central point's shortest difference to the ball's points, across given vectors.

    "Across" means that the component along each given vector is less than 5 % of that vector.
    Points without such a difference are left out.
    """
    central = ball[:_CENTRAL]
    D = ball[None] - central[:, None]
    square = np.einsum("ijk,ijk->ij", D, D)
    square[square == 0] = np.inf
    for vector in across:
        along = D @ vector / (vector @ vector)
        square[(along > 0.05) | (along < -0.05)] = np.inf
    best = square.argmin(axis=1)
    rows = np.arange(len(central))
    out: Floats = D[rows, best][np.isfinite(square[rows, best])]
    return out


def _peak(groups: list[Floats]) -> Floats | None:
    """Return the mean of the densest cluster of vectors; opposite vectors count as equal."""
    V = np.concatenate(groups)
    if len(V) < 4:
        return None
    V = np.concatenate([V, -V])
    square = np.einsum("ij,ij->i", V, V)
    near = square[:, None] + square - 2 * V @ V.T < 0.05**2 * square[:, None]
    count = near.sum(axis=1)
    if count.max() < 4:
        return None
    best = _extreme(count.astype(float), V)
    out: Floats = V[near[(best == V).all(axis=1).argmax()]].mean(axis=0)
    return out


def _anchor(ball: Floats, axes: Floats, steps: Floats) -> Floats:
    """Return the central point from which most points of the ball lie on a rough lattice."""
    near = ball[:250]
    best, most = ball[0], -1
    for candidate in ball[:_CENTRAL]:
        count = int(_on_lattice(Fit(axes, steps, candidate).cells(near), _LOOSE).sum())
        if count > most:
            best, most = candidate, count
    out: Floats = best
    return out


def _on_lattice(cells: Floats, tolerance: float) -> Bools:
    """Return whether each position (in steps) is whole along every axis, (n,)."""
    out: Bools = np.all(_whole(cells, tolerance), axis=1)
    return out


def _whole(cells: Floats, tolerance: float) -> Bools:
    part = cells - np.rint(cells)
    out: Bools = np.logical_and(part < tolerance, part > -tolerance)
    return out


def refit(X: Floats, fit: Fit, tolerance: float) -> Fit | None:
    """Return the least-squares lattice of the points near a rough one; None if few are near.

    The fit alternates orthogonal Procrustes for the axes with linear least squares for the steps,
    on the moments of the whole indices. A direction with a single index keeps its step.
    """
    cells = fit.cells(X)
    near = _on_lattice(cells, tolerance)
    if near.sum() < max(8, 0.3 * len(X)):
        return None
    K, P = np.rint(cells[near]), X[near]
    k_mean, p_mean = K.mean(axis=0), P.mean(axis=0)
    K, P = K - k_mean, P - p_mean
    square, mixed = np.einsum("ij,ij->j", K, K), K.T @ P
    axes, steps = fit.axes, fit.steps
    for _ in range(4):
        u, _, vt = np.linalg.svd(mixed * steps[:, None])
        axes = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        along = np.einsum("ij,ij->i", mixed, axes)
        steps = np.divide(along, square, out=steps.copy(), where=square > 0)
    if (steps <= 0).any():
        return None
    return Fit(axes, steps, p_mean - (k_mean * steps) @ axes)


def _accepted(X: Floats, fit: Fit, reference: Floats) -> Lattice | None:
    """Return the lattice on which 97 % of all points lie, fitted to some of them, or None."""
    some = _some(X)
    loose = refit(some, fit, _LOOSE)
    if loose is None:
        return None
    steps = _finest(loose.cells(some), loose.steps)
    if steps is None:
        return None
    last = refit(some, Fit(loose.axes, steps, loose.origin), TOLERANCE)
    if last is None:
        return None
    share = _share(X, last)
    if share < SHARE:
        return None
    axes, steps = named(last.axes, last.steps)
    middle = np.rint(last.cells(np.zeros((1, 3))))[0]
    origin = last.origin + (middle * last.steps) @ last.axes
    return Lattice(axes=axes, steps=steps, share=share, origin=reference + origin)


def _some(X: Floats) -> Floats:
    """Return about _FITTED points if there are more than twice as many, spread over all of them.

    The choice depends on the points' coordinates, not on their order.
    """
    if len(X) <= 2 * _FITTED:
        return X
    number = X[:, 0] * _MIXED[0] + X[:, 1] * _MIXED[1] + X[:, 2] * _MIXED[2]
    number -= np.floor(number)
    out: Floats = X[number < _FITTED / len(X)]
    return out if len(out) > _FITTED / 2 else X


def _share(X: Floats, fit: Fit) -> float:
    """Return the share of all points that lie on a lattice."""

    def work(rows: slice) -> int:
        return int(np.count_nonzero(_on_lattice(fit.cells(X[rows]), TOLERANCE)))

    return sum(over_slices(work, len(X), _SLICE)) / len(X)


def _finest(cells: Floats, steps: Floats) -> Floats | None:
    """Return steps divided by the least divisors at which 97 % of the points fit, or None."""
    out = steps.copy()
    for axis in range(3):
        for divisor in _DIVISORS:
            if _whole(cells[:, axis] * divisor, TOLERANCE).mean() >= SHARE:
                out[axis] = steps[axis] / divisor
                break
        else:
            return None
    return out


def named(axes: Floats, steps: Floats) -> tuple[Floats, Floats]:
    """Return axes and steps in the order nearest to the world's axes, free of rounding."""
    turns = proper_permutations()
    best = turns[np.round(np.einsum("aij,ji->a", turns, axes), 9).argmax()]
    axes, steps = best @ axes, (best * best) @ steps
    if np.abs(axes - np.eye(3)).max() < 1e-9:
        axes = np.eye(3)
    return axes, np.array([float(f"{step:.12g}") for step in steps])
