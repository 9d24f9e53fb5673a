"""LSCM: libigl's known failures."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.backends import igl as backend
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening import (
    Stop,
    flatten,
)
from tests.flattening.meshes import EXACT, cap, cylinder, edge_errors


def half_cylinder(n):
    V, F, _, _ = cylinder(n, n, radius=1.0, angle=np.pi)
    return V * [1, 0.3, 1], F


@pytest.mark.parametrize("n", [5, 20, 40])
def test_lscm_on_the_half_cylinder_of_libigl_issue_2409(n):
    mesh = half_cylinder(n)
    flat = flatten(mesh, "lscm")
    assert flat.stop is Stop.DIRECT
    assert np.abs(edge_errors(mesh, flat.uv)).max() < EXACT["lscm"]


def test_lscm_tries_a_second_pair_of_pins_and_says_so(monkeypatch):
    true, calls = backend.lscm, []

    def fails_once(V, F, fixed, uv_fixed):
        calls.append(fixed)
        if len(calls) == 1:
            raise BackendError("libigl's lscm returned values that are not finite")
        return true(V, F, fixed, uv_fixed)

    monkeypatch.setattr(backend, "lscm", fails_once)
    flat = flatten(cap(n=9), "lscm")
    assert "second pair" in flat.note
    assert len(calls) == 2


def to_a_point(V):
    return np.zeros((len(V), 2))


def to_a_point_but_one(V):
    uv = 1e-9 * V[:, :2]
    uv[0] *= 1e9  # a corner stays: the area is positive, nearly all lengths are lost
    return uv


@pytest.mark.parametrize(
    ("answer", "message"),
    [(to_a_point, "signed area is not positive"), (to_a_point_but_one, "lost their length")],
)
def test_collapsed_lscm_is_an_error(monkeypatch, answer, message):
    monkeypatch.setattr(backend, "lscm", lambda V, *_: answer(V))
    with pytest.raises(FlatteningError, match=message):
        flatten(cap(n=9), "lscm")
