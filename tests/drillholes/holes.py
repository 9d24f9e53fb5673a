"""Tables of drill holes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from geounfold.drillholes import DrillHoles


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


def random_tables(seed: int = 3) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    rng = np.random.default_rng(seed)
    names = [f"H{k}" for k in range(6)]
    collar = [(n, *rng.uniform(0, 1000, 3)) for n in names]
    survey = [(n, d, rng.uniform(0, 360), rng.uniform(40, 90)) for n in names for d in (0, 35, 80)]
    assay = [(n, d, d + 7.0, rng.uniform(0, 3)) for n in names for d in np.arange(0, 90, 7.0)]
    return frames(collar, survey, assay)
