"""Isomap of whole bodies: landmarks, ties, graphs in pieces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import geounfold as gu
from geounfold.errors import FlatteningError
from geounfold.methods import (
    IsomapMethodOptions,
    isomap,
)
from tests.shapes import box


def test_landmark_isomap_of_a_plane():
    rng = np.random.default_rng(4)
    xy = box(30, 20, 1)[:, :2] + rng.uniform(-0.3, 0.3, (600, 2))
    P = np.column_stack([xy, 0.3 * xy[:, 0]])  # a slope: lengths along x grow by 4.4 %
    true = np.column_stack([xy[:, 0] * np.hypot(1, 0.3), xy[:, 1]])
    spread = np.linalg.norm(true - true.mean(axis=0), axis=1).mean()
    for landmarks in (600, 60):
        uv, count = isomap.landmark_isomap(P, IsomapMethodOptions(landmarks=landmarks))
        assert count == landmarks
        off = gu.aligned_rms(*(np.column_stack([a, np.zeros(600)]) for a in (uv, true)))
        # Mirrored answers come out as they come: either way round is an answer.
        other = np.column_stack([uv * [1, -1], np.zeros(600)])
        off = min(off, gu.aligned_rms(other, np.column_stack([true, np.zeros(600)])))
        # Paths zigzag: 2 % longer than lines.  Measured 0.2 of 10.5; a wrong scaling is off by 10.
        assert off < 0.04 * spread


def test_isomap_places_by_distances_exactly():
    rng = np.random.default_rng(8)
    at = rng.normal(size=(40, 12, 3))
    true = rng.normal(size=(40, 3))
    distance = np.linalg.norm(at - true[:, None], axis=2)
    start = true + 0.3 * rng.normal(size=(40, 3))
    found = isomap._trilaterated(start, at, distance, np.ones((40, 12)))
    # Distances to points at their true places have their least sum, zero, at the truth alone.
    assert_allclose(found, true, atol=1e-8)


def test_isomap_takes_equally_near_points_together():
    P = box(8, 8, 1)
    graph = isomap._graph(P, 5)
    # Four at 1, then four at 1.41: the fifth is one of these, so all of them are taken.
    inside = np.flatnonzero(np.abs(P[:, :2]).max(axis=1) < 2.6)
    assert (np.diff(graph.indptr)[inside] == 8).all()
    assert (graph != graph.T).nnz == 0


def test_isomap_refuses_a_graph_in_pieces_and_a_line():
    apart = np.concatenate([box(6, 6, 1), box(6, 6, 1) + np.array([50.0, 0, 0])])
    with pytest.raises(FlatteningError, match="falls into 2 parts; raise neighbours"):
        isomap.landmark_isomap(apart, IsomapMethodOptions())
    with pytest.raises(FlatteningError, match="the distances span no plane"):
        isomap.landmark_isomap(box(2, 1, 1), IsomapMethodOptions())


def test_blocks_off_by_more_than_allowed_are_placed_again(monkeypatch):
    monkeypatch.setattr(isomap, "_NEAR", 8)
    P = box(6, 6, 3)
    flat = P.copy()
    flat[50] += [0, 0, 9.0]
    sound = isomap._sound(P, flat)
    assert not sound[50]
    assert sound.sum() > len(P) / 2
    assert isomap._sound(P, P).all()
