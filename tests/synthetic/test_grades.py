"""Simulated grades and drill-holes: covariances, seeds, holes that meet the body."""

from __future__ import annotations

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import OptionError
from geounfold.estimation.variogram import KINDS, correlation
from geounfold.synthetic import FIELD_KINDS, PATTERNS, GradeField, drill

RANGES = (60.0, 60.0, 12.0)


@pytest.fixture(scope="module")
def body():
    return gu.simulate("sim_case_1", blocks=4000)


def test_fields_and_variograms_mean_the_same_by_a_kind() -> None:
    assert set(FIELD_KINDS) < set(KINDS)  # matern has no field


@pytest.mark.parametrize("kind", FIELD_KINDS)
@pytest.mark.parametrize("lag", [(30.0, 0.0, 0.0), (0.0, 0.0, 6.0), (60.0, 0.0, 0.0)])
def test_fields_have_the_covariance_asked_for(kind: str, lag: tuple[float, ...]) -> None:
    # Mean over 20 fields of 1,000 scattered points: a standard error of about 0.01 (from the
    # spread between fields), so 0.04 is four of them.
    P = np.random.default_rng(0).random((1000, 3)) * [2000, 2000, 400]
    products = [
        (f.standard(P) * f.standard(P + lag)).mean()
        for f in (GradeField(kind, RANGES, seed=s) for s in range(20))
    ]
    wanted = correlation(kind, np.array([np.linalg.norm(np.divide(lag, RANGES))]))[0]
    assert np.mean(products) == pytest.approx(wanted, abs=0.04)


def test_the_seed_is_the_field() -> None:
    P = np.random.default_rng(0).random((50, 3)) * 100
    a = GradeField("spherical", RANGES, seed=3).at(P)
    assert np.array_equal(a, GradeField("spherical", RANGES, seed=3).at(P))
    assert np.abs(a - GradeField("spherical", RANGES, seed=4).at(P)).max() > 0.1
    assert np.array_equal(GradeField("spherical", RANGES, seed=3).at(P[::-1]), a[::-1])


def test_lognormal_grades_have_their_mean_and_deviation() -> None:
    # 20,000 points, 150 ranges wide: standard errors of mean and deviation below 0.03.
    P = np.random.default_rng(0).random((20_000, 3)) * [9000, 9000, 1800]
    v = GradeField("exponential", RANGES, seed=1, mean=1.0, deviation=0.5, lognormal=True).at(P)
    assert v.min() > 0
    assert v.mean() == pytest.approx(1.0, abs=0.1)
    assert v.std() == pytest.approx(0.5, abs=0.1)


def test_layers_are_added_by_height() -> None:
    P = np.zeros((4, 3))
    s = np.array([0.0, 0.49, 0.5, 1.0])
    plain, layered = (GradeField("gaussian", RANGES, layers=ls) for ls in ((), (1.0, 5.0)))
    assert (layered.at(P, s) - plain.at(P)).tolist() == pytest.approx([1, 1, 5, 5])
    with pytest.raises(OptionError, match="stratigraphic"):
        layered.at(P)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_holes_meet_the_body_and_carry_its_grades(body, pattern: str) -> None:
    field = GradeField("gaussian", (300, 300, 60), seed=2)
    holes = gu.read_drillholes(*drill(body, field, 40.0, pattern=pattern, interval=2.0))
    intervals = holes.samples()
    truth, there = body.sheet.unfold(intervals[["x", "y", "z"]].to_numpy())
    assert there.all()
    assert body.sheet.inside(truth).all()
    # Desurveyed midpoints carry the field's value there: rounding of the path alone.
    assert np.abs(field.at(truth) - intervals["grade"]).max() < 1e-6
    composites = holes.samples(6.0)
    assert 0.2 < len(composites) / len(intervals) < 0.6  # three intervals each, but at the ends
    assert len(holes) > 3


def test_closer_spacing_drills_more(body) -> None:
    field = GradeField("gaussian", RANGES)
    wide, close = (len(drill(body, field, d).collar) for d in (50.0, 25.0))
    assert 2.5 < close / wide < 6  # four times as many, but for the edges


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda b: GradeField("cubic", RANGES), "is not one of"),
        (lambda b: GradeField("gaussian", (1, 2)), "three numbers"),
        (lambda b: GradeField("gaussian", (1, 2, 0)), "ranges"),
        (lambda b: GradeField("gaussian", RANGES, deviation=0), "deviation"),
        (lambda b: GradeField("gaussian", RANGES, lognormal=True), "mean of lognormal"),
        (lambda b: GradeField("gaussian", RANGES, seed=-1), "seed must be"),
        (lambda b: GradeField("gaussian", RANGES, waves=0), "waves must be"),
        (lambda b: drill(b, GradeField("gaussian", RANGES), 0), "spacing"),
        (lambda b: drill(b, GradeField("gaussian", RANGES), 50, pattern="x"), "is not one of"),
        (lambda b: drill(b, GradeField("gaussian", RANGES), 50, dip=5), "dip must"),
        (lambda b: drill(b, GradeField("gaussian", RANGES), 50, interval=-1), "interval"),
        (lambda b: drill(b, GradeField("gaussian", RANGES), 1e5, seed=0), "miss the body"),
    ],
)
def test_wrong_options_are_named(body, make, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        make(body)
