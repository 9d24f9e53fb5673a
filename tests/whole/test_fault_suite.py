"""The runner over faulted bodies: its figures against made answers, its tables, its choice."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geounfold.synthetic.faulted import FAULTED_CASES, VARIANTS, FaultedBody, simulate_faulted
from tests.places import TESTS


@pytest.fixture
def runner(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(TESTS / "soak"))
    import faults as script  # type: ignore[import-not-found]

    return script


@pytest.fixture(scope="module")
def body() -> FaultedBody:
    return simulate_faulted("normal_1T")


def answer(body: FaultedBody, Y: np.ndarray, trust: str = "good", **more: Any) -> SimpleNamespace:
    foot, hanging = body.slips["f1"].blocks[0].tolist()
    row = {"fault": "f1", "footwall_block": foot, "hanging_wall_block": hanging, "pairs": 10,
           "throw": 43.3, "gap_area": 200.0, "overlap_area": 100.0,
           "resolved_by": "shape"}  # fmt: skip
    facts = {"injective": True, "warnings": [], "trust": {"word": trust}, "faults": [row | more]}
    return SimpleNamespace(points=Y, fault_block=body.fault_block, summary=lambda: facts)


def judged(runner: ModuleType, body: FaultedBody, u: SimpleNamespace) -> Any:
    row = runner.Row("normal_1T")
    runner.judge(row, body, u)
    return row


def test_the_truth_in_another_place_is_right(runner: ModuleType, body: FaultedBody) -> None:
    Y = body.truth[:, [1, 0, 2]] * [1, -1, 1] + np.outer(body.truth[:, 2], [0.2, 0.1, 0]) + 300
    row = judged(runner, body, answer(body, Y))
    assert row.verdict == "right"
    assert row.rms == pytest.approx(0, abs=1e-6)
    assert row.jump == pytest.approx(0, abs=1e-6)
    assert row.sorted_right == 1
    assert (row.gap, row.overlap) == (2.0, 1.0)  # squares of blocks of 10
    assert row.throw_off == pytest.approx(0, abs=0.01)  # 50 sin 60 = 43.301


@pytest.mark.parametrize(("trust", "verdict"), [("good", "silent"), ("poor", "told")])
def test_a_block_that_is_off_shows_as_rms_and_jump(
    runner: ModuleType, body: FaultedBody, trust: str, verdict: str
) -> None:
    Y = body.truth + np.where(body.fault_block[:, None] == 1, [0, 30.0, 0], 0)
    row = judged(runner, body, answer(body, Y, trust, throw=63.3))
    assert row.verdict == verdict
    # Two equal blocks, 3 apart along strike. A turn of the whole closes part of it: width over
    # length of the body leave 3/2 times 0.6 to 1 of the distance.
    assert 0.9 < row.rms <= 1.5
    assert row.alone == pytest.approx(0, abs=1e-6)
    assert 2.5 < row.jump <= 3.01
    assert row.throw_off == pytest.approx(2, abs=0.01)


def test_blocks_left_out_and_mixed_fault_blocks_are_counted(
    runner: ModuleType, body: FaultedBody
) -> None:
    Y = body.truth.copy()
    Y[::10] = np.nan
    u = answer(body, Y)
    u.fault_block = np.where(np.arange(len(Y)) < 50, 1, body.fault_block)
    row = judged(runner, body, u)
    assert row.placed == pytest.approx(0.9, abs=0.001)
    wrong = int((body.fault_block[:50] != 1).sum())
    assert row.sorted_right == pytest.approx(1 - wrong / len(Y))


def test_ways_give_what_they_say(runner: ModuleType, body: FaultedBody) -> None:
    assert set(runner.given(body, "surfaces")) == {"faults"}
    assert set(runner.given(body, "ids")) == {"fault_blocks"}
    assert set(runner.given(body, "both")) == {"faults", "fault_blocks"}
    off = runner.body_of("normal_1T", "off_one")
    assert not np.array_equal(off.surfaces["f1"][0], body.surfaces["f1"][0])
    assert runner.body_of("wide3", "ids").name == "wide3"


def test_every_body_is_chosen_once_for_each_of_its_ways(runner: ModuleType) -> None:
    args = argparse.Namespace(random=5, wide=3, body=[], way=[])
    rows = runner.chosen(args)
    keys = [(row.name, row.way) for row in rows]
    assert len(set(keys)) == len(keys)
    n = len(FAULTED_CASES)
    assert len(keys) == n + 5 + 3 + n + len(VARIANTS) * len(runner.DRAWN)
    args = argparse.Namespace(random=5, wide=3, body=["tip"], way=["ids"])
    assert [(row.name, row.way) for row in runner.chosen(args)] == [("tip", "ids")]


def test_groups_count_refusals_as_wrong(runner: ModuleType) -> None:
    made = [("answered", 0.2), ("answered", 0.7), ("answered", 3.0), ("refused", np.nan)]
    rows = [
        runner.Row("tip", outcome=how, verdict="right", rms=rms, trust="good") for how, rms in made
    ]
    f = runner.figures_of(rows)
    assert (f["bodies"], f["answered"], f["within_half"], f["within_one"]) == (4, 3, 1, 2)
    assert f["rms_median"] == 0.7
    assert f["above_one_untold"] == ["tip"]
    assert [runner.group_of(runner.Row(n)) for n in ("tip", "plain1", "wide2")] == [
        "named, surfaces", "random, plain, surfaces", "random, wide, surfaces"
    ]  # fmt: skip
    empty = runner.figures_of([runner.Row("tip", verdict="failed")])
    assert empty["rms_median"] is None


def test_tables_go_between_their_marks(runner: ModuleType, tmp_path: Path) -> None:
    rows = [runner.Row("tip", way, outcome="answered", rms=0.4, found=2, fault_blocks=2)
            for way in ("surfaces", "ids")]  # fmt: skip
    rows[1].outcome, rows[1].verdict = "refused", "refused"
    table = runner.designed_table(rows)
    assert table.count("\n") == 2
    assert "| 0.40 | refused |" in table
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- designed -->\nold\n<!-- end of designed -->\nb\n")
    runner.into_page(page, {"designed": table})
    assert page.read_text() == f"a\n<!-- designed -->\n{table}\n<!-- end of designed -->\nb\n"
    with pytest.raises(SystemExit, match="has no marks"):
        runner.into_page(page, {"other": table})


def test_a_failure_is_a_row_with_its_place(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(name: str, way: str) -> None:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(runner, "body_of", broken)
    row = runner.Row("tip")
    runner.work(row, {}, cost=False)
    assert row.verdict == "failed"
    assert row.message.startswith("ZeroDivisionError: by nothing (test_fault_suite.py:")


def test_a_run_of_one_body_writes_its_row_and_figures(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- designed -->\n<!-- end of designed -->\n<!-- groups -->\n<!-- end of groups -->\n"
    )
    run = subprocess.run(
        [sys.executable, TESTS / "soak" / "faults.py", "--body", "strike_slip", "--way", "surfaces",
         "--table", tmp_path / "t.csv", "--summary", tmp_path / "s.json", "--page", page],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    row = json.loads((tmp_path / "s.json").read_text())["rows"][0]
    assert (row["verdict"], row["found"], row["certified"]) == ("right", 2, "yes")
    assert row["rms"] < 0.35  # 0.16 as measured; 3 as one body
    assert row["jump"] < 0.5 < 8 < row["slip"]
    assert row["throw_off"] < 0.5
    assert (tmp_path / "t.csv").read_text().count("\n") == 2
    assert "`strike_slip`" in page.read_text()
