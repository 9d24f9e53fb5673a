"""The command quality."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from tests.cli.fakes import RESULTS
from tests.shapes import grid_cells


def test_quality(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    axes = np.meshgrid(np.arange(6.0), np.arange(5.0), np.arange(3.0), indexing="ij")
    truth = np.stack([a.ravel() for a in axes], axis=1)
    flat = pd.DataFrame(truth + 7.0, columns=RESULTS[:3]).assign(x=0.0, y=0.0, z=0.0)
    flat.to_csv(tmp_path / "flat.csv", index=False)
    true = pd.DataFrame(truth, columns=["true_x", "true_y", "true_z"])
    folded = pd.DataFrame(truth * [1, 1, 2], columns=list("xyz"))
    pd.concat([folded, true], axis=1).to_csv(tmp_path / "folded.csv", index=False)
    files = [str(tmp_path / "folded.csv"), str(tmp_path / "flat.csv")]
    figures = tmp_path / "f.json"
    assert main(["quality", *files, "--truth", files[0], "-o", str(figures)]) == 0
    found = json.loads(figures.read_text())
    # The answer is the truth moved by 7: both are zero but for rounding near 10.
    assert found["epsilon_truth"]["max"] < 1e-12
    assert found["rms"] < 1e-12
    assert found["rms_nothing"] > 0.5
    assert "epsilon_truth" in capsys.readouterr().out
    assert main(["quality", *files, "--neighbours", "6"]) == 0
    out = capsys.readouterr().out
    assert "neighbours" in out
    assert "epsilon_own_neighbours" in out


def test_files_in_each_others_place_are_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    cells = pd.DataFrame(grid_cells(5, 4, 3) * 1.0, columns=list("xyz"))
    cells.to_csv("folded.csv", index=False)
    flat = (cells * [2.0, 1, 1]).set_axis(list(RESULTS[:3]), axis=1)
    flat.to_csv("flat.csv", index=False)
    assert main(["quality", "folded.csv", "folded.csv"]) == 0
    said = capsys.readouterr().err
    assert "has the same coordinates as folded.csv: nothing was unfolded; were two files" in said
    assert main(["quality", "folded.csv", "flat.csv"]) == 0
    assert capsys.readouterr().err == ""
    for words, message in (
        ("map folded.csv flat.csv -o o.csv", "not a geounfold map, which ends in .npz: were two"),
        ("unfold folded.csv -o s.json", "--output must end in .csv, .csv.gz, .parquet, .gslib or "
         "another kind of table; .json is for --summary"),
        ("unfold folded.csv -o o.csv --map m.csv", "--map must end in .npz; .csv is for --output"),
        ("unfold folded.csv -o o.csv --faults folded.csv", "--faults folded.csv is POINTS itself"),
    ):  # fmt: skip
        assert main(words.split()) == 2
        said = capsys.readouterr().err
        assert message in said
        assert said.count("\n") == 1
