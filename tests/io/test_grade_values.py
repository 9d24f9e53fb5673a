"""Values of grades: one rule for codes, values below detection, negative values and caps."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import InputError, OptionError
from geounfold.io.grade_values import GradeRules, grade_of, grade_rules


def column(*values: object) -> pd.Series:
    return pd.Series(values, name="AU", dtype=object)


def test_codes_are_missing_as_numbers_and_as_words() -> None:
    rules = GradeRules(missing=("-99", -999, "-", "bdl"))
    read = rules.read(column("1.5", "-99.0", "-999", "-", "BDL", "", "2"))
    np.testing.assert_array_equal(read.values, [1.5, *[np.nan] * 5, 2])
    assert read.facts() == {
        "declared_missing": 4, "below_detection": 0, "no_numbers": 0, "negative": 0, "nines": 0,
    }  # fmt: skip
    typed = rules.read(pd.Series([1.5, -99.0, np.nan], name="AU"))
    np.testing.assert_array_equal(typed.values, [1.5, np.nan, np.nan])


@pytest.mark.parametrize(("rule", "value"), [("missing", np.nan), ("half", 0.005), ("zero", 0.0)])
def test_values_below_detection(rule: str, value: float) -> None:
    values, lines, facts = grade_of(
        column("<0.01", "< 1e-2", "<=.01", "3"), "a.csv", GradeRules(below_detection=rule)
    )
    np.testing.assert_allclose(values, [value] * 3 + [3])  # half of 0.01
    assert facts["below_detection"] == 3
    assert lines[0].startswith("a.csv: column 'AU': 3 of 4 values are below detection, the first")


def test_a_majority_below_detection_is_a_grade() -> None:
    read = GradeRules().read(column(*["<0.01"] * 9, "0.5"))
    assert read.is_grade(column(*["<0.01"] * 9, "0.5"))
    assert np.nanmean(read.values) == 0.5


def test_a_grade_of_words_is_an_error_that_names_the_row() -> None:
    grade = column("0.5", "BDL", "BDL", "BDL", "0.7")  # two kinds of numbers, one word
    read = GradeRules().read(grade)
    assert read.is_grade(grade)
    with pytest.raises(
        InputError,
        match=r"a.csv: column 'AU' is a grade, but 3 of its 5 values "
        r"are no numbers, the first 'BDL' at data row 2.*--missing BDL",
    ):
        read.check(grade, "a.csv")
    assert GradeRules(missing=("BDL",)).read(grade).is_grade(grade)
    rock = column("1", "2A", "QZ", "SCH", "1")  # a column of codes: one number, three words
    assert not GradeRules().read(rock).is_grade(rock)


def test_negative_values_are_kept_and_told() -> None:
    values, lines, _ = grade_of(column("-99", "1"), "a.csv")
    assert values.tolist() == [-99, 1]
    assert lines == [
        "a.csv: column 'AU': 1 of 2 values is negative, the first '-99' at data row 1: kept; "
        "declare codes by --missing"
    ]


def test_codes_of_nines_are_told() -> None:
    lines = grade_of(column("0.5", "9999", "2", "9999.0"), "a.csv")[1]
    assert len(lines) == 1
    assert "2 of 4 values are nines, perhaps a code, the first '9999' at data row 2" in lines[0]
    assert grade_of(column("998", "999", "1000"), "a.csv")[1] == []  # a grade in g/t
    assert grade_of(column("998", "999"), "a.csv")[1] == []


def test_caps_by_number_and_by_percentile_tell_what_they_changed() -> None:
    grades = column(*(str(k) for k in range(101)))  # p99 of 0 to 100 is 99
    for cap, top, changed in (("p99", 99, 1), (90, 90, 10), ("p100", 100, 0)):
        values, lines, facts = grade_of(grades, "a.csv", GradeRules(cap={"AU": cap}))
        assert values.max() == top
        assert facts["cap"]["changed"] == changed
        assert facts["cap"]["mean_before"] == 50
        assert f"capped at {top}" in lines[-1]


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        ({"below_detection": "third"}, "below_detection must be one of missing, half, zero"),
        ({"cap": {"AU": "p101"}}, "the cap of AU must be a number or a percentile such as p99"),
        ({"cap": {"AU": float("nan")}}, "the cap of AU must be"),
        ({"mising": (-99,)}, "no rule 'mising'; rules: missing, below_detection, cap"),
    ],
)
def test_rules_that_are_not_valid(rules: dict[str, object], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        grade_rules(rules)
