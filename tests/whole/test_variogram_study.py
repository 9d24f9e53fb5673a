"""The study of automatic variograms: its page has the figures of its table, and sets repeat."""

from __future__ import annotations

import sys

import pandas as pd
import pytest

from tests.places import ROOT, TESTS

TABLE = ROOT / "data" / "variograms.csv"


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(TESTS / "study"))
    import variograms

    yield variograms
    sys.modules.pop("variograms", None)


def test_the_page_has_the_figures_of_the_table(study) -> None:
    page = (ROOT / "docs" / "results" / "variograms.md").read_text(encoding="utf-8")
    for line in study.markdown(study.table(pd.read_csv(TABLE))):
        assert line in page


def test_the_likelihood_is_near_the_best_in_every_set() -> None:
    rows = pd.read_csv(TABLE)
    ours = rows[rows["way"] == "likelihood"]
    # The share of the best possible error: its median, and the worst sets (measured 0.948).
    assert (ours.groupby("space")["share"].median() >= 0.98).all()
    assert len(ours) == 100
    assert ours["share"].min() >= 0.93
    assert (rows.loc[rows["way"] == "likelihood", "bounds"] == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("number", [17, 27])
def test_a_set_repeats(study, number: int) -> None:
    rows = pd.read_csv(TABLE)
    kept = rows[(rows["set"] == number) & (rows["way"] == "likelihood")]
    got = pd.DataFrame(study.run(number, {"likelihood": {}}))
    assert got["share"].to_numpy() == pytest.approx(kept["share"].to_numpy(), abs=0.005)
