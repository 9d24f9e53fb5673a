"""The command compare."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from geounfold.cli import main
from tests.cli.fakes import replace_module


def test_compare(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked: list[Any] = []

    def compare(given: Any, flatteners: Any, **how: Any) -> pd.DataFrame:
        asked.append((type(given).__name__, flatteners, how.get("unfolding")))
        row = {"surface": "top", "flattener": "spring", "flips": 0, "error": "too, long"}
        return pd.DataFrame([row])

    replace_module(monkeypatch, "comparison.flatteners", compare=compare)
    (tmp_path / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert main(["compare", "p.csv", "-o", "t.csv", "--hull", "alpha"]) == 0
    assert "spring failed on the top surface: too, long" in capsys.readouterr().err
    assert main(["compare", "t.obj", "--flatteners", "spring,arap", "-o", "t2.csv"]) == 0
    assert asked == [("ndarray", "all", {"hull": "alpha"}), ("TriMesh", ["spring", "arap"], None)]
    written = (tmp_path / "t.csv").read_text()
    assert written == 'surface,flattener,flips,error\ntop,spring,0,"too, long"\n'
    assert main(["compare", "t.obj", "--hull", "alpha", "-o", "t3.csv"]) == 2
    assert "--hull needs a table of points; t.obj is one surface" in capsys.readouterr().err
