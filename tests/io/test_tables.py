"""Tables, surfaces and outputs: nothing changes on the way through, nothing appears by half."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from geounfold.errors import InputError, MissingDependencyError, OptionError, OutputError
from geounfold.io import (
    TABLE_ENDINGS,
    Outputs,
    coordinate_columns,
    read_points,
    read_surface,
    read_table,
    replacing,
    write_json,
    write_table,
)
from geounfold.io.coordinate_columns import coded, coded_told, parse_columns
from geounfold.io.tables import files as tables_module

EDGES = [0.1 + 0.2, 1 / 3, 625387.5, 1e-300, -0.0, 5e-324, 1.7976931348623157e308, 2.0**53 + 2]


def _csv(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


# ---------------------------------------------------------------------------------- columns


@pytest.mark.parametrize(
    "names",
    [
        "centroid_x centroid_y centroid_z",
        "x y z",
        "X Y Z",
        "XC YC ZC",
        "xc YC Zc",
        "xcentre ycentre zcentre",
        "XCENTER YCENTER ZCENTER",
        "x_centre y_centre z_centre",
        "easting northing elevation",
        "Easting Northing RL",
        "EAST NORTH ELEV",
        "x_(m) y_(m) z_(m)",
        "mid_x mid_y mid_z",
        "X Y Elevation",
    ],
)
def test_columns_are_recognised(names: str) -> None:
    a, b, c = names.split()
    others = ["id", "XINC", "true_x", "true_y", "true_z", "unfolded_x", "nx", "ny", "nz"]
    assert coordinate_columns([*others, c, a, b]) == (len(others) + 1, len(others) + 2, len(others))


def test_coordinates_beside_another_height_are_no_question() -> None:
    assert coordinate_columns(["x", "y", "z", "elevation"]) == (0, 1, 2)


def test_named_columns_go_before_recognised_ones() -> None:
    names = ["x", "y", "z", "A", "b,c", "D"]
    assert coordinate_columns(names, parse_columns('D,"b,c",a')) == (5, 4, 3)


def test_exact_name_goes_before_letter_case() -> None:
    assert coordinate_columns(["X", "x", "y", "z"], ("x", "y", "z")) == (1, 2, 3)


@pytest.mark.parametrize("text", ["", "x", "x,y", "x,y,z,w", "x,x,y", "x,,z"])
def test_columns_option_needs_three_names(text: str) -> None:
    with pytest.raises(OptionError, match="three different"):
        parse_columns(text)


def test_two_spellings_of_one_column_are_not_two() -> None:
    with pytest.raises(InputError, match="not three columns"):
        coordinate_columns(["a", "b"], ("a", "A", "b"))


# ----------------------------------------------------------------------------------- reading


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,n\n1,2,3,a\n4,5,6,b\n",
        "\ufeffx,y,z,n\n1,2,3,a\n4,5,6,b\n",
        "x;y;z;n\n1;2;3;a\n4;5;6;b\n",
        "x\ty\tz\tn\n1\t2\t3\ta\n4\t5\t6\tb\n",
        "x,y,z,n\r\n1,2,3,a\r\n4,5,6,b\r\n",
        "x,y,z,n\r1,2,3,a\r4,5,6,b\r",
        '"x","y","z","n"\n"1","2","3","a"\n"4","5","6","b"\n',
        "\n\nx,y,z,n\n1,2,3,a\n\n4,5,6,b",
        " x , y , z ,n\n 1 , 2 , 3 ,a\n4.0,+5,6e0,b\n",
    ],
    ids=["plain", "bom", "semicolon", "tab", "crlf", "cr", "quoted", "blank lines", "spaces"],
)
def test_dialects(text: str, tmp_path: Path) -> None:
    table = read_points(_csv(tmp_path / "p.csv", text))
    assert table.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert list(table.frame.columns) == ["x", "y", "z", "n"]
    assert table.frame["n"].tolist() == ["a", "b"]


def test_values_pass_through_as_text(tmp_path: Path) -> None:
    lines = [
        "hole,x,y,z,grade,note,,hole",
        '007,625387.50,1e3,.5,,"a, ""b""",1,NA',
        "12345678901234567890,-0,2,3,1.10,été,,n/a",
    ]
    path = _csv(tmp_path / "p.csv", "\n".join([*lines, ""]))
    table = read_points(path)
    table.write(tmp_path / "q.csv", {"w": np.array([0.1, np.nan])})
    out = (tmp_path / "q.csv").read_text("utf-8").split("\n")
    assert out == [lines[0] + ",w", lines[1] + ",0.1", lines[2] + ",", ""]


def test_text_in_the_last_of_many_rows_is_named(tmp_path: Path) -> None:
    body = "1,2,3\n" * 50_000
    path = _csv(tmp_path / "p.csv", f"x,y,z\n{body}1,2,three\n")
    with pytest.raises(InputError, match="data row 50001 has 'three'"):
        read_points(path)


def test_invalid_rows_can_be_dropped(tmp_path: Path) -> None:
    path = _csv(tmp_path / "p.csv", "id,x,y,z\na,1,2,3\nb,,2,3\nc,4,5,6\nd,1,inf,3\n")
    table = read_points(path, drop_invalid=True)
    assert table.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert table.frame["id"].tolist() == ["a", "c"]
    assert table.dropped.tolist() == [2, 4]
    facts = table.facts()
    assert (facts["rows"], facts["dropped_invalid"], facts["dropped_rows"]) == (4, 2, [2, 4])


def test_codes_of_missing_coordinates_are_known_by_their_place(tmp_path: Path) -> None:
    values = np.array([0.0, 100, 200, 300, 400, -99])
    # 99 below a body of 400 lies apart by more than a tenth of it; so does no -999 beside -1000.
    assert np.flatnonzero(coded(values)).tolist() == [5]
    assert np.flatnonzero(coded(values, np.array([-999.0]))).tolist() == []
    assert not coded(np.array([-999.0, -990, -900, -600])).any()
    assert coded(np.array([5e5, 5e5, 9999999, -99.99])).tolist() == [False, False, True, True]
    assert not coded(np.array([-999.0, -999.0])).any()  # there is no other place
    pd.DataFrame({"x": values, "y": 1.0, "z": [1, 2, 3, -99, 5, 6]}).to_csv(tmp_path / "c.csv")
    with pytest.raises(InputError, match=r"2 of 6 rows have a missing .* data rows 4, 6 "):
        read_points(tmp_path / "c.csv", missing=(-99,))
    table = read_points(tmp_path / "c.csv", missing=(-99,), drop_invalid=True)
    assert table.points[:, 2].tolist() == [1, 2, 3, 5]
    assert coded_told(
        read_points(tmp_path / "c.csv").points, table.columns, lambda: np.arange(1, 7)
    ) == (
        "2 rows have -99 as x and z, far from all others, perhaps a code for a missing value: data "
        'rows 4, 6; --missing -99 --drop-invalid, or --where "x!=-99", leaves such rows out'
    )
    # A place that is declared a code, among others, stays one.
    pd.DataFrame({"x": np.arange(-150.0, 0, 10) + 1, "y": 1, "z": 2}).to_csv(tmp_path / "d.csv")
    assert len(read_points(tmp_path / "d.csv", missing=(-99,))) == 15


def test_duplicates_are_kept_and_counted(tmp_path: Path) -> None:
    path = _csv(tmp_path / "p.csv", "x,y,z\n1,2,3\n1,2,3\n4,5,6\n1,2,3.0\n")
    table = read_points(path)
    assert len(table) == 4
    assert table.duplicates == 2


def test_preferred_columns(tmp_path: Path) -> None:
    path = _csv(tmp_path / "p.csv", "x,y,z,u,v,w\n1,2,3,4,5,6\n")
    assert read_points(path, prefer=(("a", "b", "c"), ("u", "v", "w"))).points.tolist() == [
        [4, 5, 6]
    ]
    assert read_points(path, prefer=(("a", "b", "c"),)).points.tolist() == [[1, 2, 3]]


def test_other_columns_as_numbers(tmp_path: Path) -> None:
    table = read_points(_csv(tmp_path / "p.csv", "x,y,z,g,n\n1,2,3,NA,a\n1,2,4,1.5,b\n"))
    np.testing.assert_array_equal(table.numbers("g"), [np.nan, 1.5])
    with pytest.raises(InputError, match="no column 'h'"):
        table.numbers("h")
    with pytest.raises(InputError, match="'n' is not numeric"):
        table.numbers("n")


# ----------------------------------------------------------------------------------- writing


@pytest.mark.parametrize("kind", TABLE_ENDINGS)
@settings(max_examples=25, deadline=None)
@given(
    values=arrays(
        np.float64,
        st.tuples(st.integers(1, 20), st.just(3)),
        elements=st.floats(-1e15, 1e15, allow_nan=False),
    )
)
def test_floats_come_back_bit_for_bit(
    kind: str, values: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> None:
    if kind == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("t") / f"p{kind}"
    write_table(path, pd.DataFrame(values, columns=list("xyz")))
    assert read_points(path).points.tobytes() == values.tobytes()


@pytest.mark.parametrize("kind", TABLE_ENDINGS)
def test_extreme_floats_come_back(kind: str, tmp_path: Path) -> None:
    if kind == ".parquet":
        pytest.importorskip("pyarrow")
    frame = pd.DataFrame({"x": 1.0, "y": 2.0, "z": 3.0, "v": [*EDGES, np.nan]})
    write_table(tmp_path / f"p{kind}", frame)
    back = read_points(tmp_path / f"p{kind}").numbers("v")
    assert back[:-1].tobytes() == np.array(EDGES).tobytes()
    assert np.isnan(back[-1])


def test_results_replace_columns_of_their_name(tmp_path: Path) -> None:
    path = _csv(tmp_path / "p.csv", "x,w,y,z,w,location\n1,a,2,3,b,pit\n")
    frame = read_points(path).with_columns({"location": ["inside"], "w": [0.5], "v": [1.5]})
    assert list(frame.columns) == ["x", "w", "y", "z", "location", "v"]
    assert frame["location"].tolist() == ["inside"]
    assert frame["w"].tolist() == [0.5]


def test_a_table_from_csv_gets_types_in_parquet(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    text = "x,y,z,n,id,code,g,e\n1,2,3.5,4,007,a,,\n4,5,6.5,,008,b,1e3,\n"
    read_points(_csv(tmp_path / "p.csv", text)).write(tmp_path / "q.parquet", {"w": [0.5, 1.5]})
    back = pd.read_parquet(tmp_path / "q.parquet")
    assert back["x"].tolist() == [1, 4]
    assert str(back["x"].dtype) == "int64"
    assert back["z"].tolist() == [3.5, 6.5]
    assert back["n"][0] == 4
    assert pd.isna(back["n"][1])
    assert back["id"].tolist() == ["007", "008"]  # a name, not the number seven
    assert back["code"].tolist() == ["a", "b"]
    assert back["g"][1] == 1000.0


def test_parquet_keeps_types_and_order(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame(
        {
            "when": pd.to_datetime(["2024-01-02", None]),
            "z": np.array([1, 2], dtype=np.float32),
            "big": pd.array([2**60 + 1, None], dtype="Int64"),
            "x": [1, 2],
            "y": [0.5, 1.5],
            "word": ["007", None],
        },
        index=pd.Index(["a", "b"], name="key"),
    )
    frame.to_parquet(tmp_path / "p.parquet")
    table = read_points(tmp_path / "p.parquet")
    assert table.points.tolist() == [[1, 0.5, 1], [2, 1.5, 2]]
    table.write(tmp_path / "q.parquet", {"w": np.array([1.0, 2.0])})
    back = read_table(tmp_path / "q.parquet").frame
    assert list(back.columns) == ["when", "z", "big", "x", "y", "word", "key", "w"]
    assert back["big"][0] == 2**60 + 1
    assert pd.isna(back["big"][1])
    assert str(back["z"].dtype) == "float[pyarrow]"
    assert "timestamp" in str(back["when"].dtype)
    table.write(tmp_path / "q.csv", {})
    assert (tmp_path / "q.csv").read_text().split("\n")[2] == ",2.0,,2,1.5,,b"


def test_parquet_without_pyarrow_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    _csv(tmp_path / "p.parquet", "PAR1")
    with pytest.raises(MissingDependencyError, match=r"pip install 'geounfold\[parquet\]'"):
        read_table(tmp_path / "p.parquet")


def test_gzip_does_not_tell_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = pd.DataFrame({"x": [1.5]})
    write_table(tmp_path / "a.csv.gz", frame)
    monkeypatch.setattr(tables_module.gzip.time, "time", lambda: 2e9)
    write_table(tmp_path / "b.csv.gz", frame)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()


def test_a_lone_blank_value_is_a_row(tmp_path: Path) -> None:
    write_table(tmp_path / "p.csv", pd.DataFrame({"x": [np.nan, 1.0]}))
    assert len(pd.read_csv(tmp_path / "p.csv")) == 2


def test_json_has_no_nan(tmp_path: Path) -> None:
    content = {"a": np.float64("nan"), "b": (np.int64(1), np.bool_(True)), 3: {"c": np.ones(2)}}
    write_json(tmp_path / "s.json", content)
    import json

    assert json.loads((tmp_path / "s.json").read_text()) == {
        "a": None,
        "b": [1, True],
        "3": {"c": [1.0, 1.0]},
    }


# ----------------------------------------------------------------------------------- outputs


def _outputs(folder: Path, *, overwrite: bool = False, **names: str) -> Outputs:
    wanted = {name: (folder / file, ()) for name, file in names.items()}
    return Outputs.planned(wanted, overwrite=overwrite)


@pytest.mark.parametrize("stop", [ValueError, KeyboardInterrupt, SystemExit])
def test_an_early_end_leaves_everything_as_it_was(
    stop: type[BaseException], tmp_path: Path
) -> None:
    (tmp_path / "a").write_text("old")
    outputs = _outputs(tmp_path, a="a", b="b", overwrite=True)

    def run() -> None:
        with outputs.writing() as parts:
            parts["a"].write_text("new")
            raise stop

    with pytest.raises(stop):
        run()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "old"}


def test_outputs_appear_together(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    outputs = _outputs(tmp_path, a="a.csv", b="sub/b.csv")
    with outputs.writing() as parts:
        parts["a"].write_text("1")
        assert parts["a"].name == "a.csv"  # writers look at the ending
        parts["b"].write_text("2")
        assert not (tmp_path / "a.csv").exists()
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["a.csv", "b.csv", "sub"]


def test_an_output_that_was_not_written_stops_all(tmp_path: Path) -> None:
    outputs = _outputs(tmp_path, a="a", b="b")

    def run() -> None:
        with outputs.writing() as parts:
            parts["a"].write_text("1")

    with pytest.raises(OutputError, match="nothing was changed"):
        run()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("links", [True, False], ids=["hard links", "no hard links"])
def test_a_file_that_appears_meanwhile_is_kept(
    links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", _refuse(errno.EPERM))
    outputs = _outputs(tmp_path, a="a", b="b")

    def run() -> None:
        with outputs.writing() as parts:
            parts["a"].write_text("1")
            parts["b"].write_text("2")
            (tmp_path / "b").write_text("theirs")

    with pytest.raises(OutputError, match="appeared meanwhile"):
        run()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"b": "theirs"}


def test_without_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "link", _refuse(errno.EPERM))
    with replacing(tmp_path / "a") as part:
        part.write_text("1")
    assert (tmp_path / "a").read_text() == "1"


def test_a_full_disk_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", _refuse(errno.ENOSPC))

    def run() -> None:
        with replacing(tmp_path / "a") as part:
            part.write_text("1")

    with pytest.raises(OutputError, match=r"cannot write .*a: No space left on device"):
        run()
    assert list(tmp_path.iterdir()) == []


def _refuse(code: int) -> Callable[..., None]:
    def refuse(*_: object) -> None:
        raise OSError(code, os.strerror(code))

    return refuse


def test_replacing_keeps_mode_and_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "real").chmod(0o640)
    (tmp_path / "link").symlink_to("real")
    with replacing(tmp_path / "link", overwrite=True) as part:
        part.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"
    assert stat.S_IMODE((tmp_path / "real").stat().st_mode) == 0o640


# ---------------------------------------------------------------------------------- surfaces

# Coordinates with an offset of 10^6 and a tenth, which single precision cannot hold.
VERTICES = np.array([[0.1, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]]) + np.array([[6e5, 2e6, 0]])
FACES = [[0, 1, 2], [1, 3, 2]]


@pytest.mark.parametrize("kind", ["ply", "obj", "off"])
def test_mesh_files(kind: str, tmp_path: Path) -> None:
    v = [" ".join(map(repr, row)) for row in VERTICES.tolist()]
    f = [" ".join(map(str, row)) for row in FACES]
    texts = {
        "obj": [*("v " + r for r in v), "f 1 2 3", "f 2 4 3"],
        "off": ["OFF", "4 2 0", *v, *("3 " + r for r in f)],
        "ply": [
            *("ply", "format ascii 1.0", "element vertex 4"),
            *(f"property double {axis}" for axis in "xyz"),
            *("element face 2", "property list uchar int vertex_indices", "end_header"),
            *v,
            *("3 " + r for r in f),
        ],
    }
    path = _csv(tmp_path / f"t.{kind}", "\n".join([*texts[kind], ""]))
    mesh = read_surface(path)
    # Every text number is read in double precision: 1e-9 of 10^6 m is a thousand ulps.
    np.testing.assert_allclose(mesh.V, VERTICES, rtol=0, atol=1e-9)
    assert mesh.F.tolist() == FACES


@pytest.mark.parametrize(("names", "base"), [("v1,v2,v3", 1), ("v0,v1,v2", 0)])
def test_table_of_vertices_and_triangles(names: str, base: int, tmp_path: Path) -> None:
    rows = [",".join(map(repr, row)) for row in VERTICES.tolist()]
    faces = [",".join(str(v + base) for v in face) for face in FACES]
    lines = [f"{row},{face}" for row, face in zip(rows, [*faces, ",,", ",,"], strict=True)]
    path = _csv(tmp_path / "t.csv", "\n".join([f"x,y,z,{names}", *lines]))
    mesh = read_surface(path)
    assert mesh.V.tobytes() == VERTICES.tobytes()
    assert mesh.F.tolist() == FACES


def test_points_alone_are_draped(tmp_path: Path) -> None:
    u, v = (a.ravel() for a in np.meshgrid(np.arange(12.0), np.arange(9.0)))
    points = np.column_stack([u, v, 2 * np.sin(u / 4)])
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    write_table(tmp_path / "t.csv", pd.DataFrame(points @ turn, columns=list("xyz")))
    mesh = read_surface(tmp_path / "t.csv")
    # 11 x 8 cells of two triangles each, over every point, all turned to one side.
    assert len(mesh.F) == 176
    assert len(mesh.V) == 108
    a, b, c = (mesh.V[mesh.F[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    assert (normals @ normals.mean(axis=0) > 0).all()


def test_points_alone_must_not_overhang(tmp_path: Path) -> None:
    angle, along = (a.ravel() for a in np.meshgrid(np.linspace(0, 6, 40), np.arange(20.0)))
    points = np.column_stack([5 * np.cos(angle), along, 5 * np.sin(angle)])
    write_table(tmp_path / "t.csv", pd.DataFrame(points, columns=list("xyz")))
    with pytest.raises(InputError, match="overhang"):
        read_surface(tmp_path / "t.csv")
