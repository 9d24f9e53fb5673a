"""Field inputs 06 to 23: whole models, domains, projects, wall rock, codes, names of holes.

Each test runs the command of the input's CMD.txt and compares with what its EXPECT.txt states.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.io import read_points
from tests.places import shared

BLOCKS = 4005
"""Blocks of 10 m of the common body."""


def given(name: str) -> Path:
    return shared("field", "inputs", name)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*words: Any) -> int:
    return main([str(word) for word in words])


def figures(path: str = "s.json") -> dict[str, Any]:
    found: dict[str, Any] = json.loads(Path(path).read_text())
    return found


@pytest.mark.slow
def test_06_a_filled_box_is_told_and_its_ore_can_be_chosen(capsys) -> None:
    model = given("06_whole_model_silent") / "full_wide.csv.gz"
    assert run("unfold", model, "-o", "o.csv") == 0
    said = capsys.readouterr().err
    assert "columns ROCK (WASTE 102400, ORE 25600) and ORE (0 102400, 1 25600) vary" in said
    assert '--where "ROCK=ORE"' in said
    box = re.search(r"fill the whole box of their lattice \((\d+) x (\d+) x (\d+)\)", said)
    assert box is not None
    assert sorted(map(int, box.groups())) == [20, 80, 80]
    assert run("unfold", model, "-o", "ore.csv", "--where", "ORE=1") == 0
    found = pd.read_csv("ore.csv")
    level = found.loc[found["ORE"] == 1, "stratigraphic"]
    # A layer of whole blocks: centres of the outermost lie half a block inside, about 1/8.
    assert level.min() > -0.1
    assert level.max() < 1.1
    assert found.loc[found["ORE"] == 0, "location"].unique().tolist() == ["not selected"]


def test_07_the_refusal_names_the_column(capsys) -> None:
    model = given("07_whole_model_refused") / "full.csv.gz"
    assert run("unfold", model, "-o", "o.csv") == 2
    said = capsys.readouterr().err
    assert "ROCK (WASTE 28359, ORE 4005) vary" in said
    assert "--where" in said
    assert run("unfold", model, "-o", "o.csv", "--where", "ROCK=ORE", "--quiet") == 0
    base = given("base") / "base.csv"
    assert run("unfold", base, "-o", "b.csv", "--quiet") == 0
    ore, alone = pd.read_csv("o.csv"), pd.read_csv("b.csv")
    ore = ore[ore["ROCK"] == "ORE"]
    both = ore.merge(alone, left_on=["X", "Y", "Z"], right_on=[f"centroid_{a}" for a in "xyz"])
    assert len(both) == len(ore) == BLOCKS
    np.testing.assert_allclose(both["stratigraphic_x"], both["stratigraphic_y"], atol=1e-9)


def test_08_waste_is_not_estimated_as_ore(capsys) -> None:
    folder = given("08_estimate_whole_model")
    files = (folder / "es.csv", folder / "full.csv.gz")
    assert run("estimate", given("base") / "base.npz", *files, "--grade", "AU", "-o", "o.csv") == 0
    old = pd.read_csv("o.csv")
    # A map of an older version does not hold the body's blocks, which is told.
    assert "the map does not hold the body's blocks" in capsys.readouterr().err
    assert set(old.loc[old["AU_flag"] == "estimated", "location"]) == {"inside"}
    assert (old.loc[old["ORE"] == 1, "AU_flag"] == "estimated").all()
    more = ("--where", "ORE=1", "--map", "m.npz", "--quiet")
    assert run("unfold", folder / "full.csv.gz", "-o", "u.csv", *more) == 0
    assert run("estimate", "m.npz", *files, "--grade", "AU", "-o", "n.csv", "--quiet") == 0
    new = pd.read_csv("n.csv")
    np.testing.assert_array_equal(new["AU_estimate"].notna(), new["ORE"] == 1)


def test_09_wall_rock_does_not_enter_the_ore(capsys) -> None:
    folder = given("09_wall_rock_samples")
    files = (folder / "thin_s.csv", folder / "p_thin.csv")
    words = (*files, "--grade", "AU", "--summary", "s.json", "--overwrite")
    assert run("estimate", folder / "thin.npz", *words, "-o", "o.csv") == 0
    assert re.search(r"\d+ of 3600 samples lie outside the body \(wall rock\): left out",
                     capsys.readouterr().err)  # fmt: skip
    assert run("unfold", folder / "p_thin.csv", "-o", "u.csv", "--map", "m.npz", "--quiet") == 0
    assert run("estimate", "m.npz", *words, "-o", "o.csv", "--quiet") == 0
    samples = pd.read_csv(folder / "thin_s.csv")
    found = figures()
    assert found["samples"]["used"] == samples["ore"].sum()
    assert found["mean_of_samples"] == pytest.approx(samples.loc[samples["ore"], "AU"].mean())
    assert found["mean_of_blocks"] == pytest.approx(1.035, abs=0.005)  # EXPECT.txt


def test_10_a_majority_below_detection_stays_a_grade(capsys) -> None:
    folder = given("10_bdl_majority")
    holes = [folder / f"{name}.csv" for name in ("ref_c", "ref_s", "thr_a")]
    words = ["map", given("base") / "base.npz", "--holes", *holes, "--composite", "12"]
    assert run(*words, "--samples-out", "o.csv") == 0
    assert "AU is below detection in" in capsys.readouterr().err
    assert run(*words, "--samples-out", "z.csv", "--below-detection", "zero", "--quiet") == 0
    found, zero = pd.read_csv("o.csv"), pd.read_csv("z.csv")
    assert found["AU"].dtype == float
    # Intervals of 4 m: 0.484, 0.355 and <0.01.
    assert zero["AU"].iloc[0] == pytest.approx((0.484 + 0.355) / 3)
    assert found["AU"].iloc[0] == pytest.approx((0.484 + 0.355) / 2)


def test_12_codes_can_be_declared_and_negative_grades_are_told(capsys) -> None:
    base, samples = given("base"), given("12_missing_codes") / "es_99.csv"
    words = ("estimate", base / "base.npz", samples, base / "base.csv", "--grade", "AU")
    assert run(*words, "-o", "o.csv") == 0
    assert "80 of 400 values are negative, the first '-99.0' at data row 1" in (
        capsys.readouterr().err
    )
    more = ("--missing", "-99,-999,-", "--summary", "s.json", "--quiet")
    assert run(*words, "-o", "p.csv", *more) == 0
    assert figures()["samples"]["values"]["declared_missing"] == 80
    assert pd.read_csv("p.csv")["AU_estimate"].min() > 0


@pytest.mark.parametrize(("name", "word"), [("es_dash.csv", "-"), ("es_bdl.csv", "<0.01")])
def test_13_codes_in_samples_are_read_as_in_holes(name: str, word: str, capsys) -> None:
    base, samples = given("base"), given("13_estimate_codes_refused") / name
    words = ("estimate", base / "base.npz", samples, base / "base.csv", "--grade", "AU")
    assert run(*words, "-o", "o.csv", "--summary", "s.json") == 0
    count = (pd.read_csv(samples, dtype=str)["AU"] == word).sum()
    assert figures()["samples"]["without_grade"] == count
    assert f"the first '{word}' at data row 1" in capsys.readouterr().err


def test_16_projects_of_several_elements_are_not_guessed(capsys) -> None:
    folder = given("16_omf_project_choice")
    for name, words in (
        ("proj.omf", "block model 'ore block model', point set 'assay points'"),
        ("two.omf", "block model 'model A', block model 'model B'"),
        (
            "several.omf",
            "block model 'model A', block model 'model B', surface 'topo', point set 'blocks'",
        ),
    ):
        assert run("unfold", folder / name, "-o", "o.csv") == 2
        said = capsys.readouterr().err
        assert f"{words}; choose one by --element NAME" in said
        assert "damaged" not in said
    assert len(read_points(folder / "proj.omf", element="ore block model")) == 8000
    assert run("unfold", folder / "several.omf", "--element", "blocks", "-o", "o.csv") == 0
    assert len(pd.read_csv("o.csv")) == BLOCKS


@pytest.mark.parametrize("kind", ["fl", "case"])
def test_22_names_of_holes_are_matched_and_told(kind: str, capsys) -> None:
    folder = given("22_hole_names")
    holes = [folder / f"{kind}_{table}.csv" for table in "csa"]
    words = ["map", given("base") / "base.npz", "--holes", *holes, "--samples-out", "o.csv"]
    assert run(*words) == 0
    assert "hole named otherwise than in the collar table" in capsys.readouterr().err
    found = pd.read_csv("o.csv", dtype={"hole": str})
    collars = pd.read_csv(holes[0], dtype=str)["HOLEID"]
    assays = pd.read_csv(holes[2])
    assert set(found["hole"]) == set(collars)
    assert len(found) == len(assays)


def test_23_lodes_are_told_apart_by_their_column() -> None:
    model = given("23_two_lodes_touch") / "dom_apart.csv"
    assert run("unfold", model, "-o", "o.csv", "--by", "DOMAIN", "--quiet") == 0
    assert run("unfold", model, "-o", "w.csv", "--where", "DOMAIN=LOWER", "--quiet") == 0
    by, where = pd.read_csv("o.csv"), pd.read_csv("w.csv")
    lower = by["DOMAIN"] == "LOWER"
    assert lower.sum() == (~lower).sum() == BLOCKS
    names = ["unfolded_x", "unfolded_y", "unfolded_z", "stratigraphic"]
    np.testing.assert_array_equal(by.loc[lower, names], where.loc[lower, names])
    assert where.loc[~lower, "location"].unique().tolist() == ["not selected"]
    # The upper lode is the lower one 80 m higher: both lie flat alike.
    np.testing.assert_allclose(
        np.sort(by.loc[lower, "stratigraphic"]), np.sort(by.loc[~lower, "stratigraphic"]), atol=1e-6
    )
    touching = given("23_two_lodes_touch") / "dom_touch.csv"
    assert run("unfold", touching, "-o", "t.csv", "--where", "DOMAIN=LOWER", "--quiet") == 0
    found = pd.read_csv("t.csv").dropna(subset=["stratigraphic"])
    assert len(found) == BLOCKS
    np.testing.assert_allclose(found["stratigraphic"], by.loc[lower, "stratigraphic"], atol=1e-9)
