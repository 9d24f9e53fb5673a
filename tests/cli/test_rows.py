"""Rows and elements chosen on the command line: they keep their place, the others are empty."""

from __future__ import annotations

import json
import uuid
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from tests.cli.fakes import SHIFT

ROWS = "ROCK,AU,x,y,z\nORE,1,1,2,3\nWASTE,0,,,\nORE,2,4,5,6\nWASTE,0,7,8,9\n"


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.npz").write_bytes(b"map")
    path = tmp_path / "model.csv"
    path.write_text(ROWS)
    return path


def test_unfold_takes_the_rows_chosen_and_keeps_all(
    model: Path, calls: list[dict[str, Any]]
) -> None:
    words = ["unfold", "model.csv", "-o", "o.csv", "--summary", "s.json"]
    assert main([*words, "--where", "ROCK=ORE"]) == 0
    np.testing.assert_array_equal(calls[0]["points"], [[1, 2, 3], [4, 5, 6]])
    found = pd.read_csv("o.csv", dtype=str, keep_default_na=False)
    assert found["ROCK"].tolist() == ["ORE", "WASTE", "ORE", "WASTE"]
    assert found["location"].tolist() == ["inside", "not selected", "inside", "not selected"]
    assert found["unfolded_x"].tolist() == ["1001.0", "", "1004.0", ""]
    read = json.loads(Path("s.json").read_text())["input"]
    assert (read["where"], read["selected"], read["rows"]) == ("ROCK=ORE", 2, 4)


def test_map_carries_the_rows_chosen(model: Path, calls: list[dict[str, Any]]) -> None:
    words = ["map", "m.npz", "model.csv", "-o", "o.parquet", "--where", "ROCK = 'ORE' and AU > 1"]
    assert main(words) == 0
    found = pd.read_parquet("o.parquet")
    assert found["location"].tolist() == ["not selected"] * 2 + ["inside", "not selected"]
    assert found["unfolded_x"].iloc[2] == 4 + SHIFT[0]
    assert found["unfolded_x"].isna().sum() == 3


def test_large_tables_choose_rows_in_batches(
    model: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("geounfold.io.tables.large.LARGE", 0)
    monkeypatch.setattr("geounfold.io.tables.large.BATCH", 1)
    assert main(["unfold", "model.csv", "-o", "o.csv", "--where", "ROCK=ORE"]) == 0
    assert calls[0]["points"].tolist() == [[1, 2, 3], [4, 5, 6]]
    whole = pd.read_csv("o.csv", dtype=str, keep_default_na=False)
    assert whole["unfolded_y"].tolist() == ["2.0", "", "5.0", ""]
    assert whole["location"].tolist() == ["inside", "not selected", "inside", "not selected"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--where ROK=ORE", "model.csv: no column 'ROK' in where 'ROK=ORE'; did you mean ROCK?"),
        ("--where ROCK=Ore", "no row meets where 'ROCK=Ore': column ROCK has ORE (2), WASTE (2)"),
        ("--where ROCK", "a comparison such as = or in is needed"),
        ("--where AU=rich", "column 'AU' holds numbers, and 'rich' is text"),
        ("--where ROCK=WASTE", "1 of 4 rows has a missing or infinite coordinate: data row 2"),
        ("--element ore", "--element chooses one of several elements"),
    ],
)
def test_choices_that_cannot_be_made(
    words: str,
    message: str,
    model: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(f"unfold model.csv -o o.csv {words}".split()) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert not calls
    assert not Path("o.csv").exists()


def test_samples_are_chosen_by_an_option_of_their_own(
    model: Path, calls: list[dict[str, Any]]
) -> None:
    Path("s.csv").write_text("LITH,x,y,z\nQZ,1,1,1\nSCH,2,2,2\n")
    words = "unfold model.csv -o o.csv --where ROCK=ORE --samples s.csv --samples-out q.csv"
    assert main([*words.split(), "--samples-where", "LITH=QZ"]) == 0
    assert pd.read_csv("q.csv")["LITH"].tolist() == ["QZ"]


def test_quality_takes_the_same_rows_of_all_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    frame = pd.DataFrame(grid, columns=list("xyz"))
    frame["ROCK"] = np.where(grid[:, 0] < 2, "ORE", "WASTE")
    frame.to_csv("f.csv", index=False)
    moved = frame.assign(x=frame["x"].where(frame["ROCK"] == "ORE", 3 * frame["x"]))
    moved.drop(columns="ROCK").to_csv("u.csv", index=False)
    words = ["quality", "f.csv", "u.csv", "--neighbours", "6", "-o", "q.json", "--overwrite"]
    assert main([*words, "--where", "ROCK=ORE"]) == 0
    assert json.loads(Path("q.json").read_text())["epsilon_folded"]["max"] == 0  # not stretched
    assert main(words) == 0
    assert json.loads(Path("q.json").read_text())["epsilon_folded"]["max"] > 0


def project(path: Path, **elements: np.ndarray) -> None:
    """Write an OMF project of version 1 by hand: a point set for every array."""
    content, index, names = b"", {}, []
    for name, xyz in elements.items():
        packed = zlib.compress(np.asarray(xyz, dtype="<f8").tobytes())
        keys = [str(uuid.uuid5(uuid.NAMESPACE_URL, name + part)) for part in ("e", "g", "a")]
        place = {"start": 60 + len(content), "length": len(packed), "dtype": "<f8"}
        content += packed
        index[keys[0]] = {"__class__": "PointSetElement", "name": name, "geometry": keys[1]}
        index[keys[1]] = {
            "__class__": "PointSetGeometry", "origin": [0, 0, 0], "vertices": keys[2],
        }  # fmt: skip
        index[keys[2]] = {"__class__": "Vector3Array", "array": place}
        names.append(keys[0])
    key = uuid.uuid5(uuid.NAMESPACE_URL, "project")
    index[str(key)] = {"elements": names, "origin": [0, 0, 0], "units": "m"}
    head = b"\x84\x83\x82\x81" + b"OMF-v0.9.0".ljust(32, b"\0") + key.bytes
    start = (60 + len(content)).to_bytes(8, "little")
    path.write_bytes(head + start + content + json.dumps(index).encode())


def test_an_element_of_a_project_is_chosen_by_name(
    model: Path, calls: list[dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    project(Path("p.omf"), blocks=np.ones((2, 3)), assays=np.zeros((3, 3)))
    assert main(["unfold", "p.omf", "-o", "o.csv"]) == 2
    said = capsys.readouterr().err
    assert "'blocks', point set 'assays'; choose one by --element NAME" in said
    assert main(["unfold", "p.omf", "-o", "o.csv", "--element", "block"]) == 2
    assert "is called 'block'; did you mean point set 'blocks'?" in capsys.readouterr().err
    words = ["unfold", "p.omf", "-o", "o.csv", "--summary", "s.json"]
    assert main([*words, "--element", "Blocks"]) == 0
    assert calls[0]["points"].tolist() == [[1, 1, 1]] * 2
    assert json.loads(Path("s.json").read_text())["input"]["element"] == "blocks"
