"""Columns of rock, ore or domain that vary: named, with a choice of rows that works."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from geounfold.io.selection import read_where
from geounfold.io.selection.mixed import mixed_frame


@pytest.mark.parametrize(
    ("name", "values", "choice"),
    [
        ("ROCK", ["WASTE", "ORE", "WASTE"], "ROCK=ORE"),
        ("ore", [0, 1, 0], "ore=1"),
        ("Est_Domain", ["LODE 1", "LODE 2", "LODE 1"], "Est_Domain='LODE 1'"),
        ("ROCK TYPE", ["QZ", "QZ", "SCH"], "'ROCK TYPE'=QZ"),
        ("ZONE", [3.0, 3.0, np.nan], "ZONE=3"),  # blank rows are other rock too
        ("lithology", ["a", "b", "b"], "lithology=a"),
    ],
)
def test_a_column_that_varies_is_named_with_a_choice(
    name: str, values: list[object], choice: str
) -> None:
    frame = pd.DataFrame({"x": [1, 2, 3], name: values})
    said = mixed_frame(frame)
    assert f"column {name} (" in said
    assert f'--where "{choice}"' in said
    found = re.search('--where "(.*)", or', said)
    assert found is not None
    chosen = read_where(found.group(1)).mask(frame)
    assert 0 < chosen.sum() < 3


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("ROCK", ["ORE"] * 3),  # does not vary
        ("HOLE", ["a", "b", "c"]),  # no rock
        ("AU", [0, 1, 1]),
        ("location", ["inside", "outside", "inside"]),
    ],
)
def test_other_columns_are_not_named(name: str, values: list[object]) -> None:
    assert mixed_frame(pd.DataFrame({"x": [1, 2, 3], name: values})) == ""


def test_columns_of_many_values_are_no_kinds_of_rock() -> None:
    assert mixed_frame(pd.DataFrame({"ORE": np.linspace(0, 1, 200)})) == ""
