"""Layouts of text tables: what stands above the data, separators, encodings, decimal commas.

The truth of every case is the same three blocks, written in the layout of the case.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.io import read_points, read_table
from geounfold.io.tables import large
from geounfold.io.tables.large import PointStream, open_points
from geounfold.io.tables.parts import parts_of

XYZ = np.array([[412295.5, 6815765.0, 1505.25], [412305.5, 6815765.0, 1505.25], [1.0, 2.0, -3.5]])
ROWS = [("412295.5", "6815765", "1505.25", "0.3"), ("412305.5", "6815765", "1505.25", "0.1")]
ROWS += [("1.0", "2", "-3.5", "7")]


def table(separator: str = ",", names: str = "X Y Z AU", comma: bool = False) -> str:
    """Return the blocks as a table."""
    rows = [separator.join(row) for row in [names.split(), *ROWS]]
    text = "\n".join(rows) + "\n"
    return text.replace(".", ",") if comma else text


VULCAN = (
    "centroid_x,centroid_y,centroid_z,au\nVariable descriptions:,,,gold g/t\n"
    "Variable types:,,,double\nVariable defaults:,,,-99.0\n"
)
BODY = "\n".join(",".join(row) for row in ROWS) + "\n"
TYPES = "EAST,NORTH,RL,AU,_EAST,_NORTH,_RL,ROCK\nREAL,REAL,REAL,REAL,REAL,REAL,REAL,CHAR\n"
MICROMINE = TYPES + "412000,10,6815600,10,1400,10,Centre,\n"
SIZED = "".join(",".join(row) + ",10,10,10,ore\n" for row in ROWS)

# Case, content, a word of the note; None if nothing is assumed.
CASES: list[tuple[str, str | bytes, str | None]] = [
    ("commas", table(), None),
    ("semicolons", table(";"), None),
    ("tabs", table("\t"), None),
    ("bars", table("|"), "bars"),
    ("blanks", "  X Y  Z AU\n" + "\n".join("  ".join(r) for r in ROWS) + "\n", "blanks"),
    ("byte-order mark", "\ufeff" + table(), None),
    ("windows line ends", table().replace("\n", "\r\n"), None),
    ("comments", '# Block model: main\n# base 1" pipe, 2\n#\n' + table(), "3 comment lines"),
    ("comments of a spreadsheet", '"# n_blocks: 30, 40",,,\n#,,,\n' + table(), "2 comment lines"),
    ("other comments", "! made by hand\n/ twice\n% or thrice\n" + table(" "), "3 comment lines"),
    ("names in a comment", "# made by hand\n#" + table(" "), "1 comment line"),
    ("title", "Resource model 2024 - final,,,\n,,,\n" + table(), "'Resource model 2024 - final'"),
    ("title with a quote", 'Vein 5" wide\n' + table(), "1 line above"),
    ("title with names", "columns x y z follow\n" + table(), "'columns x y z follow'"),
    ("title, semicolons", "Modell;;;\nStand 2024;;;\n" + table(";"), "2 lines above"),
    ("separator line", "sep=;\n" + table(";"), None),
    ("units", "X,Y,Z,AU\nm,m,m,g/t\n" + BODY, "1 row below"),
    ("units and types", "X,Y,Z,AU\n(m),(m),(m),(g/t)\nreal,real,real,real\n" + BODY, "2 rows"),
    ("Vulcan", VULCAN + BODY, "'Variable defaults:'"),
    ("Micromine", MICROMINE + SIZED, "model's origin"),
    ("Micromine, types only", TYPES + SIZED, "'REAL'"),
    ("Micromine, turned", MICROMINE + "30,0,0,412000,6815600,0,,\n" + SIZED, "--rotation"),
    ("decimal commas", table(";", comma=True), "decimal commas"),
    ("decimal commas, tabs", table("\t", comma=True), "decimal commas"),
    ("decimal commas, blanks", table(" ", comma=True), "decimal commas"),
    ("decimal commas in quotes", "X,Y,Z\n" + '"412295,5","6815765","1505,25"\n'
     '"412305,5","6815765","1505,25"\n"1,0","2","-3,5"\n', "decimal commas"),
    ("Latin-1", table(names="X Y Z GRÈS").encode("latin-1"), "Windows-1252"),
    ("Windows-1252", table(names="X Y Z €").encode("cp1252"), "Windows-1252"),
    ("UTF-16", table(names="X Y Z €").encode("utf-16"), "UTF-16"),
    ("UTF-16, big end first", b"\xfe\xff" + table().encode("utf-16-be"), "UTF-16"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "note"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
@pytest.mark.parametrize("name", ["p.csv", "p.txt", "p.csv.gz"])
def test_the_same_points_in_every_layout(
    name: str, content: str | bytes, note: str | None, tmp_path: Path, monkeypatch
) -> None:
    path = tmp_path / name
    raw = content.encode() if isinstance(content, str) else content
    path.write_bytes(gzip.compress(raw) if name.endswith(".gz") else raw)
    whole = read_points(path)
    assert np.array_equal(whole.points, XYZ)
    assert (whole.notes == ()) if note is None else any(note in line for line in whole.notes)
    assert whole.facts().get("notes", []) == list(whole.notes)
    monkeypatch.setattr(large, "LARGE", 0)
    stream = open_points(path)
    assert isinstance(stream, PointStream)
    assert np.array_equal(stream.points, XYZ)
    assert stream.facts() == whole.facts()
    stream.write_parts(tmp_path / "a.csv", lambda frame, points, rows: {})
    whole.write(tmp_path / "b.csv", {})
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert read_table(tmp_path / "b.csv").notes == ()
    assert np.array_equal(read_points(tmp_path / "b.csv").points, XYZ)


@pytest.mark.parametrize(
    "case", ["comments", "Vulcan", "blanks", "decimal commas", "title", "units"]
)
def test_parts_of_a_table_hold_its_rows(case: str, tmp_path: Path) -> None:
    content = next(c[1] for c in CASES if c[0] == case)
    assert isinstance(content, str)
    (tmp_path / "p.csv").write_text(content, encoding="utf-8")
    (part,) = parts_of(tmp_path / "p.csv")
    whole = read_table(tmp_path / "p.csv")
    assert part.frame().equals(whole.frame)


def test_a_part_in_another_encoding_is_refused(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_bytes(table().encode("utf-16"))
    with pytest.raises(InputError, match="not in UTF-8; save it as UTF-8"):
        parts_of(tmp_path / "p.csv")


def test_corners_in_place_of_centres_are_refused(tmp_path: Path) -> None:
    content = MICROMINE.replace("Centre", "Bottom-Left corner") + SIZED
    (tmp_path / "p.csv").write_text(content)
    with pytest.raises(InputError, match=r"'Bottom-Left corner'; export again .* at the centre"):
        read_points(tmp_path / "p.csv")


def test_names_that_the_user_gives_find_their_row(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("Model 3,,,\n" + table(names="A B C AU"))
    found = read_points(tmp_path / "p.csv", ("a", "b", "c"))
    assert np.array_equal(found.points, XYZ)


def test_a_row_that_is_wrong_is_not_taken_for_units(tmp_path: Path) -> None:
    """One coordinate of the first row is a number, so the row is data with a fault."""
    (tmp_path / "p.csv").write_text("X,Y,Z,AU\nm,m,3,g/t\n" + BODY)
    with pytest.raises(InputError, match="'X' is not numeric: data row 1 has 'm'"):
        read_points(tmp_path / "p.csv")


def test_units_below_the_names_of_a_table_without_coordinates(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("Survey 2024\nBHID,AT,BRG,DIP\n,m,deg,deg\nA,0,450,-60\n")
    found = read_table(tmp_path / "p.csv")
    assert found.frame.to_numpy().tolist() == [["A", "0", "450", "-60"]]
    assert len(found.notes) == 2


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x;y;z\n1,500;2,500;3,125\n", "write decimals with a point, not a comma"),
        ("x;y;z\n1.234,5;2;3\n", "write decimals with a point, not a comma"),
        ("x;y;z\n1,5;2;3\n1,234,567;2;3\n", "'1,5'"),
        ("lon,lat,z\n150.1,-30.2,5\n", "degrees"),
    ],
)
def test_what_cannot_be_told_is_asked_for(content: str, words: str, tmp_path: Path) -> None:
    """One comma before three digits may stand between thousands."""
    (tmp_path / "p.csv").write_text(content)
    with pytest.raises(InputError, match=words):
        read_points(tmp_path / "p.csv")
