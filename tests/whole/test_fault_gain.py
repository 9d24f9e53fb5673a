"""The study of what taking faults out is worth: shares, fault blocks with few samples, one run."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from geounfold.synthetic.faulted import simulate_faulted
from tests.places import TESTS

pytest.importorskip("gstlearn")


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(TESTS / "study"))
    monkeypatch.syspath_prepend(str(TESTS / "soak"))
    import fault_gain as script  # type: ignore[import-not-found]

    return script


def test_share_is_the_part_of_the_possible_gain(study: ModuleType) -> None:
    row = dict.fromkeys(study.ARMS, 0.6) | {"folded": 0.8, "truth": 0.4, "rejoined": 0.5}
    rows = pd.DataFrame([row | {"body": "b", "spacing": 8, "one body": np.nan}] * 2)
    assert study.share(pd.Series(row), "rejoined") == pytest.approx(0.75)
    line = study.table_of(rows).splitlines()[2]
    assert line.startswith("| b | 8 | 0.800 | 0.600 | - |")
    assert line.endswith("| 0.75 | 0.50 | 0.50 |")


def test_a_fault_block_with_few_samples_takes_all(study: ModuleType) -> None:
    P = np.random.default_rng(0).uniform(0, 100, (30, 3))
    z = np.where(np.arange(30) < 15, 0.0, 10.0)
    own = np.where(np.arange(30) < 15, 0, 1)
    T = np.full((2, 3), 50.0)
    found = study.by_block(P, z, T, (100.0, 100.0, 100.0), own, np.array([0, 1]))
    assert found == pytest.approx([0.0, 10.0], abs=1e-9)  # each from its own samples alone
    few = np.where(np.arange(30) < 28, 0, 1)
    mixed = study.by_block(P, z, T[:1], (100.0, 100.0, 100.0), few, np.array([1]))
    assert 0.5 < mixed[0] < 9.5  # two of its own: all thirty are used


def test_true_coordinates_are_better_than_folded_ones(study: ModuleType) -> None:
    body = simulate_faulted("strike_slip")
    flat = {"truth": body.truth, "rejoined": body.truth}
    row = study.run("strike_slip", 12, 0, flat, body.fault_block)
    assert row["rejoined"] == row["truth"]
    assert row["truth"] < row["each alone"] < row["folded"]  # 0.70, 0.75 and 0.86 of four seeds
    assert np.isnan(row["one body"])
    assert row["samples"] > 30  # eight holes of five blocks
