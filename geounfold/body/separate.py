"""What the points must be to have a top and a bottom, and the separate bodies among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.body.block_cells import Cells, neighbours, offsets
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Floats, Ints

SPECK_SHARE = 0.005
"""A body with a smaller share of the points is a speck."""


_NEAR, _WIDE = 21, 64  # neighbours that join scattered points, and those tried for the rest


_REACH, _CAP = 1.15, 2.0  # of the near neighbours' distance; of its median


@dataclass(frozen=True)
class ConnectedPart:
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
        cells = Cells.of(np.rint(points_work / frame.steps).astype(np.int64))
        if not cells.gappy():
            labels = _connected_cells(cells)[cells.cell]
    if labels is None:
        sides = 1.0 if frame.sides is None else frame.sides
        labels = _connected_points(points_work / sides)
    return _by_size(labels, points_work)


def describe_bodies(points: Floats, labels: Ints) -> tuple[ConnectedPart, ...]:
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
        ConnectedPart(
            i, int(size), (float(x), float(y), float(z)), bool(size < SPECK_SHARE * len(labels))
        )
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


def _body_number(choice: int | str, bodies: Sequence[ConnectedPart]) -> int:
    text = str(choice).strip()
    if not text.isdecimal() or int(text) >= len(bodies):
        raise OptionError(
            f"--body {choice} is none of all, 0 to {len(bodies) - 1}: {_listed(bodies)}"
        )
    return int(text)


def _listed(bodies: Sequence[ConnectedPart], most: int = 10) -> str:
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


def _connected(first: Ints, second: Ints, count: int) -> Ints:
    """Return component labels (count,) of an undirected graph given by its edges."""
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    labels: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def _connected_cells(cells: Cells) -> Ints:
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
    for offset in offsets(2):
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
    distance, near = neighbours(tree, X, _NEAR)
    reach = np.minimum(distance[:, -1], _CAP * np.median(distance[:, -1]))
    labels = np.arange(len(X))
    for part in (slice(1, 5), slice(5, None)):
        labels = _joined(labels, labels, near[:, part], distance[:, part], reach, reach)
    sizes = np.bincount(labels)
    rest = np.flatnonzero(labels != sizes.argmax())
    if len(rest):
        distance, near = neighbours(tree, X[rest], _WIDE)
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
