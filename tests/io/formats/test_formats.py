"""All formats: round trips, units, damaged files."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import InputError, MissingDependencyError, OutputError
from geounfold.io import holds_surface, read_points, read_surface, write_surface
from geounfold.io.formats import FORMATS, find_format, point_endings, surface_endings
from geounfold.io.formats.registry import require
from geounfold.io.paths import TABLE_ENDINGS
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables.files import check_writable, write_table
from tests.io.formats.samples import (
    NEEDS,
    XYZ,
    by_corners,
    needs,
    needs_omf_1,
    points_frame,
    tetrahedron,
)


def test_each_ending_is_one_format() -> None:
    for what in ("reads_points", "writes_points", "reads_surface", "writes_surface"):
        endings = sum((getattr(f, what) for f in FORMATS), ())
        assert len(set(endings)) == len(endings)
        assert not set(endings) & set(TABLE_ENDINGS)


def test_every_module_offers_what_it_is_registered_for() -> None:
    for f in FORMATS:
        module = f.load()
        for kind in ("points", "surface"):
            for verb in ("read", "write"):
                if getattr(f, f"{verb}s_{kind}"):
                    frame = "frame" if kind == "points" else kind
                    assert hasattr(module, f"{verb}_{kind}") or hasattr(module, f"{verb}_{frame}")


def test_a_missing_library_is_named_with_its_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "ezdxf.render", None)
        with pytest.raises(MissingDependencyError, match=r"Odd.*ezdxf.*geounfold\[formats\]"):
            require("ezdxf.render", "Odd")
    for kind, name in NEEDS.items():
        if importlib.util.find_spec(name) is None:
            path = tmp_path / f"t{kind}"
            path.write_bytes(b"anything")
            if kind != ".omf":  # which is read without: see test_omf
                with pytest.raises(MissingDependencyError, match=name):
                    (read_surface if kind == ".dxf" else read_points)(path)
            if kind != ".dxf":
                with pytest.raises(MissingDependencyError, match=name):
                    check_writable(path, points_frame())


@pytest.mark.parametrize("kind", [".csv", ".csv.gz", ".parquet", *point_endings(writing=True)])
def test_points_come_back_bit_for_bit(tmp_path: Path, kind: str) -> None:
    needs(kind)
    frame = points_frame()
    before = frame.copy()
    path = tmp_path / f"p{kind}"
    write_table(path, frame, columns=("x", "y", "z"))
    pd.testing.assert_frame_equal(frame, before)  # the writer leaves its input alone
    table = read_points(path)
    np.testing.assert_array_equal(table.points, XYZ)
    assert list(table.frame.columns) == list(frame.columns)
    np.testing.assert_array_equal(table.numbers("au"), frame["au"])  # -999 is a value, NaN missing
    np.testing.assert_array_equal(table.numbers("count"), frame["count"])
    found = find_format(kind, "writes_points")
    if found is not None and found.numbers_only:
        # Codes in the order of the alphabet: blank, größer 1, ore.
        assert table.numbers("rock").tolist() == [2.0, 0.0, 1.0]
        assert "rock: 0=(blank) 1=größer_1 2=ore" in path.read_text(encoding="utf-8")
    else:
        assert table.frame["rock"].tolist() == ["ore", "", "größer 1"]


@pytest.mark.parametrize("kind", [".csv", ".parquet", *surface_endings(writing=True)])
def test_surfaces_come_back(tmp_path: Path, kind: str) -> None:
    needs(kind)
    mesh = tetrahedron()
    path = tmp_path / f"s{kind}"
    write_surface(path, mesh)
    again = read_surface(path)
    assert holds_surface(path) == (kind not in TABLE_ENDINGS)
    if kind == ".stl":  # single precision: half of the spacing of floats at 2.3 million, 0.25 / 2
        np.testing.assert_allclose(by_corners(again), by_corners(mesh), rtol=0, atol=0.125)
        assert len(again.V) == 4
    elif kind == ".dxf":  # no vertex numbers: the same triangles with the same orientation
        assert by_corners(again) == by_corners(mesh)
        assert len(again.V) == 4
    else:
        np.testing.assert_array_equal(again.V, mesh.V)
        np.testing.assert_array_equal(again.F, mesh.F)


@pytest.mark.parametrize("kind", [".vtu", ".vtp", ".vs", ".geoh5", ".omf"])
def test_unit_and_coordinate_reference_are_carried(tmp_path: Path, kind: str) -> None:
    needs(kind)
    if kind == ".omf":
        needs_omf_1()
    meta = {"unit": "ft", "crs": "EPSG:26711"}
    path = tmp_path / f"p{kind}"
    write_table(path, points_frame(), columns=("x", "y", "z"), meta=meta)
    # OMF 1 has no place for a coordinate reference.
    assert read_points(path).meta == ({"unit": "ft"} if kind == ".omf" else meta)


@pytest.mark.parametrize("kind", [".vtp", ".ts", ".geoh5", ".omf", ".dxf"])
def test_a_surfaces_unit_is_carried(tmp_path: Path, kind: str) -> None:
    needs(kind)
    write_surface(tmp_path / f"s{kind}", tetrahedron(), {"unit": "ft"})
    assert read_surface_with_meta(tmp_path / f"s{kind}")[1] == {"unit": "ft"}


def test_text_from_a_csv_gets_its_type(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("id,x,y,z,au\n007,1,2,3,0.5\nB,4,5,6,\n")
    table = read_points(tmp_path / "p.csv")
    table.write(tmp_path / "p.vtu", {"unfolded_x": np.array([9.0, 8.0])})
    again = read_points(tmp_path / "p.vtu")
    assert again.frame["id"].tolist() == ["007", "B"]
    np.testing.assert_array_equal(again.numbers("au"), [0.5, np.nan])
    np.testing.assert_array_equal(again.numbers("unfolded_x"), [9.0, 8.0])


def test_a_value_called_as_a_coordinate_is_renamed(tmp_path: Path) -> None:
    frame = pd.DataFrame({"X": [7.0], "XC": [1.0], "YC": [2.0], "ZC": [3.0]})
    write_table(tmp_path / "p.vtu", frame, columns=("XC", "YC", "ZC"))
    table = read_points(tmp_path / "p.vtu")
    assert table.points.tolist() == [[1.0, 2.0, 3.0]]
    assert table.numbers("X_value").tolist() == [7.0]


@pytest.mark.parametrize("kind", [".gslib", ".vs"])
def test_names_do_not_become_codes(tmp_path: Path, kind: str) -> None:
    frame = pd.DataFrame({"x": 0.0, "y": 0.0, "z": 0.0, "id": [f"B{k}" for k in range(101)]})
    with pytest.raises(OutputError, match="column 'id' has 101 different texts"):
        check_writable(tmp_path / f"p{kind}", frame)
    with pytest.raises(OutputError, match="column 'id' has 101 different texts"):
        write_table(tmp_path / f"p{kind}", frame)


BAD = {
    "p.gslib": [
        b"title\nmany\n",
        b"title\n3\nx\ny\nz\n1 2\n",
        b"t\n3\nx\ny\nz\n1 2 a\n",
        b"\xff\xfe",
    ],
    "p.vtu": [b"hello", b"<VTKFile type='UnstructuredGrid'>", b"\0\1\2"],
    "p.vtp": [b"hello"],
    "p.vti": [b"hello"],
    "p.vs": [b"hello", b"GOCAD VSet 1\nVRTX 1 2\n", b"GOCAD VSet 1\nEND\n"],
    "p.omf": [b"hello", b"\x84\x83\x82\x81OMF-v0.9.0" + bytes(44)],
    "p.geoh5": [b"hello", b"\x89HDF\r\n\x1a\n" + bytes(40)],
}


@pytest.mark.parametrize("name", BAD)
def test_damaged_points_are_one_line(name: str, tmp_path: Path) -> None:
    needs(Path(name).suffix)
    for content in BAD[name]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name) as caught:
            read_points(tmp_path / name)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("s.ts", b"GOCAD TSurf 1\nVRTX 1 0 0 0\nTRGL 1 2 3\n"),
        ("s.ts", b"GOCAD TSurf 1\nVRTX 1 0 0 0\nEND\n"),
        ("s.vtp", b"hello"),
        ("s.dxf", b"hello"),
        ("s.omf", b"hello"),
        ("s.geoh5", b"hello"),
        ("s.ply", b"hello"),
        ("s.csv", b"x,y,z,v1,v2,v3\n0,0,0,1,2,3\n,,,1,2,3\n1,0,0,,,\n"),
        ("s.csv", b"x,y,z,v1,v2,v3\n0,0,0,1,2,3\n1,0,0,,,\n1,1,,,,\n"),
    ],
)
def test_damaged_surfaces_are_one_line(name: str, content: bytes, tmp_path: Path) -> None:
    needs(Path(name).suffix)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=name) as caught:
        read_surface(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_unknown_endings(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="unknown kind of surface"):
        write_surface(tmp_path / "s.unknown", tetrahedron())
    said = {
        "p.unknown": r"the ending '.unknown' is none of the kinds that points .*: .*\.gslib",
        "p": "a file without an ending is none of the kinds that points are read from: .csv",
        "m.npz": "is a map of geounfold, and holds no points: were two files swapped",
        "s.json": "is a JSON file, such as a summary, and holds no points: were two files swapped",
        "b.xlsx": "is a spreadsheet: save the sheet as .csv",
        "b.dm": "is of a closed format: export it as .csv",
    }
    for name, message in said.items():
        (tmp_path / name).write_text("1 2 3")
        with pytest.raises(InputError, match=rf"{name}: {message}") as caught:
            read_points(tmp_path / name)
        assert len(str(caught.value).removeprefix(str(tmp_path))) < 170
    with pytest.raises(InputError, match=r"s.json: is a JSON file.* holds no surface: were two"):
        read_surface(tmp_path / "s.json")


def test_several_objects_of_different_systems(tmp_path: Path) -> None:
    one = "GOCAD VSet 1\nAXIS_UNIT {u} {u} {u}\nVRTX 1 0 0 0\nEND\n"
    (tmp_path / "p.vs").write_text(one.format(u="m") + one.format(u="ft"))
    with pytest.raises(InputError, match="different units"):
        read_points(tmp_path / "p.vs")
    (tmp_path / "p.vs").write_text(one.format(u="m") * 2)
    assert len(read_points(tmp_path / "p.vs")) == 2


@pytest.mark.parametrize("kind", [".vtu", ".vtp", ".gslib", ".vs", ".omf", ".ply", ".dxf"])
def test_a_full_disk_is_an_error(kind: str, tmp_path: Path) -> None:
    needs(kind)
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("there is no /dev/full on this system")
    path = tmp_path / f"f{kind}"
    path.symlink_to(full)
    write: Callable[[], None] = partial(write_table, path, points_frame(), columns=("x", "y", "z"))
    if kind in (".ply", ".dxf"):
        write = partial(write_surface, path, tetrahedron())
    with pytest.raises(OSError, match="No space left"):
        write()


def test_columns_that_are_called_alike_are_both_kept(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x,y,z,au,au\n1,2,3,4,5\n")
    for kind in (".vtu", ".gslib", ".vs"):
        read_points(tmp_path / "p.csv").write(tmp_path / f"p{kind}", {})
        again = read_points(tmp_path / f"p{kind}")
        assert (again.numbers("au")[0], again.numbers("au_2")[0]) == (4.0, 5.0)
