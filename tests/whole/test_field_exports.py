"""Field inputs 01, 02, 04, 05, 14, 17 to 21 and 26: exports, units, strings, split blocks.

Each test runs the command of the input's CMD.txt and compares with what its EXPECT.txt states. Most
inputs hold the common body of 4,005 blocks; they must unfold as `base.csv` does.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial import cKDTree

from geounfold.cli import main
from geounfold.geometry.mesh import Floats
from geounfold.io import read_points
from geounfold.io.strings import read_strings
from tests.io.formats.samples import needs
from tests.places import shared

FLAT = ["unfolded_x", "unfolded_y", "unfolded_z"]
SIDE = 10.0


def given(name: str, file: str) -> Path:
    return shared("field", "inputs", name) / file


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@cache
def base() -> tuple[Floats, Floats]:
    """Return the centroids of the common body and its unfolded ones."""
    path = given("base", "base.csv")
    assert main(["unfold", str(path), "-o", "base.csv", "--quiet"]) == 0
    return read_points(path).points, pd.read_csv("base.csv")[FLAT].to_numpy()


def unfolded(path: Path) -> tuple[Floats, Floats]:
    """Return the points of an input and their unfolded ones, by the command."""
    assert main(["unfold", str(path), "-o", "o.csv"]) == 0
    return read_points(path).points, pd.read_csv("o.csv")[FLAT].to_numpy()


@pytest.mark.parametrize(
    ("name", "file", "note"),
    [
        ("01_leapfrog_hash_header", "leapfrog.csv", "7 comment lines above the names skipped"),
        ("01_leapfrog_hash_header", "leapfrog1.csv", "1 comment line above the names skipped"),
        ("02_vulcan_4_header_rows", "vulcan.csv", "'Variable descriptions:'"),
        ("04_title_row", "title.csv", "'Resource model 2024 - final'"),
        ("05_micromine", "mm2.csv", ""),
        ("20_text_endings", "v.asc", "separated by blanks"),
        ("20_text_endings", "v.tsv", ""),
        ("20_text_endings", "v_tab.txt", ""),
        ("20_text_endings", "ore.vtk", ""),
        ("21_latin1", "e_latin-1.csv", "read as Windows-1252"),
    ],
)
def test_exports_unfold_as_the_common_body(name: str, file: str, note: str, capsys) -> None:
    truth, flat = base()
    points, found = unfolded(given(name, file))
    said = capsys.readouterr().err
    assert (f"geounfold: note: {given(name, file)}" in said) == bool(note)
    assert note in said
    away, row = cKDTree(points).query(truth)
    assert away.max() == 0
    # The order of rows changes sums in the last digits only.
    np.testing.assert_allclose(found[row], flat, rtol=0, atol=1e-9)


@pytest.mark.parametrize("file", ["split_all.csv", "split_2pc.csv"])
def test_18_split_blocks_unfold_as_the_common_body(file: str) -> None:
    truth, flat = base()
    points, found = unfolded(given("18_refined_blocks_fail", file))
    away, row = cKDTree(truth).query(points)
    assert away.max() < SIDE  # parts lie within their blocks
    whole = away == 0
    np.testing.assert_allclose(found[whole], flat[row[whole]], rtol=0, atol=1e-9)
    # The parts of a block lie around its image: the map bends little within a block.
    for axis in range(3):
        sums = np.bincount(row, found[:, axis], len(truth)) / np.bincount(row, None, len(truth))
        assert np.abs(sums - flat[:, axis]).max() < 0.02 * SIDE


@pytest.mark.parametrize("file", ["slab_strip1.csv", "slab_strip2.csv"])
def test_19_a_row_of_sub_blocks_on_an_edge_unfolds(file: str) -> None:
    """The slab is flat from z = 0 to 60, so a block's height is its stratigraphic coordinate."""
    path = given("19_subblock_edge_row", file)
    assert main(["unfold", str(path), "-o", "o.csv"]) == 0
    found = pd.read_csv("o.csv")
    assert (found["location"] == "inside").all()
    # Measured 0.015 and 0.012: a tenth of a block at the edge.
    assert (found["stratigraphic"] - found["ZC"] / 60).abs().max() < 0.02


def test_14_degrees_beside_metres_are_refused(capsys) -> None:
    assert main(["unfold", str(given("14_degrees_hang", "lonlat.csv")), "-o", "o.csv"]) == 2
    assert "x and y look like degrees" in capsys.readouterr().err


def test_17_strings_and_faces_in_a_block_are_carried() -> None:
    needs(".dxf")
    saved = str(given("base", "base.npz"))
    strings = given("17_dxf_strings", "strings.dxf")
    assert main(["map", saved, str(strings), "-o", "o.dxf"]) == 0
    assert main(["map", saved, str(strings), "-o", "o.csv"]) == 0
    folded, flat = read_strings(strings), read_strings("o.dxf")
    assert flat.first.tolist() == folded.first.tolist()
    np.testing.assert_allclose(pd.read_csv("o.csv")[FLAT], flat.xyz, rtol=0, atol=1e-9)
    assert main(["map", saved, str(given("17_dxf_strings", "inblock.dxf")), "-o", "w.dxf"]) == 0


def test_26_a_rotated_datamine_model_is_moved_to_the_world(capsys) -> None:
    """Its own coordinates are the common body's less X0, Y0; turning it turns the answer only."""
    path = given("26_datamine_rotated", "dmr.csv")
    assert main(["unfold", str(path), "-o", "o.csv"]) == 0
    said = capsys.readouterr().err
    assert "XC, YC, ZC are the rotated model's own coordinates" in said
    assert "--origin and --rotation" in said
    found = pd.read_csv("o.csv")
    angle = np.radians(30)
    x = 412000 + found["XC"] * np.cos(angle) + found["YC"] * np.sin(angle)
    y = 6815600 - found["XC"] * np.sin(angle) + found["YC"] * np.cos(angle)
    np.testing.assert_allclose(found["world_x"], x, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found["world_y"], y, rtol=0, atol=1e-6)
