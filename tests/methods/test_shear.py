"""Vertical shear: exact on what it assumes."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

import geounfold as gu
from tests.methods.bodies import inner, unfold
from tests.shapes import box


def test_shear_is_exact_on_vertical_shear():
    W = box(44, 24, 5)
    rise = 3 * np.sin(W[:, 0] / 7) + 0.2 * W[:, 1]
    u = unfold(W + np.outer(rise, [0, 0, 1]), "shear")
    # Measured 0.02 blocks, the fitted surfaces' error; slopes reach 25 degrees, and the sheet
    # method, which slips along the layers, is off by 0.9.
    assert gu.aligned_rms(u.points[inner(W)], W[inner(W)]) / u.frame.scale < 0.06
    # x and y are kept to the last digit, but for the frame's rigid motion.
    flat, given = (P[:, :2] - P[:, :2].mean(axis=0) for P in (u.points, W))
    gram, wanted = (P[::7] @ P[::11].T for P in (flat, given))
    assert_allclose(gram, wanted, atol=1e-9)
    assert_allclose(u.columns["volume_ratio"], 1, atol=0.05)
