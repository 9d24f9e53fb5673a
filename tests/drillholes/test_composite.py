"""Composites: ends, metal and coverage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from geounfold.drillholes import CompositeOptions, read_drillholes
from geounfold.drillholes.composite import composite
from geounfold.errors import InputError, OptionError
from tests.drillholes.holes import one_hole, random_tables


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
    holes = read_drillholes(*random_tables())
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
        with pytest.raises(OptionError, match=r"^length must be a number above 0, but is"):
            holes.samples(bad)
    with pytest.raises(OptionError, match="too many"):
        holes.samples(1e-9)
    with pytest.raises(
        OptionError, match="residual must be one of merge, drop, keep, but is 'guess'"
    ):
        holes.samples(1.0, residual="guess")  # type: ignore[arg-type]
    with pytest.raises(OptionError, match=r"min_coverage must be .* from 0 to 1, but is 2"):
        holes.samples(1.0, min_coverage=2.0)
