"""Names of holes that differ by letter case, zeros or ``.0`` only; grades by the one rule."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.drillholes import read_drillholes
from geounfold.errors import InputError

COLLAR = pd.DataFrame({"HOLE": ["DDH-001", "7"], "X": [0.0, 50], "Y": 0.0, "Z": 100.0})


def tables(survey: str, assay: str, **more: object) -> tuple[pd.DataFrame, ...]:
    survey_table = pd.DataFrame({"HOLE": [survey, "7"], "AT": 0.0, "AZ": 0.0, "DIP": 90.0})
    assay_table = pd.DataFrame({"HOLE": [assay, "7"], "FROM": 10.0, "TO": 20.0, "AU": [1.0, 2.0]})
    return COLLAR, survey_table, assay_table.assign(**more)


@pytest.mark.parametrize(
    ("survey", "assay"), [("ddh-001", "DDH-1"), ("Ddh-01", "DDH-001.0"), ("DDH-0001", "DDH-001")]
)
def test_names_are_matched_and_told(survey: str, assay: str) -> None:
    holes = read_drillholes(*tables(survey, assay), dip_positive_down=True)
    assert holes.samples()["hole"].tolist() == ["DDH-001", "7"]
    np.testing.assert_array_equal(holes.samples()[["x", "z"]], [[0, 85], [50, 85]])
    told = [line for line in holes.messages() if "named otherwise" in line]
    assert any(f"hole {survey}" in line and "'DDH-001' there" in line for line in told)


def test_names_that_only_look_alike_are_not_matched() -> None:
    collar = pd.concat([COLLAR, COLLAR.assign(HOLE=["DDH-01", "8"], Y=10.0)], ignore_index=True)
    _, survey, assay = tables("DDH-001", "DDH-1")
    with pytest.raises(InputError, match=r"without a usable collar.*hole DDH-1"):
        read_drillholes(collar, survey, assay, dip_positive_down=True)
    with pytest.raises(InputError, match=r"hole DH-001 .*the nearest collar is 'DDH-001'"):
        read_drillholes(*tables("DDH-001", "DH-001"), dip_positive_down=True)


def test_rules_for_grades_hold_before_composites_are_made() -> None:
    given = tables("DDH-001", "DDH-001", AU=["<0.02", "-99"], CU=["1", "30"])
    rules = {"missing": (-99,), "below_detection": "half", "cap": {"CU": 10}}
    holes = read_drillholes(*given, dip_positive_down=True, values=rules)
    samples = holes.samples(10.0)
    np.testing.assert_array_equal(samples["AU"], [0.01, np.nan])
    assert samples["CU"].tolist() == [1, 10]
    facts = holes.facts()
    assert facts["grade_values"]["AU"]["declared_missing"] == 1
    assert facts["caps"][0]["changed"] == 1
    assert any("CU was capped at 10: 1 of 2 values" in line for line in holes.messages())
    with pytest.raises(InputError, match="no column 'CO' to cap; did you mean CU"):
        read_drillholes(*given, dip_positive_down=True, values={"cap": {"CO": 1}})


def test_assays_are_chosen_by_their_columns() -> None:
    holes = read_drillholes(*tables("DDH-001", "DDH-001"), dip_positive_down=True, where="AU>1")
    assert holes.samples()["hole"].tolist() == ["7"]
