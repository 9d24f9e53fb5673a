"""The same solid from split blocks: every block, few blocks, one row of blocks.

The truth is the unsplit model: its cells, or the volume that it fills.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import geounfold as gu
from geounfold.body.coarsest_cells import coarsest_cells
from geounfold.body.lattice import measure_lattice, refined
from geounfold.body.prepare import prepare
from geounfold.body.sub_blocks import FilledCells, filled_cells
from geounfold.geometry.mesh import Floats
from tests.shapes import grid_cells

SIDE = 10.0


def ball() -> Floats:
    """Return the blocks of a lens 13 blocks thick, 2,601 of them, in national coordinates."""
    k = grid_cells(22, 20, 14) - np.array([10.5, 9.5, 6.5])
    inside = ((k / [10.0, 9.4, 6.6]) ** 2).sum(axis=1) <= 1
    return k[inside] * SIDE + np.array([412000.0, 6815000.0, 1500.0])


def split(blocks: Floats, parts: tuple[int, int, int]) -> Floats:
    """Return the centres of blocks cut into equal parts."""
    places = [(np.array(i) + 0.5) / parts - 0.5 for i in product(*map(range, parts))]
    return np.concatenate([blocks + place * SIDE for place in places])


def solid(points: Floats) -> FilledCells:
    lattice = measure_lattice(points)
    found = coarsest_cells(points, lattice, filled_cells(points, lattice))
    assert found is not None
    return found


def check_home(points: Floats, found: FilledCells, sides: Floats) -> None:
    """Every block's home is a cell within it."""
    away = np.abs(points - found.points[found.home])
    assert (away <= np.maximum(found.lattice.steps, sides) / 2 + 1e-6).all()


@pytest.mark.parametrize("count", [2, 3, 4])
def test_blocks_that_all_are_split_are_joined_again(count: int) -> None:
    blocks = ball()
    points = split(blocks, (count,) * 3)
    found = solid(points)
    assert np.allclose(found.lattice.steps, SIDE)
    assert found.joined == count
    np.testing.assert_allclose(np.sort(found.points, axis=0), np.sort(blocks, axis=0), atol=1e-6)
    check_home(points, found, np.full(3, SIDE))


def test_the_summary_has_the_sides_of_the_blocks_given() -> None:
    """A slab of blocks of 5 that were joined to cells of 10."""
    u = gu.unfold(grid_cells(20, 20, 10) * 5.0)
    assert u.frame.scale == pytest.approx(10.0)
    summary = u.summary()
    assert summary["lattice"]["steps"] == pytest.approx([5.0] * 3)
    assert sorted(summary["lattice"]["full_box"]) == [10, 20, 20]
    assert summary["body_volume"]["folded"] == pytest.approx(20 * 20 * 10 * 125)
    assert summary["body_volume"]["unfolded"] == pytest.approx(20 * 20 * 10 * 125, rel=1e-3)


def test_one_part_that_is_missing_keeps_the_parts() -> None:
    points = split(ball(), (2, 2, 2))[1:]
    lattice = measure_lattice(points)
    assert coarsest_cells(points, lattice, None) is None


def test_thin_sheets_are_not_joined() -> None:
    """Four fine blocks across would be two joined ones."""
    points = split(grid_cells(20, 20, 2) * SIDE, (2, 2, 2))
    assert coarsest_cells(points, measure_lattice(points), None) is None


@pytest.mark.parametrize(
    "parts", [(2, 2, 2), (1, 1, 2), (1, 2, 1), (2, 2, 1), (4, 4, 4), (3, 3, 3), (1, 1, 3)]
)
def test_few_split_blocks_fill_the_solid(parts: tuple[int, int, int]) -> None:
    blocks = ball()
    some = np.random.default_rng(1).random(len(blocks)) < 0.05
    points = np.concatenate([blocks[~some], split(blocks[some], parts)])
    sides = np.full((len(points), 3), SIDE)
    sides[(~some).sum() :] /= parts
    found = solid(points)
    volume = len(found.points) * found.lattice.steps.prod()
    assert volume == pytest.approx(len(blocks) * SIDE**3, rel=1e-9)
    check_home(points, found, sides)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("parts", [(2, 2, 2), (4, 4, 4)])
def test_one_row_of_sub_blocks_on_an_edge(axis: int, parts: tuple[int, int, int]) -> None:
    """The row has no neighbours of its size across, so no gap shows its side."""
    k = grid_cells(24, 20, 18)
    slab, edge = k[k[:, axis] > 0], k[k[:, axis] == 0]
    fine = split(edge * SIDE, parts)
    last = fine[:, axis] > fine[:, axis].max() - 1e-6  # the part next to the slab
    points = np.concatenate([slab * SIDE, fine[last]])
    found = solid(points)
    volume = len(found.points) * found.lattice.steps.prod()
    wanted = (len(slab) + len(edge) / parts[axis]) * SIDE**3
    # More than 250,000 quarters are joined to halves; a layer of quarters is then half a half.
    joined = parts[axis] == 4
    assert volume == pytest.approx(wanted, rel=0.015 if joined else 1e-9)


def test_a_handful_of_sub_blocks_off_the_lattice_of_the_others_is_filled_too() -> None:
    """Three of 1,800 blocks are split in 8: 1.3 % of the centroids, few enough to be noise."""
    k = grid_cells(30, 20, 3)
    corner = (k[:, 0] == 0) & (k[:, 1] == 0)
    points = np.concatenate([k[~corner] * SIDE, split(k[corner] * SIDE, (2, 2, 2))])
    lattice = measure_lattice(points)
    assert lattice is not None
    assert 0.97 < lattice.share < 1
    assert refined(points, lattice).steps.tolist() == [SIDE / 4] * 3  # parts' centres
    (body,) = prepare(points)[1]
    assert len(body.fitted) == 8 * len(k)
    assert len(body.blocks) == len(points)
    # A point that lies anywhere else leaves the lattice as it is.
    assert refined(np.concatenate([points, [[3.3, 7.1, 11.7]]]), lattice) is lattice
