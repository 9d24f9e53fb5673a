"""A body cut into fault blocks along fault surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells, connected
from geounfold.body.fault_surface import FaultSurface, Sides
from geounfold.body.prepare import Cells
from geounfold.body.scattered import nearest_points
from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Bools, Floats, Ints

CRUMB = 50
"""Number of blocks below which a piece is a crumb of the staircase along a fault.

Measured: 5 to 20 crumbs in the wrong fault block double its error.
"""

SMALL = 200
"""Number of blocks below which a fault block is not unfolded by itself.

Fewer have no hull, or one whose sides cannot be told apart.
"""

_PAST = 1.6  # blocks past a surface's border up to which its plane still cuts
_STEEPEST = 1.3  # longest step across a surface over its plane, in blocks' distances
_CONTINUED = 20  # blocks on each side of a surface inside one piece from which it is continued
_NEAR = 0.9  # blocks: their distance from it
_AROUND = 40  # blocks near a crumb among which its fault block is sought
_SCATTERED = 14  # nearest points that count as neighbours of a scattered point


@dataclass(frozen=True, eq=False)
class FaultCut:
    """Blocks cut into fault blocks.

    Attributes
    ----------
    block : (n,) int
        Fault block of each, 0 the largest.
    weld : (k, 2) int
        Neighbours parted where a fault that ends inside the body was continued: no slip there.
    crossed : (s,) int
        Number of neighbours that each surface itself parts.
    crumbs : int
        Blocks of pieces smaller than CRUMB, which were given to a fault block near by.
    """

    block: Ints
    weld: Ints
    crossed: Ints
    crumbs: int

    @property
    def count(self) -> int:
        """Number of fault blocks."""
        return int(self.block.max()) + 1


def neighbours(points: Floats, frame: Frame) -> Ints:
    """Return the pairs of neighbours among points, (k, 2): across faces on a lattice."""
    cells = frame.cells(points)
    if cells is None:
        _, near = nearest_points(cKDTree(points), points, min(_SCATTERED, len(points)))
        near = near[:, 1:]
        row = np.repeat(np.arange(len(points)), near.shape[1])
        pairs = np.sort(np.stack([row, near.ravel()], axis=1), axis=1)
        return np.unique(pairs, axis=0)
    occupied, row = OccupiedCells.numbered(cells)
    first = np.full(len(occupied.keys), -1)
    first[row[::-1]] = np.arange(len(points))[::-1]  # of repeated points the first
    found = [np.stack([first[row], np.arange(len(points))], axis=1)]
    found[0] = found[0][found[0][:, 0] != found[0][:, 1]]
    for step in occupied.stride.tolist():
        beside = occupied.rows(occupied.keys + step)
        there = np.flatnonzero(beside >= 0)
        found.append(np.stack([first[there], first[beside[there]]], axis=1))
    return np.concatenate(found)


def crossing_pairs(
    points: Floats, surfaces: Sequence[FaultSurface], frame: Frame
) -> tuple[Ints, Bools, Floats]:
    """Return pairs of neighbours, which of them surfaces part, and distances from these."""
    pairs = neighbours(points, frame)
    side = 1.0 if frame.sides is None else float(max(frame.sides))
    parted, nearest = np.zeros(len(pairs), dtype=bool), np.full(len(points), np.inf)
    for surface in surfaces:
        seen = surface.sides(points)
        parted |= _crossing(points, pairs, seen, side)
        nearest = np.minimum(nearest, seen.distance)
    return pairs, parted, nearest


def cut_blocks(
    points: Floats, surfaces: Sequence[FaultSurface], frame: Frame, least: int = CRUMB
) -> FaultCut:
    """Return points cut into fault blocks by surfaces.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    surfaces : sequence of FaultSurface
        Working units.
    frame : Frame
        The working frame.
    least : int
        Number of blocks below which a piece is no fault block.
    """
    pairs = neighbours(points, frame)
    side = 1.0 if frame.sides is None else float(max(frame.sides))
    seen = [surface.sides(points) for surface in surfaces]
    crossing = [_crossing(points, pairs, s, side) for s in seen]
    parted = np.zeros(len(pairs), dtype=bool)
    for crossed in crossing:
        parted |= crossed
    label = connected(pairs[~parted, 0], pairs[~parted, 1], len(points))
    weld = np.zeros((0, 2), np.int64)
    for s in seen:
        parted, label, more = _continued(pairs, parted, label, s, side, least)
        weld = np.concatenate([weld, more])
    label, crumbs = _without_crumbs(points, label, seen, side, least)
    label = by_size(label)
    apart = label[weld[:, 0]] != label[weld[:, 1]]
    count = np.array([int(c.sum()) for c in crossing], dtype=np.int64)
    return FaultCut(label, weld[apart], count, crumbs)


def blocks_of_cells(cells: Cells, blocks: Ints) -> Ints:
    """Return the fault block of every cell, by those of the points (n,) in them."""
    out = np.full(len(cells.work), -1)
    out[cells.home[::-1]] = blocks[::-1]
    empty = np.flatnonzero(out < 0)
    if len(empty):
        full = np.flatnonzero(out >= 0)
        out[empty] = out[full[cKDTree(cells.work[full]).query(cells.work[empty])[1]]]
    return out


def joined_small(
    points: Floats, cut: FaultCut, frame: Frame, least: int = SMALL
) -> tuple[FaultCut, list[str]]:
    """Return the cut with fault blocks too small to unfold joined to a neighbour, and notes.

    A small block joins the block with which it has the most neighbours, or the nearest one.
    """
    block, notes = cut.block.copy(), []
    pairs = neighbours(points, frame)
    while True:
        size = np.bincount(block)
        small = np.flatnonzero((size > 0) & (size < least))
        if not len(small) or np.count_nonzero(size) == 1:
            break
        own = int(small[np.argmin(size[small])])
        ends = block[pairs]
        touching = np.concatenate([ends[ends[:, 0] == own, 1], ends[ends[:, 1] == own, 0]])
        touching = touching[touching != own]
        rows = np.flatnonzero(block == own)
        if len(touching):
            to = int(np.bincount(touching).argmax())
        else:
            rest = np.flatnonzero(block != own)
            near = cKDTree(points[rest]).query(points[rows])[1]
            to = int(np.bincount(block[rest[near]]).argmax())
        place = ", ".join(f"{c:.6g}" for c in frame.to_world(points[rows].mean(0)[None])[0])
        notes.append(
            f"a fault block of {len(rows)} blocks around ({place}) is too small to unfold alone "
            f"(fewer than {least}); it was joined to its neighbour of {size[to]}"
        )
        block[rows] = to
    block = by_size(block)
    apart = block[cut.weld[:, 0]] != block[cut.weld[:, 1]]
    return replace(cut, block=block, weld=cut.weld[apart]), notes


def by_size(label: Ints) -> Ints:
    """Return labels (n,) from 0 without gaps, the largest first."""
    _, label = np.unique(label, return_inverse=True)
    order = np.argsort(-np.bincount(label), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    out: Ints = rank[label]
    return out


def _crossing(points: Floats, pairs: Ints, seen: Sides, side: float) -> Bools:
    """Return which pairs (k, 2) of neighbours lie on both sides of a surface, at its border too."""
    a, b = pairs.T
    s, beyond = seen.signed, seen.beyond
    out: Bools = (np.sign(s[a]) != np.sign(s[b])) & (
        np.maximum(beyond[a], beyond[b]) < _PAST * side
    )
    rows = np.flatnonzero(out)
    a, b = pairs[rows].T
    length = np.linalg.norm(points[a] - points[b], axis=1)
    out[rows] = np.abs(s[a]) + np.abs(s[b]) < _STEEPEST * length
    return out


def _continued(
    pairs: Ints, parted: Bools, label: Ints, seen: Sides, side: float, least: int
) -> tuple[Bools, Ints, Ints]:
    """Return what is parted and the pieces, a surface that ends inside one continued, and welds."""
    weld = np.zeros((0, 2), np.int64)
    for piece in np.flatnonzero(np.bincount(label) > 2 * least):
        near = (label == piece) & (seen.distance < _NEAR * side) & ~seen.past
        above = seen.signed > 0
        if min((near & above).sum(), (near & ~above).sum()) <= _CONTINUED:
            continue
        own = (label[pairs] == piece).all(axis=1) & ~parted
        more = own & (above[pairs[:, 0]] != above[pairs[:, 1]])
        parted = parted | more
        weld = np.concatenate([weld, pairs[more]])
        label = connected(pairs[~parted, 0], pairs[~parted, 1], len(label))
    return parted, label, weld


def _without_crumbs(
    points: Floats, label: Ints, seen: Sequence[Sides], side: float, least: int
) -> tuple[Ints, int]:
    """Return labels with crumbs given to a piece near by, on their side of the faults near by."""
    size = np.bincount(label)
    crumb = np.flatnonzero(size[label] < least)
    whole = np.flatnonzero(size[label] >= least)
    if not len(crumb) or not len(whole):
        return label, 0
    k = min(_AROUND, len(whole))
    distance, near = nearest_points(cKDTree(points[whole]), points[crumb], k)
    near, wrong = whole[near], 0.01 * distance
    for s in seen:
        rows = np.flatnonzero(s.distance[crumb] < 2 * side)
        own = np.sign(s.signed[crumb[rows]])
        wrong[rows] += np.sign(s.signed[near[rows]]) != own[:, None]
    label = label.copy()
    label[crumb] = label[near[np.arange(len(crumb)), wrong.argmin(axis=1)]]
    return label, len(crumb)
