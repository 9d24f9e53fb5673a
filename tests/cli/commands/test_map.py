"""The command map, there and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from tests.cli.fakes import PLACE


def test_map_there_and_back(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "m.npz").write_bytes(b"map")
    assert main(["map", "m.npz", "p.csv", "-o", "flat.csv"]) == 0
    flat = pd.read_csv(tmp_path / "flat.csv", dtype=str)
    assert list(flat) == ["id", "XC", "YC", "ZC", "location", *PLACE, "mesh_distance"]
    assert "p.csv: 1 of 3 points lie outside the control mesh" in capsys.readouterr().err
    columns = "unfolded_x,unfolded_y,unfolded_z"
    assert main(f"map m.npz flat.csv --inverse --columns {columns} -o back.csv".split()) == 0
    back = pd.read_csv(tmp_path / "back.csv", dtype={"id": str})
    assert list(back) == [*flat, "folded_x", "folded_y", "folded_z"]
    folded = back[["folded_x", "folded_y", "folded_z"]].to_numpy()
    np.testing.assert_array_equal(folded, back[["XC", "YC", "ZC"]].to_numpy())
    # The unfolded columns are those meant on the way back, though XC/YC/ZC are there too.
    assert main(["map", "m.npz", "flat.csv", "--inverse", "-o", "back2.csv"]) == 0
    assert (tmp_path / "back2.csv").read_text() == (tmp_path / "back.csv").read_text()
    capsys.readouterr()
    assert main(["map", "m.npz", "p.csv", "--inverse", "-o", "back3.csv"]) == 0
    assert "note: p.csv: no columns unfolded_x, unfolded_y" in capsys.readouterr().err
    assert main(f"map m.npz flat.csv --columns {columns} -o no.csv".split()) == 2
    assert not (tmp_path / "no.csv").exists()
