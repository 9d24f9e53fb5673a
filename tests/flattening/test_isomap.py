"""Isomap of surfaces against scikit-learn's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.flattening import (
    IsomapOptions,
    flatten,
)
from geounfold.geometry.measures import lengths, unique_edges
from tests.flattening.meshes import cap, grid, slab


def test_isomap_on_all_vertices_is_scikit_learns():
    sklearn = pytest.importorskip("sklearn.manifold", reason="scikit-learn is not installed")
    V, F = cap(n=9)
    # Off the lattice, so that no two neighbours tie.
    V = V + 0.002 * np.random.default_rng(4).normal(size=V.shape)
    flat = flatten((V, F), "isomap", options=IsomapOptions(neighbours=12))
    theirs = sklearn.Isomap(n_neighbors=12, n_components=2, eigen_solver="dense").fit(V)
    # Theirs has no edges of the surface as such: here they are all among the nearest.
    near = theirs.nbrs_.kneighbors_graph(V, 12)
    near = near.maximum(near.T)
    assert all(near[i, j] for i, j in unique_edges(F))
    apart = lengths(theirs.embedding_, unique_edges(F))
    assert_allclose(lengths(flat.uv, unique_edges(F)), apart, rtol=1e-9)


def test_isomap_cuts_through_between_near_limbs():
    # Two limbs two cells apart, joined by a hinge: paths of 16 neighbours cross the gap.
    n, gap = 41, 0.3
    S, F = grid(n, 9)
    s = S[:, 0] - (n - 1) / 2
    x = np.abs(s)
    V = np.c_[np.where(x < 1, x * x / 2, x - 0.5), S[:, 1], gap * np.tanh(s)]
    rough, sound = (flatten((V, F), m, repair=False) for m in ("isomap", "mds"))
    ends = [4, (n - 1) * 9 + 4]
    across = [np.linalg.norm(f.uv[ends[1]] - f.uv[ends[0]]) for f in (rough, sound)]
    assert across[0] < 0.1 * across[1]


def test_isomap_takes_all_neighbours_that_tie():
    V, F = slab()
    order = np.random.default_rng(1).permutation(len(V))
    place = np.argsort(order)
    one = flatten((V, F), "isomap", options=IsomapOptions(neighbours=5))
    two = flatten((V[order], place[F]), "isomap", options=IsomapOptions(neighbours=5))
    edges = unique_edges(F)
    assert_allclose(lengths(two.uv[place], edges), lengths(one.uv, edges), rtol=1e-9)
