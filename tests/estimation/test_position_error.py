"""Variograms of values whose places have an error."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import geounfold as gu
from geounfold.errors import OptionError
from geounfold.estimation.position_error import with_position_error
from geounfold.estimation.variogram import Structure, Variogram
from geounfold.quality.uncertainty import PositionUncertainty

RANGES = (200.0, 100.0, 20.0)


def test_a_gaussian_structure_loses_what_the_theory_gives() -> None:
    # exp(-ln 20 (e / a)^2) averaged over normal e of deviation s is 1 / sqrt(1 + 2 ln 20 (s/a)^2)
    # for each axis.
    model = Variogram(0.1, (Structure("gaussian", 0.9, RANGES),))
    found = with_position_error(model, 20.0, 5.0)
    s = np.array([20.0, 20.0, 5.0]) / RANGES
    share = float(np.prod(1 / np.sqrt(1 + 2 * np.log(20) * s**2)))
    # 4,096 draws give the mean to 0.3 %.
    assert found.structures[0].sill == pytest.approx(0.9 * share, rel=0.01)
    assert found.sill == pytest.approx(1.0)
    assert found.structures[0].ranges == RANGES


def test_exact_places_change_nothing() -> None:
    model = Variogram(0.1, (Structure("spherical", 0.9, RANGES),), (30.0, 10.0, 0.0))
    assert with_position_error(model, 0.0, 0.0) == model


def test_errors_along_a_turned_axis_are_measured_along_it() -> None:
    # Turned by a quarter about z, the short second range lies along x.
    kind = Structure("spherical", 1.0, (1000.0, 10.0, 1000.0))
    flat, turned = Variogram(0.0, (kind,)), Variogram(0.0, (kind,), (90.0, 0.0, 0.0))
    one, other = (with_position_error(m, 2.0, 0.0).nugget for m in (flat, turned))
    assert one == pytest.approx(other, rel=0.05)  # both errors along the layer are alike
    assert with_position_error(flat, 0.0, 2.0).nugget < 0.1 * one


@pytest.mark.parametrize("errors", [(-1.0, 0.0), (0.0, float("nan"))])
def test_negative_errors_are_refused(errors: tuple[float, float]) -> None:
    model = Variogram(0.0, (Structure("spherical", 1.0, RANGES),))
    with pytest.raises(OptionError, match="the position error"):
        with_position_error(model, *errors)


def test_estimates_use_the_uncertainty_of_an_unfolding_or_what_is_given() -> None:
    pytest.importorskip("gstlearn")
    blocks = np.stack(np.meshgrid(*map(np.arange, (20, 16, 3)), indexing="ij"), -1).reshape(-1, 3)
    blocks = blocks * 10.0
    u = gu.unfold(blocks)
    rows = blocks[::7]
    samples = pd.DataFrame(rows, columns=["x", "y", "z"]).assign(CU=np.sin(rows[:, 0] / 40))
    model = Variogram(0.01, (Structure("spherical", 0.5, (150.0, 150.0, 30.0)),))
    exact = gu.estimate(u, samples, None, model, grade="CU")
    given = gu.estimate(u, samples, None, model, grade="CU", position_error=(5.0, 2.0))
    u.uncertainty = PositionUncertainty(u.folded, np.tile([5.0, 2.0], (len(blocks), 1)), 8)
    own = gu.estimate(u, samples, None, model, grade="CU")
    # Blocks between samples; at a sample's own place the variance stays 0.
    between = exact.blocks.variance > 0.02
    assert (given.blocks.variance[between] > exact.blocks.variance[between]).all()
    assert_allclose(own.blocks.variance, given.blocks.variance, rtol=1e-9)
    assert exact.summary()["position_error"] is None
    assert given.summary()["position_error"] == (5.0, 2.0)
    assert own.variogram == model  # as it was given; it is blurred for kriging only
