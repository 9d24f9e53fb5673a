"""The cross-check of meshes from the command line: tables, JSON, warnings, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main

QUICK = ("--meshers", "tetwild", "--interiors", "harmonic")

FAILED = "cross-check: no tetwild mesh: tetwild could not be started"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    gu.simulate("sim_case_1", blocks=1000).frame(4).to_csv("p.csv", index=False)
    return tmp_path


def test_tables_of_meshes_and_of_blocks(folder, capsys):
    assert main(["crosscheck", "p.csv", *QUICK, "-o", "t.csv", "--differences", "d.csv"]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    # A thousand blocks of the thesis's body are 1.8 times as wide as thick.
    assert err.startswith("geounfold: warning: trust is poor: the body is only 1.8 times as wide")
    assert err.count("\n") == 1
    # Nothing else: fTetWild leaves a file where it runs.
    assert {path.name for path in folder.iterdir()} == {"p.csv", "t.csv", "d.csv"}
    table = pd.read_csv("t.csv")
    assert table.mesh.tolist() == ["prism", "tetwild"]
    assert (table.volume_difference.abs() < 0.01).all()
    given, blocks = pd.read_csv("p.csv"), pd.read_csv("d.csv")
    new = ["difference_prism_harmonic", "difference_tetwild_harmonic"]
    assert blocks.columns.tolist() == [*given.columns, *new]
    pd.testing.assert_frame_equal(blocks[given.columns], given)
    rms = np.sqrt((blocks[new] ** 2).mean()).to_numpy()
    assert rms == pytest.approx(table.rms.to_numpy(), rel=1e-9)


def test_the_answer_in_words_and_as_json(folder, monkeypatch, capsys):
    # A mesher that cannot be called at all is a row, and a warning.
    monkeypatch.setattr("sys.executable", "/no/such/python")
    assert main(["crosscheck", "p.csv", *QUICK]) == 0
    words, warned = capsys.readouterr()
    for expected in ("volume of the hull", "prism", "harmonic", "same inside"):
        assert expected in words
    assert "tetwild   tetwild could not be started" in words
    assert f"geounfold: warning: {FAILED}" in warned
    assert main(["crosscheck", "p.csv", *QUICK, "--json", "-o", "t.json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["mesh"] for row in answer["meshes"]] == ["prism", "tetwild"]
    assert answer["meshes"][1]["volume"] is None
    assert answer["command"].startswith("geounfold crosscheck p.csv")
    assert json.loads((folder / "t.json").read_text()) == answer


def test_unfold_tells_a_disagreement_in_its_summary_and_on_stderr(folder, monkeypatch, capsys):
    monkeypatch.setattr("sys.executable", "/no/such/python")
    words = ("unfold", "p.csv", "-o", "f.csv", "--summary", "s.json")
    assert main([*words, "--crosscheck"]) == 0
    assert f"geounfold: warning: {FAILED}" in capsys.readouterr().err
    summary = json.loads((folder / "s.json").read_text())
    assert any(FAILED in warning for warning in summary["warnings"])
    assert summary["crosscheck"]["meshes"][0]["error"] == ""
    assert main([*words, "--overwrite"]) == 0
    assert "crosscheck" not in json.loads((folder / "s.json").read_text())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("--meshers", "gmsh"),
            "meshers must be a list of one or more of tetwild, tetgen, but is ['gmsh']",
        ),
        (
            ("--interiors", ""),
            "interiors must be a list of one or more of harmonic, arap, but is ['']",
        ),
        (("-o", "t.xlsx"), "t.xlsx"),
        (("-o", "p.csv"), "p.csv"),
        (
            ("--hull", "cube"),
            "hull must be one of auto, density, alpha, ball_pivoting, poisson, but is 'cube'",
        ),
    ],
)
def test_what_cannot_be_used_is_one_line_and_nothing_is_lost(folder, capsys, words, message):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert main(["crosscheck", "p.csv", *words]) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
