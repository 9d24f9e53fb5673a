"""The mid surface on a cylinder, where frames, curvature, feet and slip are known."""

import numpy as np
import pytest

from geounfold.methods.sheet.mid_surface.normal_equations import spd_solver
from geounfold.methods.sheet.mid_surface.pin_line import fold_axes
from geounfold.methods.sheet.mid_surface.spline import SplineGrid
from geounfold.methods.sheet.mid_surface.surface import (
    MidSurface,
    blur_shift,
    near_any,
    normals,
    principal_curvatures,
    slip_potential,
)

RADIUS = 30.0
LOW, HIGH = np.array([-20.0, 0.0]), np.array([20.0, 25.0])
INNER = LOW + 4 + np.random.default_rng(5).random((300, 2)) * (HIGH - LOW - 8)


def point(U, t=0.0):
    """An arch: parameters are arc length along it and its axis; t > 0 is outside, above."""
    a, r = U[:, 0] / RADIUS, RADIUS + t
    return np.column_stack([r * np.sin(a), U[:, 1], r * np.cos(a) - RADIUS])


@pytest.fixture(scope="module")
def arch():
    rng = np.random.default_rng(5)
    grid = SplineGrid.over(LOW, HIGH, 3.5)
    U = LOW + rng.random((6000, 2)) * (HIGH - LOW)
    B = grid.basis(U)
    C = spd_solver(B.T @ B + 1e-9 * grid.energy(3).sparse())(B.T @ point(U))
    return MidSurface(grid, C, LOW, HIGH)


# A cubic spline of step 3.5 on a circle of radius 30 errs by about (3.5/30)^4 30/384 = 1.4e-5
# in position; each derivative loses a factor of the step.
POSITION = 5e-5


def test_position_normal_and_curvature(arch):
    jet = arch.jet(INNER)
    assert np.abs(jet.value - point(INNER)).max() < POSITION
    outward = (point(INNER, 1.0) - point(INNER)) @ np.diag([1.0, 1, 1])
    assert np.abs(normals(jet) - outward).max() < 1e-4
    k1, k2 = principal_curvatures(jet)
    # An arch is convex above: normals diverge there, so its curvature is negative.
    assert np.abs(k1).max() < 2e-3 / RADIUS + 1e-4
    assert np.allclose(k2, -1 / RADIUS, rtol=0.02)


def test_feet_are_found_on_both_sides(arch):
    rng = np.random.default_rng(5)
    t = rng.uniform(-6, 6, len(INNER))
    foot = arch.search().feet(point(INNER, t))
    assert np.abs(foot.U - INNER).max() < 1e-3
    assert np.abs(foot.t - t).max() < POSITION
    assert foot.miss.max() < 1e-6  # Newton's quadratic convergence from a triangle's chord


def test_search_can_be_restricted(arch):
    search = arch.search(near=np.array([[0.0, 10.0]]), reach=6.0)
    assert np.linalg.norm(search.U - [0.0, 10.0], axis=1).max() < 6.0


def test_slip_is_minus_height_times_heading(arch):
    slip = slip_potential(arch, INNER, np.ones(len(INNER)), arch.grid.energy(2))
    phi = arch.grid.value(slip, INNER)
    # Before folding a point at offset t over arc length s lay at s - t theta(s), where the
    # heading turns by -1/R per length on an arch; the mean over the samples is the pin line.
    heading = -INNER[:, 0] / RADIUS
    assert np.abs(phi[:, 0] - (heading - heading.mean())).max() < 0.01
    assert np.abs(phi[:, 1]).max() < 0.01


def test_crests_and_troughs_show_one_direction():
    rng = np.random.default_rng(5)
    # One whole wave along a direction 0.6 radians from the first axis: as much crest as trough.
    grid = SplineGrid.over(np.full(2, -25.0), np.full(2, 25.0), 3.5)
    U = rng.uniform(-25, 25, (8000, 2))
    phase = U @ [np.cos(0.6), np.sin(0.6)]
    P = np.column_stack([U, 2 * np.sin(2 * np.pi * phase / 50)])
    B = grid.basis(U)
    C = spd_solver(B.T @ B + 1e-6 * grid.energy(3).sparse())(B.T @ P)
    sheet = MidSurface(grid, C, np.full(2, -25.0), np.full(2, 25.0))
    inner = U[np.linalg.norm(U, axis=1) < 20]
    # Curvatures that cancel leave the direction to chance, anywhere within pi / 2.
    across, along = fold_axes(sheet, inner)
    assert np.abs(across @ [-np.sin(0.6), np.cos(0.6)]) < 0.01
    assert np.abs(along @ [np.cos(0.6), np.sin(0.6)]) < 0.01


def test_a_blurred_ball_shrinks_as_the_shift_says():
    rng = np.random.default_rng(5)
    # Half level of a Gaussian-blurred ball of radius r: inward by sigma^2 / r to first order.
    grid = SplineGrid.over(np.full(2, -9.0), np.full(2, 9.0), 1.5)
    U = rng.uniform(-9, 9, (8000, 2))
    r = 40.0
    cap = np.column_stack([U, np.sqrt(r * r - (U**2).sum(axis=1)) - r])
    B = grid.basis(U)
    C = spd_solver(B.T @ B + 1e-9 * grid.energy(3).sparse())(B.T @ cap)
    shift = blur_shift(grid.jet(C, np.zeros((1, 2))), np.zeros(1), np.full(3, 0.64))
    assert shift[0] == pytest.approx(-0.64 / r, rel=0.02)


def test_near_any():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0]])
    assert near_any(points, np.array([True, False, False]), 1.5).tolist() == [True, True, False]
    assert not near_any(points, np.zeros(3, dtype=bool), 9.0).any()
