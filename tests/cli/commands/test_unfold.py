"""The command unfold: what goes in comes out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.quality.uncertainty import PositionUncertainty
from geounfold.report import CarriedHoles, CarriedPoints
from tests.cli.fakes import RESULTS, SHIFT, FakeUnfolding, replace_module


def test_unfold_writes_everything(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, Any] = {}

    def write_report(
        path: Path,
        summary: Any,
        folded: Any,
        unfolded: Any,
        columns: Any,
        *,
        holes: Any,
        faults: Any,
        exploration: Any,
        horizons: Any,
    ) -> None:
        assert exploration is None  # without --grade
        assert horizons == {}
        assert faults is None  # without --faults
        seen.update(summary=summary, folded=folded, unfolded=unfolded, columns=columns, holes=holes)
        path.write_text("<html>")

    kinds = {"CarriedHoles": CarriedHoles, "CarriedPoints": CarriedPoints}
    kinds["carried_faults"] = lambda result: None
    replace_module(monkeypatch, "report", write_report=write_report, **kinds)
    replace_module(monkeypatch, "report.plots.rendering", check_rendering=lambda: None)
    (tmp_path / "q.csv").write_text("hole;x;y;z\na;1;1;1\n")
    argv = [
        "unfold",
        "p.csv",
        "-o",
        "out.csv",
        "--summary",
        "s.json",
        "--map",
        "m.npz",
        "--report",
        "r.html",
    ]
    assert main([*argv, "--samples", "q.csv", "--samples-out", "qo.csv"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {
        *("p.csv", "q.csv", "out.csv", "s.json", "m.npz", "r.html", "qo.csv")
    }
    assert (tmp_path / "out.csv").read_text().splitlines() == [
        "id,XC,YC,ZC,location,unfolded_x,unfolded_y,unfolded_z,stratigraphic,mesh_distance,volume_ratio",
        "007,1.50,2,3,inside,1001.5,2.0,-2.0,0.3,0.0,1.0",
        ",-4,5,6,extrapolated,996.0,5.0,1.0,0.6,4.0,1.0",
        "9,7,8,9,inside,1007.0,8.0,4.0,0.9,0.0,1.0",
    ]
    assert (tmp_path / "qo.csv").read_text().splitlines() == [
        "hole,x,y,z," + ",".join(RESULTS),
        "a,1,1,1,1001.0,1.0,-4.0,0.1,inside,0.0",
    ]
    summary = json.loads((tmp_path / "s.json").read_text())
    assert summary["nmd"] is None
    assert summary["input"]["columns"] == ["XC", "YC", "ZC"]
    assert summary["input"]["rows"] == 3
    assert seen["summary"]["points"] == 3
    assert list(seen["columns"])[:6] == RESULTS
    np.testing.assert_array_equal(seen["unfolded"], seen["folded"] + SHIFT)
    samples = seen["holes"].samples
    np.testing.assert_array_equal(samples.unfolded, samples.folded + SHIFT)
    assert list(samples.columns) == ["stratigraphic", "location"]
    assert list(seen["columns"]["id"]) == ["007", "", "9"]


def test_options_reach_the_pipeline(points: Path, calls: list[dict[str, Any]]) -> None:
    argv = [
        "unfold",
        "p.csv",
        "-o",
        "out.csv",
        "--method",
        "thesis",
        "--up",
        "-1,0,0.5",
        "--body",
        "2",
        "--neighbours",
        "6",
    ]
    assert main(argv) == 0
    assert calls[0]["options"] == {
        "method": "thesis",
        "up": (-1.0, 0.0, 0.5),
        "body": 2,
        "neighbours": 6,
    }
    assert calls[0]["top"] is None
    assert main(["unfold", "p.csv", "-o", "out2.csv", "--body", "all"]) == 0
    assert calls[1]["options"] == {"body": "all"}


def test_uncertainty_is_eight_members_or_as_many_as_are_named(
    points: Path, calls: list[dict[str, Any]]
) -> None:
    argv = ["unfold", "p.csv", "-o", "out.csv", "--uncertainty"]
    assert main(argv) == 0
    assert main([*argv, "12", "--overwrite"]) == 0
    assert [call["options"] for call in calls] == [{"uncertainty": 8}, {"uncertainty": 12}]


@pytest.mark.parametrize(
    ("number", "said"), [("3", "must be 0 or from 6 up"), ("many", "must be a whole number")]
)
def test_too_few_members_are_refused(
    points: Path, capsys: pytest.CaptureFixture[str], number: str, said: str
) -> None:
    assert main(["unfold", "p.csv", "-o", "out.csv", "--uncertainty", number]) == 2
    assert f"--uncertainty {said}" in capsys.readouterr().err


def test_samples_get_their_standard_deviations(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = pd.read_csv(points)[["XC", "YC", "ZC"]].to_numpy()
    sd = np.array([[1.0, 0.5], [2.0, 0.5], [3.0, 0.5]])
    found = PositionUncertainty(blocks, sd, 8)
    monkeypatch.setattr(FakeUnfolding, "uncertainty", found, raising=False)
    (tmp_path / "q.csv").write_text("x,y,z\n7,8,9\n1.5,2,3\n")
    argv = ["unfold", "p.csv", "-o", "out.csv", "--samples", "q.csv", "--samples-out", "qo.csv"]
    assert main(argv) == 0
    out = pd.read_csv(tmp_path / "qo.csv")
    np.testing.assert_allclose(out["sd_along"], [3, 1], rtol=1e-6)
    np.testing.assert_allclose(out["sd_across"], 0.5)


def test_surfaces_reach_the_pipeline(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]]
) -> None:
    (tmp_path / "t.csv").write_text("x,y,z,v1,v2,v3\n0,0,1,1,2,3\n1,0,1,,,\n0,1,1,,,\n")
    (tmp_path / "b.csv").write_text("x,y,z,v1,v2,v3\n0,0,0,1,2,3\n1,0,0,,,\n0,1,0,,,\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--top", "t.csv", "--bottom", "b.csv"]) == 0
    assert calls[0]["top"].V[:, 2].tolist() == [1, 1, 1]
    assert calls[0]["bottom"].V[:, 2].tolist() == [0, 0, 0]


def test_dropped_rows_are_counted_and_said(
    tmp_path: Path,
    points: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    points.write_text("x,y,z\n1,2,3\n1,,3\n4,5,6\n4,5,6\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--summary", "s.json", "--drop-invalid"]) == 0
    facts = json.loads((tmp_path / "s.json").read_text())["input"]
    assert (facts["rows"], facts["dropped_invalid"], facts["duplicates"]) == (4, 1, 1)
    assert len(pd.read_csv(tmp_path / "out.csv")) == 3
    said = capsys.readouterr().err
    assert "p.csv: 1 row without finite coordinates left out: data row " in said


def test_overwrite_and_quiet(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "out.csv").write_text("old")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--overwrite"]) == 0
    assert (tmp_path / "out.csv").read_text().startswith("id,")
    # In a pipe: no progress, but what to distrust.
    assert capsys.readouterr() == ("", "geounfold: warning: 8 blocks lie outside\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--overwrite", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
