"""Bodies from drill-holes against bodies that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.drillholes import read_drillholes
from geounfold.errors import InputError, OptionError
from geounfold.modelling import BodyOptions
from geounfold.modelling.intercepts import in_body, intercepts_of
from geounfold.modelling.reference import PlaneReference, fold_of, mean_plane
from geounfold.modelling.sheet import contacts_of, fit_sheet, foretold
from geounfold.modelling.traced import traced
from tests.modelling.holes import drilled, plate, shares


def test_a_plate_is_rebuilt_exactly() -> None:
    made = gu.body_from_holes(*plate(), code="ORE", block_size=5, extent=25)
    # Depths 20 to 40 and collars at z = 0; 25 beyond the outer holes, whose corners are round.
    assert made.points[:, 2].min() == -37.5
    assert made.points[:, 2].max() == -22.5
    square, rounded = 200**2 * 20, (200**2 - (4 - np.pi) * 25**2) * 20
    assert rounded * 0.99 < made.volume < square
    np.testing.assert_allclose(made.intercepts["thickness"], 20, rtol=1e-9)
    np.testing.assert_allclose(made.hanging_wall.V[:, 2], -20, atol=1e-6)
    np.testing.assert_allclose(made.footwall.V[:, 2], -40, atol=1e-6)


def test_thickness_is_across_the_layer() -> None:
    made = gu.body_from_holes(*plate(dip=30.0), code="ORE", block_size=5)
    np.testing.assert_allclose(made.intercepts["thickness"], 20 * np.cos(np.pi / 6), rtol=1e-6)
    assert "dips 30 degrees to 090" in made.told[0]


@pytest.mark.parametrize("shape", ["plane", "fold"])
def test_walls_pass_through_the_contacts(shape: str) -> None:
    _, tables = drilled("sim_case_1", 60, "inclined")
    holes, options = read_drillholes(*tables), BodyOptions(code="ORE")
    found = intercepts_of(holes, in_body(holes, options)[0], options)
    reference = mean_plane(found) if shape == "plane" else fold_of(found, traced(holes, found, 8.0))
    contacts, _ = contacts_of(found, reference)
    middle, half = fit_sheet(found, reference).walls.at(contacts.places)
    at = middle + np.where(contacts.hanging, half, -half)
    # Contacts of neighbouring holes differ by metres; what the ridge leaves is micrometres.
    np.testing.assert_allclose(at, contacts.heights, atol=1e-4)


def test_an_open_fold_is_rebuilt() -> None:
    body, tables = drilled("sim_case_1", 50)
    made = gu.body_from_holes(*tables, code="ORE", block_size=5)
    volume, right, met = shares(body, made)
    # Measured -0.007, 0.943, 0.934; what is wrong are the rims, half a spacing beyond the holes.
    assert abs(volume) < 0.03
    assert right > 0.92
    assert met > 0.91
    assert made.error is not None
    assert made.error < 0.06  # measured 0.029; 0.54 for an overturned fold drawn over a plane


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "pattern", "wrong"),
    # Measured: volume -0.001, +0.003 and -0.012.
    [("recumbent", "inclined", 0.03), ("box", "vertical", 0.03), ("steep", "vertical", 0.04)],
)
def test_folds_are_drawn_about_their_axis(name: str, pattern: str, wrong: float) -> None:
    body, tables = drilled(name, 50, pattern)
    made = gu.body_from_holes(*tables, code="ORE", block_size=5)
    assert "about an axis that plunges 0 degrees to" in made.told[0]
    volume, right, met = shares(body, made)
    assert abs(volume) < wrong
    assert right > 0.9
    assert met > 0.87
    flat = gu.body_from_holes(*tables, code="ORE", block_size=5, shape="plane")
    assert min(shares(body, flat)[1:]) < min(right, met)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "pattern", "least"),
    # Shares of the true body that are met: over the plane 0.961 and 0.634, over the fold 0.895 and
    # 0.436. The fold of sim_case_1 foretells 0.07 wrongly if its curve has seen the left-out holes
    # (the plane 0.09) and 0.12 if not; that of recumbent turns by 292 degrees and foretells 0.79.
    [("sim_case_1", "vertical", 0.94), ("recumbent", "inclined", 0.6)],
)
def test_no_fold_is_chosen_that_left_out_holes_do_not_bear_out(name, pattern, least) -> None:
    body, tables = drilled(name, 100, pattern)
    made = gu.body_from_holes(*tables, code="ORE", block_size=10)
    assert "over a plane" in made.told[0]
    assert shares(body, made)[2] > least
    assert bool(made.warnings) == (name == "recumbent")


def test_a_surface_that_cannot_be_drawn_foretells_no_body() -> None:
    holes, options = read_drillholes(*plate()), BodyOptions(code="ORE")
    found = intercepts_of(holes, in_body(holes, options)[0], options)
    trace, plane = traced(holes, found, 2.5), mean_plane(found)
    assert foretold(found, plane, trace) == 0.0  # a plate is foretold exactly
    assert foretold(found, plane, trace, redrawn=True) == 0.0

    class Lost(PlaneReference):
        def redrawn(self, found: object, trace: object) -> PlaneReference:
            raise InputError("the body falls apart")

    lost = Lost(plane.origin, plane.axes)
    assert foretold(found, lost, trace, redrawn=True) == 1.0  # all of the body's length is missed


def test_the_rows_order_does_not_matter() -> None:
    collar, survey, lith = plate(dip=20.0)
    lith["from"] += np.where(lith["lith"] == "ORE", np.arange(len(lith)) % 7, 0)
    made = gu.body_from_holes(collar, survey, lith, code="ORE", block_size=10)
    mixed = [t.sample(frac=1, random_state=k) for k, t in enumerate((collar, survey, lith))]
    again = gu.body_from_holes(*mixed, code="ORE", block_size=10)
    assert np.array_equal(made.points, again.points)


def test_a_barren_hole_keeps_the_body_away() -> None:
    collar, survey, lith = plate(5)
    middle = collar.loc[12, "hole"]
    lith.loc[(lith["hole"] == middle) & (lith["lith"] == "ORE"), "lith"] = "WASTE"
    made = gu.body_from_holes(collar, survey, lith, code="ORE", block_size=5)
    assert made.barren == 1
    away = np.linalg.norm(made.points[:, :2] - [100, 100], axis=1)
    assert away.min() > 20  # half-way to the four nearest holes, 50 away
    whole = gu.body_from_holes(*plate(5), code="ORE", block_size=5)
    assert whole.barren == 0
    assert np.linalg.norm(whole.points[:, :2] - [100, 100], axis=1).min() < 5


def test_a_cut_off_makes_the_body_of_the_codes() -> None:
    tables = plate(dip=10.0)
    by_code = gu.body_from_holes(*tables, code="ORE", block_size=5)
    by_grade = gu.body_from_holes(*tables, cut_off=("CU", 0.5), block_size=5)
    assert np.array_equal(by_code.points, by_grade.points)


def test_a_polygon_bounds_the_body() -> None:
    corners = [(-10, -10), (100, -10), (100, 300), (-10, 300)]
    made = gu.body_from_holes(*plate(), code="ORE", block_size=5, polygon=corners)
    assert made.points[:, 0].min() == -7.5
    assert made.points[:, 0].max() == 97.5
    assert made.points[:, 1].max() > 200  # beyond the holes, up to the polygon


def test_a_least_thickness_widens_about_the_middle() -> None:
    made = gu.body_from_holes(*plate(), code="ORE", block_size=5, least_thickness=40)
    assert made.points[:, 2].min() == -47.5
    assert made.points[:, 2].max() == -12.5


def test_waste_inside_an_intercept_joins_up_to_a_length() -> None:
    collar, survey, lith = plate()
    ore = lith["lith"] == "ORE"
    upper, lower = lith[ore].copy(), lith[ore].copy()
    upper["to"], lower["from"] = 27.0, 30.0
    split = pd.concat([lith[~ore], upper, lower], ignore_index=True)
    made = gu.body_from_holes(collar, survey, split, code="ORE", max_waste=3, block_size=5)
    assert len(made.intercepts) == len(collar)
    np.testing.assert_allclose(made.intercepts["waste"], 3)
    assert any("15.0% of the intercepts' length is waste" in line for line in made.told)
    parted = gu.body_from_holes(collar, survey, split, code="ORE", block_size=5)
    assert any("joined across waste" in line for line in parted.told)


def test_ends_of_holes_are_no_contacts() -> None:
    collar, survey, lith = plate()
    short = collar["hole"] == "H05"
    collar.loc[short, "depth"] = 30.0  # ends in the body
    made = gu.body_from_holes(collar, survey, lith, code="ORE", block_size=5)
    row = made.intercepts.set_index("hole").loc["H05"]
    assert row["contact_above"]
    assert not row["contact_below"]
    # The footwall goes on at the depth of the other holes, not up to the end of the short one.
    np.testing.assert_allclose(made.footwall.V[:, 2], -40, atol=1e-6)


def test_samples_do_not_cross_codes() -> None:
    collar, survey, lith = plate()
    ore = lith["lith"] == "ORE"
    upper, lower = lith[ore].copy(), lith[ore].copy()
    upper["to"], lower["from"] = 27.0, 27.0
    upper["lith"], lower["lith"] = "ORE1", "ORE2"
    lith = pd.concat([lith[~ore], upper, lower], ignore_index=True).drop(columns="CU")
    made = gu.body_from_holes(collar, survey, lith, code=("ORE1", "ORE2"), block_size=5)
    assays = pd.concat(
        [
            pd.DataFrame({"hole": h, "from": np.arange(0, 60, 4.0), "to": np.arange(4, 64, 4.0)})
            for h in collar["hole"]
        ],
        ignore_index=True,
    )
    assays["CU"] = assays["from"]
    found = made.samples(4.0, read_drillholes(collar, survey, assays))
    for code, low, high in (("ORE1", 20, 27), ("ORE2", 27, 40)):
        own = found[found["lith"] == code]
        assert own["from"].min() == low
        assert own["to"].max() == high
        assert (own["to"] - own["from"]).max() <= 6  # the last one takes a short rest
    first = found[(found["hole"] == "H00") & (found["lith"] == "ORE2")].iloc[0]
    # From 27 to 31: 1 m of the assay that begins at 24, 3 m of the one that begins at 28.
    assert first["CU"] == pytest.approx((24 * 1 + 28 * 3) / 4)


BAD = [
    ({}, "give the body's codes or a cut-off grade"),
    ({"code": "ORE", "cut_off": ("CU", 1.0)}, "one of them"),
    ({"code": "OR"}, "no column holds the codes OR"),
    ({"code": "OREE", "code_column": "lith"}, "no code 'OREE'; did you mean ORE"),
    ({"code": "ORE", "code_column": "lit"}, "no column 'lit' of codes; did you mean lith"),
    ({"cut_off": ("CUU", 0.5)}, "no grade 'CUU' for the cut-off; did you mean CU"),
    ({"cut_off": ("CU", 50.0)}, "no interval has CU of 50 or more; the largest is 1"),
    ({"code": "ORE", "least_length": 50}, "no intercept is 50 long; the longest is 20"),
    ({"code": "ORE", "shape": "round"}, "shape"),
    ({"code": "ORE", "axis": (0, 0), "shape": "plane"}, "axis is for a fold"),
    ({"code": "ORE", "extent": 0}, "extent"),
    ({"code": "ORE", "polygon": [(0, 0), (1, 1)]}, "three or more"),
    ({"code": "ORE", "polygon": [(900, 900), (910, 900), (900, 910)]}, "lies in the polygon"),
    ({"code": "ORE", "block_size": 500}, "no centre of a block of 500"),
    ({"code": "ORE", "block_size": 0.01}, "more than"),
    ({"code": "ORE", "block_size": (1, 2)}, "block_size must be a length or three"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), BAD)
def test_bad_choices_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        gu.body_from_holes(*plate(), **changes)  # type: ignore[arg-type]


def test_too_few_holes_are_refused() -> None:
    with pytest.raises(InputError, match="1 intercept of the body; a body needs four"):
        gu.body_from_holes(*plate(1), code="ORE")
    collar, survey, lith = plate(5)
    line = collar["y"] == 0
    own = lith["hole"].isin(collar.loc[line, "hole"])
    with pytest.raises(InputError, match="lie on one line"):
        gu.body_from_holes(collar, survey, lith[own], code="ORE", shape="plane")
    with pytest.raises(InputError, match="takes three tables"):
        gu.body_from_holes(collar, code="ORE")
    with pytest.raises(OptionError, match="not both"):
        gu.body_from_holes(collar, survey, lith, BodyOptions(code="ORE"), extent=5.0)


def test_walls_that_cannot_be_fitted_are_refused() -> None:
    from geounfold.modelling.walls import MOST_CONTACTS, fit_walls

    places = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    sides = np.array([True, True, True, False])
    with pytest.raises(InputError, match="the footwall has 1 contacts"):
        fit_walls(places, np.zeros(4), sides)
    line = np.column_stack([np.arange(6.0), np.arange(6.0)])
    with pytest.raises(InputError, match="contacts on one line"):
        fit_walls(line, np.zeros(6), np.arange(6) < 3)
    many = np.random.default_rng(0).random((MOST_CONTACTS + 2, 2))
    with pytest.raises(InputError, match="more than 6000"):
        fit_walls(many, np.zeros(len(many)), np.arange(len(many)) % 2 == 0)


def test_a_fold_that_falls_apart_is_refused() -> None:
    from geounfold.modelling.fold_profile import profile_curve

    rng = np.random.default_rng(0)
    parts = np.concatenate([rng.random((50, 2)), rng.random((50, 2)) + 500])
    with pytest.raises(InputError, match="falls apart in the fold's profile"):
        profile_curve(parts, rng.random((20, 2)) + 250, 2.0)


def test_the_axis_of_a_plunging_fold_is_found() -> None:
    from geounfold.modelling.fold_axis import angles_of_axis, found_axis

    _, tables = drilled("plunging", 50)
    holes, options = read_drillholes(*tables), BodyOptions(code="ORE")
    found = intercepts_of(holes, in_body(holes, options)[0], options)
    near = traced(holes, found, 10.0).near(found, 150.0)
    trend, plunge = angles_of_axis(found_axis(near))
    # The body plunges 18 degrees towards 35; measured 36 and 17.
    assert abs(trend - 35) < 6
    assert abs(plunge - 18) < 6


def test_assays_beside_the_body_make_no_samples() -> None:
    collar, survey, lith = plate()
    made = gu.body_from_holes(collar, survey, lith, code="ORE", block_size=5)
    above = pd.DataFrame({"hole": collar["hole"], "from": 0.0, "to": 5.0, "AU": 1.0})
    with pytest.raises(InputError, match="no assay lies in the body"):
        made.samples(None, read_drillholes(collar, survey, above))


def test_the_turn_of_a_fold_is_that_of_its_curve() -> None:
    # Half a circle turns by 180 degrees, less half a step of the polygon at either end.
    from geounfold.modelling.reference import FoldReference

    angle = np.linspace(0, np.pi, 181)
    fold = FoldReference(np.zeros(3), np.eye(3), 50 * np.stack([np.cos(angle), np.sin(angle)], 1))
    assert fold.turn == pytest.approx(179)


def test_a_fold_that_turns_too_far_gives_way_to_the_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    _, holes = drilled("box", 50)
    given = {"code": "ORE", "block_size": 20}
    assert "over a fold" in " ".join(gu.body_from_holes(*holes, **given).told)
    monkeypatch.setattr("geounfold.modelling.from_holes._TURN", 1.0)
    assert "over a plane" in " ".join(gu.body_from_holes(*holes, **given).told)


def test_a_body_that_holes_contradict_is_warned_of() -> None:
    made = gu.body_from_holes(*plate(), code="ORE", block_size=5)
    assert made.warnings == ()
    assert "60% of their length" in replace(made, error=0.6).warnings[0]
