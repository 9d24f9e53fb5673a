"""Blocks, limits by hole and octant, and methods side by side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import OptionError
from geounfold.estimation import Neighbourhood, Structure, Variogram, estimate, krige
from geounfold.estimation.neighbourhood import Search
from geounfold.estimation.support import discretised, local_axes
from geounfold.estimation.systems import solve_systems
from geounfold.synthetic import GradeField, drill

pytest.importorskip("gstlearn", reason="the extra geostat is not installed")

RNG = np.random.default_rng(5)
POINTS = RNG.random((200, 3)) * [100.0, 100.0, 20.0]
VALUES = RNG.normal(2.0, 1.0, 200)
HOLES = RNG.integers(0, 20, 200)
TARGETS = RNG.random((12, 3)) * [100.0, 100.0, 20.0]
MODEL = Variogram(
    0.2,
    (Structure("spherical", 0.5, (60, 40, 12)), Structure("matern", 0.3, (90, 90, 30))),
    (30.0, 5.0, 10.0),
)
NEAR = Neighbourhood(radii=(80.0, 80.0, 16.0), max_samples=12)
IDENTITY = np.broadcast_to(np.eye(3), (len(TARGETS), 3, 3))


def covariance(a, b):
    """Return the covariance without nugget between two places."""
    gap = (a - b)[None]
    gamma = MODEL.gamma(gap)[0]
    return MODEL.sill - gamma if np.any(gap) else MODEL.sill - MODEL.nugget


@pytest.mark.parametrize("mean", [None, 1.5])
def test_a_block_is_the_mean_of_its_points(mean) -> None:
    # Kriging is linear: a block's estimate is the mean of the estimates of its points. Its system
    # and its variance are those written out pair by pair.
    inside = discretised(np.array([12.0, 8.0, 4.0]), (2, 3, 2))
    how = {} if mean is None else {"method": "simple", "mean": mean}
    got = krige(POINTS, VALUES, TARGETS, MODEL, NEAR, blocks=(inside, IDENTITY), **how)
    found = Search(POINTS, None, NEAR).find(TARGETS)
    for k, target in enumerate(TARGETS):
        rows = found.rows[k, : found.counts[k]]
        P, v, n = POINTS[rows], VALUES[rows], len(rows)
        C = np.array([[covariance(a, b) for b in P] for a in P]) + MODEL.nugget * np.eye(n)
        c = np.array([np.mean([covariance(a, target + q) for q in inside]) for a in P])
        own = np.mean([[covariance(p, q) for q in inside] for p in inside])
        if mean is None:
            A = np.block([[C, np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
            w = np.linalg.solve(A, np.r_[c, 1.0])
            variance, w = own - w @ np.r_[c, 1.0], w[:n]
            value = w @ v
        else:
            w = np.linalg.solve(C, c)
            variance, value = own - w @ c, mean + w @ (v - mean)
        assert got.estimate[k] == pytest.approx(value, abs=1e-6)
        assert got.variance[k] == pytest.approx(variance, abs=1e-6)
        assert got.efficiency is not None
        assert got.slope is not None
        assert got.efficiency[k] == pytest.approx(1 - variance / own, abs=1e-6)
        assert got.slope[k] == pytest.approx(w @ c / (w @ C @ w), abs=1e-6)


def test_blocks_of_one_point_are_points() -> None:
    # The same systems by another solver, which rounds practical ranges to 1e-6.
    at = np.zeros((1, 3))
    got = krige(POINTS, VALUES, TARGETS, MODEL, NEAR, blocks=(at, IDENTITY))
    points = krige(POINTS, VALUES, TARGETS, MODEL, NEAR)
    assert np.abs(got.estimate - points.estimate).max() < 1e-5
    assert np.abs(got.variance - points.variance).max() < 1e-5


def test_a_point_on_a_sample_is_the_sample_and_its_diagnostics_are_perfect() -> None:
    offset = (POINTS[:12] - POINTS[0])[None]
    used = np.ones((1, 12), dtype=bool)
    got = solve_systems(MODEL, offset, used, VALUES[None, :12], np.zeros((1, 1, 3)), None)
    assert got.estimate[0] == pytest.approx(VALUES[0], abs=1e-6)
    assert got.efficiency[0] == pytest.approx(1.0, abs=1e-6)
    assert got.slope[0] == pytest.approx(1.0, abs=1e-6)


def test_blocks_vary_less_than_points() -> None:
    inside = discretised(np.array([40.0, 40.0, 10.0]), (3, 3, 3))
    blocks = krige(POINTS, VALUES, TARGETS, MODEL, NEAR, blocks=(inside, IDENTITY))
    points = krige(POINTS, VALUES, TARGETS, MODEL, NEAR)
    assert (blocks.variance < points.variance).all()
    assert (blocks.variance > 0).all()


# -------------------------------------------------------------------------------------- limits


@pytest.mark.parametrize("per_hole", [None, 1])
def test_limits_count_the_samples_that_are_taken(per_hole) -> None:
    near = replace(NEAR, max_per_octant=2, max_per_hole=per_hole)
    found = Search(POINTS, HOLES, near).find(TARGETS)
    for k, target in enumerate(TARGETS):
        far = np.linalg.norm(near.measured(POINTS - target), axis=1)
        taken: list[int] = []
        octant = (near.measured(POINTS) >= near.measured(target[None])) @ np.array([1, 2, 4])
        for row in np.argsort(far):
            here = sum(octant[t] == octant[row] for t in taken) < 2
            free = per_hole is None or all(HOLES[t] != HOLES[row] for t in taken)
            if far[row] <= 1 and here and free and len(taken) < near.max_samples:
                taken.append(int(row))
        assert found.rows[k, : found.counts[k]].tolist() == taken


def test_too_few_holes_or_octants_leave_a_target_empty() -> None:
    corner = np.array([[-1.0, -1.0, -1.0], [50.0, 50.0, 10.0]])
    got = krige(POINTS, VALUES, corner, MODEL, replace(NEAR, min_octants=2))
    assert got.flag.tolist() == ["too_few_samples", "estimated"]  # all samples in one octant
    got = krige(POINTS, VALUES, corner, MODEL, replace(NEAR, min_holes=13), holes=HOLES)
    assert (got.flag == "too_few_samples").all()  # 12 samples are of at most 12 holes
    with pytest.raises(OptionError, match="min_holes needs the hole of each sample"):
        krige(POINTS, VALUES, corner, MODEL, replace(NEAR, min_holes=2))
    with pytest.raises(OptionError, match="min_octants must be 8 or less, not 9"):
        replace(NEAR, min_octants=9)


# ----------------------------------------------------------------------- through the unfolding


@pytest.fixture(scope="module")
def unfolded():
    body = gu.simulate("steep", blocks=3000)
    field = GradeField("spherical", (150, 150, 25), seed=4, mean=2.0, deviation=0.5)
    holes = gu.read_drillholes(*drill(body, field, 60.0, pattern="inclined"))
    return gu.unfold(body.folded), holes.samples(4.0)


def test_steps_of_blocks_are_the_maps_own(unfolded) -> None:
    # The images of the axes have the volume ratio of the block, which the map measures by itself.
    u, _ = unfolded
    rows = np.flatnonzero(u.location == "inside")[::7]
    steps, plain = local_axes(u.map, u.folded[rows], np.full(3, 1.0))
    assert plain == 0
    ratio = np.linalg.det(steps)
    assert np.median(np.abs(ratio - u.columns["volume_ratio"][rows])) < 0.02
    assert (ratio > 0).all()


def test_methods_side_by_side_are_those_alone(unfolded) -> None:
    u, samples = unfolded
    how = {"grade": "grade", "block_size": (8.0, 8.0, 4.0)}
    got = estimate(u, samples, also=("simple", "inverse_distance", "nearest"), **how)
    assert list(got.columns) == [
        *("grade_estimate", "grade_variance", "grade_efficiency", "grade_slope"),
        *("grade_simple", "grade_inverse_distance", "grade_nearest"),
        *("grade_samples", "grade_flag", "location"),
    ]
    for method in ("simple", "inverse_distance", "nearest"):
        alone = estimate(u, samples, variogram=got.variogram, method=method, **how)
        assert np.array_equal(alone.blocks.estimate, got.others[method].estimate)
    assert np.isin(got.columns["grade_nearest"], samples["grade"]).all()
    told = got.summary()
    assert told["support"] == {"block_size": [8.0, 8.0, 4.0], "discretised": [3, 3, 3]}
    assert 0 < told["kriging_efficiency"] < 1
    assert set(told["other_methods"]) == {"simple", "inverse_distance", "nearest"}
    assert got.cross_validation("nearest").counts()["estimated"] == len(got.samples.grades)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"block_size": (1, 0, 1)}, "block_size must have sides above 0"),
        ({"block_size": (1, 1)}, "block_size"),
        ({"block_size": (1, 1, 1), "discretise": (0, 1, 1)}, "discretise must be three whole"),
        ({"also": ("x",)}, "method 'x' is not one of"),
    ],
)
def test_what_blocks_refuse(unfolded, how, said: str) -> None:
    u, samples = unfolded
    with pytest.raises(OptionError, match=said):
        estimate(u, samples, variogram=MODEL, grade="grade", **how)
