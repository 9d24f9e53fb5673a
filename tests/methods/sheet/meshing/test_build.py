"""Registration of the flat mesh."""

import numpy as np
import pytest

from geounfold.geometry.measures import triangle_areas
from geounfold.methods.sheet.meshing.build import register


def test_registration_finds_the_motion_and_never_mirrors():
    rng = np.random.default_rng(2)
    A = rng.normal(size=(40, 2))
    turn = np.array([[np.cos(1.1), -np.sin(1.1)], [np.sin(1.1), np.cos(1.1)]])
    B = A @ turn.T + [5.0, -3.0]
    weight = rng.uniform(0.1, 1, 40)
    assert np.allclose(register(A, B, weight), B)
    mirrored = A * [1, -1]
    moved, face = register(mirrored, A, weight), np.array([[0, 1, 2]])
    assert triangle_areas(moved, face) == pytest.approx(triangle_areas(mirrored, face))
