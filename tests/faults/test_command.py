"""Faults from the command line: surfaces, ids, slips, maps both ways, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.geometry.mesh import TriMesh
from geounfold.io import write_surface
from tests.faults.test_rejoin import faulted_slab

XYZ = ["x", "y", "z"]
FLAT = [f"unfolded_{axis}" for axis in "xyz"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the slab, its fault and its unfolding."""
    path = tmp_path_factory.mktemp("faults")
    X, _, hanging, surface = faulted_slab()
    table = pd.DataFrame(X, columns=XYZ)
    table.assign(part=np.where(hanging, "h", "f")).to_csv(path / "b.csv", index=False)
    write_surface(path / "F1.ts", TriMesh(*surface))
    words = ["unfold", "b.csv", "-o", "o.csv", "--faults", "F1.ts", "--slips", "slips.csv"]
    words += ["--summary", "s.json", "--map", "m.npz", "--quiet"]
    assert main([str(path / w) if "." in w else w for w in words]) == 0
    return path


def test_table_and_summary_hold_blocks_and_faults(folder: Path) -> None:
    out = pd.read_csv(folder / "o.csv")
    summary = json.loads((folder / "s.json").read_text())
    assert set(out["fault_block"]) == {0, 1}
    assert out.groupby("part")["fault_block"].nunique().tolist() == [1, 1]
    [row] = summary["faults"]
    assert row["fault"] == "F1"
    # Half a block is what the blocks resolve; the true throw is 3 blocks.
    assert row["throw"] == pytest.approx(3.0, abs=0.5)
    assert row["throw_p10"] <= row["throw"] <= row["throw_p90"]
    slips = pd.read_csv(folder / "slips.csv")
    assert np.median(slips["throw"]) == pytest.approx(row["throw"])


def test_map_returns_points_by_their_fault_block(folder: Path) -> None:
    samples = pd.read_csv(folder / "o.csv")[XYZ].iloc[::5] + 0.2
    samples.to_csv(folder / "p.csv", index=False)
    one = ["map", str(folder / "m.npz"), str(folder / "p.csv"), "-o", str(folder / "q.csv")]
    assert main([*one, "--quiet", "--overwrite"]) == 0
    flat = pd.read_csv(folder / "q.csv")
    back = ["map", str(folder / "m.npz"), str(folder / "q.csv"), "-o", str(folder / "r.csv")]
    assert main([*back, "--inverse", "--quiet", "--overwrite"]) == 0
    found = pd.read_csv(folder / "r.csv")
    placed = flat["location"] != "outside"
    folded = found.loc[placed, [f"folded_{axis}" for axis in "xyz"]]
    # Rounding of coordinates of 30 blocks, written with all digits.
    np.testing.assert_allclose(folded, samples[placed.to_numpy()], atol=1e-9)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--slips", "t.csv"], "--slips is of faults: give --faults or --fault-blocks too"),
        (["--fault-blocks", "q"], "no column 'q'"),
        (["--faults", "F1.ts", "--slip-direction", "F1=x"], "--slip-direction must be NAME="),
        (["--faults", "F1.ts", "--slip-direction", "F9=1/2"], "there is no fault 'F9'; given: F1"),
        (["--faults", "F1.ts", "--by", "part"], "--by unfolds domains one by one"),
        (["--faults", "F1.ts", "--method", "shear"], "shear"),
        (["--faults", "gone.ts"], "gone.ts"),
    ],
)
def test_one_line_for_what_cannot_be(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    own = [str(folder / w) if w.endswith((".ts", ".csv")) else w for w in words]
    status = main(["unfold", str(folder / "b.csv"), "-o", str(folder / "z.csv"), *own, "--quiet"])
    [line] = capsys.readouterr().err.strip().splitlines()
    assert status == 2
    assert message in line
    assert not (folder / "z.csv").exists()
