"""Flat maps by multidimensional scaling of geodesic distances."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.backends import geodesics
from geounfold.errors import FlatteningError
from geounfold.flattening import (
    MdsOptions,
    flatten,
    measures,
)
from geounfold.geometry.measures import lengths, unique_edges
from tests.flattening.meshes import cap, cylinder, slab


def test_mds_from_landmarks_is_exact_on_a_cylinder():
    V, F, chords, _ = cylinder()
    flat = flatten((V, F), "mds", options=MdsOptions(landmarks=5))
    assert "5 of 117" in flat.note
    edges = unique_edges(F)
    assert_allclose(lengths(flat.uv, edges), lengths(chords, edges), rtol=1e-11)
    assert flat.energy[0] < 1e-20  # the distances are the plane's own


def test_mds_by_heat_is_near(monkeypatch):
    mesh = cap(n=17)
    exact = flatten(mesh, "mds")
    monkeypatch.setattr(sys.modules[MdsOptions.__module__], "EXACT_UP_TO", 100)
    heat = flatten(mesh, "mds")
    assert "heat" in heat.note
    # Measured 0.0198 and 0.068: heat errs by about an edge length near its source.  A disk out of
    # the square cap, which knows nothing of its lengths, has 0.139.
    assert measures.edge_strain(*mesh, exact.uv) < 0.025
    assert measures.edge_strain(*mesh, heat.uv) < 0.1


def test_mds_keeps_exact_distances_away_from_needles():
    V, F = slab()
    V = V.copy()
    V[1] = V[0] + 1e-5 * (V[1] - V[0])  # a side of a border cell shrinks to nothing
    assert "heat" in flatten((V, F), "mds", repair=False).note


def test_mds_of_distances_that_fail_is_an_error(monkeypatch):
    mesh = cap(n=9)
    monkeypatch.setattr(geodesics.igl, "exact_geodesic", lambda *_: np.full(81, np.nan))
    with pytest.raises(FlatteningError, match=r"mds: libigl's exact_geodesic .*not finite"):
        flatten(mesh, "mds")
    on_a_line = np.abs(np.subtract.outer(np.arange(81.0), np.arange(81.0)))
    monkeypatch.setattr(geodesics.igl, "exact_geodesic", lambda V, F, s, *_: on_a_line[s[0]])
    with pytest.raises(FlatteningError, match="span no plane"):
        flatten(mesh, "mds")
