"""The volumetric method: strain, early stops and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import FlatteningError
from geounfold.methods import (
    VolumetricOptions,
    volumetric,
)
from tests.methods.bodies import QUICK
from tests.shapes import box


def test_volumetric_strains_less_than_what_it_starts_from(unfolded):
    u = unfolded("volumetric")
    notes = u.fits[0].notes
    before, after = notes["energy"]
    assert 6 < after < before  # 6: the energy of an isometry
    assert notes["iterations"] == QUICK.max_iter
    z = u.control.unfolded.V[:, 2] / u.frame.scale
    low, high = (z[np.abs(z - e) < 0.5] for e in (z.min(), z.max()))
    # Top and bottom are drawn to planes, softly: measured within 0.02 blocks.
    assert max(np.ptp(low), np.ptp(high)) < 0.1


def test_volumetric_says_when_it_stops_early(unfolded):
    u = unfolded("volumetric")
    assert not u.fits[0].notes["converged"]
    assert any("stopped after 1 steps" in warning for warning in u.summary()["warnings"])


def test_volumetric_stops_where_nothing_moves():
    u = gu.unfold(box(16, 10, 3), method="volumetric")
    assert u.fits[0].notes["converged"]
    assert u.fits[0].notes["moved_last"] <= VolumetricOptions().tol
    assert u.summary()["warnings"] == []


def test_volumetric_refuses_an_inverted_start(monkeypatch, plunging):
    def mirrored(body):
        anchored = sound(body)
        return replace(anchored, uv=anchored.uv * [1, -1])

    sound = volumetric.anchor
    monkeypatch.setattr(volumetric, "anchor", mirrored)
    with pytest.raises(FlatteningError, match=r"tetrahedra are inverted.*--flattener"):
        gu.unfold(plunging, method="volumetric")


def test_volumetric_names_libigls_failure(monkeypatch, plunging):
    class Broken:
        def __init__(self, *_):
            pass

        def __call__(self, *_):
            raise volumetric.BackendError("libigl's slim_solve returned values that are not finite")

    monkeypatch.setattr(volumetric, "SlimTets", Broken)
    with pytest.raises(FlatteningError, match="volumetric: libigl's slim_solve"):
        gu.unfold(plunging, method="volumetric")
