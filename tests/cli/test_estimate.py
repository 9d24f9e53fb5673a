"""The command `estimate`: from a map, samples and blocks to a table, and every way it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.synthetic import GradeField, drill

pytest.importorskip("gstlearn", reason="the extra geostat is not installed")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return a map, the samples of holes, and blocks."""
    folder = tmp_path_factory.mktemp("estimate")
    body = gu.simulate("slab", blocks=2000)
    field = GradeField("spherical", (100, 100, 20), mean=2.0, deviation=0.5)
    samples = gu.read_drillholes(*drill(body, field, 40.0)).samples(4.0)
    names = {n: str(folder / n) for n in ("m.npz", "holes.csv", "blocks.csv", "v.json")}
    gu.unfold(body.folded).save(names["m.npz"])
    samples.rename(columns={"grade": "CU", "hole": "BHID"}).to_csv(names["holes.csv"], index=False)
    body.frame(4).to_csv(names["blocks.csv"], index=False)
    variogram = {"nugget": 0.1, "structures": [
        {"kind": "spherical", "sill": 0.2, "ranges": [100, 100, 20]}]}  # fmt: skip
    Path(names["v.json"]).write_text(json.dumps(variogram), encoding="utf-8")
    return names


def words(files: dict[str, str], out: Path, *more: str) -> list[str]:
    inputs = [files["m.npz"], files["holes.csv"], files["blocks.csv"]]
    return ["estimate", *inputs, "-o", str(out), "--grade", "CU", *more]


def test_blocks_come_back_with_estimates(files, tmp_path: Path) -> None:
    out, summary = tmp_path / "out.csv", tmp_path / "s.json"
    more = ("--summary", str(summary), "--cross-validate", "--max-per-hole", "6", "--quiet")
    assert main(words(files, out, *more)) == 0
    blocks, got = pd.read_csv(files["blocks.csv"]), pd.read_csv(out)
    assert list(got) == [*blocks, "CU_estimate", "CU_variance", "CU_samples", "CU_flag"]
    assert (got.CU_estimate.notna() == (got.CU_flag == "estimated")).all()
    told = json.loads(summary.read_text(encoding="utf-8"))
    assert told["blocks"]["given"] == len(blocks)
    assert told["blocks"]["estimated"] == int((got.CU_flag == "estimated").sum())
    assert told["neighbourhood"]["max_per_hole"] == 6
    assert told["cross_validation"]["count"] > 0
    # The summary's variogram repeats the run.
    again = tmp_path / "again.csv"
    assert main(words(files, again, "--variogram", str(summary), *more[3:])) == 0
    assert again.read_bytes() == out.read_bytes()


def test_few_samples_are_flagged_and_told(files, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out.csv"
    more = ("--variogram", files["v.json"], "--radii", "3,3,3", "--json")
    assert main(words(files, out, *more)) == 0
    got = pd.read_csv(out)
    few = got.CU_flag == "too_few_samples"
    assert few.any()
    assert got.CU_estimate[few].isna().all()
    said = capsys.readouterr()
    assert f"{few.sum()} of {len(got)} blocks are not estimated" in said.err
    assert json.loads(said.out)["blocks"]["too_few_samples"] == few.sum()


@pytest.mark.parametrize("method", ["simple", "inverse_distance"])
def test_other_methods(files, tmp_path: Path, method: str) -> None:
    out = tmp_path / "out.csv"
    more = ("--method", method, "--variogram", files["v.json"], "--quiet")
    assert main(words(files, out, *more)) == 0
    got = pd.read_csv(out).CU_estimate
    # Grades are 2 with a deviation of 0.5: their mean on 2,000 blocks is within one of it.
    assert abs(np.nanmean(got) - 2.0) < 0.5


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--method", "idw"), "is not one of"),
        (("--radii", "1,2"), "--radii needs three finite numbers"),
        (("--radii", "1,2,a"), "--radii needs three finite numbers"),
        (("--radii", "1,2,inf"), "finite"),
        (("--radii", "1,2,0"), "radii must be above 0"),
        (("--rotation", "1,2,3"), "--rotation needs --radii"),
        (("--min-samples", "0"), "--min-samples needs a whole number"),
        (("--power", "-1", "--method", "inverse_distance"), "power of inverse distance"),
        (("--mean", "x"), "--mean needs a number"),
        (("--hole", "nobody"), "no column 'nobody'"),
        (("--variogram", "none.json"), "none.json: no such file"),
        (("--grade", "AU"), "no column 'AU'"),
        (("--grade", "x"), "names a coordinate"),
    ],
)
def test_what_cannot_be_is_one_line(files, tmp_path: Path, capsys, more, said: str) -> None:
    out = tmp_path / "out.csv"
    assert main(words(files, out, "--quiet", *more)) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.strip().splitlines()) == 1
    assert not out.exists()


def test_an_output_is_not_replaced(files, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out.csv"
    out.write_text("mine", encoding="utf-8")
    assert main(words(files, out)) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert out.read_text(encoding="utf-8") == "mine"
