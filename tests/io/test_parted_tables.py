"""Tables whose rows are divided into parts: results spread, whole or in batches, in any format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.io.selection import read_where
from geounfold.io.tables.large import open_points
from geounfold.io.tables.parted import ELSEWHERE, NOT_SELECTED, PartedTable, spread_columns

DOMAINS = ["A", "B", "A", "C", "", "B", "A"]


@pytest.fixture(params=["whole", "in batches"])
def table(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    if request.param == "in batches":
        monkeypatch.setattr("geounfold.io.tables.large.LARGE", 0)
        monkeypatch.setattr("geounfold.io.tables.large.BATCH", 2)
    path = tmp_path / "m.csv"
    places = pd.DataFrame({"x": np.arange(7.0), "y": 1.0, "z": 2.0, "D": DOMAINS})
    places.loc[3, "y"] = np.nan  # of a row that is not selected
    places.to_csv(path, index=False)
    return open_points(path, where=read_where("D!=C"))


def test_values_of_a_column_are_labels(table: Any) -> None:
    codes, names = table.categories("d")
    assert names == ["A", "B", "C"]
    assert codes.tolist() == [0, 1, 0, 2, -1, 1, 0]


@pytest.mark.parametrize("kind", [".csv", ".parquet"])
def test_every_part_gets_its_results_and_the_others_none(
    table: Any, kind: str, tmp_path: Path
) -> None:
    codes, _ = table.categories("D")
    part = np.where(table.chosen, np.where(codes == 1, 1, np.where(codes == 0, 0, -2)), -1)
    parted = PartedTable(table, part, 2)
    assert len(parted) == 5
    np.testing.assert_array_equal(parted.points[:, 0], [0, 1, 2, 5, 6])

    def make(name: str) -> Any:
        return lambda frame, points, rows: {
            "out": points[:, 0] * 10,
            "row": np.arange(rows.start, rows.stop),  # among the part's own rows
            "location": np.full(len(frame), f"inside {name}"),
        }

    out = tmp_path / f"o{kind}"
    parted.write_parts(out, make("A"), make("B"))
    found = pd.read_csv(out) if kind == ".csv" else pd.read_parquet(out)
    np.testing.assert_array_equal(found["out"], [0, 10, 20, np.nan, np.nan, 50, 60])
    assert found["row"].fillna(-1).tolist() == [0, 0, 1, -1, -1, 1, 2]
    assert found["location"].tolist() == [
        *("inside A", "inside B", "inside A", NOT_SELECTED, ELSEWHERE, "inside B", "inside A")
    ]


def test_results_of_every_type_have_a_missing_value() -> None:
    part = np.array([0, -1])
    rows = np.array([0])
    found = spread_columns(
        [(rows, {"f": [0.5], "i": [3], "b": [True], "t": ["word"], "location": ["inside"]})], part
    )
    assert np.isnan(found["f"][1])
    assert found["i"][0] == 3
    assert found["i"][1] is pd.NA
    assert found["b"][1] is pd.NA
    assert found["t"].tolist() == ["word", ""]
    assert found["location"].tolist() == ["inside", NOT_SELECTED]
