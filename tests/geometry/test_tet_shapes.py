"""Shapes of tetrahedra against solids whose angles and spheres are known."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.geometry.tet_shapes import dihedral_angles, radius_ratios

REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
UPRIGHT = np.array([[1, 0, 2, 3]])


def test_regular_tetrahedra_have_equal_angles_and_ratio_one():
    # arccos(1/3) between any two faces.
    assert dihedral_angles(REGULAR, UPRIGHT) == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert radius_ratios(REGULAR, UPRIGHT) == pytest.approx(1.0)


def test_inverted_ones_have_negative_ratios_and_the_same_angles():
    turned = UPRIGHT[:, [1, 0, 2, 3]]
    assert radius_ratios(REGULAR, turned) == pytest.approx(-1.0)
    flipped = 180 - dihedral_angles(REGULAR, turned)
    assert flipped == pytest.approx(180 - np.degrees(np.arccos(1 / 3)))


def test_flat_ones_have_ratio_zero_and_angles_of_0_and_180():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    T = np.array([[0, 1, 2, 3]])
    assert radius_ratios(square, T)[0] == 0
    # The two diagonals carry 180 degrees, the four sides 0.
    assert np.sort(dihedral_angles(square, T)[0]) == pytest.approx([0, 0, 0, 0, 180, 180], abs=1e-5)


def test_a_cubes_corner_has_known_spheres():
    # Corner of a unit cube: inscribed radius 1/(3 + sqrt 3), circumscribed sqrt(3)/2.
    V, T = np.concatenate([np.zeros((1, 3)), np.eye(3)]), np.array([[0, 1, 2, 3]])
    ratio = 3 / (3 + np.sqrt(3)) / (np.sqrt(3) / 2)
    assert radius_ratios(V, T) == pytest.approx(ratio)


def test_shape_knows_neither_place_turn_nor_size():
    rng = np.random.default_rng(5)
    V, T = rng.normal(size=(40, 3)), rng.permuted(np.tile(np.arange(40), (9, 1)), axis=1)[:, :4]
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = 7.5 * V @ turn.T + [4e5, 7e6, 100]
    # 1e-6: coordinates of 7e6 with elements of size 7 leave ten digits of each edge.
    assert dihedral_angles(moved, T) == pytest.approx(dihedral_angles(V, T), abs=1e-5)
    assert radius_ratios(moved, T) == pytest.approx(radius_ratios(V, T), abs=1e-6)
    assert (np.abs(radius_ratios(V, T)) <= 1).all()
