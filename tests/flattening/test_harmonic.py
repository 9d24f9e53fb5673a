"""Harmonic maps: their border, their weights, their least energy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.backends import geodesics
from geounfold.flattening import (
    flatten,
    measures,
    tutte,
)
from geounfold.geometry.measures import triangle_areas
from tests.flattening.meshes import cap


def test_harmonic_spaces_the_border_on_a_circle_of_the_surfaces_area():
    V, F = cap(n=9)
    flat = flatten((V, F), "harmonic")
    loop = flat.loops[0]
    around = flat.uv[loop] - flat.uv[loop].mean(axis=0)
    centre, *_ = np.linalg.lstsq(
        np.c_[2 * around, np.ones(len(loop))], (around**2).sum(axis=1), rcond=None
    )
    radius = np.linalg.norm(around - centre[:2], axis=1)
    assert_allclose(radius, np.sqrt(triangle_areas(V, F).sum() / np.pi), rtol=1e-12)
    step = np.linalg.norm(V[np.roll(loop, -1)] - V[loop], axis=1)
    z = (around - centre[:2]) @ [1, 1j]
    turn = np.angle(np.roll(z, -1) / z)
    assert_allclose(turn, 2 * np.pi * step / step.sum(), rtol=1e-10)


def test_harmonic_with_cotangents_has_the_least_dirichlet_energy():
    V, F = cap(n=9)
    flat = flatten((V, F), "harmonic")

    def dirichlet(uv):
        s1, s2 = measures.stretches(V, F, uv)
        return float((triangle_areas(V, F) * (s1**2 + s2**2)).sum())

    inner = np.setdiff1d(np.arange(len(V)), flat.loops[0])
    least = dirichlet(flat.uv)
    for k in inner[::7]:
        for step in ([0.01, 0], [-0.01, 0], [0, 0.01], [0, -0.01]):
            uv = flat.uv.copy()
            uv[k] += step
            assert dirichlet(uv) > least
    assert least < dirichlet(tutte((V, F)))


@pytest.mark.parametrize("answer", ["nan", "folded"])
def test_harmonic_maps_that_fail_give_way_to_tuttes(monkeypatch, answer):
    mesh = cap(n=9)
    bad = np.full((81, 2), np.nan) if answer == "nan" else -np.abs(mesh[0][:, :2])
    monkeypatch.setattr(geodesics.igl, "harmonic", lambda *_: bad)
    flat = flatten(mesh, "harmonic")
    assert "Tutte's embedding instead" in flat.note
    assert_allclose(flat.uv, tutte(mesh), atol=1e-15)  # the radius is 0.55
