"""Uniform bicubic B-splines against polynomials, differences and dense solves."""

import numpy as np
import pytest

from geounfold.methods.sheet.mid_surface.spline import SplineGrid, density_weights

GRID = SplineGrid.over(np.array([-4.0, 2.0]), np.array([17.0, 11.0]), 3.5)
INSIDE = np.array([-4.0, 2.0]) + np.random.default_rng(3).random((200, 2)) * [21.0, 9.0]


def test_basis_sums_to_one_and_its_derivatives_to_nothing():
    # Partition of unity of B-splines; the sums are of 16 terms of size 1: rounding 1e-15.
    assert np.allclose(GRID.basis(INSIDE).sum(axis=1), 1, atol=1e-13)
    for du, dv in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
        assert np.abs(GRID.basis(INSIDE, du, dv).sum(axis=1)).max() < 1e-13


def test_linear_functions_are_reproduced_from_the_greville_points():
    C = GRID.nodes @ np.array([[2.0, -1.0], [0.5, 3.0]]) + 7
    expected = INSIDE @ np.array([[2.0, -1.0], [0.5, 3.0]]) + 7
    assert np.allclose(GRID.value(C, INSIDE), expected, atol=1e-12)


def test_jet_agrees_with_the_basis_and_with_finite_differences():
    rng = np.random.default_rng(3)
    C = rng.random((GRID.size, 3))
    jet = GRID.jet(C, INSIDE)
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    for value, (du, dv) in zip(jet, orders, strict=True):
        assert np.allclose(value, GRID.basis(INSIDE, du, dv) @ C, atol=1e-13)
    step = 1e-5
    ahead, behind = (GRID.value(C, INSIDE + s * np.array([step, 0.0])) for s in (1, -1))
    # Central differences: error step^2/6 times the third derivative (below 1), and rounding.
    assert np.allclose((ahead - behind) / (2 * step), jet.u, atol=1e-9)


@pytest.mark.parametrize("order", [2, 3])
def test_energy_is_blind_to_polynomials_below_its_order(order):
    x, y = GRID.nodes.T / 10
    blind = [np.ones_like(x), x, y] + ([x * y, x * x, y * y] if order == 3 else [])
    energy = GRID.energy(order)
    for c in blind:
        # Zero but for the rounding of the sums, each term of which errs by 1e-16 of itself.
        rounding = 1e-15 * (np.abs(c) @ (abs(energy.sparse()) @ np.abs(c)))
        assert abs(c @ (energy @ c)) < rounding
    seen = x**order
    assert seen @ (energy @ seen) > 1e-3  # a polynomial of the order itself is seen


def test_density_weights_count_every_occupied_cell_once():
    rng = np.random.default_rng(3)
    U = rng.random((500, 2)) * 10
    cells = len(np.unique(np.floor((U - U.min(axis=0)) / 2.0), axis=0))
    assert density_weights(U, 2.0).sum() == pytest.approx(cells)
