"""Which points lie in the body's own blocks, and how far others lie from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import InputError
from geounfold.mapping.body_cells import BodyCells
from tests.shapes import grid_cells, turned

CELLS = np.array([[0, 0, 0], [1, 0, 0], [5, -2, 3]])
STEPS = np.array([2.0, 1.0, 0.5])


def body() -> BodyCells:
    made = BodyCells.of(CELLS, STEPS)
    assert made is not None
    return made


def test_points_in_cells_and_on_their_faces() -> None:
    inside = np.array([[0, 0, 0], [2.9, 0.4, 0.2], [3.0, 0, 0], [1.0, 0.5, 0.25], [10, -2, 1.5]])
    outside = np.array([[3.01, 0, 0], [0, 0.51, 0], [0, 0, 0.26], [10, -2, 1.0], [-99, 0, 0]])
    assert body().hold(inside).all()
    assert not body().hold(outside).any()


def test_distances_are_counted_in_blocks_along_the_axes() -> None:
    points = np.array([[0, 0, 0], [5.0, 0, 0], [0, 2.0, 0], [0, 1.5, 1.25]])
    # Beyond the face: 2 m of blocks of 2 m, 1.5 of 1 m; of two axes the larger (2 and 1 blocks).
    np.testing.assert_allclose(body().distance(points), [0, 1, 1.5, 2])
    # As a length: 2 m, 1.5 m, and 1 m beside 1 m above.
    np.testing.assert_allclose(body().gap(points), [0, 2, 1.5, np.sqrt(2)])


def test_a_random_body_against_every_cell() -> None:
    random = np.random.default_rng(5)
    cells = np.unique(random.integers(-4, 5, (60, 3)), axis=0)
    made = BodyCells.of(cells, STEPS)
    assert made is not None
    points = random.uniform(-8, 8, (400, 3))
    apart = np.abs(points[:, None] / STEPS - cells).max(axis=2).min(axis=1)
    np.testing.assert_array_equal(made.hold(points), apart <= 0.5)
    np.testing.assert_allclose(made.distance(points), np.maximum(apart - 0.5, 0), atol=1e-12)


def test_a_saved_map_knows_the_blocks_of_its_body(tmp_path: Path) -> None:
    # An arch, 24 by 10 columns of 4 blocks of 2 by 1 by 1, turned at random.
    cells = grid_cells(24, 10, 4)
    cells[:, 2] += 3 - np.abs(cells[:, 0] - 12) // 4
    X = turned(cells * [2.0, 1.0, 1.0], seed=2)
    gu.unfold(X).save(tmp_path / "m.npz")
    saved = gu.load(tmp_path / "m.npz")
    moved = np.concatenate([cells + d for d in np.vstack([np.eye(3, dtype=int), np.zeros(3, int)])])
    own = {tuple(cell) for cell in cells.tolist()}
    truth = [tuple(cell) in own for cell in moved.tolist()]
    points = turned(moved * [2.0, 1.0, 1.0], seed=2)
    np.testing.assert_array_equal(saved.in_body(points, saved.carry(points)), truth)


def test_cells_that_do_not_fit_are_refused() -> None:
    arrays = {**body().arrays(), "body_shape": np.array([2, 2, 2])}
    with pytest.raises(InputError, match="body cells do not fit its lattice"):
        BodyCells.of_arrays(arrays, STEPS)
    assert BodyCells.of(np.array([[0, 0, 0], [10**6] * 3]), STEPS) is None
