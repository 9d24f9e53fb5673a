"""The command simulate."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.io.surfaces import read_surface


def test_simulate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--list"]) == 0
    cases = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert {"sim_case_1", "sim_case_2"} <= {name for name, _description in cases}
    out = tmp_path / "thin.parquet"
    pytest.importorskip("pyarrow")
    assert main(["simulate", "sim_case_1", "-o", str(out)]) == 0
    assert {"centroid_x", "true_z"} <= set(pd.read_parquet(out))
    assert main(["simulate", "no_such_case", "-o", str(tmp_path / "x.csv")]) == 2
    said = capsys.readouterr().err
    assert "sim_case_1" in said
    assert "; with faults: normal" in said
    assert main(["simulate", "graban", "-o", str(tmp_path / "x.csv")]) == 2
    assert "no simulated body is named 'graban' (did you mean 'graben'?)" in capsys.readouterr().err
    assert main(["simulate", "--list", "-o", str(tmp_path / "x.csv")]) == 2
    assert "--list has neither CASE nor -o" in capsys.readouterr().err


def test_simulate_writes_four_decimals_and_about_so_many_blocks(tmp_path: Path) -> None:
    out = tmp_path / "small.csv"
    assert main(["simulate", "sim_case_1", "--blocks", "2000", "-o", str(out)]) == 0
    rows = out.read_text().splitlines()[1:]
    assert 1600 < len(rows) < 2400  # whole blocks, six layers: measured 1,944
    assert max(len(value.partition(".")[2]) for row in rows for value in row.split(",")) == 4
    assert main(["simulate", "sim_case_1", "--blocks", "0", "-o", str(tmp_path / "x.csv")]) == 2


def test_a_body_that_blocks_makes_too_narrow_is_warned_of(tmp_path, capsys):
    # Measured: the unfolding of `plunging` is poor up to 11,004 blocks and good at 12,000.
    words = ["simulate", "plunging", "-o", str(tmp_path / "a.csv"), "--overwrite", "--blocks"]
    assert main([*words, "3000"]) == 0
    said = capsys.readouterr().err
    assert "with 2,996 blocks the body is only 1.2 times as wide as thick" in said
    assert "--blocks 13000 or more is wide enough" in said
    assert main([*words, "13000"]) == 0
    assert capsys.readouterr().err == ""
    assert main(["simulate", "hairpin", *words[2:], "3000"]) == 2
    assert "--blocks 3000 is too few for hairpin: its thickness stays" in capsys.readouterr().err


def test_a_faulted_body_is_written_with_its_surfaces(tmp_path, capsys):
    out = tmp_path / "graben.csv"
    arguments = ["simulate", "graben", "-o", str(out), "--blocks", "2000"]
    assert main([*arguments, "--faults-out", str(tmp_path / "graben.ts")]) == 0
    table = pd.read_csv(out)
    assert sorted(set(table.true_fault_block)) == [0, 1, 2]
    for name in ("f1", "f2"):
        mesh = read_surface(tmp_path / f"graben_{name}.ts")
        assert len(mesh.F) > 500
    assert main([*arguments, "--overwrite"]) == 0
    capsys.readouterr()
    assert main(["simulate", "--list"]) == 0
    assert "faulted: two faults that dip towards each other" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["plunging", "-o", "a.csv", "--faults-out", "a.ts"], "plunging has no faults; faulted: n"),
        (["--list", "--faults-out", "a.ts"], "--list has neither CASE nor -o nor --faults-out"),
        (["graben", "-o", "a.csv", "--faults-out", "a.xyz9"], "a_f1.xyz9"),
        (["graben", "-o", "a.csv", "--blocks", "0"], "--blocks"),
    ],
)
def test_what_no_faulted_body_can_be_made_of(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
