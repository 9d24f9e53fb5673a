"""Tables of holes: the dip's sign, bad rows, columns of other names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.drillholes import read_drillholes
from geounfold.errors import InputError, OptionError
from tests.drillholes.holes import found, frames, one_hole


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


@pytest.mark.parametrize(
    ("order", "found"), [((2, 1, 0), "assay"), ((0, 2, 1), "assay"), ((1, 0, 2), "survey")]
)
def test_tables_in_another_order_are_told(order: tuple[int, int, int], found: str) -> None:
    tables = one_hole()
    words = rf"it has those of the {found} table: were two files swapped\? The order is collar, s"
    with pytest.raises(InputError, match=words):
        read_drillholes(*(tables[k] for k in order))


def test_what_was_assumed_in_reading_is_a_sentence(tmp_path: Path) -> None:
    names = []
    for table, name in zip(one_hole(), ("collar", "survey", "assay"), strict=True):
        table.to_csv(tmp_path / f"{name}.csv", index=False, sep=";", decimal=",")
        names.append(tmp_path / f"{name}.csv")
    told = [line for line in read_drillholes(*names).messages() if "decimal" in line]
    assert told
    assert all(line.endswith("its decimal commas were read as points") for line in told)


def test_a_code_in_a_collar_is_named_and_kept() -> None:
    given = frames(
        [*GOOD["collar"], ("C", 20.0, 0.0, -999.0)],
        [*GOOD["survey"], ("C", 0.0, 0.0, 90.0)],
        GOOD["assay"],
    )
    holes = read_drillholes(*given)
    check = "z of the collar far from all others, perhaps a code for a missing value"
    assert found(holes) == {(check, "C", 3)}
    assert holes.names == ["A", "B", "C"]


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
    # Hole B itself is lost if it has two collars, else hole C or E.
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
    assert ("CU is below detection", "A", 1) in found(holes)
    only = read_drillholes(collar, survey, assay, grades=["x"]).samples()
    assert only["CU"].tolist() == ["<0.01", "4"]


def test_an_azimuth_beyond_a_turn_in_the_collar_table_is_named() -> None:
    """Hole B has no survey, so its collar's direction counts: 450 may stand for 90 or 45."""
    collar = pd.DataFrame({"BHID": ["A", "B"], "X": 0.0, "Y": [0.0, 50.0], "Z": 100.0})
    collar = collar.assign(AZ=[90.0, 450.0], DIP=-60.0)
    _, survey, assay = one_hole()
    holes = read_drillholes(collar, survey, assay)
    assert ("azimuth beyond 360 degrees", "B", 2) in found(holes)
    assert "B" not in set(holes.traces()["hole"])
