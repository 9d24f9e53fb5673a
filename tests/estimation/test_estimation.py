"""Estimation: systems against NumPy's, neighbourhoods by hand, models that are found again."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.errors import BackendError, InputError, OptionError
from geounfold.estimation import (
    FLAGS,
    KINDS,
    Neighbourhood,
    Structure,
    Variogram,
    contact,
    cross_validate,
    directional,
    estimate,
    explore,
    fit_variogram,
    from_json,
    grade_tonnage,
    histogram,
    hole_numbers,
    krige,
    score,
    swath,
)
from geounfold.estimation.exploration import by_layer
from geounfold.estimation.neighbourhood import Search
from geounfold.estimation.scores import conservation
from geounfold.estimation.worker import apart
from geounfold.report.plots.grades import charts
from geounfold.synthetic import GradeField, drill

pytest.importorskip("gstlearn", reason="the extra geostat is not installed")

POINTS = np.random.default_rng(5).random((300, 3)) * [100.0, 100.0, 20.0]
VALUES = np.random.default_rng(6).normal(2.0, 1.0, 300)
HOLES = np.random.default_rng(7).integers(0, 30, 300)
TARGETS = np.random.default_rng(8).random((40, 3)) * [100.0, 100.0, 20.0]
WIDE = Neighbourhood(radii=(80.0, 80.0, 16.0), max_samples=12)


def model(kind: str, rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Variogram:
    """Return a nugget and two structures."""
    parts = (Structure(kind, 0.7, (60.0, 40.0, 8.0)), Structure("spherical", 0.5, (90, 90, 30)))
    return Variogram(0.2, parts, rotation)


def by_numpy(variogram: Variogram, near: Neighbourhood, mean: float | None):
    """Return estimates and variances from systems that NumPy solves, target by target."""
    out = []
    for target in TARGETS:
        far = np.linalg.norm(near.measured(POINTS - target), axis=1)
        rows = np.argsort(far)[: near.max_samples]
        rows = rows[far[rows] <= 1]
        P, v, n = POINTS[rows], VALUES[rows], len(rows)
        between = (P[:, None] - P[None]).reshape(-1, 3)
        C = variogram.sill - variogram.gamma(between).reshape(n, n)
        c = variogram.sill - variogram.gamma(P - target)
        if mean is not None:
            w = np.linalg.solve(C, c)
            out.append((mean + w @ (v - mean), variogram.sill - w @ c))
            continue
        A = np.block([[C, np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
        w = np.linalg.solve(A, np.r_[c, 1.0])
        out.append((w[:n] @ v, variogram.sill - w @ np.r_[c, 1.0]))
    return np.array(out).T


# -------------------------------------------------------------------------------------- systems


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mean", [None, 1.5])
def test_kriging_is_the_solution_of_its_system(kind: str, mean: float | None) -> None:
    # Both solve the same 12 x 12 systems. The library rounds its practical ranges' factors to 1e-6.
    variogram = model(kind, rotation=(30.0, 10.0, 20.0))
    near = Neighbourhood(radii=(80, 60, 40), rotation=(15.0, 0.0, 5.0), max_samples=12)
    how = {} if mean is None else {"method": "simple", "mean": mean}
    got = krige(POINTS, VALUES, TARGETS, variogram, near, **how)
    values, variance = by_numpy(variogram, near, mean)
    assert np.abs(got.estimate - values).max() < 1e-6
    assert np.abs(got.variance - variance).max() < 1e-6
    assert (got.flag == "estimated").all()


def test_a_target_on_a_sample_is_the_sample() -> None:
    # Without a nugget kriging interpolates exactly, and so do inverse distances.
    exact = Variogram(0.0, (Structure("spherical", 1.0, (50, 50, 10)),))
    got = krige(POINTS, VALUES, POINTS, exact, WIDE)
    assert np.abs(got.estimate - VALUES).max() < 1e-9
    assert np.abs(got.variance).max() < 1e-9
    weighted = krige(POINTS, VALUES, POINTS, None, WIDE, method="inverse_distance")
    assert np.abs(weighted.estimate - VALUES).max() < 1e-12


def test_inverse_distances_weigh_in_units_of_the_radii() -> None:
    # Two samples at 1/4 and 1/2 radius, of values 0 and 1: weights 16 and 4, so 4 / 20.
    points = np.array([[25.0, 0, 0], [0, 0, -5.0]])
    near = Neighbourhood(radii=(100, 100, 10), min_samples=1)
    got = krige(
        points, np.array([0.0, 1.0]), np.zeros((1, 3)), None, near, method="inverse_distance"
    )
    assert got.estimate[0] == pytest.approx(0.2, abs=1e-12)
    assert np.isnan(got.variance[0])


def test_a_constant_stays_constant() -> None:
    got = krige(POINTS, np.full(300, 7.0), TARGETS, model("exponential"), WIDE)
    assert np.abs(got.estimate - 7.0).max() < 1e-12


def test_the_unit_of_grades_and_lengths_does_not_matter() -> None:
    a = krige(POINTS, VALUES, TARGETS, model("spherical"), WIDE)
    wide = Neighbourhood(radii=(8e4, 8e4, 1.6e4), max_samples=12)
    structures = tuple(
        Structure(s.kind, s.sill * 1e-8, tuple(1000 * r for r in s.ranges))
        for s in model("spherical").structures
    )
    b = krige(POINTS * 1000, VALUES * 1e-4, TARGETS * 1000, Variogram(0.2e-8, structures), wide)
    assert np.abs(b.estimate * 1e4 - a.estimate).max() < 1e-9
    assert np.abs(b.variance * 1e8 - a.variance).max() < 1e-9


def test_row_order_changes_no_bit_and_workers_neither(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    near = Neighbourhood(radii=(80, 80, 16), max_samples=8, max_per_hole=2)
    a = krige(POINTS, VALUES, TARGETS, model("spherical"), near, holes=HOLES)
    p, t = rng.permutation(300), rng.permutation(40)
    b = krige(POINTS[p], VALUES[p], TARGETS[t], model("spherical"), near, holes=HOLES[p])
    assert np.array_equal(b.estimate, a.estimate[t])
    assert np.array_equal(b.variance, a.variance[t])
    monkeypatch.setattr("geounfold.estimation.kriging._CHUNK", 16)  # so that there are three
    c = krige(POINTS, VALUES, TARGETS, model("spherical"), near, holes=HOLES, workers=2)
    assert np.array_equal(c.estimate, a.estimate)


def test_samples_in_one_place_are_one_of_their_mean() -> None:
    twice = np.concatenate([POINTS, POINTS[:5]])
    values = np.r_[VALUES, VALUES[:5] + 2.0]
    merged = VALUES.copy()
    merged[:5] += 1.0
    a = krige(twice, values, TARGETS, model("spherical"), WIDE)
    b = krige(POINTS, merged, TARGETS, model("spherical"), WIDE)
    assert np.abs(a.estimate - b.estimate).max() < 1e-12


# -------------------------------------------------------------------------------- neighbourhoods


def brute(near: Neighbourhood, target: np.ndarray, own: int) -> list[int]:
    """Return the samples of a target by going through all of them."""
    far = np.linalg.norm(near.measured(POINTS - target), axis=1)
    taken: list[int] = []
    for row in np.argsort(far):
        same = sum(HOLES[t] == HOLES[row] for t in taken)
        full = near.max_per_hole is not None and same >= near.max_per_hole
        if far[row] <= 1 and HOLES[row] != own and not full and len(taken) < near.max_samples:
            taken.append(int(row))
    return taken


@pytest.mark.parametrize("per_hole", [None, 1, 3])
@pytest.mark.parametrize("radius", [15.0, 400.0])
def test_search_takes_the_nearest_of_each_hole(per_hole: int | None, radius: float) -> None:
    rng = np.random.default_rng(5)
    near = Neighbourhood(
        radii=(radius, radius, radius / 4), max_samples=20, max_per_hole=per_hole, min_samples=1
    )
    own = rng.integers(-1, 30, len(TARGETS))
    found = Search(POINTS, HOLES, near).find(TARGETS, own)
    for k, target in enumerate(TARGETS):
        assert found.rows[k, : found.counts[k]].tolist() == brute(near, target, own[k])


def test_what_is_not_estimated_is_flagged() -> None:
    near = Neighbourhood(radii=(10, 10, 2), min_samples=3)
    targets = np.array([[1e4, 0, 0], [np.nan] * 3, [50, 50, 10]])
    near_one = np.concatenate([POINTS, [[50.0, 50, 10.1], [50, 50.1, 10], [50.1, 50, 10]]])
    got = krige(near_one, np.r_[VALUES, 1, 1, 1], targets, model("spherical"), near)
    assert got.flag.tolist() == ["too_few_samples", "outside_map", "estimated"]
    assert np.isnan(got.estimate).tolist() == [True, True, False]
    assert got.samples[0] == 0
    assert sum(got.counts().values()) == 3
    assert set(got.counts()) == set(FLAGS)


def test_cross_validation_leaves_the_whole_hole_out() -> None:
    # Two holes of constant grades 1 and 3: each is estimated as the other.
    points = np.column_stack([np.repeat([0.0, 10.0], 6), np.zeros(12), np.tile(np.arange(6.0), 2)])
    holes = hole_numbers(["A"] * 6 + ["B"] * 6)
    near = Neighbourhood(radii=(50, 50, 50))
    got = cross_validate(points, np.repeat([1.0, 3.0], 6), holes, model("spherical"), near)
    assert np.abs(got.estimate - np.repeat([3.0, 1.0], 6)).max() < 1e-12


# ------------------------------------------------------------------------------------ variograms


def test_gamma_is_nothing_at_nothing_and_the_sill_far_away() -> None:
    m = model("exponential", rotation=(90.0, 0.0, 0.0))
    far = m.gamma(np.array([[0.0, 0, 0], [1e6, 0, 0], [1e-9, 0, 0]]))
    assert far == pytest.approx([0.0, 1.4, 0.2], abs=1e-6)  # sills 0.2 + 0.7 + 0.5; the nugget
    # The second axis bears east: its range, 40, lies along world x, where 5 % of 0.7 is left.
    east = Variogram(0.0, m.structures[:1], m.rotation).gamma(np.array([[40.0, 0, 0]]))
    assert east[0] == pytest.approx(0.95 * 0.7, rel=1e-12)


@pytest.mark.parametrize(
    "kind",
    [
        "spherical",
        pytest.param("exponential", marks=pytest.mark.slow),
        pytest.param("gaussian", marks=pytest.mark.slow),
    ],
)
def test_the_fit_finds_the_ranges_of_a_field(kind: str) -> None:
    # Ten fields of ranges 60 and 12; the mean of the fitted ranges' logarithms has a standard
    # error of about 0.1 (one field's spread is 0.3), so a factor of 1.35 is three of them.
    rng = np.random.default_rng(1)
    points = rng.random((900, 3)) * [400, 400, 60]
    found = []
    for seed in range(10):
        values = GradeField(kind, (60, 60, 12), seed=seed).at(points)
        found.append(fit_variogram(points, values, kinds=[kind]).model.ranges)
    along, _, across = np.exp(np.log(found).mean(axis=0))
    assert 60 / 1.35 < along < 60 * 1.35
    assert 12 / 1.35 < across < 12 * 1.35


def test_the_fit_does_not_depend_on_row_order() -> None:
    rng = np.random.default_rng(5)
    values = GradeField("spherical", (40, 40, 8), seed=2).at(POINTS)
    p = rng.permutation(300)
    a, b = fit_variogram(POINTS, values), fit_variogram(POINTS[p], values[p])
    assert a.model == b.model


def test_directional_variograms_of_a_slope() -> None:
    # z = x on a grid: pairs along x differ by their distance, those along y not at all.
    x, y, w = (g.ravel() for g in np.meshgrid(np.arange(12.0), np.arange(12.0), np.arange(6.0)))
    table = directional(np.column_stack([x, y, w]), x, lags=5)
    one = table[table.direction == "axis_1"]
    assert np.allclose(one.gamma, 0.5 * one.distance**2, rtol=0.25)  # 22.5 degrees off at most
    assert (table[table.direction == "across"].gamma < 0.51).all()  # off the axis by one at most
    assert (table[table.direction == "axis_2"].gamma < one.gamma.to_numpy()[-1]).all()


# --------------------------------------------------------------------------- scores, exploration


def test_scores_of_known_errors() -> None:
    # Estimates 1, 2, 3, 4 of truths 2, 4, 6, 8: errors -1 ... -4, slope 2, correlation 1.
    got = score(np.array([2.0, 4, 6, 8, 1]), np.array([1.0, 2, 3, 4, np.nan]))
    assert (got.count, got.missing) == (4, 1)
    assert got.bias == -2.5
    assert got.rmse == pytest.approx(np.sqrt(30 / 4))
    assert (got.slope, got.correlation) == (pytest.approx(2.0), pytest.approx(1.0))


def test_grade_tonnage_by_hand() -> None:
    table = grade_tonnage(np.array([1.0, 2, 3, np.nan]), [0.0, 2.0, 9.0], np.array([1.0, 1, 2, 5]))
    assert table.tonnage.tolist() == [1.0, 0.75, 0.0]
    assert table.metal.tolist() == [9.0, 8.0, 0.0]
    assert table.grade[1] == pytest.approx(8 / 3)
    assert np.isnan(table.grade[2])


def test_tables_of_exploration_by_hand() -> None:
    values = np.array([1.0, 2, 3, 4])
    assert histogram(values, 3)["count"].tolist() == [1, 1, 2]
    slices = swath(np.array([0.0, 1, 9, 10]), values, 5)
    assert slices["count"].tolist() == [2, 0, 0, 0, 2]
    assert slices["mean"].fillna(-1).tolist() == [1.5, -1, -1, -1, 3.5]
    layers = by_layer(np.array([0.0, 0.49, 0.5, 1.0]), values, 2)
    assert layers["mean"].tolist() == [1.5, 3.5]
    sides = contact(np.array([-1.5, -0.5, 0.0, 0.5]), values, 1.0, 2.0)
    assert sides["mean"].fillna(-1).tolist() == [1.0, 2.0, 3.5, -1.0]
    assert sides["count"].tolist() == [1, 1, 2, 0]


# ------------------------------------------------------------------------- through the unfolding


@pytest.fixture(scope="module")
def drilled():
    """A folded body, its unfolding, a field of grades, and composites of holes through it."""
    body = gu.simulate("steep", blocks=6000)
    field = GradeField("spherical", (150, 150, 25), seed=4, mean=2.0, deviation=0.5)
    holes = gu.read_drillholes(*drill(body, field, 40.0, pattern="inclined"))
    return body, gu.unfold(body.folded), field, holes.samples(4.0)


def test_estimates_in_the_unfolded_space_are_those_in_the_truth(drilled) -> None:
    body, u, field, samples = drilled
    got = estimate(u, samples, grade="grade")
    truth = field.at(body.truth)
    flat, there = body.sheet.unfold(samples[["x", "y", "z"]].to_numpy())
    assert there.mean() > 0.98  # composites at the surfaces may have their middle outside
    ceiling = krige(
        flat[there], samples.grade.to_numpy()[there], body.truth, got.variogram, got.neighbourhood
    ).estimate
    ours, best = score(truth, got.blocks.estimate), score(truth, ceiling)
    assert (got.blocks.flag == "estimated").all()
    # The same rules in the true flat space are the ceiling: 1 % is far more than the map's error.
    assert ours.rmse < 1.01 * best.rmse
    assert got.columns["grade_estimate"] is got.blocks.estimate
    counted = got.summary()["samples"]
    assert counted["used"] + counted["outside_body"] == len(samples)
    # Middles outside the body, by its truth and by the map: a few of them lie on a surface.
    assert counted["outside_body"] / len(samples) == pytest.approx(1 - there.mean(), abs=0.02)
    every = estimate(u, samples, grade="grade", soft_boundary=1.0)
    assert every.summary()["samples"]["used"] == len(samples)
    assert every.samples.let_in == counted["outside_body"]
    assert score(got.samples.grades, got.cross_validation().estimate).correlation > 0.3


def test_metal_is_conserved_within_the_volume_change(drilled) -> None:
    _, u, _, samples = drilled
    got = estimate(u, samples, grade="grade")
    kept = got.conservation(np.full(len(u.folded), 1000.0), u.columns["volume_ratio"])
    assert kept.blocks == len(u.folded)
    # Grades of about 2 all over: the metal's change is that of the volumes but for what grade and
    # change have in common, at most the spread of the one times that of the other.
    ratio = u.columns["volume_ratio"]
    grades = got.blocks.estimate
    common = grades.std() / grades.mean() * ratio.std()
    assert -common <= kept.metal_change - kept.volume_change <= common
    assert kept.unfolded == pytest.approx(1000.0 * (ratio * grades).sum(), rel=1e-12)


def test_samples_left_out_are_counted(drilled) -> None:
    _, u, _, samples = drilled
    odd = samples.copy()
    odd.loc[0, "grade"] = np.nan
    odd.loc[1, "x"] += 1e6
    how = {"grade": "grade", "method": "inverse_distance", "soft_boundary": 1.0}
    got = estimate(u.map, odd, u.folded[:50], **how)
    facts = got.samples.facts()
    assert [facts[n] for n in ("given", "used", "without_grade", "outside_map")] == [
        *(len(odd), len(odd) - 2, 1, 1)
    ]
    assert any("no grade" in line for line in got.warnings())
    assert any("outside the map" in line for line in got.warnings())


def test_exploration_of_both_spaces(drilled) -> None:
    _, u, _, samples = drilled
    e = explore(u, samples, grade="grade")
    s = e.samples.stratigraphic
    assert e.layers["count"].sum() == np.count_nonzero((s >= 0) & (s <= 1))
    assert set(e.swaths) == {"x", "y", "stratigraphic"}
    drawn = charts(e)
    assert list(drawn) == ["histogram", "layers", "variograms", "swaths", "contacts"]
    panels = {name: len(figure.axes) for name, figure in drawn.items()}
    # Profiles have a second axis for counts each, as the histogram has for shares.
    assert panels == {"histogram": 2, "layers": 1, "variograms": 2, "swaths": 6, "contacts": 4}
    for figure in drawn.values():
        picture = io.BytesIO()
        figure.savefig(picture)
        assert picture.getvalue()[:4] == b"\x89PNG"
    # The field's anisotropy is 6 to 1 (150 over 25); folded limbs at 70 degrees hide most of it
    # across the fold's axis: there lies the second axis, as the longest range is the first's.
    ratio = {name: m.model.ranges[1] / m.model.ranges[2] for name, m in e.models.items()}
    assert ratio["unfolded"] > 1.5 * ratio["folded"]


# ---------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Structure("linear", 1, (1, 1, 1)), "is not one of"),
        (lambda: Structure("spherical", 0, (1, 1, 1)), "above 0"),
        (lambda: Structure("spherical", 1, (1, 1)), "3 finite numbers"),
        (lambda: Structure("spherical", "a", (1, 1, 1)), "1 numbers"),
        (lambda: Variogram(-1, (Structure("spherical", 2, (1, 1, 1)),)), "negative"),
        (lambda: Variogram(0, ()), "nugget or a structure"),
        (lambda: Variogram(0, (Structure("gaussian", 1, (1, 1, 1)),)), "at least"),
        (lambda: Neighbourhood(radii=(1, 0, 1)), "radii must be above 0"),
        (lambda: Neighbourhood(radii=(1, 1, 1), max_samples=0), "max_samples must be"),
        (lambda: Neighbourhood(radii=(1, 1, 1), min_samples=30), "must not exceed"),
        (lambda: from_json("{", "v.json"), "v.json: not valid JSON"),
        (lambda: from_json("[]", "v.json"), "must be an object"),
        (lambda: from_json("{}", "v.json"), "needs structures"),
        (lambda: from_json('{"structures": [1]}', "v.json"), "kind, sill and ranges"),
        (lambda: from_json('{"structures": [], "nugget": 0}', "v.json"), "v.json: a variogram"),
        (lambda: krige(POINTS, VALUES, TARGETS, None, WIDE), "needs a variogram"),
        (lambda: krige(POINTS, VALUES, TARGETS, None, WIDE, method="idw"), "is not one of"),
        (
            lambda: krige(POINTS, VALUES, TARGETS, None, WIDE, method="inverse_distance", power=0),
            "power of inverse distance",
        ),
        (
            lambda: krige(
                POINTS, VALUES, TARGETS, model("spherical"),
                Neighbourhood(radii=(1, 1, 1), max_per_hole=2),
            ),
            "needs the hole of each sample",
        ),
        (
            lambda: krige(POINTS, VALUES, TARGETS, model("spherical"), WIDE, workers=0),
            "workers must be",
        ),
        (lambda: fit_variogram(POINTS, VALUES, anisotropy="two"), "is not one of"),
        (lambda: fit_variogram(POINTS, VALUES, kinds=["cubic"]), "is not one of"),
        (lambda: contact(VALUES, VALUES, 0.0), "width and reach"),
    ],
)  # fmt: skip
def test_wrong_options_are_named(make, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        make()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: krige(POINTS[:0], VALUES[:0], TARGETS, model("spherical"), WIDE), "no samples"),
        (lambda: krige(POINTS, VALUES[:9], TARGETS, model("spherical"), WIDE), "samples need"),
        (lambda: krige(POINTS, VALUES * np.nan, TARGETS, model("spherical"), WIDE), "finite"),
        (
            lambda: krige(POINTS, VALUES, TARGETS, model("spherical"), WIDE, holes=HOLES[:9]),
            "as many holes",
        ),
        (lambda: fit_variogram(POINTS[:9], VALUES[:9]), "at least 20"),
        (lambda: fit_variogram(POINTS, VALUES[:9]), "samples need"),
        (lambda: fit_variogram(POINTS, np.ones(300)), "same value"),
        (
            # 24 samples within 1 of each other and one far away: pairs in one bin, and beyond all.
            lambda: fit_variogram(np.r_[POINTS[:24] / 1e3, [[1e3] * 3]], VALUES[:25]),
            "too few samples",
        ),
        (lambda: score(VALUES, VALUES[:9]), "true values"),
        (lambda: score(VALUES[:1], VALUES[:1]), "only 1"),
        (lambda: histogram(VALUES[:0]), "no values"),
        (lambda: conservation(VALUES * np.nan, VALUES, VALUES), "no block"),
    ],
)
def test_data_that_cannot_be_used_are_named(make, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()


def test_samples_without_what_is_needed(drilled) -> None:
    _, u, _, samples = drilled
    with pytest.raises(InputError, match="no column 'Cu'"):
        estimate(u, samples, grade="Cu")
    with pytest.raises(InputError, match="no sample has a value"):
        estimate(u, samples.assign(grade=np.nan), grade="grade")
    with pytest.raises(InputError, match="map's reach"):
        estimate(u, samples.assign(x=1e7), grade="grade")
    with pytest.raises(InputError, match="a map holds no blocks"):
        estimate(u.map, samples, grade="grade")
    with pytest.raises(OptionError, match="has no parameter 'max'"):
        estimate(u, samples, grade="grade", neighbourhood={"max": 3})
    nameless = estimate(u, samples.drop(columns="hole"), u.folded[:9], grade="grade")
    with pytest.raises(InputError, match="whole holes"):
        nameless.cross_validation()
    with pytest.raises(OptionError, match="layers must be"):
        explore(u, samples, grade="grade", layers=0)


def test_a_process_that_fails_says_so() -> None:
    with pytest.raises(BackendError, match=r"ended with status 1: .*DateParseError"):
        apart(pd.Timestamp, [("no date",)], 1)
