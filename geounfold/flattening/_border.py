"""Proof that a flat map is one-to-one: exact signs of triangles, exact crossings of the border.

**Theorem** (Lipman 2014, arXiv 1310.0955, here for the plane).  A continuous map that is linear
on the triangles of a compact oriented surface, none of them turned over or without area, and
one-to-one on its border, is one-to-one, provided that one border loop runs counter-clockwise
about its image and every other one clockwise.

**Proof**: the number of preimages of a point off the border's image equals the winding number of
the border around it, because no triangle counts negatively.  Simple, disjoint loops wind once
around their inside: the counter-clockwise one adds 1, the others add 0 or subtract 1.  So no point
has two preimages.  With one loop its direction needs no test, because the number of preimages is
never negative.  With holes it does: a loop of the wrong direction encloses points that are covered
twice, around branch points (vertices whose angles sum to more than a full turn).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.predicates import orientations
from geounfold.geometry.mesh import Bools, Floats, Ints

#: The four pairs of children of a pair of boxes.
_FIRST, _SECOND = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])


@dataclass(frozen=True, eq=False)
class Border:
    """Faults in the flat image of a surface's border.

    Attributes
    ----------
    crossings : (q, 2, 2) int
        Pairs of disjoint border edges whose images meet, each edge as its two vertices.
    turned : int
        Number of counter-clockwise loops beyond one, or 1 if there is none; counted only if nothing
        crosses.
    """

    crossings: Ints
    turned: int

    @property
    def overlaps(self) -> int:
        """Return the number of crossings; if there are none, of loops of the wrong direction."""
        return len(self.crossings) + self.turned


def turned_over(uv: Floats, F: Ints) -> Ints:
    """Return the faces whose flat image is not counter-clockwise, by an exact predicate."""
    signs = orientations(uv[F[:, 0]], uv[F[:, 1]], uv[F[:, 2]])
    return np.flatnonzero(signs <= 0)


def is_one_to_one(uv: Floats, F: Ints, loops: tuple[Ints, ...]) -> bool:
    """Return whether a flat map of a disk, holes allowed, is proved to be one-to-one."""
    return not len(turned_over(uv, F)) and not border_of(uv, loops).overlaps


def border_of(uv: Floats, loops: tuple[Ints, ...]) -> Border:
    """Return the faults of the flat border: pairs of edges that meet, or loops turned over.

    Parameters
    ----------
    uv : (n, 2) float
        Flat positions.
    loops : tuple of (b,) int
        Border loops in face direction: the surface is on their left.
    """
    edges = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    pairs = _near_pairs(uv[edges])
    met = _meet(uv, edges[pairs[:, 0]], edges[pairs[:, 1]])
    crossings = edges[pairs[met]].reshape(-1, 2, 2)
    if len(crossings):
        return Border(crossings, 0)
    forward = sum(_turn(uv[loop]) > 0 for loop in loops)
    return Border(crossings, abs(forward - 1))


def _near_pairs(segments: Floats) -> Ints:
    """Return the pairs (i < j) of segments (k, 2, 2) whose boxes touch, (p, 2).

    Boxes round runs of 1, 2, 4, ... consecutive segments form a tree; pairs of boxes that touch are
    followed down it.  A border is a curve, so few boxes touch except neighbours: O(k log k) in all,
    unless the border is crumpled everywhere.
    """
    k = len(segments)
    depth = max(k - 1, 0).bit_length()
    low = np.full((2**depth, 2), np.inf)
    high = -low
    low[:k], high[:k] = segments.min(axis=1), segments.max(axis=1)
    levels = [(low, high)]
    for _ in range(depth):
        low = np.minimum(low[::2], low[1::2])
        high = np.maximum(high[::2], high[1::2])
        levels.append((low, high))
    i = j = np.zeros(1, dtype=np.int64)
    for low, high in levels[-2::-1]:
        # A box with itself has three pairs of children, two boxes have four.
        i, j = 2 * i[:, None] + _FIRST, 2 * j[:, None] + _SECOND
        i, j = i[i <= j], j[i <= j]
        touch = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)
        i, j = i[touch], j[touch]
    return np.column_stack([i, j])[i < j]


def _meet(uv: Floats, first: Ints, second: Ints) -> Bools:
    """Return whether edges whose boxes touch have images with a common point, (p,).

    Edges with a common vertex count if they have another point in common.
    """
    apart = ~(first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    out = np.zeros(len(first), dtype=bool)
    a, b, c, d = (uv[ends] for pair in (first, second) for ends in pair[apart].T)
    # Edges cross if each has its ends on both sides of the other's line.  If all four ends lie on
    # one line, the boxes decide.
    split = orientations(a, b, c) * orientations(a, b, d) <= 0
    out[apart] = split & (orientations(c, d, a) * orientations(c, d, b) <= 0)
    out[~apart] = _fold_back(uv, first[~apart], second[~apart])
    return out


def _fold_back(uv: Floats, first: Ints, second: Ints) -> Bools:
    """Return whether edges with a common vertex overlap."""
    reverse = first[:, 0] == second[:, 1]
    before = np.where(reverse[:, None], second, first)
    after = np.where(reverse[:, None], first, second)
    p, shared, q = uv[before[:, 0]], uv[after[:, 0]], uv[after[:, 1]]
    same_side = (np.sign(p - shared) == np.sign(q - shared)).all(axis=1)
    out: Bools = same_side & (orientations(p, shared, q) == 0)
    return out


def _turn(points: Floats) -> int:
    """Return 1 if a simple polygon (b, 2) runs counter-clockwise, -1 if clockwise."""
    k = int(np.lexsort((points[:, 1], points[:, 0]))[0])
    around = points[[k - 1, k, (k + 1) % len(points)]]
    return int(orientations(around[:1], around[1:2], around[2:])[0])
