"""Top and bottom of a sheet, met along normals."""

import numpy as np
import pytest

from geounfold.methods.sheet.meshing.top_and_bottom import Horizons
from geounfold.methods.sheet.mid_surface.spline import SplineGrid


def test_normals_meet_a_tilted_horizon_where_algebra_says():
    rng = np.random.default_rng(2)
    grid = SplineGrid.over(np.full(2, -20.0), np.full(2, 20.0), 3.5)
    horizons = Horizons(grid, 3 + 0.1 * grid.nodes[:, 0], np.full(grid.size, -2.0))
    U = rng.uniform(-10, 10, (60, 2))
    slip = np.column_stack([rng.uniform(-0.8, 0.8, 60), np.zeros(60)])
    bottom, top = horizons.crossings(U, slip, limit=50.0)
    # t = 3 + 0.1 (x - t s)  =>  t = (3 + 0.1 x) / (1 + 0.1 s)
    assert np.allclose(top, (3 + 0.1 * U[:, 0]) / (1 + 0.1 * slip[:, 0]), atol=1e-12)
    assert np.allclose(bottom, -2)
    assert np.abs(horizons.crossings(U, slip, limit=1.0)[0]).max() <= 1.0


def test_horizons_never_cross():
    grid = SplineGrid.over(np.full(2, -9.0), np.full(2, 9.0), 3.5)
    pinched = Horizons(grid, np.full(grid.size, -1.0), np.full(grid.size, 1.0))
    bottom, top = pinched.heights(np.zeros((1, 2)))
    assert top[0] - bottom[0] == pytest.approx(0.3)
