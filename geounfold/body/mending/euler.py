"""Euler's number of a voxel body, and how it changes when pieces are added or taken away.

Euler's number is pieces - handles + cavities. It is a sum over the corners of the voxels, each of
which depends only on the eight voxels around it. Cells that share a corner are connected; empty
cells are connected if they share a face.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy import ndimage

from geounfold.geometry.mesh import Bools, Ints, Numbers

CORNER = np.ones((3, 3, 3), dtype=bool)
"""Neighbours of a cell across faces, edges and corners."""

FACE = ndimage.generate_binary_structure(3, 1)
"""Neighbours of a cell across faces."""

_OCTANTS = list(product((0, 1), repeat=3))


def _corner_table() -> Ints:
    """Return eight times a corner's share of Euler's number, for every filling of its octants."""
    table = np.zeros(256, np.int64)
    for code in range(256):
        full = np.array([code >> bit & 1 for bit in range(8)], dtype=bool).reshape(2, 2, 2)
        edges = sum(int(full.take(s, axis=a).any()) for a in range(3) for s in (0, 1))
        lines = (full.any(axis=a) for a in range(3))
        faces = sum(int(line.sum()) for line in lines)
        table[code] = 8 * int(full.any()) - 4 * edges + 2 * faces - int(full.sum())
    return table


_SHARE = _corner_table()


def euler_number(body: Bools) -> int:
    """Return Euler's number of a voxel body.

    Parameters
    ----------
    body : (i, j, k) bool
        Filled cells, with at least one layer of empty ones around them.

    Examples
    --------
    >>> ring = np.zeros((5, 5, 3), dtype=bool)
    >>> ring[1:4, 1:4, 1], ring[2, 2, 1] = True, False
    >>> euler_number(ring)
    0
    """
    count = np.bincount(_codes(body).ravel(), minlength=256)
    return int(count @ _SHARE) // 8


def handle_count(body: Bools) -> int:
    """Return the number of handles (tunnels) of a voxel body with empty cells around it."""
    pieces = ndimage.label(body, CORNER)[1]
    cavities = ndimage.label(~body, FACE)[1] - 1
    return int(pieces + cavities - euler_number(body))


def euler_changes(before: Bools, after: Bools, piece: Numbers, count: int) -> Ints:
    """Return by how much each piece changes Euler's number, (count + 1,); entry 0 is 0.

    Parameters
    ----------
    before, after : (i, j, k) bool
        The body without and with all changes.
    piece : (i, j, k) int
        Number of the piece that each changed cell belongs to, 0 for others. Pieces do not share
        a corner.
    count : int
        Number of pieces.
    """
    at = np.unique(np.concatenate(_corners_of(np.flatnonzero(piece), piece.shape)))
    old, new = np.zeros(len(at), np.int64), np.zeros(len(at), np.int64)
    own = np.zeros(len(at), piece.dtype)
    for bit, step in enumerate(_steps(piece.shape)):
        old |= before.ravel()[at + step].astype(np.int64) << bit
        new |= after.ravel()[at + step].astype(np.int64) << bit
        np.maximum(own, piece.ravel()[at + step], out=own)
    change = np.bincount(own, _SHARE[new] - _SHARE[old], count + 1)
    return np.rint(change / 8).astype(np.int64)


def _codes(body: Bools) -> np.ndarray:
    """Return which of the octants around every corner inside the box are filled, as bits."""
    i, j, k = (n - 1 for n in body.shape)
    out = np.zeros((i, j, k), np.uint8)
    bits = body.view(np.uint8)
    for bit, (a, b, c) in enumerate(_OCTANTS):
        out |= bits[a : a + i, b : b + j, c : c + k] << bit
    return out


def _steps(shape: tuple[int, ...]) -> list[int]:
    """Return the flat offsets of the octants from a corner's first one."""
    return [int(np.dot(o, (shape[1] * shape[2], shape[2], 1))) for o in _OCTANTS]


def _corners_of(cells: Ints, shape: tuple[int, ...]) -> list[Ints]:
    """Return the corners of flat cells, each named by its first octant."""
    return [cells - step for step in _steps(shape)]
