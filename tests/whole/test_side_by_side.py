"""The benchmark beside others: its table, the figures it keeps, and the slowdown it tells."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.places import TESTS

sys.path.insert(0, str(TESTS / "benchmarks"))

import side_by_side


def row(version: str, sheet: str, body: str = "ragged") -> dict[str, str]:
    figures = {"tree": "0.02", "sheet": sheet, "thesis": "14", "isomap": ""}
    return {"version": version, "body": body, "blocks": "21600", **figures}


def run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kept: list[dict[str, str]], sheet: str
) -> int:
    out = tmp_path / "releases.csv"
    if kept:
        side_by_side.write(out, kept)
    monkeypatch.setattr(side_by_side, "measured", lambda *_: row("0.9", sheet))
    return side_by_side.main(["--only", "ragged", "--keep", "--out", str(out)])


def test_figures_are_kept_by_version(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    old, mine, other = row("0.8", "2"), row("0.9", "3"), row("0.9", "7", "recumbent")
    assert run(monkeypatch, tmp_path, [old, mine, other], "2.1") == 0
    rows = side_by_side.read(tmp_path / "releases.csv")
    assert rows == [old, other, row("0.9", "2.1")]


@pytest.mark.parametrize(("sheet", "status"), [("2.4", 0), ("2.6", 1), ("", 0)])
def test_a_quarter_more_than_the_version_before_is_told(
    sheet: str,
    status: int,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(monkeypatch, tmp_path, [row("0.7", "9"), row("0.8", "2")], sheet) == status
    told = capsys.readouterr()
    assert ("ragged: slower than in the version before" in told.err) == bool(status)
    own = f"{float(sheet) / 0.02:.0f}" if sheet else "-"
    assert f"| {own} | 100 | 14 | - |" in told.out
