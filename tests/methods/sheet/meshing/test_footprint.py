"""The footprint of the blocks on the mid surface: one part that holds every block."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import ControlMeshError
from geounfold.geometry.measures import triangle_areas
from geounfold.methods.sheet.meshing.footprint import footprint
from tests.shapes import grid_cells


def test_footprint_holds_every_foot_inside_its_border():
    rng = np.random.default_rng(2)
    U = rng.uniform(-20, 20, (800, 2))
    prints = footprint(U, 0.4, 1.5, 1)
    # Counter-clockwise halves of square cells.
    assert triangle_areas(prints.U, prints.F) == pytest.approx(np.full(len(prints.F), 1.5**2 / 2))
    centres = prints.U[prints.F].mean(axis=1)
    nearest = np.sqrt(((U[:, None] - centres[None]) ** 2).sum(axis=2)).min(axis=1)
    assert nearest.max() < 1.5
    assert prints.axes @ prints.axes.T == pytest.approx(np.eye(2))


@pytest.mark.parametrize("apart", [[12.0, 0.0], [7.0, 9.0], [-30.0, 3.0]])
def test_parts_far_apart_are_an_error(apart: list[float]) -> None:
    U = np.random.default_rng(1).uniform(0, 5, (300, 2))
    footprint(U, 0.7, 1.0, dilation=1)
    with pytest.raises(ControlMeshError, match="in 2 parts that do not touch"):
        footprint(np.concatenate([U, U[:40] + apart]), 0.7, 1.0, dilation=1)


def test_a_slab_of_few_blocks_stays_flat() -> None:
    # All its sites lie near its rim, so that none contradicts the first fit.
    X = grid_cells(30, 20, 4) * 1.0
    u = gu.unfold(X)
    # Measured 0.003 of a block; 0.1 if it was fitted again all the same.
    assert gu.aligned_rms(u.points, X) < 0.02
