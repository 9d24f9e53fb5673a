"""The soak run: a row for every body, a run that goes on, failures counted and found again."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import TESTS

SCRIPT = TESTS / "soak" / "soak.py"
FLAT = 27  # a seed whose body is a flat slab: the quickest


def soak(work: Path, *args: str) -> subprocess.CompletedProcess[str]:
    out = ["--work", str(work), "--summary", str(work / "s.json"), "--figure", str(work / "s.png")]
    command = [sys.executable, str(SCRIPT), "--jobs", "1", *args, *out]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def rows(work: Path) -> list[dict[str, str]]:
    with (work / "bodies.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_soak_run_goes_on_and_reports(tmp_path: Path) -> None:
    soak(tmp_path, "--seed", str(FLAT), "--bodies", "1")
    first = rows(tmp_path)
    assert [row["family"] for row in first] == ["flat"]
    assert first[0]["outcome"] in ("ok", "uncertified")
    assert float(first[0]["rms"]) < 0.1  # blocks; measured 0.013
    # Goes on: the first row stays as it was, to its seconds.
    soak(tmp_path, "--seed", str(FLAT), "--bodies", "2")
    both = rows(tmp_path)
    assert both[0] == first[0]
    assert [int(row["seed"]) for row in both] == [FLAT, FLAT + 1]
    summary = json.loads((tmp_path / "s.json").read_text())
    assert sum(summary["outcomes"].values()) == summary["bodies"] == 2
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    # Other arguments would mix two runs in one table.
    other = soak(tmp_path, "--seed", "5", "--bodies", "1")
    assert other.returncode == 1
    assert "--restart" in other.stderr
    # One body alone comes to the same figures.
    alone = json.loads(soak(tmp_path, "--only", str(FLAT)).stdout)
    assert alone["rms"] == float(first[0]["rms"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limit", "reason"), [(("--seconds", "0"), "timeout"), (("--memory", "50"), "")]
)
def test_soak_counts_what_breaks_as_a_crash(
    tmp_path: Path, limit: tuple[str, str], reason: str
) -> None:
    done = soak(tmp_path, "--seed", str(FLAT), "--bodies", "1", *limit)
    assert done.returncode == 1
    (row,) = rows(tmp_path)
    assert row["outcome"] == "crash"
    assert row["reason"].startswith(reason)
    assert json.loads((tmp_path / "s.json").read_text())["outcomes"]["crash"] == 1
