"""Members: other unfoldings that the coordinates allow, and how far they lie from the answer."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import geounfold as gu
from geounfold.errors import OptionError
from geounfold.methods.sheet.members.flat_places import FlatPlaces
from geounfold.methods.sheet.members.kinds import smooth_field
from geounfold.methods.sheet.members.run import DERIVED, FITTED, LEAST_MEMBERS, schedule
from geounfold.methods.sheet.stages import parameters
from geounfold.quality.uncertainty import laid_on
from tests.shapes import box


@pytest.fixture(scope="module")
def blocks() -> np.ndarray:
    """A fold of 10 m blocks, four thick."""
    P = box(40, 24, 24) + 0.5
    return P[np.abs(P[:, 2] - 12 - 4 * np.sin(P[:, 0] / 8)) < 2] * 10


@pytest.fixture(scope="module")
def told(blocks: np.ndarray) -> gu.Unfolding:
    return gu.unfold(blocks, uncertainty=LEAST_MEMBERS)


def test_every_question_is_answered_once_before_one_is_drawn_again() -> None:
    assert [name for name, _ in schedule(LEAST_MEMBERS)] == list(FITTED)
    more = schedule(14)
    assert len(more) == len(set(more)) == 14
    assert more[:8] == schedule(8)


def test_the_answer_is_the_same_with_and_without(blocks: np.ndarray, told: gu.Unfolding) -> None:
    assert_array_equal(gu.unfold(blocks).points, told.points)


def test_flat_places_are_those_of_the_control_mesh(told: gu.Unfolding) -> None:
    fit = told.fits[0]
    assert fit.sheet is not None
    places = FlatPlaces.of(fit.sheet.fitted, told.frame.to_work(told.folded), parameters)
    flat = places.place(fit.sheet.fitted)
    carried = told.points / told.frame.scale
    # Cells of 3 blocks and of 1.5: measured 0.12 blocks at most at the rim, 0.02 in the mean; the
    # fold is 8 blocks high.
    off = np.abs(laid_on(flat, carried) - carried)
    assert off.max() < 0.25
    assert off.mean() < 0.04


def test_every_kind_spreads_a_fold_and_is_named(told: gu.Unfolding) -> None:
    spread = told.fits[0].spread
    assert spread is not None
    assert set(spread.along) == {*FITTED, *DERIVED, "noise"}
    assert spread.failed == ()
    assert all((spread.across[name] > 0).any() for name in (*FITTED, *DERIVED))
    assert not spread.across["noise"].any()  # the lattice is exact


def test_columns_summary_and_other_points(blocks: np.ndarray, told: gu.Unfolding) -> None:
    assert {"sd_along", "sd_across"} <= set(told.table.columns)
    sd = told.table[["sd_along", "sd_across"]].to_numpy()
    assert np.isfinite(sd).all()
    assert told.uncertainty is not None
    assert_allclose(told.uncertainty.at(blocks[:5]), sd[:5], rtol=1e-6)
    assert told.summary()["uncertainty"]["members"] == LEAST_MEMBERS
    # Blocks of 10 m of a gentle fold: less than half a block, and not nothing; measured 1.5 m.
    assert 0.05 < told.summary()["uncertainty"]["rms"] < 5


def test_points_in_layers_leave_little_open() -> None:
    body = gu.simulate("sim_case_2")  # gridded before folding; 0.01 blocks off
    told = gu.unfold(body.folded, uncertainty=LEAST_MEMBERS)
    figures = told.summary()["uncertainty"]
    # Before, a stiffer fit to the hull lost the layers: 0.3 blocks; measured 0.03.
    assert figures["rms"] / told.frame.scale < 0.1
    assert figures["failed"] == []


def test_rows_and_unit_do_not_matter(blocks: np.ndarray, told: gu.Unfolding) -> None:
    order = np.random.default_rng(0).permutation(len(blocks))
    other = gu.unfold(blocks[order] * 2 + [1000, -500, 20], uncertainty=LEAST_MEMBERS)
    for name in ("sd_along", "sd_across"):
        assert_allclose(other.columns[name] / 2, told.columns[name][order], rtol=1e-4)


def test_no_uncertainty_without_the_option(blocks: np.ndarray) -> None:
    u = gu.unfold(blocks)
    assert u.uncertainty is None
    assert "sd_along" not in u.table
    assert "uncertainty" not in u.summary()


@pytest.mark.parametrize("wrong", [-1, 3, 2.5, "8"])
def test_too_few_members_are_refused(blocks: np.ndarray, wrong: object) -> None:
    with pytest.raises(OptionError, match=r"^uncertainty must be"):
        gu.unfold(blocks, uncertainty=wrong)


def test_other_methods_are_refused_before_they_run(blocks: np.ndarray) -> None:
    with pytest.raises(OptionError, match="uncertainty is measured of the method sheet only"):
        gu.unfold(blocks, method="ufo", uncertainty=8)


def test_smooth_fields_are_smooth_and_of_variance_one() -> None:
    P = np.random.default_rng(0).uniform(0, 4000, (20_000, 3))
    field = smooth_field(P, 5, (40.0, 6.0))
    assert_allclose(field.var(axis=0), 1, rtol=0.05)  # 20,000 places nearly independent
    near = smooth_field(P + np.array([0.1, 0, 0]), 5, (40.0, 6.0))
    # Waves of at least 6 blocks turn by 0.1 rad at most over a tenth of a block.
    assert np.abs(near - field).std() < 0.1
    assert not np.allclose(smooth_field(P, 6, (40.0, 6.0)), field)


def test_noise_of_the_centroids_is_found(blocks: np.ndarray) -> None:
    shaken = blocks + np.random.default_rng(2).normal(0, 0.8, blocks.shape)  # of 10 m blocks
    u = gu.unfold(shaken, uncertainty=LEAST_MEMBERS)
    spread = u.fits[0].spread
    assert spread is not None
    # 5,904 normal draws give their own deviation to 1 %; measured 0.79 m.
    assert np.sqrt(spread.along["noise"][0]) * u.frame.scale == pytest.approx(0.8, rel=0.05)
