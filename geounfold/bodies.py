"""What the points must be to have a top and a bottom, and the separate bodies among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.errors import InputError, OptionError
from geounfold.frame import Frame
from geounfold.lattice import Lattice, distinct, lattice_indices, measure_lattice, point_spacing
from geounfold.mesh import Floats, Ints
from geounfold.threads import cores

MIN_POINTS = 50
"""Fewest distinct points of a body: a sheet of 5 x 5 blocks, two thick."""

SPECK_SHARE = 0.005
"""A body with a smaller share of the points is a speck."""

_MIXED = np.array([1.0, np.sqrt(2) / 2, np.pi / 6])  # different rows hardly ever share a sum
_EMPTY = 32  # cells of a box per block, up to which parts are told in an array of all
_FLAT = 0.05  # extent, in point spacings, below which points lie on a line or plane
_SCATTER = 0.38  # rms off the local surface per nearest distance: one layer 0.27, two 0.5
_MARGIN = 2  # blocks, the farthest neighbours that are looked up
_SAMPLE = 2000  # blocks that are looked at
_AROUND = 101  # nearest points among which three directions are looked for, itself included
_NEAR, _WIDE = 21, 64  # neighbours that join scattered points, and those tried for the rest
_REACH, _CAP = 1.15, 2.0  # of the near neighbours' distance; of its median


@dataclass(frozen=True)
class Body:
    """One connected part of the input.

    Attributes
    ----------
    label : int
        Its number: 0 is the largest.
    size : int
        Number of its blocks, duplicates included.
    centre : tuple of float
        Mean of its points, in the coordinates given.
    speck : bool
        True when it holds less than 0.5 % of all points.
    """

    label: int
    size: int
    centre: tuple[float, float, float]
    speck: bool


def count_duplicates(points: Floats) -> int:
    """Return how many rows repeat the coordinates of another row.

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
    """Raise unless the points fill a body that can have a top and a bottom.

    Parameters
    ----------
    points : (n, 3) float
        Finite world coordinates; duplicates are allowed.
    lattice : Lattice, optional
        Theirs, where the caller has measured it; measured here when left out.

    Raises
    ------
    InputError
        Too few distinct points; all in one column, on a line or in a plane; or all on one
        surface and not on a lattice.  A folded sheet of one layer of blocks has a top and a
        bottom, as its blocks have.
    """
    count = len(points) - count_duplicates(points)
    _check_count(count, len(points))
    if lattice is None:
        _check_extent(points, count, point_spacing(points))
        lattice = measure_lattice(distinct(points))
    else:
        _check_extent(points, count, float(np.cbrt(lattice.steps.prod())))
    if lattice is not None and not _Cells.of(lattice_indices(points, lattice)).gappy():
        return
    X = distinct(points)
    if _one_layer_of_points(X) and not _in_three_directions(X):
        raise InputError(
            f"the {len(X)} points lie on one surface, on no lattice of touching blocks: a sheet "
            "one block thick, and nothing tells how thick a block is; give at least two layers "
            "of blocks (smaller blocks across the sheet)"
        )


def separate_bodies(points_work: Floats, frame: Frame) -> Ints:
    """Return the body that each point belongs to, (n,): 0 the largest, then by size.

    On a lattice, blocks are connected when they touch (faces, edges or corners) or one
    missing block lies between them.  Scattered points, and lattices most of whose positions
    are empty (sub-blocked models), are connected to their 20 nearest neighbours and to points
    15 % farther, but over no more than twice the median distance of the 20th neighbour: that
    bridges one missing point of a regular grid and not three.  Bodies of equal size are
    numbered by their lowest point in lexicographic order.

    Parameters
    ----------
    points_work : (n, 3) float
        Points in working units.
    frame : Frame
        Their frame.
    """
    labels: Ints | None = None
    if frame.steps is not None:
        cells = _Cells.of(np.rint(points_work / frame.steps).astype(np.int64))
        if not cells.gappy():
            labels = _connected_cells(cells)[cells.cell]
    if labels is None:
        sides = 1.0 if frame.sides is None else frame.sides
        labels = _connected_points(points_work / sides)
    return _by_size(labels, points_work)


def describe_bodies(points: Floats, labels: Ints) -> tuple[Body, ...]:
    """Return number, size and centre of each body, the largest first.

    Parameters
    ----------
    points : (n, 3) float
        In the coordinates that the centres shall have (world).
    labels : (n,) int
        As separate_bodies gives them.
    """
    sizes = np.bincount(labels)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    sums = [np.bincount(labels, column) for column in (points - middle).T]
    centres = np.stack(sums, axis=1) / sizes[:, None] + middle
    return tuple(
        Body(i, int(size), (float(x), float(y), float(z)), bool(size < SPECK_SHARE * len(labels)))
        for i, (size, (x, y, z)) in enumerate(zip(sizes, centres, strict=True))
    )


def select_body(points: Floats, labels: Ints, choice: int | str | None = None) -> tuple[Ints, ...]:
    """Return the row numbers of each body to unfold, one array per body.

    Parameters
    ----------
    points : (n, 3) float
        World coordinates.
    labels : (n,) int
        As separate_bodies gives them.
    choice : int, str or None
        A body's number, ``"all"`` (every body that is no speck, one after the other), or None:
        the only body.  Specks beside one body do not make a choice necessary; report them
        (describe_bodies).

    Raises
    ------
    InputError
        Several bodies and no choice; each is named with its size and centre.
    OptionError
        The choice is no body's number and not ``all``.
    """
    bodies = describe_bodies(points, labels)
    whole = [body.label for body in bodies if not body.speck] or [0]
    if choice is None:
        if len(whole) > 1:
            raise InputError(
                f"the points form {len(bodies)} separate bodies: {_listed(bodies)}; "
                "choose one with --body N, or --body all"
            )
        chosen = whole
    elif choice == "all":
        chosen = whole
    else:
        chosen = [_body_number(choice, bodies)]
    return tuple(np.flatnonzero(labels == label) for label in chosen)


def _body_number(choice: int | str, bodies: Sequence[Body]) -> int:
    text = str(choice).strip()
    if not text.isdecimal() or int(text) >= len(bodies):
        raise OptionError(
            f"--body {choice} is none of all, 0 to {len(bodies) - 1}: {_listed(bodies)}"
        )
    return int(text)


def _listed(bodies: Sequence[Body], most: int = 10) -> str:
    """Name bodies with their sizes and centres, the first ten at most."""
    named = [
        f"{body.label} ({body.size} blocks around {', '.join(f'{c:.10g}' for c in body.centre)}"
        f"{', a speck' if body.speck else ''})"
        for body in bodies[:most]
    ]
    if len(bodies) > most:
        rest = sum(body.size for body in bodies[most:])
        named.append(f"and {len(bodies) - most} smaller ones ({rest} blocks in all)")
    return ", ".join(named)


def _check_count(count: int, rows: int) -> None:
    if count < MIN_POINTS:
        same = f" ({rows} rows with duplicates)" if rows > count else ""
        raise InputError(
            f"only {count} distinct points{same}, but a body needs at least {MIN_POINTS}; "
            "give the centroids of all its blocks"
        )


def _check_extent(X: Floats, count: int, spacing: float) -> None:
    """Raise when the points' extents across their main directions are (nearly) nothing.

    So many of them are distinct, and they lie about so far apart.
    """
    limit = _FLAT * spacing
    constant = np.ptp(X, axis=0) < limit
    if constant.sum() == 2:
        fixed = " and ".join(f"{'xyz'[i]} = {X[0, i]:.10g}" for i in np.flatnonzero(constant))
        raise InputError(
            f"all {count} points are in one column ({fixed}); "
            "give a body that extends in all three directions"
        )
    centred = X - X.mean(axis=0)
    along = centred @ np.linalg.eigh(centred.T @ centred)[1]
    across, second = np.ptp(along[:, 0]), np.ptp(along[:, 1])
    if second < limit:
        raise InputError(
            f"all {count} points are on one line; give a body that extends in all three directions"
        )
    if across < limit:
        raise InputError(
            f"all {count} points are in one plane, so nothing tells how thick the body is (and "
            "it is unfolded already); give at least two layers of blocks"
        )


@dataclass(frozen=True, eq=False)
class _Cells:
    """The distinct occupied lattice cells, hashed so that neighbours are found by bisection."""

    keys: Ints  # (m,) sorted
    strides: Ints  # (3,) key of one step along each axis
    cell: Ints  # (n,) distinct cell of each input row
    shape: Ints  # (3,) cells of the box that the keys count

    @classmethod
    def of(cls, indices: Ints) -> _Cells:
        """Hash integer cells (n, 3); offsets of up to _MARGIN cells never collide."""
        low = indices.min(axis=0) - _MARGIN
        size = indices.max(axis=0) - low + 1 + _MARGIN
        strides = np.array([size[1] * size[2], size[2], 1], dtype=np.int64)
        keys, cell = np.unique((indices - low) @ strides, return_inverse=True)
        return cls(keys, strides, cell, size)

    def find(self, which: Ints, offset: Sequence[int]) -> Ints:
        """Return the cell at an offset from each of some cells; -1 where it is empty."""
        wanted = self.keys[which] + int(np.dot(offset, self.strides))
        place = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        out: Ints = np.where(self.keys[place] == wanted, place, -1)
        return out

    def labelled(self) -> Ints | None:
        """Return the face-connected part of each cell, (m,); None where the box is too empty."""
        if float(np.prod(self.shape.astype(float))) > _EMPTY * len(self.keys):
            return None
        held = np.zeros(int(self.shape.prod()), dtype=bool)
        held[self.keys] = True
        labels = ndimage.label(held.reshape(self.shape))[0].ravel()
        out: Ints = labels.take(self.keys).astype(np.int64) - 1
        return out

    def sample(self) -> Ints:
        """Return about _SAMPLE cells spread evenly over the sorted ones."""
        return np.arange(0, len(self.keys), -(-len(self.keys) // _SAMPLE))

    def gappy(self) -> bool:
        """Say whether most cells have no neighbour face to face (a sub-blocked model)."""
        some = self.sample()
        touched = np.zeros(len(some), bool)
        for offset in _offsets(1):
            touched |= self.find(some, offset) >= 0
        return bool(touched.mean() < 0.8)


def _offsets(reach: int) -> list[tuple[int, ...]]:
    """Return the cells up to ``reach`` steps away along each axis, the cell itself left out."""
    span = range(-reach, reach + 1)
    return [offset for offset in product(span, repeat=3) if any(offset)]


def _one_layer_of_points(X: Floats) -> bool:
    """Say whether scattered points lie on one surface, within their noise.

    A paraboloid is fitted to each point's 24 nearest neighbours across their direction of
    least variance; the rms distance from it, over the median distance of the nearest
    neighbour, is 0 on a surface and 0.5 for two layers.  Neighbourhoods along a line (columns
    of flat blocks) count as thick.
    """
    some = X[:: -(-len(X) // _SAMPLE)]
    distance, near = _neighbours(cKDTree(X), some, 25)
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
    """Say whether most points have neighbours along three directions, as blocks in layers have.

    From the nearest other point; the nearest across it; and the nearest more than 60 degrees out
    of the plane of both, which a sheet of one layer has none of.  Folded grids of flat or
    long blocks, whose nearest points all lie on a line or two, count as thick by this.
    """
    some = X[:: -(-len(X) // _SAMPLE)]
    near = _neighbours(cKDTree(X), some, _AROUND)[1]
    D = X[near[:, 1:]] - some[:, None]
    length = np.linalg.norm(D, axis=2)
    first = D[:, 0] / length[:, :1]
    across = np.abs(np.einsum("nki,ni->nk", D, first)) < 0.3 * length
    second = D[np.arange(len(D)), across.argmax(axis=1)]
    normal = np.cross(first, second)
    size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    out = np.abs(np.einsum("nki,ni->nk", D, normal)) > 0.87 * length * size[:, None]
    return bool((across.any(axis=1) & out.any(axis=1)).mean() > 0.5)


def _neighbours(tree: cKDTree, points: Floats, count: int) -> tuple[Floats, Ints]:
    """Return distances and numbers of the nearest points, themselves first, (m, count) each."""
    distance, near = tree.query(points, k=min(count, tree.n), workers=cores())
    return np.asarray(distance), np.asarray(near, dtype=np.int64)


def _connected(first: Ints, second: Ints, count: int) -> Ints:
    """Return component labels (count,) of an undirected graph given by its edges."""
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    labels: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def _connected_cells(cells: _Cells) -> Ints:
    """Return component labels of cells at most two steps apart along every axis.

    Face neighbours first; the other 118 offsets only from cells outside the largest of those
    components (an edge between two components has such an end), and not from inner ones.
    """
    every = np.arange(len(cells.keys))
    labels = cells.labelled()
    if labels is not None and labels.max() == 0:
        return labels
    found = [cells.find(every, offset) for offset in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    first = np.concatenate([every[other >= 0] for other in found])
    second = np.concatenate([other[other >= 0] for other in found])
    labels = _connected(first, second, len(every))
    faces = np.bincount(np.concatenate([first, second]), minlength=len(every))
    sizes = np.bincount(labels)
    if len(sizes) == 1:
        return labels
    open_cells = every[(labels != sizes.argmax()) & (faces < 6)]
    joined = [np.zeros((0, 2), np.int64)]
    for offset in _offsets(2):
        other = cells.find(open_cells, offset)
        pairs = np.stack([labels[open_cells], labels[other]], axis=1)[other >= 0]
        joined.append(np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0))
    a, b = np.concatenate(joined).T
    return _connected(a, b, len(sizes))[labels]


def _connected_points(points: Floats) -> Ints:
    """Return component labels of scattered points (see separate_bodies).

    The nearest few neighbours make the first components; farther ones only join those.
    """
    order = np.asarray(cKDTree(points).indices, dtype=np.int64)
    X = points[order]  # neighbours in space are neighbours in memory: three times as fast
    tree = cKDTree(X)
    distance, near = _neighbours(tree, X, _NEAR)
    reach = np.minimum(distance[:, -1], _CAP * np.median(distance[:, -1]))
    labels = np.arange(len(X))
    for part in (slice(1, 5), slice(5, None)):
        labels = _joined(labels, labels, near[:, part], distance[:, part], reach, reach)
    sizes = np.bincount(labels)
    rest = np.flatnonzero(labels != sizes.argmax())
    if len(rest):
        distance, near = _neighbours(tree, X[rest], _WIDE)
        wide = _REACH * reach
        labels = _joined(labels, labels[rest], near, distance, wide[rest], wide)
    out = np.empty_like(labels)
    out[order] = labels
    return out


def _joined(
    labels: Ints, own: Ints, near: Ints, distance: Floats, own_reach: Floats, reach: Floats
) -> Ints:
    """Return labels with the components joined that neighbours within reach connect.

    Rows of ``near`` and ``distance`` belong to points labelled ``own`` that reach
    ``own_reach``; two points connect when either reaches the other.
    """
    other = labels[near]
    row, column = np.nonzero(other != own[:, None])
    target = near[row, column]
    close = distance[row, column] <= np.maximum(own_reach[row], reach[target])
    row, target = row[close], target[close]
    return _connected(own[row], labels[target], int(labels.max()) + 1)[labels]


def _by_size(labels: Ints, points: Floats) -> Ints:
    """Renumber labels by decreasing size; equal sizes by their first point in x, y, z."""
    sizes = np.bincount(labels)
    rank = np.zeros(len(sizes), np.int64)
    if len(np.unique(sizes)) < len(sizes):
        order = np.lexsort(points.T[::-1])
        rank[labels[order[::-1]]] = np.arange(len(points))[::-1]
    out = np.empty(len(sizes), np.int64)
    out[np.lexsort((rank, -sizes))] = np.arange(len(sizes))
    return out[labels]
