"""Tutte's embedding, where the other methods start."""

from __future__ import annotations

import pytest

from geounfold.flattening import (
    tutte,
)
from geounfold.geometry.measures import triangle_areas
from tests.flattening.meshes import annulus, cap, nearly_closed


@pytest.mark.parametrize(
    "mesh", [cap(), annulus(), nearly_closed()], ids=["cap", "annulus", "ball"]
)
def test_tutte_flips_nothing_and_keeps_the_area_of_its_disk(mesh):
    uv = tutte(mesh)
    assert (triangle_areas(uv, mesh[1]) > 0).all()
