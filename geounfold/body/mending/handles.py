"""Close the handles of a body, smallest first: fill small holes, cut thin bridges."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import ndimage

from geounfold.body.mending.euler import CORNER, FACE, handle_count
from geounfold.body.mending.fillings import OPEN_RIM
from geounfold.body.mending.pieces import Pieces
from geounfold.geometry.mesh import Bools, Ints

WIDTHS = (1, 2, 3, 4)
"""Half widths, in cells, of the holes that are filled and the bridges that are cut, in turn."""

SMALL = 120
"""Number of cells, per handle and half width, up to which a piece closes a handle whatever its rim.

Measured: 1 to 14 in layers with waste lenses; 645 at a half width of two in the parting of a split
seam, which stays. With 60, crude shells of 20,000 to 140,000 blocks keep 1 to 29 handles instead of
0 to 21.
"""

LARGEST_SHARE = 0.1
"""Share of the body that a filling with a closed rim may have."""

BRIDGE = 60
"""Number of cells, per handle and half width, up to which a bridge is cut."""

BRIDGE_SHARE = 0.02
"""Share of the body up to which a bridge is cut.

A thin wedge or neck with many handles is part of the layer: one of 28 % is in a sound body.
"""


@dataclass(frozen=True, eq=False)
class ClosedHandles:
    """A body whose small handles are closed.

    Attributes
    ----------
    body : (i, j, k) bool
        Its cells.
    closed, left : int
        Number of handles that were closed, and that are left.
    """

    body: Bools
    closed: int
    left: int


def close_handles(body: Bools, handles: int) -> ClosedHandles:
    """Return a body with its small handles closed.

    A piece that a closing adds or an opening takes away is used if Euler's number counts a handle
    less with it.

    Parameters
    ----------
    body : (i, j, k) bool
        A body in one piece, with layers of empty cells around it as wide as the widest closing.
    handles : int
        Its number of handles.
    """
    left = handles
    for width in WIDTHS:
        if not left:
            break
        body = _fill_holes(body, width)
        body = _cut_bridges(body, width)
        left = handle_count(body)
    return ClosedHandles(body, handles - left, left)


def _fill_holes(body: Bools, width: int) -> Bools:
    """Return the body with the holes filled that a closing of a half width closes."""
    closed = np.asarray(ndimage.binary_closing(body, FACE, width))
    pieces = Pieces.of(body, closed & ~body)
    if not pieces.count:
        return body
    small = pieces.sizes <= SMALL * width * pieces.handles
    lens = (pieces.open_rim < OPEN_RIM) & (pieces.sizes <= LARGEST_SHARE * body.sum())
    return pieces.with_chosen((pieces.handles > 0) & (small | lens))


def _cut_bridges(body: Bools, width: int) -> Bools:
    """Return the body without the bridges that an opening of a half width takes away."""
    opened = np.asarray(ndimage.binary_opening(body, FACE, width))
    pieces = Pieces.of(body, body & ~opened)
    if not pieces.count:
        return body
    wanted = (pieces.handles > 0) & (pieces.sizes <= BRIDGE * width * pieces.handles)
    wanted &= pieces.sizes <= BRIDGE_SHARE * body.sum()
    if not wanted.any():
        return body
    return pieces.with_chosen(wanted & ~_separators(pieces, pieces.with_chosen(wanted)))


def _separators(pieces: Pieces, rest: Bools) -> Bools:
    """Return which pieces join components of the rest of the body, (count + 1,).

    Euler's number rises too if such a piece is taken away, but no handle goes.
    """
    part = ndimage.label(rest, CORNER)[0].ravel()
    first = np.full(pieces.count + 1, part.max() + 1)
    last = np.zeros(pieces.count + 1, part.dtype)
    for step in _neighbours(pieces.number.shape):
        beside = part[pieces.cells + step]
        there = beside > 0
        np.minimum.at(first, pieces.own[there], beside[there])
        np.maximum.at(last, pieces.own[there], beside[there])
    out: Bools = first < last
    return out


def _neighbours(shape: tuple[int, ...]) -> list[int]:
    """Return the flat offsets of a cell's 26 neighbours."""
    stride: Ints = np.array([shape[1] * shape[2], shape[2], 1])
    return [int(np.dot(o, stride)) for o in product((-1, 0, 1), repeat=3) if any(o)]
