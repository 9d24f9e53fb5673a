"""Measures of flat maps against known stretches."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.flattening import (
    measures,
)
from geounfold.geometry.measures import triangle_areas
from tests.flattening.meshes import slab


def test_measures_of_known_stretches():
    V, F = slab()
    uv = V[:, :2] * [2.0, 0.5]
    assert measures.area_error(V, F, uv) == pytest.approx(0, abs=1e-14)
    assert measures.area_distortion(V, F, uv) == pytest.approx(1)
    assert measures.angle_distortion(V, F, uv) == pytest.approx((4 + 1 / 4) / 2)
    assert measures.symmetric_dirichlet(V, F, uv) == pytest.approx(2 * (4 + 1 / 4))
    assert measures.symmetric_dirichlet(V, F, V[:, :2]) == pytest.approx(4)
    assert measures.edge_strain(V, F, 1.1 * V[:, :2]) == pytest.approx(0.1)
    area = triangle_areas(V, F).sum()
    assert measures.arap_energy(V, F, uv) == pytest.approx(area * (1 + 0.25))
    assert measures.conformal_energy(V, F, uv) == pytest.approx(area * 1.5**2 / 2)


def test_measures_show_a_flip():
    V, F = slab()
    mirrored = V[:, :2] * [-1.0, 1.0]
    assert measures.flips(F, mirrored) == len(F)
    assert measures.area_error(V, F, mirrored) == pytest.approx(2)
    for measure in (
        measures.area_distortion,
        measures.angle_distortion,
        measures.symmetric_dirichlet,
    ):
        assert measure(V, F, mirrored) == np.inf
