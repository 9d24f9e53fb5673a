"""Stratigraphic coordinates: exact on proportional layers."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.methods.bodies import unfold
from tests.shapes import box


def test_stratigraphic_is_exact_on_proportional_layers():
    W = box(44, 24, 5)

    def at(xy, share):
        thick, floor = 5 + 1.5 * np.sin(xy[:, 0] / 7), 2 * np.cos(xy[:, 1] / 8)
        return np.column_stack([xy, floor + share * thick])

    share = (W[:, 2] + 2.5) / 5
    # Reference surfaces given, two blocks wider than the body: how far a hull runs off blocks that
    # lie more closely here than there is no matter of the method.
    plan = box(48, 28, 1)[:, :2]
    k = np.arange(48 * 28).reshape(48, 28)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    u = unfold(at(W[:, :2], share), "stratigraphic", top=(at(plan, 1), F), bottom=(at(plan, 0), F))
    # Measured 0.001, 0.005 at most; true thickness in place of the proportional one is 0.08 off.
    assert np.abs(u.stratigraphic - share).max() < 0.02
    # z is the share times the mean thickness, level at the mean of the two surfaces.
    mean = np.ptp(u.points[:, 2]) / np.ptp(u.stratigraphic)
    assert_allclose(u.points[:, 2], (u.stratigraphic - 0.5) * mean, atol=1e-9)
    assert mean == pytest.approx(
        at(W[:, :2], 1.0)[:, 2].mean() - at(W[:, :2], 0.0)[:, 2].mean(), abs=0.05
    )
