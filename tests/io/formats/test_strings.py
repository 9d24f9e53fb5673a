"""Strings: DXF lines against ezdxf, Surpac string files against the published layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.errors import InputError
from geounfold.io import holds_surface, read_points, read_surface
from geounfold.io.formats import Strings
from geounfold.io.strings import holds_strings, read_strings, write_strings
from tests.io.formats.samples import needs
from tests.shapes import grid_cells

# As the layout is published: y before x; a point of string 0 ends a string, END the file.
SURPAC = """\
outlines, 01-Jan-24, , ore outlines
0, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000
1, 6815765.250, 412295.500, 1505.000, hw, ore
1, 6815775.250, 412295.500, 1515.000, hw
0, 0.000, 0.000, 0.000,
7, 100.000, 20.000, -3.500,
7, 100.000, 21.000, -3.500,
7, 100.000, 20.000, -3.500,
0, 0.000, 0.000, 0.000,
1, 5.000, 4.000, 3.000,
1, 6.000, 4.000, 3.000,
0, 0.000, 0.000, 0.000, END
"""
LINES = [
    [[412295.5, 6815765.25, 1505.0], [412295.5, 6815775.25, 1515.0]],
    [[20.0, 100.0, -3.5], [21.0, 100.0, -3.5], [20.0, 100.0, -3.5]],
    [[4.0, 5.0, 3.0], [4.0, 6.0, 3.0]],
]


def lines(strings: Strings) -> list[list[list[float]]]:
    return [part.tolist() for part in np.split(strings.xyz, strings.first[1:-1])]


def test_surpac_strings(tmp_path: Path) -> None:
    path = tmp_path / "s.str"
    path.write_text(SURPAC)
    strings = read_strings(path)
    assert lines(strings) == LINES
    assert strings.names == ("1", "7", "1")
    assert holds_strings(path)
    table = read_points(path)
    assert table.points.tolist() == [point for line in LINES for point in line]
    assert table.frame["string"].tolist() == [1, 1, 2, 2, 2, 3, 3]
    assert table.frame["d2"].tolist() == ["ore", "", "", "", "", "", ""]
    write_strings(tmp_path / "t.str", strings)
    again = read_strings(tmp_path / "t.str")
    assert lines(again) == LINES
    assert again.names == strings.names


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name\n0, 0, 0, 0, 0, 0, 0\n1, two, 3, 4,\n", "line 3 is not a point.*'1, two, 3, 4,'"),
        ("name\n0, 0, 0, 0, 0, 0, 0\n1, 2\n", "line 3 is not a point"),
        ("name\n0, 0, 0, 0, 0, 0, 0\n0, 0, 0, 0, END\n", "holds no points"),
        ("x,y,z\n1,2,3\n", "is not a Surpac string file"),
    ],
)
def test_damaged_surpac_strings_are_refused(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "s.str").write_text(content)
    with pytest.raises(InputError, match=words):
        read_strings(tmp_path / "s.str")


def drawing(path: Path, *, within: bool = False, faces: bool = False) -> Path:
    """Write a drawing with a line, 2D and 3D polylines, one of them closed, by its own library."""
    import ezdxf

    made = ezdxf.new("R2010")
    made.units = 6
    space = made.blocks.new("B") if within else made.modelspace()
    space.add_line((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), dxfattribs={"layer": "fault"})
    space.add_lwpolyline(
        [(0, 0), (1, 0), (1, 1)], close=True, dxfattribs={"elevation": 7.5, "layer": "pit"}
    )
    space.add_polyline3d([(0, 0, 1 / 3), (2, 0, 1), (2, 2, 0.1)], dxfattribs={"layer": "ore"})
    space.add_point((9, 9, 9))
    if faces:
        space.add_3dface([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    if within:
        made.modelspace().add_blockref("B", (100.0, 0.0, 0.0))
    made.saveas(path)
    return path


def expected(shift: float = 0.0) -> list[list[list[float]]]:
    every = [
        [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        [[0.0, 0.0, 7.5], [1.0, 0.0, 7.5], [1.0, 1.0, 7.5], [0.0, 0.0, 7.5]],
        [[0.0, 0.0, 1 / 3], [2.0, 0.0, 1.0], [2.0, 2.0, 0.1]],
    ]
    return [[[x + shift, y, z] for x, y, z in line] for line in every]


@pytest.mark.parametrize("within", [False, True])
def test_dxf_lines_are_strings(tmp_path: Path, within: bool) -> None:
    needs(".dxf")
    path = drawing(tmp_path / "d.dxf", within=within)
    strings = read_strings(path)
    assert lines(strings) == expected(100.0 if within else 0.0)
    assert strings.names == ("fault", "pit", "ore")
    assert strings.meta == {"unit": "m"}
    assert holds_strings(path)
    assert not holds_surface(path)
    assert read_points(path).frame["name"].tolist()[:3] == ["fault", "fault", "pit"]
    write_strings(tmp_path / "e.dxf", strings)
    again = read_strings(tmp_path / "e.dxf")
    assert lines(again) == lines(strings)
    assert again.names == strings.names


def test_faces_within_a_block_are_a_surface(tmp_path: Path) -> None:
    needs(".dxf")
    path = drawing(tmp_path / "d.dxf", within=True, faces=True)
    assert holds_surface(path)
    assert not holds_strings(path)
    corners = [[100.0, 0.0, 0.0], [101.0, 0.0, 0.0], [100.0, 1.0, 0.0]]
    assert read_surface(path).V.tolist() == corners


@pytest.mark.parametrize("kind", [".dxf", ".str"])
def test_strings_are_carried_with_a_map(tmp_path: Path, monkeypatch, kind: str) -> None:
    """A flat slab's map keeps lengths, so that strings keep theirs."""
    needs(kind)
    monkeypatch.chdir(tmp_path)
    pd.DataFrame(grid_cells(24, 18, 4) * 10.0, columns=list("xyz")).to_csv("m.csv", index=False)
    assert main(["unfold", "m.csv", "-o", "o.csv", "--map", "m.npz", "--quiet"]) == 0
    points = np.array([[50.0, 60, 5], [90, 60, 15], [90, 90, 25], [60, 60, 10], [70, 80, 20]])
    given = Strings(points, np.array([0, 3, 5]), ("3", "8"))
    write_strings(f"s{kind}", given)
    for out in (f"flat{kind}", "flat.vtp", "flat.csv"):
        assert main(["map", "m.npz", f"s{kind}", "-o", out]) == 0
    flat = read_strings(f"flat{kind}")
    assert flat.names == given.names
    assert flat.first.tolist() == [0, 3, 5]
    lengths = [np.linalg.norm(np.diff(s.xyz[:3], axis=0), axis=1) for s in (given, flat)]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=1e-3)
    table = pd.read_csv("flat.csv")
    np.testing.assert_allclose(
        table[["unfolded_x", "unfolded_y", "unfolded_z"]], flat.xyz, rtol=0, atol=1e-9
    )
    far = Strings(points + 1e5, given.first, given.names)
    write_strings(f"far{kind}", far)
    assert main(["map", "m.npz", f"far{kind}", "-o", f"no{kind}"]) == 2
