"""Columns of heights: overhangs, crossings, bodies that stand."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import geounfold as gu
from geounfold.errors import SplitError
from geounfold.geometry.mesh import TriMesh
from geounfold.methods import (
    VerticalOptions,
)
from geounfold.methods.vertical_heights import HeightField
from geounfold.synthetic import simulate
from tests.methods.bodies import tent, unfold
from tests.shapes import box


@pytest.mark.parametrize("method", ["shear", "stratigraphic"])
def test_overhangs_are_counted(method):
    body = simulate("recumbent", blocks=4000)
    u = unfold(body.folded, method)
    count = u.fits[0].notes["ambiguous"]
    # Limbs overturned to 100 degrees cover each other over most of the plan: measured 80 %.
    assert 0.3 * len(body.folded) < count < len(body.folded)
    said = f"{count} of {len(body.folded)} blocks stand where a vertical line meets"
    assert any(said in warning for warning in u.summary()["warnings"])
    assert u.summary()["method"]["ambiguous"] == count
    # What such a tool gives is no unfolding: blocks by blocks off, where the sheet is within 1.
    assert gu.aligned_rms(u.points, body.truth) / u.frame.scale > 5


@pytest.mark.parametrize("method", ["shear", "stratigraphic"])
def test_a_standing_sheet_is_refused(method):
    X = box(30, 20, 4)[:, [0, 2, 1]]  # thin along y
    with pytest.raises(SplitError, match=r"stands on end.*turn --up across it"):
        unfold(X, method)
    # Along the axis across the body it is a slab.
    u = unfold(X, method, vertical_options=VerticalOptions(axis="across"))
    assert gu.aligned_rms(u.points, X) / u.frame.scale < 0.02


def test_a_top_beside_its_bottom_is_refused(monkeypatch):
    from geounfold.methods import vertical_heights

    def parted(self, xy):
        n = len(xy)
        return vertical_heights.VerticalColumn(
            np.zeros(n), np.ones(n), np.zeros(n, bool), np.zeros(n, bool)
        )

    monkeypatch.setattr(vertical_heights.VerticalRule, "column", parted)
    with pytest.raises(SplitError, match="vertically over the bottom nowhere"):
        unfold(box(20, 14, 4), "shear")


def test_crossed_columns_are_left_empty_and_counted(monkeypatch):
    from geounfold.methods import vertical_heights

    sound = vertical_heights.VerticalRule.column

    def crossed(self, xy):
        at = sound(self, xy)
        return at._replace(top=np.where(xy[:, 0] > 8.2, at.bottom - 1, at.top))

    monkeypatch.setattr(vertical_heights.VerticalRule, "column", crossed)
    u = unfold(box(20, 14, 4), "shear")
    empty = u.location == "outside"
    # Whole rows of 14 by 4 blocks at the end of the longest axis: one or two, by where the frame
    # has its origin.
    assert empty.sum() in (56, 112)
    assert np.isnan(u.points[empty]).all()
    assert u.fits[0].notes["crossed"] == empty.sum()
    assert any("bottom lies over the top" in w for w in u.summary()["warnings"])


def test_heights_are_met_continued_and_told_apart():
    field = HeightField(tent(0.5), 1)
    at = field.at(np.array([[-0.5, 0.5], [0.5, 0.25], [-3.0, 0.5], [3.0, 0.5]]))
    # On the plane z = x / 2, on z = 0; and beyond their borders on the same planes.
    assert_allclose(at.z, [-0.25, 0, -1.5, 0], atol=1e-12)
    assert at.met.tolist() == [True, True, False, False]
    assert not at.several.any()
    steep = HeightField(tent(5.0), 1).at(np.array([[-3.0, 0.5]]))
    # Continued level, not down to -15: at the mean height of the border's triangle.
    assert -5 <= steep.z[0] < 0
    over = tent(0.5)
    two = TriMesh(
        np.concatenate([over.V, over.V + np.array([0, 0, 2])]), np.concatenate([over.F, over.F + 6])
    )
    for side, z in ((1, 2.0), (-1, 0.0)):
        found = HeightField(two, side).at(np.array([[0.5, 0.5]]))
        assert found.z[0] == pytest.approx(z)
        assert found.several.all()
