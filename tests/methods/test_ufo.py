"""The thesis's UFO as a method of whole bodies."""

from __future__ import annotations

import numpy as np
import pytest

import geounfold as gu
from tests.methods.bodies import inner
from tests.shapes import box


def test_ufo_is_exact_on_the_reference_surface_of_a_cylinder():
    W = box(44, 20, 5)
    R = 24.0
    angle = W[:, 0] / R  # 105 degrees between the limbs
    out = (R + W[:, 2])[:, None] * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    X = out + np.outer(W[:, 1], [0, 1, 0])
    u = gu.unfold(X, method="ufo")
    scale = u.frame.scale
    at = W[:, 2] == 0
    # Blocks of the middle layer lie on the surface: measured 0.01 blocks.
    assert gu.aligned_rms(u.points[at], W[at]) / scale < 0.04
    # The others keep their anchor and their height: no slip, W as it is.
    assert gu.aligned_rms(u.points, W) / scale < 0.04
    # Lengths along a layer at height t were R + t for R: the volume of the blocks above shrinks.
    ratio = u.columns["volume_ratio"]
    for t in (-2.0, 0.0, 2.0):
        mine = (W[:, 2] == t) & inner(W)
        assert ratio[mine].mean() == pytest.approx(R / (R + t), abs=0.02)
    assert u.fits[0].notes["reference"] == "mid"
