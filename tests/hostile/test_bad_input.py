"""Bad input: status 2, one clear line, nothing written and nothing lost."""

from __future__ import annotations

import gzip
import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main

# Root writes into folders that forbid it.
not_root = pytest.mark.skipif(
    getattr(os, "geteuid", lambda: 0)() == 0, reason="permissions do not bind root, nor Windows"
)

HAS_PIPES = hasattr(os, "mkfifo")
"""Whether the system has named pipes among its files; Windows does not."""

GOOD = "x,y,z\n" + "".join(f"{i % 5},{i // 5 % 5},{i // 25}\n" for i in range(75))
HEADER = "x,y,z\n"


class Bad(NamedTuple):
    """One bad input: the file's name and content, words of the message, more arguments."""

    what: str
    name: str
    content: str | bytes
    words: tuple[str, ...]
    args: tuple[str, ...] = ()


FILES = [
    Bad("empty file", "p.csv", "", ("empty",)),
    Bad("blank lines only", "p.csv", "\n\n \n", ("empty",)),
    Bad("empty parquet", "p.parquet", "", ("empty",)),
    Bad("header only", "p.csv", HEADER, ("no rows",)),
    Bad("header without line end", "p.csv", "x,y,z", ("no rows",)),
    Bad("unknown ending", "p.pdf", GOOD, (".pdf", ".csv.gz", ".parquet")),
    Bad("no ending", "points", GOOD, (".csv", ".parquet")),
    Bad("picture", "p.csv", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", ("not a table", "binary")),
    Bad("parquet called csv", "p.csv", b"PAR1\x15\x04\x15", ("Parquet", ".parquet")),
    Bad("gzip called csv", "p.csv", gzip.compress(GOOD.encode()), ("gzip", ".csv.gz")),
    Bad("spreadsheet", "p.csv", b"PK\x03\x04\x14\0", ("spreadsheet", "CSV")),
    Bad("utf-8 damaged", "p.csv", "x,y,z,é\n1,2,3,éé".encode() + b"\xe9\n", ("damaged", "UTF-8")),
    Bad("prose", "p.csv", "It was a dark\nand stormy night.\n", ("no coordinate columns",)),
    Bad("not gzip", "p.csv.gz", GOOD, ("damaged",)),
    Bad("cut gzip", "p.csv.gz", gzip.compress(GOOD.encode())[:-20], ("damaged",)),
    Bad("not parquet", "p.parquet", GOOD, ("not a Parquet table",)),
    Bad("more values than names", "p.csv", "x,y,z\n1,2,3,4\n", ("3 columns", "4 values")),
    Bad("one long row", "p.csv", "x,y,z\n1,2,3\n1,2,3,4,5\n", ("well-formed", "line 3")),
    Bad("quote left open", "p.csv", 'x,y,z,n\n1,2,3,"a\n4,5,6,b\n', ("well-formed",)),
    Bad("columns missing", "p.csv", "id,x,y\n1,2,3\n", ("no coordinate columns", "id, x, y")),
    Bad("no header", "p.csv", "1,2,3\n4,5,6\n", ("first row must name",)),
    Bad("two sets", "p.csv", "x,y,z,XC,YC,ZC\n1,2,3,1,2,3\n", ("ambiguous", "x/y/z", "XC/YC/ZC")),
    Bad("letter case", "p.csv", "x,y,z,X\n1,2,3,1\n", ("ambiguous", "x, X", "--columns")),
    Bad("name twice", "p.csv", "x,y,z,x\n1,2,3,1\n", ("ambiguous", "x, x")),
    Bad("no such column", "p.csv", GOOD, ("'q'", "x, y, z"), ("--columns", "x,y,q")),
    Bad("named twice", "p.csv", "a,b,c,a\n1,2,3,4\n", ("'a'", "2 times"), ("--columns", "a,b,c")),
    Bad("two columns", "p.csv", GOOD, ("three different", "x,y"), ("--columns", "x,y")),
    Bad("same column", "p.csv", GOOD, ("three different",), ("--columns", "x,y,y")),
    Bad("text", "p.csv", HEADER + "1,2,3\n1,two,3\n", ("'y'", "not numeric", "row 2", "'two'")),
    Bad("commas of thousands?", "p.csv", "x;y;z\n1,500;2;3\n", ("'1,500'", "point, not a comma")),
    Bad("comma and point", "p.csv", "x;y;z\n1,5;2;3\n2.5;2;3\n", ("'x'", "'2.5'", "with a point")),
    Bad("thousands", "p.csv", HEADER + '1,2,"1,234.5"\n', ("'1,234.5'", "thousands")),
    Bad("spaced thousands", "p.csv", HEADER + "1,2,1 234.5\n", ("thousands",)),
    Bad("underscore", "p.csv", HEADER + "1,2,1_000\n", ("not numeric", "'1_000'")),
    Bad("hexadecimal", "p.csv", HEADER + "1,2,0x1A\n", ("not numeric", "'0x1A'")),
    Bad("true", "p.csv", HEADER + "1,2,true\n", ("not numeric", "'true'")),
    Bad("units", "p.csv", HEADER + "1 m,2 m,3 m\n", ("'x'", "'1 m'")),
    Bad("date", "p.csv", HEADER + "2024-01-01,2,3\n", ("'2024-01-01'",)),
    Bad("line break inside", "p.csv", HEADER + '"1\nb",2,3\n', ("'1?b'",)),
    Bad("NaN", "p.csv", HEADER + "1,2,3\n1,nan,3\n", ("1 of 2", "data row 2", "--drop-invalid")),
    Bad("blank", "p.csv", HEADER + ",2,3\n1,2,\n", ("2 of 2", "data rows 1, 2")),
    Bad("NA", "p.csv", HEADER + "NA,2,3\n", ("data row 1",)),
    Bad("short row", "p.csv", HEADER + "1,2,3\n1,2\n", ("data row 2",)),
    Bad("infinite", "p.csv", HEADER + "1,2,3\n1,2,-inf\n", ("data row 2", "infinite")),
    Bad("1e400", "p.csv", HEADER + "1,2,1e400\n", ("data row 1", "infinite")),
    Bad("1e308", "p.csv", HEADER + "1,2,1e308\n", ("data row 1", "1e+15")),
    Bad(
        "many rows",
        "p.csv",
        HEADER + "1,2,\n" * 30,
        ("30 of 30", "data rows 1, 2, 3", "and 18 more"),
    ),
    Bad("all invalid", "p.csv", HEADER + "1,2,\n", ("no row",), ("--drop-invalid",)),
]


def _line(capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one line on stderr."""
    out, err = capsys.readouterr()
    assert out == ""
    assert err.endswith("\n")
    assert err.count("\n") == 1, err
    assert err.startswith("geounfold: error: ")
    return err


def _state(folder: Path) -> dict[str, bytes | None]:
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None
        for p in folder.rglob("*")
    }


@pytest.fixture
def fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Run a command that must fail with status 2 and change nothing; return its line."""
    monkeypatch.chdir(tmp_path)

    def run(argv: list[str], *words: str) -> str:
        before = _state(tmp_path)
        assert main(argv) == 2
        line = _line(capsys)
        for word in words:
            assert word in line
        assert _state(tmp_path) == before
        return line

    return run


@pytest.mark.parametrize("bad", FILES, ids=lambda bad: bad.what)
@pytest.mark.parametrize("overwritten", [False, True], ids=["new", "overwrite"])
def test_file(bad: Bad, overwritten: bool, tmp_path: Path, fails: Callable[..., str]) -> None:
    content = bad.content if isinstance(bad.content, bytes) else bad.content.encode()
    (tmp_path / bad.name).write_bytes(content)
    argv = ["unfold", bad.name, "-o", "out.csv", "--summary", "s.json", *bad.args]
    if overwritten:
        (tmp_path / "out.csv").write_text("precious")
        argv.append("--overwrite")
    fails(argv, bad.name if not bad.args or bad.args[0] != "--columns" else "", *bad.words)


def test_no_file(fails: Callable[..., str]) -> None:
    fails(["unfold", "nowhere.csv", "-o", "out.csv"], "nowhere.csv", "no such file")


def test_directory(tmp_path: Path, fails: Callable[..., str]) -> None:
    (tmp_path / "folder.csv").mkdir()
    fails(["unfold", "folder.csv", "-o", "out.csv"], "folder.csv", "is a directory")


def test_nul_in_a_name(fails: Callable[..., str]) -> None:
    fails(["unfold", "a\0b.csv", "-o", "out.csv"], "a?b.csv", "no such file")


@not_root
def test_unreadable_file(tmp_path: Path, fails: Callable[..., str]) -> None:
    path = tmp_path / "p.csv"
    path.write_text(GOOD)
    path.chmod(0)
    try:
        assert main(["unfold", "p.csv", "-o", "out.csv"]) == 2
    finally:
        path.chmod(0o600)


def test_cut_parquet(tmp_path: Path, fails: Callable[..., str]) -> None:
    pytest.importorskip("pyarrow")
    pd.DataFrame(np.eye(3), columns=list("xyz")).to_parquet(tmp_path / "p.parquet")
    whole = (tmp_path / "p.parquet").read_bytes()
    (tmp_path / "p.parquet").write_bytes(whole[: len(whole) // 2])
    fails(["unfold", "p.parquet", "-o", "out.csv"], "not a Parquet table")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ([True, False, True], "not numeric"),
        (pd.to_datetime(["2024-01-01"] * 3), "not numeric"),
        (["a", "b", "c"], "not numeric: data row 1 has 'a'"),
        ([1.0, None, 3.0], "data row 2"),
    ],
)
def test_parquet_values(
    values: list[object], words: str, tmp_path: Path, fails: Callable[..., str]
) -> None:
    pytest.importorskip("pyarrow")
    pd.DataFrame({"x": values, "y": 0.0, "z": 0.0}).to_parquet(tmp_path / "p.parquet")
    fails(["unfold", "p.parquet", "-o", "out.csv"], words)


# ------------------------------------------------------------------------------------ outputs


@pytest.fixture
def points(tmp_path: Path) -> Path:
    path = tmp_path / "p.csv"
    path.write_text(GOOD)
    return path


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["-o", "nowhere/out.csv"], ("nowhere", "no such folder")),
        (["-o", "p.csv/out.csv"], ("is a file, not a folder",)),
        (["-o", "old.csv"], ("old.csv", "exists already", "--overwrite")),
        (["-o", "out.csv", "--summary", "old.json"], ("old.json", "exists already")),
        (["-o", "folder"], ("is a directory",)),
        (["-o", "folder", "--overwrite"], ("is a directory",)),
        (["-o", "p.csv"], ("also an input",)),
        (["-o", "p.csv", "--overwrite"], ("also an input",)),
        (["-o", "./folder/../p.csv", "--overwrite"], ("also an input",)),
        (["-o", "link.csv", "--overwrite"], ("also an input",)),
        (["-o", "hard.csv", "--overwrite"], ("also an input",)),
        pytest.param(
            ["-o", "pipe.csv", "--overwrite"],
            ("not a regular file",),
            marks=pytest.mark.skipif(not HAS_PIPES, reason="Windows has no named pipes"),
        ),
        (["-o", "out.xlsx"], (".csv", ".parquet")),
        (["-o", "out.csv", "--map", "m.zip"], ("--map", ".npz")),
        (["-o", "out.csv", "--summary", "s.txt"], ("--summary", ".json")),
        (["-o", "out.csv", "--report", "r.pdf"], ("--report", ".html")),
        (["-o", "out.csv", "--samples", "old.csv"], ("--samples-out",)),
        (["-o", "out.csv", "--samples-out", "q.csv"], ("--samples",)),
        (
            ["-o", "out.csv", "--samples", "old.csv", "--samples-out", "out.csv"],
            ("--output and --samples-out name the same file",),
        ),
        (
            ["-o", "out.csv", "--samples", "old.csv", "--samples-out", "old.csv", "--overwrite"],
            ("--samples-out is also an input",),
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_output(
    argv: list[str],
    words: tuple[str, ...],
    tmp_path: Path,
    points: Path,
    fails: Callable[..., str],
) -> None:
    (tmp_path / "old.csv").write_text("precious")
    (tmp_path / "old.json").write_text("precious")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.csv").symlink_to(points)
    (tmp_path / "hard.csv").hardlink_to(points)
    if HAS_PIPES:
        os.mkfifo(tmp_path / "pipe.csv")
    fails(["unfold", "p.csv", *argv], *words)


def test_unwritable_folder(
    points: Path, monkeypatch: pytest.MonkeyPatch, fails: Callable[..., str]
) -> None:
    def refuse(*_: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "mkdir", refuse)
    fails(["unfold", "p.csv", "-o", "out.csv"], "cannot be written", "Permission denied")


@not_root
def test_read_only_folder(tmp_path: Path, points: Path, fails: Callable[..., str]) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    fails(["unfold", "p.csv", "-o", "locked/out.csv"], "locked", "cannot be written")


# ------------------------------------------------------------------------------------ options


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--"], ("COMMAND", "geounfold --help")),
        (["fold"], ("'fold'", "'unfold'", "geounfold --help")),
        (["unfold"], ("-o/--output",)),
        (["unfold", "-o", "o.csv"], ("POINTS",)),
        (["unfold", "p.csv", "-o"], ("-o/--output", "expected one argument")),
        (["unfold", "p.csv", "-o", "out.csv", "--frobnicate"], ("--frobnicate",)),
        (["unfold", "p.csv", "-o", "out.csv", "--summ", "s.json"], ("--summ",)),
        (["map", "p.csv"], ("POINTS",)),
        (["simulate"], ("CASE", "--list")),
        (["quality", "p.csv", "p.csv", "--neighbours", "0"], ("--neighbours", "'0'")),
    ],
    ids=" ".join,
)
def test_arguments(
    argv: list[str], words: tuple[str, ...], points: Path, fails: Callable[..., str]
) -> None:
    fails(argv, *words)


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--method", "magic", ("--method must be one of sheet, thesis", "'magic'")),
        ("--flattener", "iron", ("--flattener must be one of", "spring", "'iron'")),
        ("--hull", "balloon", ("--hull must be one of auto", "density", "'balloon'")),
        ("--split", "axe", ("--split must be one of", "signed", "normal", "'axe'")),
        ("--datum", "sea", ("--datum must be one of", "mid", "proportional", "'sea'")),
        ("--up", "0,0", ("--up must be a list of 3 numbers", "[0, 0]")),
        ("--up", "-1,x,0", ("--up must be a list of 3 numbers", "[-1, 'x', 0]")),
        ("--up", "0,0,0", ("--up must be", "not all 0")),
        ("--up", "nan,0,1", ("--up must be a list of 3 numbers",)),
        ("--reach", "far", ("--reach must be a number of 0 or more", "'far'")),
        ("--reach", "-1", ("--reach must be a number of 0 or more", "-1")),
        ("--body", "-1", ("--body", "all")),
        ("--body", "99", ("body", "all")),
        ("--body", "both", ("--body", "all")),
        ("--neighbours", "-3", ("--neighbours must be a whole number of 1 or more",)),
        ("--neighbours", "2.5", ("--neighbours must be a whole number", "2.5")),
    ],
)
def test_option_value(
    option: str, value: str, words: tuple[str, ...], points: Path, fails: Callable[..., str]
) -> None:
    fails(["unfold", "p.csv", "-o", "out.csv", f"{option}={value}"], *words)


# ----------------------------------------------------------------------------------- the body


def _blocks(nx: int, ny: int, nz: int) -> np.ndarray:
    axes = np.meshgrid(np.arange(nx), np.arange(ny), np.arange(nz), indexing="ij")
    return 10.0 * np.stack([a.ravel() for a in axes], axis=1)


def _ball(radius: int) -> np.ndarray:
    cube = _blocks(*[2 * radius + 1] * 3) - 10.0 * radius
    return cube[np.linalg.norm(cube, axis=1) <= 10.0 * radius]


_SLAB = _blocks(30, 20, 5)
_SLANT = np.array([[1, 0, 1], [0, 1, 1], [0, 0, 1.0]])
_BEND = np.array([0, 0, 80.0]) * np.sin(np.arange(1200)[:, None] // 30 / 6.0).round(1)
_TWO = np.concatenate([_SLAB, _SLAB + np.array([1000.0, 0, 0])])
BODIES = {
    "one point": (_blocks(1, 1, 1), ("1 distinct point", "at least")),
    "three points": (_blocks(3, 1, 1), ("3 distinct points", "at least")),
    "one place": (np.zeros((500, 3)), ("1 distinct point", "duplicates")),
    "line along an axis": (_blocks(200, 1, 1) + 5.0, ("one column", "y = 5")),
    "slanted line": (np.outer(np.arange(200.0), [1.0, 2, 3]), ("one line",)),
    "one column": (_blocks(1, 1, 200), ("one column", "x = 0")),
    "one block thick": (_blocks(40, 30, 1), ("plane", "two layers")),
    "slanted plane": (_blocks(40, 30, 1) @ _SLANT, ("plane", "two layers")),
    "bent, one block thick": (_blocks(40, 30, 1) + _BEND, ("one block thick", "two layers")),
    "cube": (_blocks(12, 12, 12), ("no two opposite surfaces", "sheet")),
    "ball": (_ball(8), ("no two opposite surfaces", "sheet")),
    "two bodies": (_TWO, ("2 separate bodies", "3000 blocks", "--body N", "--body all")),
}


@pytest.mark.parametrize("name", BODIES)
def test_body(name: str, tmp_path: Path, fails: Callable[..., str]) -> None:
    body, words = BODIES[name]
    pd.DataFrame(body, columns=list("xyz")).to_csv(tmp_path / "p.csv", index=False)
    fails(["unfold", "p.csv", "-o", "out.csv", "--summary", "s.json", "--map", "m.npz"], *words)


# --------------------------------------------------------------------------- maps and surfaces


@pytest.mark.parametrize(
    "content",
    [b"", b"hello", GOOD.encode(), b"PK\x03\x04" + bytes(100), b"\x80\x04K\x01."],
    ids=["empty", "text", "table", "cut archive", "pickle"],
)
def test_map_file(content: bytes, tmp_path: Path, points: Path, fails: Callable[..., str]) -> None:
    (tmp_path / "m.npz").write_bytes(content)
    fails(["map", "m.npz", "p.csv", "-o", "out.csv"], "m.npz")


def test_foreign_map_file(tmp_path: Path, points: Path, fails: Callable[..., str]) -> None:
    np.savez(tmp_path / "m.npz", a=np.arange(3))
    fails(["map", "m.npz", "p.csv", "-o", "out.csv"], "m.npz")


def test_no_map_file(points: Path, fails: Callable[..., str]) -> None:
    fails(["map", "m.npz", "p.csv", "-o", "out.csv"], "m.npz", "no such file")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("t.ply", "hello", ("t.ply", "not a surface")),
        ("t.obj", "", ("empty",)),
        ("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", ("no triangles",)),
        ("t.dwg", "0\nSECTION\n", (".dwg", ".ply")),
        ("t.csv", "x,y,z,v1,v2,v3\n0,0,0,1,2,4\n1,0,0,,,\n0,1,0,,,\n", ("triangle 1", "1 to 3")),
        ("t.csv", "x,y,z,v1,v2,v3\n0,0,0,1,2,2.5\n1,0,0,,,\n0,1,0,,,\n", ("triangle 1",)),
        ("t.csv", "x,y,z,v1,v2\n0,0,0,1,2\n1,0,0,,\n", ("v1, v2, v3",)),
        ("t.csv", "x,y,z\n0,0,0\n1,0,0\n", ("three points",)),
        ("t.csv", "x,y,z\n0,0,0\n1,0,0\n2,0,0\n", ("line",)),
    ],
)
def test_surface(
    name: str,
    content: str,
    words: tuple[str, ...],
    tmp_path: Path,
    points: Path,
    fails: Callable[..., str],
) -> None:
    (tmp_path / name).write_text(content)
    fails(["unfold", "p.csv", "-o", "out.csv", "--top", name], *words)


def test_no_surface_file(points: Path, fails: Callable[..., str]) -> None:
    fails(["unfold", "p.csv", "-o", "out.csv", "--bottom", "b.ply"], "b.ply", "no such file")


def test_rows_that_do_not_belong_together(
    tmp_path: Path, points: Path, fails: Callable[..., str]
) -> None:
    (tmp_path / "q.csv").write_text(HEADER + "1,2,3\n")
    fails(["quality", "p.csv", "q.csv"], "1 rows", "75")


def test_result_over_its_own_coordinates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from geounfold.errors import InputError
    from geounfold.io import read_points

    path = tmp_path / "p.csv"
    path.write_text("unfolded_x,unfolded_y,unfolded_z\n1,2,3\n")
    table = read_points(path, ("unfolded_x", "unfolded_y", "unfolded_z"))
    with pytest.raises(InputError, match="replace the coordinates"):
        table.with_columns({"unfolded_x": [1.0]})
