"""Drill-holes: paths against circles, every bad row named, composites that lose no metal."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.drillholes import CompositeOptions, DrillHoles, read_drillholes
from geounfold.drillholes.composite import composite
from geounfold.drillholes.desurvey import desurvey, directions, dogleg, ratio_factor
from geounfold.errors import InputError, OptionError
from tests.places import SHARED_DATA

BABBITT = SHARED_DATA / "babbitt"


def frames(
    collar: list[tuple[Any, ...]],
    survey: list[tuple[Any, ...]],
    assay: list[tuple[Any, ...]],
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    names = ["BHID", "X", "Y", "Z", "DEPTH"][: len(collar[0])]
    return (
        pd.DataFrame(collar, columns=names),
        pd.DataFrame(survey, columns=["BHID", "AT", "AZ", "DIP"]),
        pd.DataFrame(assay, columns=["BHID", "FROM", "TO", "CU"]),
    )


def one_hole(**changes: list[tuple[Any, ...]]) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """A vertical hole at the origin, from 100 down, assayed to 30; parts replaced."""
    return frames(
        changes.get("collar", [("A", 0.0, 0.0, 100.0)]),
        changes.get("survey", [("A", 0.0, 0.0, 90.0), ("A", 30.0, 0.0, 90.0)]),
        changes.get("assay", [("A", 0.0, 10.0, 1.0), ("A", 10.0, 30.0, 4.0)]),
    )


def found(holes: DrillHoles) -> set[tuple[str, str, int]]:
    """Return check, hole and row of all findings but notes."""
    return {(f.check, f.hole, f.row) for f in holes.findings if f.severity != "note"}


# ------------------------------------------------------------------------------------- desurvey


def test_a_circular_hole_is_exact() -> None:
    # A hole along a circle of radius 200 in the plane of azimuth 30: its inclination is s / 200,
    # so it lies at 200 (1 - cos) sideways and 200 sin down.  Stations 40, 110 and 90 apart.
    radius, azimuth = 200.0, np.radians(30.0)
    depth = np.array([0.0, 40.0, 150.0, 240.0])
    tangent = directions(np.full(4, 30.0), 90.0 - np.degrees(depth / radius))
    collar = np.array([[5e5, 6e6, 300.0]])
    paths = desurvey(collar, np.zeros(4, dtype=np.int64), depth, tangent)
    asked = np.linspace(0.0, 240.0, 49)
    position, surveyed = paths.at(np.zeros(49, dtype=np.int64), asked)
    sideways = radius * (1 - np.cos(asked / radius))
    truth = collar + np.column_stack(
        [sideways * np.sin(azimuth), sideways * np.cos(azimuth), -radius * np.sin(asked / radius)]
    )
    # Neighbouring doubles lie 9.3e-10 apart at 6e6; three roundings are the rest.
    np.testing.assert_allclose(position, truth, rtol=0, atol=3e-9)
    assert surveyed.all()


def test_a_published_course() -> None:
    # 3500 ft at 15 degrees from the vertical, azimuth 20, to 3600 ft at 25, 45: the textbooks'
    # example of minimum curvature has north 27.22, east 19.45 and depth 94.01 ft.
    tangent = directions(np.array([20.0, 45.0]), np.array([75.0, 65.0]))
    paths = desurvey(
        np.zeros((1, 3)), np.zeros(2, dtype=np.int64), np.array([3500.0, 3600.0]), tangent
    )
    np.testing.assert_allclose(np.diff(paths.offset, axis=0)[0], [19.45, 27.22, -94.01], atol=5e-3)


def test_ratio_factor_has_no_seam() -> None:
    # Both forms of the factor agree where one takes over (1e-4): a step there would be 1e-9.
    beta = np.array([0.99999e-4, 1.00001e-4])
    assert np.diff(ratio_factor(beta))[0] == pytest.approx(2e-9 * 1e-4 / 6, abs=5e-16)
    assert ratio_factor(np.array([0.0]))[0] == 1.0


def test_dogleg_is_accurate_at_its_ends() -> None:
    # arccos of the product would round 1e-9 to 0.
    t = np.array([[0.0, 0.0, -1.0]])
    small = np.array([[np.sin(1e-9), 0.0, -np.cos(1e-9)]])
    assert dogleg(t, small)[0] == pytest.approx(1e-9, rel=1e-9)
    assert dogleg(t, -t)[0] == pytest.approx(np.pi, rel=1e-15)


def test_a_station_read_off_the_path_changes_nothing() -> None:
    tangent = directions(np.array([10.0, 80.0]), np.array([80.0, 30.0]))
    hole = np.zeros(2, dtype=np.int64)
    coarse = desurvey(np.zeros((1, 3)), hole, np.array([0.0, 100.0]), tangent)
    ahead, _ = coarse.at(np.array([0, 0]), np.array([40.0 - 1e-3, 40.0 + 1e-3]))
    middle = np.diff(ahead, axis=0) / np.linalg.norm(np.diff(ahead, axis=0))
    fine = desurvey(
        np.zeros((1, 3)),
        np.zeros(3, dtype=np.int64),
        np.array([0.0, 40.0, 100.0]),
        np.concatenate([tangent[:1], middle, tangent[1:]]),
    )
    asked = np.linspace(0.0, 120.0, 25)
    whole = np.zeros(25, dtype=np.int64)
    # The middle direction comes from a difference over 2e-3: 1e-10 over 100.
    np.testing.assert_allclose(fine.at(whole, asked)[0], coarse.at(whole, asked)[0], atol=1e-8)


def test_beyond_the_surveys_straight_on_and_marked() -> None:
    # First station at 10, dipping 45 degrees east all along: x is depth over the root of two.
    tables = one_hole(
        survey=[("A", 10.0, 90.0, 45.0), ("A", 20.0, 90.0, 45.0)],
        assay=[("A", 0.0, 4.0, 1.0), ("A", 14.0, 16.0, 1.0), ("A", 38.0, 42.0, 1.0)],
    )
    samples = read_drillholes(*tables, dip_positive_down=True).samples()
    np.testing.assert_allclose(samples["x"], np.array([2.0, 15.0, 40.0]) / np.sqrt(2), rtol=1e-14)
    assert samples["position"].tolist() == ["extrapolated", "surveyed", "extrapolated"]
    notes = [f for f in read_drillholes(*tables).findings if f.check.startswith("hole runs below")]
    assert [(f.hole, f.row, f.detail) for f in notes] == [("A", 2, "20 to 42")]


def _random_tables(seed: int = 3) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    rng = np.random.default_rng(seed)
    names = [f"H{k}" for k in range(6)]
    collar = [(n, *rng.uniform(0, 1000, 3)) for n in names]
    survey = [(n, d, rng.uniform(0, 360), rng.uniform(40, 90)) for n in names for d in (0, 35, 80)]
    assay = [(n, d, d + 7.0, rng.uniform(0, 3)) for n in names for d in np.arange(0, 90, 7.0)]
    return frames(collar, survey, assay)


def test_rows_in_another_order_give_the_same_bits() -> None:
    tables = _random_tables()
    mixed = [t.sample(frac=1.0, random_state=4) for t in tables]
    mixed[0] = tables[0]  # holes come in the collar table's order
    for length in (None, 10.0):
        pd.testing.assert_frame_equal(
            read_drillholes(*tables).samples(length),
            read_drillholes(*mixed).samples(length),
            check_exact=True,
        )


def test_other_holes_change_no_bit_of_a_hole() -> None:
    tables = _random_tables()
    alone = read_drillholes(*(t[t["BHID"] == "H4"] for t in tables)).samples()
    every = read_drillholes(*tables).samples()
    pd.testing.assert_frame_equal(
        alone, every[every["hole"] == "H4"].reset_index(drop=True), check_exact=True
    )


def test_turned_by_azimuth_and_scaled() -> None:
    # 25 degrees more on every azimuth turns the field clockwise by 25 degrees about z.
    collar, survey, assay = _random_tables()
    plain = read_drillholes(collar, survey, assay).samples()[["x", "y", "z"]].to_numpy()
    c, s = np.cos(np.radians(25.0)), np.sin(np.radians(25.0))
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    xyz = collar[["X", "Y", "Z"]].to_numpy() @ turn.T * 3.0
    collar = collar.assign(X=xyz[:, 0], Y=xyz[:, 1], Z=xyz[:, 2])
    survey = survey.assign(AZ=(survey["AZ"] + 25.0) % 360.0, AT=survey["AT"] * 3.0)
    assay = assay.assign(FROM=assay["FROM"] * 3.0, TO=assay["TO"] * 3.0)
    moved = read_drillholes(collar, survey, assay).samples()[["x", "y", "z"]].to_numpy()
    # 3000 across: 1e-12 of it.
    np.testing.assert_allclose(moved, 3.0 * plain @ turn.T, rtol=0, atol=3e-9)


# --------------------------------------------------------------------------------- dip's sign


@pytest.mark.parametrize(("sign", "stated"), [(1, True), (-1, False), (1, None), (-1, None)])
def test_dip_sign_stated_or_detected(sign: int, stated: bool | None) -> None:
    survey = [("A", 0.0, 90.0, sign * 30.0), ("A", 20.0, 90.0, sign * 30.0)]
    holes = read_drillholes(*one_hole(survey=survey), dip_positive_down=stated)
    # Midpoint of 10 to 30 is at 20: half of that down at 30 degrees, from 100.
    assert holes.samples()["z"].iloc[1] == pytest.approx(90.0, rel=1e-14)
    assert holes.facts()["dip_convention"] == ("detected" if stated is None else "stated")
    said = [f for f in holes.findings if f.check.startswith("no dip is")]
    assert len(said) == (stated is None)


def test_dips_of_both_signs_must_be_stated() -> None:
    tables = one_hole(survey=[("A", 0.0, 0.0, 10.0), ("A", 20.0, 0.0, -10.0)])
    with pytest.raises(InputError, match=r"1 positive, 1 negative.*--dip-positive-down"):
        read_drillholes(*tables)
    assert len(read_drillholes(*tables, dip_positive_down=True)) == 1


def test_a_convention_that_sends_all_holes_up_is_named() -> None:
    holes = read_drillholes(*one_hole(), dip_positive_down=False)
    assert holes.samples()["z"].iloc[0] == 105.0
    assert "every hole goes up by the dip convention stated" in {f.check for f in holes.findings}


# ------------------------------------------------------------------------------------- bad rows

GOOD = {
    "collar": [("A", 0.0, 0.0, 100.0), ("B", 50.0, 0.0, 100.0)],
    "survey": [("A", 0.0, 0.0, 90.0), ("A", 30.0, 0.0, 90.0), ("B", 0.0, 0.0, 90.0)],
    "assay": [("A", 0.0, 10.0, 1.0), ("A", 10.0, 30.0, 4.0), ("B", 0.0, 10.0, 2.0)],
}
BAD_ROWS: dict[str, tuple[str, list[tuple[Any, ...]], list[str], list[tuple[float, float]]]] = {
    # by case: the table, rows added, the findings of these rows, hole A's intervals after it
    "no hole": ("assay", [("", 0.0, 10.0, 1.0)], ["no hole named"], [(0, 10), (10, 30)]),
    "reversed": ("assay", [("A", 45.0, 40.0, 1.0)], ["reversed interval"], [(0, 10), (10, 30)]),
    "empty": ("assay", [("A", 40.0, 40.0, 1.0)], ["interval of no length"], [(0, 10), (10, 30)]),
    "negative": (
        "assay",
        [("A", -5.0, 5.0, 1.0)],
        ["interval above the collar"],
        [(0, 10), (10, 30)],
    ),
    "no to": (
        "assay",
        [("A", 30.0, np.nan, 1.0)],
        ["interval without from or to"],
        [(0, 10), (10, 30)],
    ),
    # 12.5 to 125 written for 12.5 to 15: the row that runs too far is cut, the next ones stay.
    "overlap": (
        "assay",
        [("A", 30.0, 400.0, 1.0), ("A", 35.0, 40.0, 1.0)],
        ["overlapping intervals", ""],
        [(0, 10), (10, 30), (30, 35), (35, 40)],
    ),
    "same start": (
        "assay",
        [("A", 10.0, 32.0, 1.0)],
        ["interval that begins where another does"],
        [(0, 10), (10, 30)],
    ),
    "too deep": (
        "survey",
        [("A", 90000.0, 0.0, 60.0)],
        ["survey far below the hole"],
        [(0, 10), (10, 30)],
    ),
    "above": ("survey", [("A", -1.0, 0.0, 60.0)], ["survey above the collar"], [(0, 10), (10, 30)]),
    "steep": ("survey", [("A", 9.0, 0.0, 95.0)], ["dip beyond 90 degrees"], [(0, 10), (10, 30)]),
    "round": (
        "survey",
        [("A", 9.0, 999.0, 60.0)],
        ["azimuth beyond 360 degrees"],
        [(0, 10), (10, 30)],
    ),
    "missing": (
        "survey",
        [("A", 9.0, np.nan, 60.0)],
        ["survey without depth, azimuth or dip"],
        [(0, 10), (10, 30)],
    ),
    "twice": (
        "survey",
        [("A", 30.0, 0.0, 60.0)],
        ["two surveys at one depth"],
        [(0, 10), (10, 30)],
    ),
    "stranger": (
        "survey",
        [("C", 0.0, 0.0, 60.0)],
        ["survey of a hole without a usable collar"],
        [(0, 10), (10, 30)],
    ),
    "same collar": (
        "collar",
        [("A", 0.0, 0.0, 100.0)],
        ["duplicate collar with the same coordinates"],
        [(0, 10), (10, 30)],
    ),
    "planned": ("collar", [("D", 0.0, 9.0, 100.0)], ["unsurveyed hole"], [(0, 10), (10, 30)]),
}


@pytest.mark.parametrize("case", BAD_ROWS)
def test_bad_rows_are_named_and_left_out_or_cut(case: str) -> None:
    table, rows, checks, intervals = BAD_ROWS[case]
    tables = {**GOOD, table: GOOD[table] + rows}
    first = len(GOOD[table]) + 1
    expected = {(check, rows[k][0], first + k) for k, check in enumerate(checks) if check}
    given = frames(tables["collar"], tables["survey"], tables["assay"])
    holes = read_drillholes(*given)
    assert found(holes) == expected
    samples = holes.samples()
    of_a = samples[samples["hole"] == "A"]
    assert list(zip(of_a["from"], of_a["to"], strict=True)) == intervals
    # The holes are vertical whatever was added: z is 100 less the depth.
    np.testing.assert_allclose(of_a["z"], 100 - of_a[["from", "to"]].mean(axis=1), rtol=1e-14)
    with pytest.raises(InputError, match=rf"data row {first}\b.*--strict"):
        read_drillholes(*given, strict=True)
    read_drillholes(*frames(**GOOD), strict=True)


UNPLACED = {
    "no collar": ("assay", [("C", 0.0, 5.0, 1.0)], "assays of a hole without a usable collar"),
    "two collars": ("collar", [("B", 51.0, 0.0, 100.0)], "duplicate collar with other coordinates"),
    "no place": ("collar", [("E", np.nan, 0.0, 1.0)], "collar without coordinates"),
    "no survey": ("collar", [("E", 1.0, 0.0, 1.0)], "unsurveyed hole"),
}


@pytest.mark.parametrize("case", UNPLACED)
def test_a_hole_with_assays_that_cannot_be_placed_is_refused(case: str) -> None:
    table, rows, check = UNPLACED[case]
    tables = {**GOOD, table: GOOD[table] + rows}
    if rows[0][0] == "E":
        tables["assay"] = [*tables["assay"], ("E", 0.0, 5.0, 1.0)]
    given = frames(tables["collar"], tables["survey"], tables["assay"])
    where = rf"{check}: hole {rows[0][0]} data row {len(GOOD[table]) + 1}\b.*--drop-invalid"
    with pytest.raises(InputError, match=where):
        read_drillholes(*given)
    holes = read_drillholes(*given, drop_invalid=True)
    # Hole B itself is lost where it has two collars, hole C or E elsewhere.
    assert holes.names == (["A"] if case == "two collars" else ["A", "B"])
    assert set(holes.samples()["hole"]) == set(holes.names)


def test_the_collar_tables_direction_and_depth() -> None:
    collar = pd.DataFrame(
        {"hole": ["A"], "x": [0.0], "y": [0.0], "z": [0.0], "azimuth": [90], "dip": [0],
         "eoh": [25.0]}
    )  # fmt: skip
    survey = pd.DataFrame({"hole": ["Z"], "at": [0.0], "azimuth": [0.0], "dip": [0.0]})
    assay = pd.DataFrame({"hole": ["A", "A"], "from": [0, 20], "to": [20, 30], "cu": [1, 2]})
    holes = read_drillholes(collar, survey, assay)
    # Level to the east: x is the depth.  The second interval ends with the hole, at 25.
    assert holes.samples()["x"].tolist() == [10.0, 22.5]
    assert ("unsurveyed hole", "A", 1) in found(holes)
    assert ("interval below the hole's depth", "A", 2) in found(holes)


def test_a_hole_turned_back_on_itself() -> None:
    tables = one_hole(
        survey=[("A", 0.0, 0.0, 45.0), ("A", 10.0, 180.0, -45.0), ("A", 20.0, 0.0, 45.0)]
    )
    holes = read_drillholes(*tables, dip_positive_down=True)
    assert found(holes) == {("direction turned back on itself", "A", 2)}
    assert holes.samples()["y"].iloc[1] == pytest.approx(20.0 / np.sqrt(2), rel=1e-14)


def test_nothing_left() -> None:
    with pytest.raises(InputError, match=r"no hole of .* has both a survey and assays"):
        read_drillholes(*one_hole(assay=[("Q", 0.0, 1.0, 1.0)]))
    with pytest.raises(InputError, match="no row is an interval with a length"):
        read_drillholes(*one_hole(assay=[("A", 2.0, 1.0, 1.0)]))


def test_columns_by_other_names() -> None:
    collar, survey, assay = one_hole()
    collar = collar.set_axis(["Hole_ID", "Easting (m)", "Northing (m)", "RL"], axis=1)
    survey = survey.set_axis(["HOLEID", "Depth", "Azimuth", "INCL"], axis=1)
    assay = assay.set_axis(["DHID", "mFrom", "Depth_To", "Cu_pct"], axis=1)
    # Inclination is counted from the horizontal by some and from the vertical by others.
    with pytest.raises(InputError, match=r"needs a column for dip.*--holes-columns dip=NAME"):
        read_drillholes(collar, survey, assay)
    holes = read_drillholes(collar, survey, assay, columns={"dip": "INCL"})
    assert holes.samples()["z"].tolist() == [95.0, 80.0]
    assert holes.samples()["Cu_pct"].tolist() == [1.0, 4.0]
    with pytest.raises(InputError, match=r"several columns.*RL, Elevation.*z=RL"):
        read_drillholes(collar.assign(Elevation=0.0), survey, assay, columns={"dip": "INCL"})
    with pytest.raises(OptionError, match=r"no column 'DEEP' for at in the survey table"):
        read_drillholes(collar, survey, assay, columns={"dip": "INCL", "at": "DEEP"})
    with pytest.raises(OptionError, match="no field 'inclination'"):
        read_drillholes(collar, survey, assay, columns={"inclination": "INCL", "dip": "INCL"})


def test_grades_that_are_no_numbers_are_not_zero() -> None:
    collar, survey, assay = one_hole()
    assay = assay.assign(CU=["<0.01", "4"], ROCK=["ore", "waste"], x=[7.0, 8.0])
    holes = read_drillholes(collar, survey, assay)
    samples = holes.samples()
    assert np.isnan(samples["CU"].iloc[0])
    assert samples["CU"].iloc[1] == 4.0
    assert samples["ROCK"].tolist() == ["ore", "waste"]
    assert samples["assay_x"].tolist() == [7.0, 8.0]
    assert ("CU is no number", "A", 1) in found(holes)
    only = read_drillholes(collar, survey, assay, grades=["x"]).samples()
    assert only["CU"].tolist() == ["<0.01", "4"]


# ----------------------------------------------------------------------------------- composites


def test_composites_by_hand() -> None:
    # Windows 0-10, 10-20, 20-23; the last is shorter than 5 and joins the one above.
    start, end = np.array([2.0, 8.0, 14.0, 20.0]), np.array([8.0, 14.0, 20.0, 23.0])
    grade = np.array([[1.0], [2.0], [np.nan], [4.0]])
    words = np.array([["a"], ["b"], ["b"], ["c"]], dtype=object)
    made = composite(
        np.zeros(4, dtype=np.int64), start, end, grade, words, CompositeOptions(length=10.0)
    )
    # 0-10: 6 of 1 and 2 of 2.  10-23: 4 of 2 and 3 of 4, 7 of 13 assayed.
    assert list(zip(made.start, made.end, strict=True)) == [(0.0, 10.0), (10.0, 23.0)]
    np.testing.assert_allclose(made.grades[:, 0], [10 / 8, 20 / 7], rtol=1e-15)
    np.testing.assert_allclose(made.covered, [8.0, 13.0], rtol=1e-15)
    assert made.words[:, 0].tolist() == ["a", "b"]  # 6 against 2, and 10 against 3


@pytest.mark.parametrize(
    ("residual", "ends"), [("merge", [10, 23]), ("drop", [10, 20]), ("keep", [10, 20, 23])]
)
def test_a_short_last_composite(residual: Any, ends: list[float]) -> None:
    made = composite(
        np.zeros(1, dtype=np.int64),
        np.array([0.0]),
        np.array([23.0]),
        np.array([[1.0]]),
        np.empty((1, 0), dtype=object),
        CompositeOptions(length=10.0, residual=residual),
    )
    assert made.end.tolist() == ends


@pytest.mark.parametrize("length", [3.0, 7.0, 11.3, 500.0])
def test_composites_keep_the_metal(length: float) -> None:
    holes = read_drillholes(*_random_tables())
    plain, made = holes.samples(), holes.samples(length, min_coverage=0.0)
    metal = [((f["to"] - f["from"]) * f["CU"]).groupby(f["hole"]).sum() for f in (plain, made)]
    covered = (made["to"] - made["from"]) * made["coverage"] * made["CU"]
    # Every interval is assayed, so covered length times mean grade is the metal; sums of 90
    # lengths round at 1e-13.
    np.testing.assert_allclose(covered.groupby(made["hole"]).sum(), metal[0], rtol=1e-12)


def test_minimum_coverage() -> None:
    tables = one_hole(assay=[("A", 0.0, 4.0, 1.0), ("A", 10.0, 20.0, 3.0)])
    holes = read_drillholes(*tables)
    assert holes.samples(10.0)["CU"].tolist() == [3.0]  # 4 of 10 are too few for a half
    assert holes.samples(10.0, min_coverage=0.4)["CU"].tolist() == [1.0, 3.0]
    with pytest.raises(InputError, match="no composite of 100 is assayed over 90%"):
        holes.samples(100.0, min_coverage=0.9)


def test_composite_options_are_checked() -> None:
    holes = read_drillholes(*one_hole())
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(OptionError, match="composite length"):
            holes.samples(bad)
    with pytest.raises(OptionError, match="too many"):
        holes.samples(1e-9)
    with pytest.raises(OptionError, match="residual"):
        holes.samples(1.0, residual="guess")  # type: ignore[arg-type]
    with pytest.raises(OptionError, match="min_coverage"):
        holes.samples(1.0, min_coverage=2.0)


# --------------------------------------------------------------------------------------- traces


def test_traces_have_every_station_and_the_end() -> None:
    tables = one_hole(survey=[("A", 0.0, 90.0, 60.0), ("A", 11.0, 90.0, 50.0)])
    holes = read_drillholes(*tables)
    traces = holes.traces(10.0)
    assert traces["depth"].tolist() == [0.0, 10.0, 11.0, 20.0, 30.0]
    assert traces["position"].tolist() == ["surveyed"] * 3 + ["extrapolated"] * 2
    np.testing.assert_array_equal(traces[["x", "y", "z"]], holes.at("A", traces["depth"]))
    with pytest.raises(OptionError, match="step along traces"):
        holes.traces(0.0)
    with pytest.raises(InputError, match="no hole 'B'"):
        holes.at("B", np.zeros(1))


# -------------------------------------------------------------------------------------- Babbitt


@pytest.fixture(scope="module")
def babbitt() -> DrillHoles:
    if not BABBITT.is_dir():
        pytest.skip("the Babbitt drill-holes are not beside this checkout")
    return read_drillholes(
        *(BABBITT / f"{kind}_BABBITT.csv" for kind in ("collar", "survey", "assay"))
    )


def test_babbitt_desurveys_with_its_bad_rows_named(babbitt: DrillHoles) -> None:
    # What is wrong with the survey table by another reading of it: depths of 90000, in 70 rows.
    with (BABBITT / "survey_BABBITT.csv").open() as stream:
        survey = list(csv.DictReader(stream))
    bad = {(r["BHID"], k + 1) for k, r in enumerate(survey) if float(r["AT"]) == 90000}
    assert len(bad) == 70
    assert found(babbitt) == {("survey far below the hole", *row) for row in bad}
    # SOURCE.md: 399 holes, 35,616 intervals.
    assert len(babbitt) == 399
    samples = babbitt.samples()
    assert len(samples) == 35616
    assert np.isfinite(samples[["x", "y", "z"]]).all(axis=None)
    assert babbitt.positive_down
    assert babbitt.facts()["dip_convention"] == "detected"


def test_babbitt_lies_where_it_was_drilled(babbitt: DrillHoles) -> None:
    samples, collars = babbitt.samples(), babbitt.collars
    # Straight down at 34873, and a straight hole at 60 degrees towards 327 at B1-001.
    for name, azimuth, dip in (("34873", 0.0, 90.0), ("B1-001", 327.0, 60.0)):
        of_hole = samples[samples["hole"] == name]
        middle = 0.5 * (of_hole["from"] + of_hole["to"]).to_numpy()
        straight = directions(np.array([azimuth]), np.array([dip]))
        collar = collars.points[babbitt.names.index(name)]
        truth = collar + middle[:, None] * straight
        np.testing.assert_allclose(of_hole[["x", "y", "z"]], truth, rtol=0, atol=1e-8)
    # No chord of a path is longer than the way along it.
    traces = babbitt.traces(25.0)
    same = traces["hole"].to_numpy()[1:] == traces["hole"].to_numpy()[:-1]
    chord = np.linalg.norm(np.diff(traces[["x", "y", "z"]].to_numpy(), axis=0), axis=1)[same]
    way = np.diff(traces["depth"])[same]
    assert (chord <= way * (1 + 1e-6) + 1e-9).all()  # coordinates of 2e6 round at 5e-10
    assert (chord >= 0.98 * way).all()  # a hole that drills do: 40 degrees in 25 ft are 0.98


def test_babbitt_composites_keep_the_metal(babbitt: DrillHoles) -> None:
    plain, made = babbitt.samples(), babbitt.samples(20.0, min_coverage=0.0)
    metal = np.nansum((plain["to"] - plain["from"]) * plain["CU"])
    # Of partly assayed composites the mean is over the assayed part, so only whole ones compare.
    options = CompositeOptions(length=20.0, min_coverage=0.0)
    assayed = ~np.isnan(babbitt.grades["CU"])
    iv = babbitt.intervals.kept(assayed)
    part = composite(
        iv.hole,
        iv.start,
        iv.end,
        babbitt.grades["CU"][assayed, None],
        np.empty((assayed.sum(), 0), dtype=object),
        options,
    )
    assert (part.covered * part.grades[:, 0]).sum() == pytest.approx(metal, rel=1e-12)
    assert made["CU"].max() <= plain["CU"].max()


# --------------------------------------------------------------------------------- with the body


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, gu.Unfolding, pd.DataFrame]:
    """A small fold, and holes whose midpoints are blocks: straight down from 50 above each."""
    folder = tmp_path_factory.mktemp("holes")
    blocks = gu.simulate("sim_case_1", blocks=3000).frame(4)
    blocks.to_csv(folder / "X.csv", index=False)
    chosen = blocks.iloc[::300].reset_index(drop=True)
    names = [f"H{k}" for k in range(len(chosen))]
    xyz = chosen[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    pd.DataFrame({"hole": names, "x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2] + 50}).to_csv(
        folder / "collar.csv", index=False
    )
    pd.DataFrame({"hole": names, "at": 0, "azimuth": 0, "dip": -90}).to_csv(
        folder / "survey.csv", index=False
    )
    pd.DataFrame({"hole": names, "from": 49, "to": 51, "au": 1.5}).to_csv(
        folder / "assay.csv", index=False
    )
    return folder, gu.unfold(blocks[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()), blocks


def test_samples_and_traces_go_with_the_body(
    body: tuple[Path, gu.Unfolding, pd.DataFrame], capsys: pytest.CaptureFixture[str]
) -> None:
    import pyvista

    folder, unfolding, _ = body
    tables = [str(folder / f"{kind}.csv") for kind in ("collar", "survey", "assay")]
    argv = ["unfold", str(folder / "X.csv"), "-o", str(folder / "Y.csv"), "--holes", *tables]
    argv += ["--samples-out", str(folder / "S.csv"), "--traces-out", str(folder / "T.vtp")]
    argv += ["--map", str(folder / "m.npz"), "--summary", str(folder / "s.json")]
    assert main(argv) == 0
    err = capsys.readouterr().err
    assert "no dip is positive" in err
    samples = pd.read_csv(folder / "S.csv")
    flat = samples[["unfolded_x", "unfolded_y", "unfolded_z"]].to_numpy()
    # Midpoints are blocks but for rounding of z + 50 - 50, 1e-14, so they land on them.
    np.testing.assert_allclose(flat, unfolding.points[::300], rtol=0, atol=1e-9)
    assert set(samples["location"]) == {"inside"}
    lines = pyvista.read(folder / "T.vtp")
    assert lines.n_lines == len(samples)
    assert list(lines.cell_data["hole"]) == samples["hole"].tolist()
    image = unfolding.to_flat(np.asarray(lines.points))
    np.testing.assert_allclose(lines.point_data["unfolded"], image, rtol=0, atol=1e-9)
    summary = json.loads((folder / "s.json").read_text())
    assert summary["drillholes"]["holes"] == len(samples)
    assert summary["drillholes"]["samples"] == {
        "points": len(samples),
        "extrapolated": 0,
        "outside": 0,
    }
    assert any("no dip is positive" in line for line in summary["warnings"])

    # The saved map carries them alike, and traces as a table have both spaces.
    argv = ["map", str(folder / "m.npz"), "--holes", *tables, "--no-dip-positive-down"]
    argv += ["--samples-out", str(folder / "S2.csv"), "--traces-out", str(folder / "T.csv")]
    assert main(argv) == 0
    assert (folder / "S2.csv").read_text() == (folder / "S.csv").read_text()
    traces = pd.read_csv(folder / "T.csv")
    np.testing.assert_array_equal(traces[["x", "y", "z"]], np.asarray(lines.points))
    np.testing.assert_array_equal(
        traces[["unfolded_x", "unfolded_y", "unfolded_z"]], lines.point_data["unfolded"]
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--composite", "2"], "--composite needs --holes"),
        (["--strict"], "--strict needs --holes"),
        (["--traces-out", "t.csv"], "--traces-out needs --holes"),
        (["--holes", "c.csv", "s.csv", "a.csv"], "needs --samples-out or --traces-out"),
        (
            ["--holes", "c", "s", "a", "--samples", "p.csv", "--samples-out", "q.csv"],
            "exclude each other",
        ),
    ],
)
def test_hole_options_that_do_not_go_together(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["unfold", "x.csv", "-o", "y.csv", *options]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["p.csv"], "map needs POINTS and -o OUT, or --holes"),
        ([], "the following arguments are required: POINTS"),
        (
            ["--holes", "c.csv", "s.csv", "a.csv", "--samples-out", "q.csv", "-o", "r.csv"],
            "map needs POINTS and -o OUT, or --holes",
        ),
        (["--samples-out", "q.csv", "p.csv", "-o", "r.csv"], "--samples-out needs --holes"),
        (
            ["--holes", "c.csv", "s.csv", "a.csv", "--samples-out", "q.csv", "--inverse"],
            "without --inverse",
        ),
    ],
)
def test_map_options_that_do_not_go_together(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", "m.npz", *options]) == 2
    assert words in capsys.readouterr().err


def test_bad_hole_options_are_one_line(
    body: tuple[Path, gu.Unfolding, pd.DataFrame], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = body[0]
    tables = [str(folder / f"{kind}.csv") for kind in ("collar", "survey", "assay")]
    argv = ["unfold", str(folder / "X.csv"), "-o", str(folder / "Z.csv"), "--holes", *tables]
    argv += ["--samples-out", str(folder / "Z2.csv")]
    for more, words in (
        (["--composite", "long"], "needs a length"),
        (["--composite", "-3"], "above 0"),
        (["--holes-columns", "dip"], "FIELD=NAME"),
        (["--holes-columns", "slope=dip"], "no field 'slope'"),
        (["--dip-positive-down", "--strict"], "every hole goes up"),
    ):
        assert main([*argv, *more]) == 2
        assert words in capsys.readouterr().err
        assert not (folder / "Z.csv").exists()
