"""Normal equations by stencils against the same matrices made sparse or dense."""

import numpy as np
import pytest
import scipy.sparse as sp

from geounfold.methods.sheet.mid_surface import normal_equations
from geounfold.methods.sheet.mid_surface.normal_equations import (
    Stencils,
    coupled_solver,
    gram,
    spd_solver,
)
from geounfold.methods.sheet.mid_surface.spline import SplineGrid

GRID = SplineGrid.over(np.array([-4.0, 2.0]), np.array([30.0, 24.0]), 3.5)
U = np.array([-4.0, 2.0]) + np.random.default_rng(5).random((700, 2)) * [34.0, 22.0]
WEIGHT = np.random.default_rng(6).random(len(U)) + 0.1


def assembled() -> Stencils:
    return GRID.gram(GRID.basis(U), WEIGHT) + 0.1 * GRID.energy(3)


def differences(n: int, order: int) -> sp.csr_array:
    D = sp.eye_array(n, format="csr")
    for _ in range(order):
        D = (D[1:] - D[:-1]).tocsr()
    return D


@pytest.mark.parametrize("order", [2, 3, 4])
def test_energy_is_the_sum_of_squared_differences(order):
    rng = np.random.default_rng(5)
    nu, nv = GRID.shape
    c = rng.random(GRID.size)
    terms = [sp.kron(differences(nu, k), differences(nv, order - k)) @ c for k in range(order + 1)]
    binomial = [1, order, order * (order - 1) // 2, order, 1]
    weights = binomial[: order + 1] if order == 4 else {2: [1, 2, 1], 3: [1, 3, 3, 1]}[order]
    expected = sum(w * (t @ t) for w, t in zip(weights, terms, strict=True))
    # A sum of some thousand terms: rounding 1e-13 of it.
    assert c @ (GRID.energy(order) @ c) == pytest.approx(expected, rel=1e-12)


def test_gram_is_the_weighted_product(monkeypatch):
    B = GRID.basis(U)
    expected = (B.T @ sp.diags_array(WEIGHT) @ B).toarray()
    for chunk in (normal_equations._CHUNK, 64):  # cells that straddle chunks
        monkeypatch.setattr(normal_equations, "_CHUNK", chunk)
        assert np.allclose(gram(B, WEIGHT, GRID.shape).sparse().toarray(), expected, atol=1e-12)


def test_gram_of_no_points_is_zero():
    B = GRID.basis(np.zeros((0, 2)))
    assert not gram(B, np.zeros(0), GRID.shape).sparse().toarray().any()


def test_product_sum_and_multiple_agree_with_the_sparse_matrix():
    rng = np.random.default_rng(5)
    K = assembled()
    for x in (rng.random(GRID.size), rng.random((GRID.size, 3))):
        assert np.allclose(K @ x, K.sparse() @ x, atol=1e-12)


def test_between_normals_weighs_entries_by_their_cosine():
    rng = np.random.default_rng(5)
    nodes = rng.normal(size=(GRID.size, 3))
    nodes /= np.linalg.norm(nodes, axis=1, keepdims=True)
    E = GRID.energy(4)
    expected = E.sparse().toarray() * (nodes @ nodes.T)
    assert np.allclose(E.between(nodes).sparse().toarray(), expected, atol=1e-12)


@pytest.mark.parametrize("largest", [normal_equations._LARGEST_BAND, 10])
def test_solvers_solve(monkeypatch, largest):
    rng = np.random.default_rng(5)
    monkeypatch.setattr(normal_equations, "_LARGEST_BAND", largest)  # 10: the sparse factorisation
    K, b = assembled(), rng.random((GRID.size, 2))
    A = K.sparse().toarray() + 1e-6 * np.eye(GRID.size)
    # Errors are rounding times the condition number, here below 1e7.
    assert np.allclose(A @ K.solver(ridge=1e-6)(b), b, atol=1e-8)


def test_matrix_that_rounding_makes_indefinite_is_solved_all_the_same():
    rng = np.random.default_rng(5)
    K = GRID.energy(2)  # blind to linear functions: singular
    b = K @ rng.random(GRID.size)
    assert np.allclose(K @ K.solver(ridge=1e-12)(b), b, atol=1e-6)


@pytest.mark.parametrize("largest", [normal_equations._LARGEST_BAND, 10])
def test_coupled_fields_are_solved_together(monkeypatch, largest):
    rng = np.random.default_rng(5)
    monkeypatch.setattr(normal_equations, "_LARGEST_BAND", largest)
    B, H = GRID.basis(U), GRID.basis(U[::-1] * 0.9)
    first = gram(B, WEIGHT, GRID.shape) + 0.1 * GRID.energy(3)
    second = gram(H, WEIGHT, GRID.shape) + 0.1 * GRID.energy(2)
    side = np.where(rng.random(len(U)) < 0.5, -1.0, 1.0)
    cross = sp.csr_array(B.T @ H.multiply((WEIGHT * side)[:, None]).tocsr())
    whole = sp.block_array([[first.sparse(), cross], [cross.T, second.sparse()]]).toarray()
    b = rng.random(2 * GRID.size)
    x = coupled_solver(first, second, cross, ridge=1e-6)(b)
    assert np.allclose(whole @ x + 1e-6 * x, b, atol=1e-8)


def test_sparse_solver_solves():
    rng = np.random.default_rng(5)
    A = sp.random_array((60, 60), density=0.1, rng=np.random.default_rng(0))
    K = sp.csc_array(A @ A.T + sp.eye_array(60))
    b = rng.random((60, 2))
    assert np.allclose(K @ spd_solver(K)(b), b, atol=1e-12)
