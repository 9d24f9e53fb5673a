"""`geounfold body-from-holes`, and what follows it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from tests.modelling.holes import drilled, plate


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plate")
    for name, table in zip(("collar", "survey", "lith"), plate(dip=20.0), strict=True):
        table.to_csv(folder / f"{name}.csv", index=False)
    outline = pd.DataFrame({"X": [-10, 90, 90, -10], "Y": [-10, -10, 90, 90]})
    outline.to_csv(folder / "outline.csv", index=False)
    return folder


def words(folder: Path, *more: str) -> list[str]:
    files = [str(folder / f"{name}.csv") for name in ("collar", "survey", "lith")]
    return ["body-from-holes", *files, "--overwrite", "-o", str(folder / "body.parquet"), *more]


def test_all_outputs_hold_the_library_s_answer(tables: Path) -> None:
    more = {"--top-out": "top.ts", "--bottom-out": "bottom.ts", "--intercepts-out": "i.csv"}
    more |= {"--samples-out": "s.csv", "--summary": "s.json", "--polygon": "outline.csv"}
    given = [w for name, file in more.items() for w in (name, str(tables / file))]
    more_words = ["--code", "ORE", "--block-size", "5", "--composite", "4", *given]
    assert main(words(tables, *more_words)) == 0
    made = gu.body_from_holes(
        *plate(dip=20.0), code="ORE", block_size=5,
        polygon=[(-10, -10), (90, -10), (90, 90), (-10, 90)],
    )  # fmt: skip
    blocks = pd.read_parquet(tables / "body.parquet")
    assert np.array_equal(blocks[["x", "y", "z"]], made.points)
    facts = json.loads((tables / "s.json").read_text())
    assert facts["volume"] == made.volume
    assert facts["extent"] is None
    samples = pd.read_csv(tables / "s.csv")
    assert set(samples["lith"]) == {"ORE"}
    assert np.allclose((samples["to"] - samples["from"]).groupby(samples["hole"]).sum(), 20)
    assert len(pd.read_csv(tables / "i.csv")) == len(made.intercepts)
    from geounfold.io import read_surface

    np.testing.assert_allclose(read_surface(tables / "top.ts").V, made.hanging_wall.V)


BAD = [
    ([], "needs --code A,B or --cut-off GRADE=VALUE"),
    (["--code", "ORE", "--cut-off", "CU=1"], "one of them"),
    (["--code", " , "], "--code needs codes"),
    (["--cut-off", "CU"], "--cut-off needs GRADE=VALUE"),
    (["--cut-off", "CU=high"], "--cut-off needs a number"),
    (["--code", "ORE", "--axis", "30"], "--axis needs trend and plunge"),
    (["--code", "ORE", "--max-waste", "-1"], "--max-waste"),
    (["--code", "ORE", "--block-size", "0"], "--block-size"),
    (["--code", "ORE", "--composite", "2"], "are for --samples-out"),
    (["--code", "ORE", "--polygon", "{}/lith.csv"], "--polygon needs columns x and y"),
    (["--code", "ORE", "--polygon", "{}/none.csv"], "none.csv"),
    (["--code", "ORE", "--shape", "ball"], "shape"),
    (["--code", "GOLD"], "no column holds the codes GOLD"),
]


@pytest.mark.parametrize(("more", "line"), BAD)
def test_bad_words_end_in_one_line(
    tables: Path, more: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(tables, *(word.format(tables) for word in more))) == 2
    err = capsys.readouterr().err.strip().splitlines()
    assert line in err[-1]
    assert all(other.startswith("geounfold: warning") for other in err[:-1])  # of the dips


def test_the_body_unfolds_and_its_samples_estimate_it(tmp_path: Path) -> None:
    pytest.importorskip("gstlearn")
    body, made = drilled("sim_case_1", 60)
    for name, table in zip(("collar", "survey", "lith"), made, strict=True):
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    samples = ["--composite", "4", "--samples-out", str(tmp_path / "samples.csv")]
    assert main(words(tmp_path, "--code", "ORE", "--block-size", "15", *samples)) == 0
    blocks, flat, saved = (str(tmp_path / n) for n in ("body.parquet", "flat.csv", "m.npz"))
    assert main(["unfold", blocks, "-o", flat, "--map", saved]) == 0
    argv = ["estimate", saved, str(tmp_path / "samples.csv"), blocks, "--grade", "grade"]
    assert main([*argv, "-o", str(tmp_path / "grades.csv")]) == 0
    found = pd.read_csv(tmp_path / "grades.csv")
    assert (found["grade_flag"] == "estimated").mean() > 0.95
    # The layer of the rebuilt body is that of the true one: 0.016 of the thickness, measured; a
    # body that is turned over has 0.5.
    truth, there = body.sheet.unfold(found[["x", "y", "z"]].to_numpy())
    low, high = body.sheet.heights(truth[:, 0], truth[:, 1])
    level = (truth[:, 2] - low) / (high - low)
    inside = there & body.sheet.inside(truth)
    error = pd.read_csv(flat)["stratigraphic"].to_numpy()[inside] - level[inside]
    assert np.sqrt((error**2).mean()) < 0.03


def test_waste_in_the_blocks_that_samples_lack_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Of every intercept from 20 to 40, four are waste: a fifth.
    collar, survey, _ = plate()
    rows = [
        (0, 20, "WASTE"),
        (20, 28, "ORE"),
        (28, 32, "WASTE"),
        (32, 40, "ORE"),
        (40, 60, "WASTE"),
    ]
    lith = pd.DataFrame(
        [(hole, *row) for hole in collar["hole"] for row in rows],
        columns=["hole", "from", "to", "lith"],
    )
    for name, table in zip(("collar", "survey", "lith"), (collar, survey, lith), strict=True):
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    more = ["--code", "ORE", "--max-waste", "5", "--block-size", "5"]
    assert main(words(tmp_path, *more)) == 0
    assert "grade is too high" not in capsys.readouterr().err
    assert main(words(tmp_path, *more, "--samples-out", str(tmp_path / "s.csv"))) == 0
    assert "waste between intercepts (20.0% of their length)" in capsys.readouterr().err
