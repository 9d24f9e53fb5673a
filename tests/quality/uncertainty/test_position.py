"""Standard deviations of places: at blocks, at other points, and what 90 % lie within."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from geounfold.quality.trust import Reason, Trust
from geounfold.quality.uncertainty import (
    PositionUncertainty,
    Spread,
    calibrated,
    joined,
    laid_on,
    with_spread_reason,
)
from geounfold.quality.uncertainty.calibration import Mix
from geounfold.quality.uncertainty.position import BAND_ACROSS, BAND_ALONG, within
from geounfold.quality.uncertainty.spread import FARTHEST

RNG = np.random.default_rng(1)
W = RNG.uniform([0, 0, -4], [60, 40, 4], (400, 3))


def turned(P: np.ndarray, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return P @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def test_a_limb_that_lies_elsewhere_does_not_turn_the_rest() -> None:
    Y = W.copy()
    lost = W[:, 0] > 50  # a sixth of the blocks
    Y[lost, 2] += 15
    off = np.abs(laid_on(turned(Y, 30) + 7, W) - W)
    # Least squares leave the rest 2.8 blocks off in the mean; twelve rounds leave 0.03.
    assert off[~lost].max() < 0.1
    assert_allclose(off[lost][:, 2], 15, atol=0.2)


def test_what_a_member_does_not_place_is_left_out_of_the_motion() -> None:
    Y = turned(W, -100)
    Y[::3] = np.nan
    moved = laid_on(Y, W)
    assert np.isnan(moved[::3]).all()
    assert_allclose(
        np.delete(moved, np.s_[::3], axis=0), np.delete(W, np.s_[::3], axis=0), atol=1e-9
    )
    assert np.isnan(laid_on(np.full_like(W, np.nan), W)).all()


def test_a_mirrored_member_stays_mirrored() -> None:
    assert np.abs(laid_on(W * [1, 1, -1], W) - W).mean() > 1


def test_spread_is_the_mean_square_per_axis_and_is_cut_off() -> None:
    moved = np.zeros((4, 3))
    moved[0] = [3.0, 4.0, 2.0]  # cut: (9 + 16) / 2 = 12.5 is more than 9
    moved[1] = [1.0, 1.0, -2.0]
    moved[3] = np.nan
    spread = Spread.of(W[:4], {"a": [moved, np.zeros((4, 3))], "b": []}, ["b"])
    assert_allclose(spread.along["a"][:3], [FARTHEST**2 / 2, 0.5, 0.0])
    assert_allclose(spread.across["a"][:3], [2.0, 2.0, 0.0])
    # A block without a place counts as the mean of the others.
    assert spread.across["a"][3] == pytest.approx((4 + 4 + 0) / 3 / 2)
    assert "b" not in spread.along
    assert spread.failed == ("b",)


def test_a_block_has_its_own_value_and_other_points_that_between() -> None:
    u = PositionUncertainty(np.array([[0.0, 0, 0], [10.0, 0, 0]]), np.array([[1.0, 2], [3, 2]]), 6)
    assert_allclose(u.at(u.points), u.sd, rtol=1e-6)
    # Half way, variances count alike: sqrt((1 + 9) / 2).
    assert_allclose(u.at(np.array([[5.0, 0, 0]])), [[np.sqrt(5), 2.0]])
    assert u.at(np.empty((0, 3))).shape == (0, 2)
    columns = u.columns(u.points, np.array([True, False]))
    assert_allclose(columns["sd_along"], [1.0, np.nan], rtol=1e-6)


def test_bands_hold_nine_in_ten_normal_deviations() -> None:
    z = np.random.default_rng(0).normal(size=(400_000, 3))
    # Shares of 400,000 draws are within 0.002 of their limits.
    assert np.mean(np.hypot(z[:, 0], z[:, 1]) < BAND_ALONG) == pytest.approx(0.9, abs=0.002)
    assert np.mean(np.abs(z[:, 2]) < BAND_ACROSS) == pytest.approx(0.9, abs=0.002)


@pytest.mark.parametrize(("along", "across"), [(0.0, 2.0), (1.5, 0.0), (1.0, 1.0)])
def test_within_is_the_share_of_normal_deviations(along: float, across: float) -> None:
    z = np.random.default_rng(3).normal(size=(200_000, 3)) * [along, along, across]
    found = within(np.array([[along, across]]), 0.9)
    # 256 draws place the 0.9 quantile to about 4 % (one standard deviation); measured 2 %.
    assert found == pytest.approx(np.quantile(np.linalg.norm(z, axis=1), 0.9), rel=0.08)


def test_summary_and_join() -> None:
    a = PositionUncertainty(W[:3], np.full((3, 2), 1.0), 6, ("rim",))
    b = PositionUncertainty(W[3:6], np.full((3, 2), 3.0), 6, ("rim", "sides"))
    both = joined([a, b])
    figures = both.summary()
    assert_array_equal(both.points, W[:6])
    assert figures["failed"] == ["rim", "sides"]
    assert figures["rms_across"] == pytest.approx(np.sqrt(5))
    assert figures["rms"] == pytest.approx(np.sqrt(15))
    assert figures["rms_along"] == pytest.approx(np.sqrt(10))


def test_more_spread_is_more_uncertainty() -> None:
    def spread(factor: float) -> Spread:
        field = {"rim": factor**2 * np.array([0.5, 1.0])}
        return Spread(W[:2], field, field, ())

    assert (calibrated(spread(2)) > calibrated(spread(1))).all()
    # The floor alone is left of members that agree.
    assert 0 < calibrated(spread(0)).max() < 0.01


def test_noise_of_the_blocks_own_places_is_an_error_of_their_places() -> None:
    sd = calibrated(Spread.of(W[:2], {}, (), 0.16**2))
    assert_allclose(sd, 0.16, rtol=0.001)  # and the floor of 0.003


def test_shares_of_a_mix_add_up() -> None:
    mix = Mix({"a": 4.0}, local=0.25, floor=0.0)
    # A quarter at the block, three quarters of the mean 0.5; times 4.
    assert_allclose(mix.deviation({"a": np.array([0.0, 1.0])}) ** 2, [1.5, 2.5])


@pytest.mark.parametrize(
    ("sd", "before", "after"),
    [(0.2, "good", "good"), (0.5, "good", "fair"), (1.5, "good", "poor"), (0.5, "poor", "poor")],
)
def test_a_wide_spread_lowers_the_trust(sd: float, before: str, after: str) -> None:
    # Blocks of 10: the expected error is sqrt(3) of these deviations, 0.35, 0.87 and 2.6 blocks.
    off = PositionUncertainty(W, np.full((len(W), 2), 10 * sd), 8)
    old = Reason("a step", None, 1, "look", before)
    trust = Trust(before, () if before == "good" else (old,))
    found = with_spread_reason(trust, off, 10.0)
    assert found is not None
    assert found.word == after
    assert len(found.reasons) == (before == "poor") + (sd > 0.3)
    assert with_spread_reason(trust, None, 10.0) is trust
    assert with_spread_reason(None, off, 10.0) is None
