"""How level top and bottom come out: flanks that the split counts to them do not matter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geounfold.geometry.measures import face_normals
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.unfolding.level_horizons import level_errors
from tests.body.fill.solids import box


def flat_box(tilt: float = 0.0, image: bool = True) -> tuple[Any, Any, Any]:
    """Return a box 10 x 10 x 2 whose flanks count to the top, its map, and a frame.

    Flat heights are those of the box plus ``tilt`` times x.
    """
    V, F = box((0, 0, 0), (10.0, 10.0, 2.0), cell=1.0)
    mesh = TriMesh(V, F)
    side = np.where(face_normals(mesh.V, mesh.F)[:, 2] < -0.9, -1, 1)
    split = SimpleNamespace(mesh=mesh, side=side, rim=np.zeros(len(mesh.F), dtype=bool))

    def carry(points: Floats) -> Any:
        flat = points + points[:, :1] * [0, 0, tilt]
        level = flat[:, 2] / 2
        if not image:
            flat, level = np.full_like(flat, np.nan), np.full_like(level, np.nan)
        return SimpleNamespace(points=flat, stratigraphic=level)

    frame = SimpleNamespace(to_world=lambda points: points)
    return SimpleNamespace(split=split), SimpleNamespace(carry=carry), frame


def test_flanks_are_left_out() -> None:
    fit, mapping, frame = flat_box()
    assert level_errors([fit], mapping, frame) == {"top": 0, "bottom": 0}


def test_a_slope_is_the_mean_distance_from_the_level() -> None:
    fit, mapping, frame = flat_box(tilt=0.02)
    # Corners of the cells at x = 0 to 10: 0.02 x / 2 in the mean.
    found = level_errors([fit], mapping, frame)
    assert found == {"top": pytest.approx(0.05), "bottom": pytest.approx(0.05)}


def test_without_an_image_nothing_is_known() -> None:
    fit, mapping, frame = flat_box(image=False)
    assert level_errors([fit], mapping, frame) == {"top": None, "bottom": None}
