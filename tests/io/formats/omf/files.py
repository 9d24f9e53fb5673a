"""OMF files that are read, cut and rewritten by the tests."""

from __future__ import annotations

import runpy
from pathlib import Path

import pandas as pd
import pytest

from tests.places import TESTS

DATA = TESTS / "data" / "omf"

MAKE = runpy.run_path(str(DATA / "make.py"))

XYZ = MAKE["XYZ"]

SIDES, PLACES = ["dx", "dy", "dz"], ["i", "j", "k"]


def file(folder: Path, name: str) -> Path:
    path = folder / f"{name}.omf"
    if not path.exists():
        pytest.skip("the library at hand is of the other version and cannot write this")
    return path


def sums_of(frame: pd.DataFrame) -> float:
    return float(frame[SIDES].prod(axis=1).sum())


# Of blocks of (10, 20) by (5, 5, 5) by (1, 2, 1, 1), u along y and v against x, the corner at
# (100, 200, 0): the block at (1, 2, 1) reaches over u 10 to 30, v 10 to 15, w 1 to 3.
TENSOR_AT = (1, 2, 1)

TENSOR_CENTRE, TENSOR_SIDES = [100 - 12.5, 200 + 20.0, 2.0], [20.0, 5.0, 2.0]

TENSOR_VOLUME = 30 * 15 * 5
