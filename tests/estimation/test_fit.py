"""The automatic variogram: its likelihood, scores, down-hole lags, warnings and what it refuses."""

from __future__ import annotations

import math
import re

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import OptionError
from geounfold.estimation import (
    FittedVariogram,
    Neighbourhood,
    Structure,
    Variogram,
    fit_variogram,
    from_toml,
    krige,
)
from geounfold.estimation.experimental import down_hole, down_hole_nugget
from geounfold.estimation.left_out import LeftOut
from geounfold.estimation.likelihood import Shape, Subsets, packed
from geounfold.estimation.neighbourhood import Search, least_factor
from geounfold.estimation.normal_scores import hermite_shares, normal_scores, shape_of_grades
from geounfold.estimation.systems import solve_systems
from geounfold.estimation.variogram import LEAST_NUGGET
from geounfold.synthetic import GradeField

RNG = np.random.default_rng(3)
COLLARS = np.repeat(RNG.random((40, 2)) * 400, 12, axis=0)
POINTS = np.column_stack([COLLARS, np.tile(np.arange(12) * 4.0, 40)])
HOLES = np.repeat(np.arange(40), 12)


def drilled(seed: int, nugget: float = 0.0, kind: str = "spherical", ranges=(120.0, 60.0, 15.0)):
    """Return a field of variance 1 at the samples, with a nugget beside."""
    noise = np.random.default_rng(seed).normal(size=len(POINTS)) * np.sqrt(nugget)
    return np.sqrt(1 - nugget) * GradeField(kind, ranges, seed=seed).at(POINTS) + noise


# ------------------------------------------------------------------------------------ likelihood


def test_the_likelihood_is_that_of_its_definition() -> None:
    # 60 samples are one subset: -log L = (log|C| + log(1'C^-1 1) + (n-1) log s2) / 2.
    P, v = POINTS[:60], drilled(1)[:60]
    subsets = Subsets(P, v, HOLES[:60])
    assert subsets.rows.shape == (1, 60)
    model = Variogram(0.3, (Structure("exponential", 0.7, (80.0, 80.0, 20.0)),))
    C = model.sill - model.gamma((P[:, None] - P[None]).reshape(-1, 3)).reshape(60, 60)
    C += 1e-6 * np.eye(60)
    inverse = np.linalg.inv(C)
    one = np.ones(60)
    left = v - (one @ inverse @ v) / (one @ inverse @ one)
    s2 = left @ inverse @ left / 59
    wanted = 0.5 * (np.linalg.slogdet(C)[1] + np.log(one @ inverse @ one) + 59 * np.log(s2))
    x = packed(np.array([0.3, 0.7]), np.array([[80.0, 80.0, 20.0]]), 0.0, "transverse")
    assert subsets.objective(x, ("exponential",), "transverse")[0] == pytest.approx(wanted)


@pytest.mark.parametrize("kind", ["spherical", "exponential", "gaussian", "matern"])
@pytest.mark.parametrize("anisotropy", ["isotropic", "transverse", "orthotropic"])
def test_its_gradient_is_that_of_differences(kind: str, anisotropy: str) -> None:
    # Central differences of 1e-5 are exact to 1e-6 of the gradient's size; spherical ranges are
    # chosen so that no pair crosses its range within the difference.
    subsets = Subsets(POINTS[:120], drilled(2)[:120], HOLES[:120])
    ranges = np.array([[90.0, 51.0, 17.0], [210.0, 130.0, 33.0]])
    x = packed(np.array([0.2, 0.5, 0.3]), ranges, 0.4, anisotropy)
    how = ((kind, "exponential"), anisotropy)
    gradient = subsets.objective(x, *how)[1]
    for k, step in enumerate(1e-5 * np.eye(len(x))):
        ahead, behind = (subsets.objective(x + s, *how)[0] for s in (step, -step))
        assert gradient[k] == pytest.approx((ahead - behind) / 2e-5, abs=2e-4), k


def test_samples_in_other_rows_give_the_same_model() -> None:
    v, order = drilled(3, 0.2), np.random.default_rng(0).permutation(len(POINTS))
    one = fit_variogram(POINTS, v, holes=HOLES)
    other = fit_variogram(POINTS[order], v[order], holes=HOLES[order])
    assert one.model == other.model
    assert one.warnings() == other.warnings()


def test_two_directions_are_found_in_the_layer() -> None:
    # Ranges 240 and 40, the long one 30 degrees from x to y: bearing of axis 2, clockwise from +y,
    # is -30 (the axes turn together). Ten fields scatter by 6 degrees; their mean by 2.
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    turned = POINTS @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    bearings, ratios = [], []
    for seed in range(5):
        v = GradeField("exponential", (240, 40, 15), seed=seed).at(turned)
        model = fit_variogram(
            POINTS, v, holes=HOLES, anisotropy="orthotropic", kinds=["exponential"], structures=1
        ).model
        bearings.append(model.rotation[0])
        ratios.append(model.ranges[0] / model.ranges[1])
    assert np.median(bearings) == pytest.approx(-30, abs=10)
    assert 3 < np.median(ratios) < 12  # true: 6


def test_the_nugget_is_found_within_its_spread() -> None:
    # Ten fields of nugget 0.4: fitted shares scatter by 0.1, so the mean is within 0.1 (3 errors).
    shares = []
    for seed in range(10):
        model = fit_variogram(
            POINTS, drilled(seed, 0.4), holes=HOLES, structures=1, anisotropy="transverse",
            kinds=["spherical"],
        ).model  # fmt: skip
        shares.append(model.nugget / model.sill)
    assert np.mean(shares) == pytest.approx(0.4, abs=0.1)


def test_normal_grades_without_nugget_are_fitted_without_one() -> None:
    # Normal scores of the same field have a nugget of 0.001 of the sill, and lognormal grades keep
    # their scores: the change of the distribution is no line.
    v, how = drilled(1, kind="gaussian"), {"kinds": ["gaussian"], "structures": 1}
    model = fit_variogram(POINTS, v, holes=HOLES, anisotropy="transverse", **how).model
    assert LEAST_NUGGET <= model.nugget / model.sill < 1.1 * LEAST_NUGGET
    assert hermite_shares(v)[0] > 0.95
    skewed = fit_variogram(POINTS, np.exp(v), holes=HOLES, anisotropy="transverse", **how).model
    assert skewed.nugget / skewed.sill > 1e-4
    assert hermite_shares(np.exp(v))[0] < 0.95


def test_the_least_nugget_leaves_systems_solvable() -> None:
    # Two solvers differ by 2e-4 of a deviation with a nugget of 1e-6 of the sill, by 6e-3 with
    # 1e-7; ranges of several times the samples' extent make the worst systems.
    model = Variogram(1.01 * LEAST_NUGGET, (Structure("gaussian", 1.0, (1500.0, 1500.0, 300.0)),))
    v = drilled(1, kind="gaussian", ranges=(150.0, 150.0, 30.0))
    P = POINTS + np.random.default_rng(2).random(POINTS.shape)
    order = np.lexsort(P.T[::-1])
    P, v, holes = P[order], v[order], HOLES[order]
    near = Neighbourhood(radii=(1e5, 1e5, 2e4), max_samples=24, max_per_hole=6)
    targets = np.random.default_rng(0).random((100, 3)) * [400, 400, 48]
    got = krige(P, v, targets, model, near, holes=holes)
    assert got.counts()["estimated"] == 100
    found = Search(P, holes, near).find(targets)
    places = P[found.rows] - targets[:, None]
    used = np.arange(found.rows.shape[1]) < found.counts[:, None]
    own = solve_systems(model, places, used, v[found.rows], np.zeros((100, 1, 3)), None)
    assert np.abs(got.estimate - own.estimate).max() < 1e-3
    with pytest.raises(OptionError, match="needs a nugget of at least 1e-06 of the sill"):
        Variogram(1e-7, model.structures)


def test_a_second_direction_is_kept_that_left_out_holes_bear_out() -> None:
    # True ranges 200 and 70; the likelihood of this field grows by less than by chance.
    v, how = drilled(1, 0.3, ranges=(200.0, 70.0, 15.0)), {"kinds": ["spherical"], "structures": 1}
    got = fit_variogram(POINTS, v, holes=HOLES, **how)
    one = fit_variogram(POINTS, v, holes=HOLES, anisotropy="transverse", **how)
    assert got.anisotropy == "orthotropic"
    assert 0 < one.value - got.value < np.log(len(POINTS))
    assert got.model.ranges[0] > 2 * got.model.ranges[1]


# ----------------------------------------------------------------------------------- the judge


def test_left_out_holes_are_estimated_as_kriging_does() -> None:
    # Samples are moved a little: among equal distances the two searches choose as they like.
    v = drilled(4, 0.1)
    P = POINTS + np.random.default_rng(2).random(POINTS.shape)
    order = np.lexsort(P.T)
    P, v, holes = P[order], v[order], HOLES[order]
    model = Variogram(0.1, (Structure("spherical", 0.9, (120.0, 60.0, 15.0)),), (20.0, 0.0, 0.0))
    errors = LeftOut(P, v, holes).errors(model)
    near = Neighbourhood(
        radii=(1.2e5, 6e4, 1.5e4), rotation=model.rotation, max_samples=24, max_per_hole=6
    )
    found = krige(P, v, P, model, near, holes=holes, leave_out=holes)
    assert np.abs(errors - (found.estimate - v)).max() < 1e-4  # 1e-6 of the sill on the diagonal


# ------------------------------------------------------------------------------- normal scores


def test_scores_of_lognormal_grades_are_their_logarithms() -> None:
    # Hermite terms of exp(s z): s^2n / n! over exp(s^2) - 1 (Chiles and Delfiner 2012, 6.4.3).
    z = np.random.default_rng(0).normal(size=20_000)
    assert np.corrcoef(normal_scores(np.exp(z)), z)[0, 1] > 0.9999
    shares = hermite_shares(np.exp(0.6 * z))
    wanted = [0.36**n / math.factorial(n) / np.expm1(0.36) for n in (1, 2, 3)]
    assert shares[:3] == pytest.approx(wanted, abs=0.02)


def test_the_model_of_lognormal_grades_is_the_exact_one() -> None:
    # exp(s^2 rho) - 1 over exp(s^2) - 1; a nugget and one structure follow it to a few hundredths.
    shape = Shape(
        ("exponential",), np.array([0.1, 0.9]), np.array([[100.0, 100.0, 20.0]]), 0.0, 0.0, (),
        np.zeros(4),
    )  # fmt: skip
    s2 = 1.0
    shares = np.array([s2**n / math.factorial(n) for n in range(1, 31)]) / np.expm1(s2)
    got = shape_of_grades(shape, shares)
    h = np.array([5.0, 20.0, 60.0, 120.0])
    rho = 0.9 * 20.0 ** (-h / 100)
    found = got.shares[1] * 20.0 ** (-h / got.ranges[0, 0])
    assert found == pytest.approx(np.expm1(s2 * rho) / np.expm1(s2), abs=0.03)
    assert got.shares[0] > 0.1  # skewed grades lose continuity
    assert got.ranges[0, 0] < 100


# ------------------------------------------------------------------------------- down-hole lags


def test_down_hole_lags_by_hand() -> None:
    # Grades 0, 1, 2, 3 down every hole: lag k has gamma k^2 / 2; a line through lags 1 to 3 with
    # weights 1, 1/4, 1/9 (times equal root pairs) starts below 0, which is clipped.
    points = np.array([[x, 0.0, z] for x in range(0, 500, 25) for z in range(4)], dtype=float)
    holes = np.repeat(np.arange(20), 4)
    table = down_hole(points, points[:, 2], holes)
    assert table.lag.tolist() == [1, 2, 3]
    assert table.gamma.tolist() == pytest.approx([0.5, 2.0, 4.5])
    assert table.pairs.tolist() == [60, 40, 20]
    assert down_hole_nugget(table) == 0.0
    flat = pd.DataFrame(
        {"lag": [1, 2], "distance": [1.0, 2.0], "gamma": [0.5, 0.6], "pairs": [9, 9]}
    )
    assert down_hole_nugget(flat) == pytest.approx(0.4)  # the line through both
    assert down_hole_nugget(flat[:1]) is None


# ----------------------------------------------------------------------------------- warnings


def fitted(model: Variogram, **more: object) -> FittedVariogram:
    return FittedVariogram(
        model, pd.DataFrame(), 0.0, "transverse", spacing=50.0, extent=(400.0, 400.0, 60.0),
        **more,  # type: ignore[arg-type]
    )  # fmt: skip


@pytest.mark.parametrize(
    ("nugget", "ranges", "said"),
    [
        (0.8, (100, 100, 20), "nugget is 80% of its sill"),
        (0.1, (500, 100, 20), "range along axis 1, 500, is longer than the samples' extent, 400"),
        (0.1, (100, 100, 70), "across the layer .axis 3., 70, is longer"),
        (
            0.1,
            (40, 30, 20),
            "range along the layer, 40, is shorter than the spacing of the holes, 50",
        ),
    ],
)
def test_doubtful_models_are_told(nugget: float, ranges, said: str) -> None:
    model = Variogram(nugget, (Structure("spherical", 1 - nugget, ranges),))
    (line,) = fitted(model).warnings()
    assert pytest.approx(1.0) == model.sill
    assert re.search(said, line)


def test_a_plain_model_is_told_nothing_and_a_bound_is() -> None:
    model = Variogram(0.2, (Structure("spherical", 0.8, (100, 100, 20)),))
    assert fitted(model).warnings() == []
    (line,) = fitted(
        model, bounds=("range across of the spherical structure (longest)",)
    ).warnings()
    assert "range across of the spherical structure (longest) lies on a bound" in line
    assert "pure nugget" in fitted(Variogram(1.0, ())).warnings()[0]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"weights": "x"}, "weights 'x' are not one of: likelihood, near, cressie"),
        ({"structures": 3}, "structures must be 1 or 2, not 3"),
        ({"kinds": []}, "no kinds of structures are given"),
        ({"anisotropy": "x"}, "anisotropy 'x' is not one of: auto, isotropic"),
    ],
)
def test_what_the_fit_refuses(how, said: str) -> None:
    with pytest.raises(OptionError, match=said):
        fit_variogram(POINTS, drilled(1), **how)


@pytest.mark.parametrize("weights", ["near", "cressie"])
def test_least_squares_fits_one_structure(weights) -> None:
    # Fields of ranges 60 and 15: one field's fit scatters by a factor of 1.5 or so.
    v = drilled(5, 0.1, ranges=(60.0, 60.0, 15.0))
    got = fit_variogram(POINTS, v, weights=weights, kinds=["spherical"])
    assert len(got.model.structures) == 1
    assert 20 < got.model.ranges[0] < 180
    assert got.model.rotation == (0, 0, 0)


# ------------------------------------------------------------------------------- radii, the file


def test_the_least_factor_is_that_of_a_search() -> None:
    near = Neighbourhood(radii=(30.0, 20.0, 5.0), rotation=(25.0, 0.0, 0.0), max_per_hole=2)
    targets = np.random.default_rng(1).random((30, 3)) * [400, 400, 50]
    targets[3] = np.nan
    factor = least_factor(near, POINTS, HOLES, targets)
    assert np.isnan(factor[3])
    assert np.isfinite(np.delete(factor, 3)).all()
    for k in np.flatnonzero(np.isfinite(factor)):
        for scale, enough in ((1.001, True), (0.999, False)):
            radii = tuple(scale * factor[k] * np.array(near.radii))
            one = Neighbourhood(radii=radii, rotation=near.rotation, max_per_hole=2)
            count = Search(POINTS, HOLES, one).find(targets[k][None]).counts[0]
            assert (count >= near.min_samples) == enough


def test_models_come_back_from_toml() -> None:
    model = Variogram(
        0.1,
        (Structure("matern", 0.5, (30.5, 20.25, 5), 2.5), Structure("spherical", 0.4, (90, 60, 9))),
        (12.5, -3.0, 40.0),
    )
    assert from_toml(model.to_toml(), "v.toml") == model
    with pytest.raises(OptionError, match=r"v\.toml: not valid TOML"):
        from_toml("nugget = ", "v.toml")
    with pytest.raises(OptionError, match=r"v\.toml: needs structures"):
        from_toml("nugget = 1.0\nsill = 2.0", "v.toml")
    with pytest.raises(OptionError, match="a spherical structure has no smoothness"):
        Structure("spherical", 1.0, (1, 1, 1), 2.0)
    with pytest.raises(OptionError, match=r"smoothness must be from 0\.1 to 20"):
        Structure("matern", 1.0, (1, 1, 1), 0.0)
