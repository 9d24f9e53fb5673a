"""Coordinates in two units or with too few digits: right, or refused with a reason."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.body.check import check_units
from geounfold.body.lattice import measure_lattice
from geounfold.body.prepare import prepare
from geounfold.body.rounded import unrounded
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from tests.shapes import grid_cells, turned

PLACE = np.array([412001.25, 6815001.25, 1500.0])


def blocks(side: float = 10.0) -> Floats:
    return grid_cells(20, 16, 6) * side + PLACE


def digits(points: Floats, count: int) -> Floats:
    """Return points written with so many significant digits."""
    return np.array([[float(f"{v:.{count}g}") for v in row] for row in points])


@pytest.mark.parametrize("decimals", [None, 5, 4])
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2)])
def test_degrees_beside_metres_are_refused(decimals: int | None, order: tuple[int, ...]) -> None:
    """A degree of latitude is 110.9 km; 10 m are 0.00009 degrees."""
    moved = blocks() - PLACE
    degrees = np.column_stack([150 + moved[:, 0] / 96500, -30 + moved[:, 1] / 110900, moved[:, 2]])
    if decimals is not None:
        degrees = np.round(degrees, decimals)
    with pytest.raises(InputError, match=r"look like degrees .* project longitude and latitude"):
        prepare(degrees[:, order])


def test_kilometres_beside_metres_are_refused() -> None:
    with pytest.raises(InputError, match=r"0\.01 along x, 0\.01 along y, 10 along z.*one unit"):
        prepare(blocks() / [1000.0, 1000.0, 1.0])


@pytest.mark.parametrize(
    "points",
    [
        blocks(),
        grid_cells(9, 9, 6) * 10.0,  # a local grid within 90 of the origin
        grid_cells(4, 20, 30) * [2.0, 2.0, 5.0] + [0.0, 0.0, -500.0],  # an upright vein there
        grid_cells(40, 40, 4) * [100.0, 100.0, 0.5],  # a seam
        turned(grid_cells(40, 40, 4) * [100.0, 100.0, 0.5]),
    ],
)
def test_bodies_in_one_unit_are_not(points: Floats) -> None:
    check_units(points, measure_lattice(points))


@pytest.mark.parametrize("side", [2.5, 3.3])
def test_seven_digits_are_put_back_on_the_lattice(side: float) -> None:
    points = blocks(side)
    rounded = digits(points, 7)
    back = unrounded(rounded)
    np.testing.assert_allclose(np.diff(np.unique(back[:, 1])), side, atol=0.05)
    assert np.abs(back - points).max() <= 0.5 + 1e-9  # the digit lost is whole metres
    assert np.array_equal(back[:, 2], points[:, 2])
    prepared = prepare(rounded)[0]
    assert prepared.lattice is not None
    np.testing.assert_allclose(prepared.lattice.steps, side, rtol=0.02)
    assert 0 < prepared.moved <= 0.6


def test_blocks_on_one_place_by_rounding_are_refused() -> None:
    with pytest.raises(InputError, match=r"all y are multiples of 10 .* more digits"):
        prepare(digits(grid_cells(20, 16, 6) * 10.0 + [412005.0, 6815005.0, 1500.0], 6))


@pytest.mark.parametrize(
    "points",
    [blocks(), blocks(2.5), turned(blocks()), np.concatenate([blocks(), blocks()])],
)
def test_other_points_stay_bit_for_bit(points: Floats) -> None:
    assert unrounded(points) is points
