"""Fixtures that several test files of this folder share."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.methods.bodies import unfold
from tests.shapes import box


@pytest.fixture(scope="session")
def plunging():
    """Blocks of 10 m on a lattice that cuts a plunging fold; no two of its sides are alike."""
    P = box(30, 17, 24) + 0.5
    height = 3 * np.sin(P[:, 0] / 7) + 0.15 * P[:, 1]
    return P[np.abs(P[:, 2] - height) < 2.4] * 10


@pytest.fixture(scope="session")
def unfolded(plunging):
    """Return the plunging body's unfolding by a method, made once."""
    return cache(lambda method: unfold(plunging, method))
