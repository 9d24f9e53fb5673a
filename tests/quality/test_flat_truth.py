"""Distance from the truth after a turn, a shift and one shear: what is free, what is an error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.errors import InputError
from geounfold.quality.flat_truth import aligned_flat, flat_rms

W = np.random.default_rng(0).uniform([0, 0, -25], [400, 300, 25], (500, 3))


def turned(P: np.ndarray, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return P @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


@pytest.mark.parametrize("degrees", [0, 40, 135, -170])
@pytest.mark.parametrize("flip", [False, True])
def test_turn_shift_shear_and_side_are_free(degrees: float, flip: bool) -> None:
    Y = W + np.outer(W[:, 2], [0.4, -0.2, 0])
    Y = turned(Y, degrees) + np.array([1e5, 2e5, 300])
    if flip:
        Y = Y * [1, -1, -1]
    assert_allclose(aligned_flat(Y, W), W, atol=1e-6)  # 1e5 times the rounding of 500 sums
    assert flat_rms(Y, W) < 1e-6


def test_what_is_no_freedom_is_an_error() -> None:
    mirrored = W * [1, -1, 1]
    # A mirrored body turned over fits in plan; z is then reversed, of spread 50 / sqrt(12).
    assert flat_rms(mirrored, W) == pytest.approx(2 * 50 / np.sqrt(12), rel=0.05)
    stretched = W * [1, 1, 1.2]
    assert flat_rms(stretched, W) == pytest.approx(0.2 * W[:, 2].std(), rel=1e-6)
    tilted = W + np.outer(W[:, 0], [0, 0, 0.1])
    assert flat_rms(tilted, W) == pytest.approx(0.1 * W[:, 0].std(), rel=0.02)
    half = np.where(W[:, :1] > 200, [10.0, 0, 0], 0.0)
    # Two equal halves 10 apart are each 5 from where they belong; the fit may turn a little.
    assert 4 < flat_rms(W + half, W) <= 5.1


def test_a_shear_of_one_half_alone_is_an_error() -> None:
    half = np.where(W[:, :1] > 200, np.outer(W[:, 2], [0.4, 0, 0]), 0.0)
    # The common shear takes half: 0.2 of the height, spread 50 / sqrt(12), is left in both.
    assert flat_rms(W + half, W) == pytest.approx(0.2 * 50 / np.sqrt(12), rel=0.05)


def test_flat_layer_without_thickness_has_no_shear() -> None:
    plane = W * [1, 1, 0]
    assert flat_rms(turned(plane, 25), plane) < 1e-9


@pytest.mark.parametrize(
    ("Y", "T", "message"),
    [
        (W[:5], W[:4], "Y and W"),
        (W[:0], W[:0], "no points to align"),
        (W * [1, np.nan, 1], W, "finite"),
    ],
)
def test_points_that_cannot_be_compared_are_refused(
    Y: np.ndarray, T: np.ndarray, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        flat_rms(Y, T)
