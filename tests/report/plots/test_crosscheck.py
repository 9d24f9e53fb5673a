"""Cuts through tetrahedra against areas that are known, and that pictures are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.geometry.mesh import TetMesh
from geounfold.report.plots.crosscheck import cut_polygons, draw_cuts, draw_histograms
from geounfold.report.plots.figures import png
from tests.shapes import CUBE, SIX

MESH = TetMesh(CUBE * [2.0, 3.0, 5.0], SIX)


def areas(polygons):
    """Return the area of polygons (m, 4, 2) by the shoelace formula, whichever way round."""
    x, y = polygons[..., 0], polygons[..., 1]
    return np.abs((x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(axis=1)) / 2


@pytest.mark.parametrize(("axis", "area"), [(0, 15.0), (1, 10.0), (2, 6.0)])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.77])
def test_a_cut_through_a_box_has_its_area(axis, area, share):
    polygons, element = cut_polygons(MESH, axis, share * MESH.V[:, axis].max())
    assert areas(polygons).sum() == pytest.approx(area)
    assert len(np.unique(element)) == len(element)
    # Corners stand in order around: cut twice across, a quadrangle would have less area.
    hull = polygons.reshape(-1, 2)
    sides = np.delete(MESH.V.max(axis=0), axis)
    assert np.ptp(hull, axis=0) == pytest.approx(sides)


def test_a_plane_that_touches_cuts_nothing():
    for at in (0.0, 5.0, 7.0):
        assert not len(cut_polygons(MESH, 2, at)[1])
    with pytest.raises(InputError, match="box: the plane z = 7 cuts no tetrahedron"):
        draw_cuts({"box": MESH}, 2, 7.0)


def test_pictures_are_drawn():
    figure = draw_cuts({"one": MESH, "other": MESH}, 1, 1.0)
    assert [ax.get_title() for ax in figure.axes[:2]] == [
        "one, cut at y = 1",
        "other, cut at y = 1",
    ]
    assert len(figure.axes[0].collections[0].get_paths()) == len(cut_polygons(MESH, 1, 1.0)[1])
    assert png(figure).startswith(b"\x89PNG")
    values = {"angle": {"a": np.arange(5.0), "b": np.ones(3)}, "ratio": {"a": np.ones(4)}}
    figure = draw_histograms(values)
    assert [ax.get_xlabel() for ax in figure.axes] == ["angle", "ratio"]
    assert png(figure).startswith(b"\x89PNG")
    with pytest.raises(InputError, match="ratio: needs finite values"):
        draw_histograms({"ratio": {"a": np.array([1.0, np.nan])}})
