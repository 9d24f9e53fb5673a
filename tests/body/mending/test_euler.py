"""Euler's number of voxel bodies, against counts of corners, edges, faces and cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from geounfold.body.mending.euler import CORNER, euler_changes, euler_number, handle_count


def counted(body):
    """Return Euler's number as corners - edges + faces - cells of the union of closed cells."""
    corner, edge, face, cell = set(), set(), set(), 0
    for c in 2 * np.argwhere(body) + 1:
        cell += 1
        for step in np.ndindex(3, 3, 3):
            part = tuple(c + step - 1)
            flat = sum(x % 2 == 0 for x in part)
            {0: set(), 1: face, 2: edge, 3: corner}[flat].add(part)
    return len(corner) - len(edge) + len(face) - cell


@pytest.mark.parametrize("seed", range(4))
def test_random_bodies(seed):
    body = np.zeros((9, 9, 9), dtype=bool)
    body[2:7, 2:7, 2:7] = np.random.default_rng(seed).random((5, 5, 5)) < 0.4
    assert euler_number(body) == counted(body)


def test_handles_of_a_pierced_plate_with_a_cavity():
    plate = np.zeros((14, 14, 8), dtype=bool)
    plate[1:-1, 1:-1, 1:-1] = True
    plate[3, 3, :] = plate[7:9, 7:9, :] = False
    plate[5, 10, 3] = False
    assert handle_count(plate) == 2
    assert euler_number(plate) == 1 - 2 + 1


def test_change_by_every_piece():
    plate = np.zeros((14, 14, 8), dtype=bool)
    plate[1:-1, 1:-1, 1:-1] = True
    whole = plate.copy()
    plate[3, 3, :] = False  # a hole
    plate[5, 10, 3] = False  # a cavity
    plate[9:11, 9:11, 6] = False  # a pit
    piece, count = ndimage.label(whole & ~plate, CORNER)
    change = euler_changes(plate, whole, piece, count)
    assert change[piece[3, 3, 3]] == 1
    assert change[piece[5, 10, 3]] == -1
    assert change[piece[9, 9, 6]] == 0
