"""ARAP: libigl's known failures."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.backends import igl as backend
from geounfold.errors import FlatteningError
from geounfold.flattening import (
    flatten,
)
from tests.flattening.meshes import cap, grid


def test_arap_that_shrinks_to_nothing_as_in_issue_54_of_the_bindings_is_an_error(monkeypatch):
    V, F = cap(n=9)
    tiny = 1e-6 * V[:, :2]  # no triangle flips and no border meets: only lengths are wrong
    monkeypatch.setattr(backend.ArapSteps, "__call__", lambda self, uv: tiny)
    for repair in (True, False):
        with pytest.raises(FlatteningError, match="arap: the flat map has collapsed"):
            flatten((V, F), "arap", repair=repair)


def three_peaks():
    """A square with three steep peaks, as libigl's issue 680 has it."""
    S, F = grid(17, 17)
    P = S / 16 - 0.5
    z = sum(
        np.exp(-((P - c) ** 2).sum(axis=1) / 0.01) for c in ([0.2, 0.2], [-0.2, 0.1], [0, -0.25])
    )
    return np.c_[P, 2 * z], F


def test_arap_that_flips_as_in_issue_680_is_named_and_mended():
    mesh = three_peaks()
    raw, flat = flatten(mesh, "arap", repair=False), flatten(mesh, "arap")
    assert raw.flips > 0  # measured 19, by libigl itself
    assert f"libigl's ARAP flipped {raw.flips} triangles" in raw.note
    assert flat.one_to_one
    assert f"{raw.flips} of 512 triangles are folded over: untangled" in flat.note


def test_flips_of_arap_are_counted_and_named(monkeypatch):
    V, F = cap(n=9)
    folded = V[:, :2].copy()
    folded[40] += 1.0
    monkeypatch.setattr(backend.ArapSteps, "__call__", lambda self, uv: folded)
    flat = flatten((V, F), "arap", repair=False)
    assert flat.flips > 0
    assert "flipped" in flat.note
    assert not flat.one_to_one
