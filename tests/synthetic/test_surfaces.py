"""Analytic surfaces: developable ones, arcs, and the side they face."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.geometry.measures import face_normals, lengths, triangle_areas, unique_edges
from geounfold.synthetic import (
    AnalyticSurface,
    cone,
    cylinder,
    slab,
    spherical_cap,
)

Map = Callable[[np.ndarray], np.ndarray]


@pytest.mark.parametrize("make", [slab, cylinder, cone])
def test_developable_surfaces_keep_their_chords(make: type) -> None:
    surface = make()
    E = unique_edges(surface.mesh.F)
    assert surface.developable
    assert_allclose(
        lengths(surface.chord_uv, E), lengths(surface.mesh.V, E), rtol=1e-12, atol=1e-12
    )
    areas = triangle_areas(surface.uv, surface.mesh.F)
    assert areas.min() > 0


@pytest.mark.parametrize("make", [cylinder, cone])
def test_arc_lengths_agree_at_second_order(make: type) -> None:
    worst = []
    for k in (16, 32, 64):
        surface = make(n=(k + 1, k + 1))
        E = unique_edges(surface.mesh.F)
        worst.append(np.ptp(lengths(surface.uv, E) / lengths(surface.mesh.V, E)))
    slopes = -np.diff(np.log2(worst))
    assert_allclose(slopes, 2, atol=0.05)


def test_cap_and_slab() -> None:
    cap = spherical_cap(radius=100, angle=40)
    assert not cap.developable
    assert_allclose(np.linalg.norm(cap.mesh.V, axis=1), 100)
    top = np.arccos(cap.mesh.V[:, 2] / 100) * 100
    assert_allclose(np.linalg.norm(cap.uv, axis=1), top, atol=1e-5)
    tilted = slab(dip=30)
    assert np.ptp(tilted.mesh.V[:, 2]) == pytest.approx(50)


@pytest.mark.parametrize(
    ("surface", "outwards"),
    [
        (cylinder(), lambda P: P * [1, 0, 1]),
        (cone(), lambda P: P * [1, 1, 0]),
        (spherical_cap(), lambda P: P),
        (slab(), lambda P: P * 0 + [0, 0, 1]),
    ],
    ids=["cylinder", "cone", "cap", "slab"],
)
def test_surfaces_face_outwards(surface: AnalyticSurface, outwards: Map) -> None:
    V, F = surface.mesh.V, surface.mesh.F
    assert (np.sum(face_normals(V, F) * outwards(V[F].mean(axis=1)), axis=1) > 0).all()
