"""The command fill, and unfold on wireframes: what is written, told and refused."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.geometry.mesh import TriMesh
from geounfold.io import write_surface
from tests.body.fill.solids import ball, box
from tests.shapes import plane


@pytest.fixture
def solid(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    V, F = ball(16)
    write_surface("solid.ply", TriMesh(10 * V, F))
    write_surface("open.ply", TriMesh(10 * V, F[: len(F) // 2]))


def test_fill_writes_the_blocks_and_their_facts(solid, capsys):
    assert main(["fill", "solid.ply", "-o", "b.csv", "--block-size", "2,2,1", "--json"]) == 0
    blocks = pd.read_csv("b.csv")
    assert blocks.columns.tolist() == ["x", "y", "z", "dx", "dy", "dz"]
    assert (blocks[["dx", "dy", "dz"]].to_numpy() == [2, 2, 1]).all()
    facts = json.loads(capsys.readouterr().out)
    assert facts["blocks"] == len(blocks)
    assert facts["blocks_volume"] == pytest.approx(4 * len(blocks))


def test_fill_tells_the_size_that_it_chose(solid, capsys):
    assert main(["fill", "solid.ply", "-o", "b.csv"]) == 0
    assert "geounfold: note: solid.ply: blocks of 0.8 a side were chosen" in capsys.readouterr().err


def test_fill_takes_two_surfaces(solid):
    nodes, F = plane(10, 8)
    for name, z in (("t.ply", 3.0), ("b.ply", 0.0)):
        write_surface(name, TriMesh(np.column_stack([nodes, np.full(len(nodes), z)]), F))
    assert (
        main(["fill", "--top", "t.ply", "--bottom", "b.ply", "-o", "o.csv", "--block-size=1"]) == 0
    )
    assert len(pd.read_csv("o.csv")) == 10 * 8 * 3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("fill open.ply", "open.ply: the surface is not closed: 1 open border"),
        ("unfold open.ply", "by --top and --bottom"),
        ("unfold", "POINTS is missing: give block centroids or a closed surface"),
        (
            "unfold --faults f.ts p.csv",
            "POINTS is missing: --faults took all words behind it; if "
            "'p.csv' is the file that is missing, put it first",
        ),
        ("unfold --uncertainty p.csv", "--uncertainty took all words behind it; if 'p.csv'"),
        (
            "unfold --limits l.ts p.csv --faults f.ts",
            "--limits and --faults took all words behind them; if one of 'p.csv' and 'f.ts' is",
        ),
        ("view --colour p.csv", "--colour took all words behind it; if 'p.csv'"),
        ("fill", "fill needs SOLID, or --top and --bottom"),
        ("fill solid.ply --top open.ply", "fill needs SOLID, or --top and --bottom"),
        ("fill --top open.ply", "--top and --bottom belong together"),
        ("fill solid.ply --block-size a", "--block-size needs a number"),
        ("fill solid.ply --block-size 1,2", "--block-size needs one length or three"),
        ("fill solid.ply --block-size -1", "--block-size must be a number above 0"),
        ("fill solid.ply --block-size 0.001", "--block-size 0.001 x 0.001 x 0.001 makes about"),
        ("fill solid.ply --sub-blocks 3", "--sub-blocks needs 1, 2, 4 or 8"),
        ("fill none.ply", "none.ply: no such file"),
        ("unfold i.csv", "; i.csv: has columns from and to, as samples of drill-holes have"),
        ("unfold a.csv", "intervals of drill-holes have no place of their own: --holes COLLAR"),
        ("fill p.csv", "p.csv: holds points without triangles, which enclose nothing"),
        ("fill solid.ply --where x>3", "(--where is an option of unfold, map, estimate,"),
        ("unfold solid.ply --where x>1", "--where needs block centroids, not surfaces"),
        ("unfold solid.ply --origin 0,0,0", "--origin needs block centroids, not surfaces"),
        ("unfold p.csv --block-size 5", "--block-size needs a closed surface; p.csv holds points"),
    ],
)
def test_wrong_input_is_one_line(solid, capsys, words, said):
    pd.DataFrame(np.eye(3), columns=["x", "y", "z"]).to_csv("p.csv", index=False)
    samples = pd.DataFrame(np.eye(3, 5), columns=["from", "to", "x", "y", "z"])
    samples.to_csv("i.csv", index=False)
    samples[["from", "to"]].to_csv("a.csv", index=False)
    assert main([*words.split(), "-o", "out.csv"]) == 2
    line = capsys.readouterr().err
    assert said in line
    assert line.count("\n") == 1


def test_a_surface_is_not_drawn(solid, capsys):
    assert main(["view", "solid.ply", "-o", "p.png"]) == 2
    assert "solid.ply: is a surface; view draws points and maps (.npz)" in capsys.readouterr().err


def test_unfold_takes_a_solid_in_one_command(solid):
    """A gentle fold of constant thickness, as a closed mesh: the horizons are its own."""
    V, F = box((0, 0, 0), (60.0, 40.0, 8.0), cell=2.0)
    bent = np.column_stack([V[:, 0], V[:, 1], V[:, 2] + 6 * np.sin(V[:, 0] / 15)])
    write_surface("fold.obj", TriMesh(bent, F))
    words = ["unfold", "fold.obj", "-o", "flat.csv", "--summary", "s.json", "--block-size", "1"]
    assert main(words) == 0
    flat, summary = pd.read_csv("flat.csv"), json.loads(Path("s.json").read_text())
    assert summary["injective"]
    assert summary["hull"]["method"] == "solid"
    assert summary["solid"]["blocks"] == len(flat) == summary["points"]
    assert flat.block_volume.tolist() == [1.0] * len(flat)
    # The share of the height is the stratigraphic coordinate away from the rim.
    height = flat.z - 6 * np.sin(flat.x / 15)
    inner = flat.x.between(8, 52) & flat.y.between(8, 32)
    assert np.abs(flat.stratigraphic - height / 8)[inner].mean() < 0.01
