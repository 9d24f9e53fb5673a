"""The separate bodies among the points, and the choice of those to unfold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells, connected, offsets
from geounfold.body.scattered import nearest_points
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, OptionError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Floats, Ints

SPECK_SHARE = 0.005
"""A body with a smaller share of the points is a speck."""

_NEAR, _WIDE = 21, 64  # nearest points that join scattered points, and those tried for the rest
_REACH = 1.15  # times the distance of the 20th neighbour: how far the rest is joined
_CAP = 2.0  # times the median distance of the 20th neighbour: farthest join of scattered points


@dataclass(frozen=True)
class ConnectedPart:
    """One connected part of the input.

    Attributes
    ----------
    label : int
        Its number; 0 is the largest.
    size : int
        Number of its blocks, duplicates included.
    centre : tuple of float
        Mean of its points, in their coordinates.
    speck : bool
        Whether it holds less than 0.5 % of all points.
    """

    label: int
    size: int
    centre: tuple[float, float, float]
    speck: bool


def separate_bodies(points_work: Floats, frame: Frame) -> Ints:
    """Return the body that each point belongs to, (n,), numbered from 0 by decreasing size.

    On a lattice, blocks are connected if they touch (at faces, edges or corners) or if one missing
    block lies between them. Scattered points are connected to their 20 nearest neighbours and to
    points up to 15 % farther, at most twice the median distance of the 20th neighbour. That
    bridges one missing point of a regular grid and not three. Lattices on which a fifth of the
    points or more have no neighbour (sub-blocked models) are connected like scattered points.
    Bodies of equal size are numbered by their lowest point in lexicographic order.

    Parameters
    ----------
    points_work : (n, 3) float
        Points in working units.
    frame : Frame
        The points' working frame.
    """
    labels: Ints | None = None
    if frame.steps is not None:
        cells, row = OccupiedCells.numbered(frame.nearest_cells(points_work))
        if not cells.gappy():
            labels = _connected_cells(cells)[row]
    if labels is None:
        sides = 1.0 if frame.sides is None else frame.sides
        labels = _connected_points(points_work / sides)
    return _by_size(labels, points_work)


def describe_bodies(points: Floats, labels: Ints) -> tuple[ConnectedPart, ...]:
    """Return number, size and centre of each body, the largest first.

    Parameters
    ----------
    points : (n, 3) float
        In the coordinates in which the centres are wanted, such as the world's.
    labels : (n,) int
        The body of each point, from separate_bodies.
    """
    sizes = np.bincount(labels)
    low, high = bounds(points)
    middle = (low + high) / 2
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
        The body of each point, from separate_bodies.
    choice : int, str or None
        A body's number; ``"all"`` for every body that is not a speck; or None for the only body.
        Specks beside one body make no choice necessary; describe_bodies lists them.

    Raises
    ------
    InputError
        Several bodies and no choice; the message names each with its size and centre.
    OptionError
        The choice is neither a body's number nor ``all``.
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
            f"--body must be all or 0 to {len(bodies) - 1}, but is {choice}: {_listed(bodies)}"
        )
    return int(text)


def _listed(bodies: Sequence[ConnectedPart], most: int = 10) -> str:
    """Return bodies with their sizes and centres as text, the first ten at most."""
    named = [
        f"{body.label} ({body.size} blocks around {', '.join(f'{c:.10g}' for c in body.centre)}"
        f"{', a speck' if body.speck else ''})"
        for body in bodies[:most]
    ]
    if len(bodies) > most:
        rest = sum(body.size for body in bodies[most:])
        named.append(f"and {len(bodies) - most} smaller ones ({rest} blocks in all)")
    return ", ".join(named)


def _connected_cells(cells: OccupiedCells) -> Ints:
    """Return the components of cells at most two steps apart along every axis.

    Cells that share a face are joined first. The other offsets are tried only from cells with a
    free face outside the largest of those parts, because every join of two parts has such a cell.
    """
    labels = cells.parts()
    sizes = np.bincount(labels)
    if len(sizes) == 1:
        return labels
    outside = np.flatnonzero(labels != sizes.argmax())
    free = outside[cells.face_counts(cells.keys[outside]) < 6]
    joined = [np.zeros((0, 2), np.int64)]
    for offset in offsets(2):
        other = cells.beside(free, offset)
        pairs = np.stack([labels[free], labels[other]], axis=1)[other >= 0]
        joined.append(np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0))
    a, b = np.concatenate(joined).T
    return connected(a, b, len(sizes))[labels]


def _connected_points(points: Floats) -> Ints:
    """Return the components of scattered points (see separate_bodies).

    The few nearest points make the first components; farther ones only join those.
    """
    order = np.asarray(cKDTree(points).indices, dtype=np.int64)
    X = points[order]  # neighbours in space become neighbours in memory: three times as fast
    tree = cKDTree(X)
    distance, near = nearest_points(tree, X, _NEAR)
    reach = np.minimum(distance[:, -1], _CAP * np.median(distance[:, -1]))
    labels = np.arange(len(X))
    for part in (slice(1, 5), slice(5, None)):
        labels = _joined(labels, labels, near[:, part], distance[:, part], reach, reach)
    sizes = np.bincount(labels)
    rest = np.flatnonzero(labels != sizes.argmax())
    if len(rest):
        distance, near = nearest_points(tree, X[rest], _WIDE)
        wide = _REACH * reach
        labels = _joined(labels, labels[rest], near, distance, wide[rest], wide)
    out = np.empty_like(labels)
    out[order] = labels
    return out


def _joined(
    labels: Ints, own: Ints, near: Ints, distance: Floats, own_reach: Floats, reach: Floats
) -> Ints:
    """Return labels with those components joined that neighbouring points connect.

    Row k of ``near`` and ``distance`` is that of a point with label ``own[k]`` and reach
    ``own_reach[k]``. Two points connect if either reaches the other.
    """
    other = labels[near]
    row, column = np.nonzero(other != own[:, None])
    target = near[row, column]
    close = distance[row, column] <= np.maximum(own_reach[row], reach[target])
    row, target = row[close], target[close]
    return connected(own[row], labels[target], int(labels.max()) + 1)[labels]


def _by_size(labels: Ints, points: Floats) -> Ints:
    """Return labels renumbered by decreasing size; equal sizes by their first point in x, y, z."""
    sizes = np.bincount(labels)
    rank = np.zeros(len(sizes), np.int64)
    if len(np.unique(sizes)) < len(sizes):
        order = np.lexsort(points.T[::-1])
        rank[labels[order[::-1]]] = np.arange(len(points))[::-1]
    out = np.empty(len(sizes), np.int64)
    out[np.lexsort((rank, -sizes))] = np.arange(len(sizes))
    return out[labels]
