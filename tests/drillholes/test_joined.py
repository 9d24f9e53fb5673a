"""Assays cut where a log's codes change."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.drillholes import DrillHoles, joined, read_drillholes
from geounfold.errors import InputError, OptionError


def holes(rows: list[tuple[str, float, float, object]], column: str) -> DrillHoles:
    names = sorted({row[0] for row in rows})
    collar = pd.DataFrame({"hole": names, "x": 0.0, "y": np.arange(len(names)) * 9.0, "z": 0.0})
    survey = pd.DataFrame({"hole": names, "at": 0.0, "azimuth": 0.0, "dip": 90.0})
    return read_drillholes(
        collar, survey, pd.DataFrame(rows, columns=["hole", "from", "to", column])
    )


ASSAYS = [("A", 0.0, 4.0, 1.0), ("A", 4.0, 8.0, 2.0), ("B", 2.0, 6.0, 3.0)]
LOG = [("A", 1.0, 6.0, "ORE"), ("A", 6.0, 9.0, "WASTE"), ("B", 0.0, 9.0, "ORE")]


def test_pieces_have_the_grade_and_the_code_of_their_place() -> None:
    found = joined(holes(ASSAYS, "CU"), holes(LOG, "LITH"), ("LITH",)).samples()
    rows = found[["hole", "from", "to", "CU", "LITH"]].to_numpy().tolist()
    assert rows == [
        ["A", 0.0, 1.0, 1.0, ""],
        ["A", 1.0, 4.0, 1.0, "ORE"],
        ["A", 4.0, 6.0, 2.0, "ORE"],
        ["A", 6.0, 8.0, 2.0, "WASTE"],
        ["B", 2.0, 6.0, 3.0, "ORE"],
    ]


def test_composites_begin_anew_where_the_code_changes() -> None:
    cut = joined(holes(ASSAYS, "CU"), holes(LOG, "LITH"), ("LITH",))
    found = cut.samples(3.0, by="LITH")
    assert found[["from", "to"]].to_numpy().tolist() == [
        [0, 1], [1, 4], [4, 6], [6, 8], [2, 6]
    ]  # fmt: skip
    # No metal is lost: length times grade is that of the assays.
    metal = ((found["to"] - found["from"]) * found["CU"]).sum()
    assert metal == pytest.approx(4 * 1 + 4 * 2 + 4 * 3)


def test_what_does_not_fit_is_refused() -> None:
    assays, log = holes(ASSAYS, "CU"), holes(LOG, "LITH")
    with pytest.raises(OptionError, match="no column 'ROCK'; columns: LITH"):
        joined(assays, log, ("ROCK",))
    with pytest.raises(OptionError, match="has a column 'CU' too"):
        joined(assays, holes([("A", 0.0, 4.0, 1.0)], "CU"), ("CU",))
    with pytest.raises(InputError, match="no assay is in a hole of"):
        joined(assays, holes([("Z", 0.0, 4.0, "ORE")], "LITH"), ("LITH",))
    with pytest.raises(OptionError, match="no column 'ROCK' of codes"):
        assays.samples(2.0, by="ROCK")
