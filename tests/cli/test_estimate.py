"""The command `estimate`: from a map, samples and blocks to a table, and every way it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.estimation import Scores, flat_samples
from geounfold.estimation.scores import cross_validation_told
from geounfold.synthetic import GradeField, drill
from tests.shapes import grid_cells

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
    results = ("CU_estimate", "CU_variance", "CU_samples", "CU_flag", "location")
    assert list(got) == [*blocks, *results]
    assert (got.CU_estimate.notna() == (got.CU_flag == "estimated")).all()
    told = json.loads(summary.read_text(encoding="utf-8"))
    assert told["blocks"]["given"] == len(blocks)
    assert told["blocks"]["estimated"] == int((got.CU_flag == "estimated").sum())
    assert told["neighbourhood"]["max_per_hole"] == 6
    assert told["cross_validation"]["count"] > 0
    assert [axis["axis"] for axis in told["variogram_axes"]] == [1, 2]
    # The summary's variogram repeats the run.
    again = tmp_path / "again.csv"
    assert main(words(files, again, "--variogram", str(summary), *more[3:])) == 0
    assert again.read_bytes() == out.read_bytes()


def test_errors_of_places_widen_the_variance(files, tmp_path: Path, capsys) -> None:
    summary = tmp_path / "unfolding.json"
    figures = {"uncertainty": {"sd_along": 5.0, "sd_across": 2.0}}
    summary.write_text(json.dumps(figures), encoding="utf-8")
    same = ("--variogram", files["v.json"], "--quiet")
    outs = {}
    for error in ("0,0", "5,2", str(summary)):
        out = tmp_path / f"out{len(outs)}.csv"
        assert main(words(files, out, *same, "--position-error", error)) == 0
        outs[error] = pd.read_csv(out)
    exact, wide, read = outs.values()
    assert wide.CU_variance.median() > exact.CU_variance.median()
    pd.testing.assert_frame_equal(wide, read)
    summary.write_text("{}", encoding="utf-8")
    out = tmp_path / "none.csv"
    assert main(words(files, out, *same, "--position-error", str(summary))) == 2
    assert "no summary of `geounfold unfold --uncertainty`" in capsys.readouterr().err


def test_the_variogram_goes_out_and_in_as_a_file(files, tmp_path: Path, capsys) -> None:
    out, again, model = tmp_path / "out.csv", tmp_path / "again.csv", tmp_path / "v.toml"
    assert main(words(files, out, "--variogram-out", str(model), "--quiet")) == 0
    text = model.read_text(encoding="utf-8")
    assert "[[structures]]" in text
    told = r"# Axis 2: azimuth \d+ in the unfolded space; in the body it trends \d+ and plunges \d+"
    assert re.search(told, text)
    assert main(words(files, again, "--variogram", str(model), "--quiet")) == 0
    assert again.read_bytes() == out.read_bytes()
    assert (pd.read_csv(out).CU_flag == "estimated").all()  # radii leave none empty
    capsys.readouterr()
    model.write_text(model.read_text(encoding="utf-8").replace("sill", "sil"), encoding="utf-8")
    assert main(words(files, again, "--variogram", str(model), "--overwrite", "--quiet")) == 2
    assert "v.toml: each structure needs exactly kind, sill and ranges" in capsys.readouterr().err
    method = ("--method", "inverse_distance", "--radii", "60,60,20")
    how = ("--variogram-out", str(tmp_path / "w.toml"), "--overwrite", "--quiet")
    assert main(words(files, out, *method, *how)) == 2
    assert "inverse_distance has no variogram" in capsys.readouterr().err


def test_blocks_and_methods_side_by_side(files, tmp_path: Path, capsys) -> None:
    out, summary = tmp_path / "out.csv", tmp_path / "s.json"
    how = ("--variogram", files["v.json"], "--block-size", "8,8,4", "--discretise", "2,2,2")
    more = ("--also", "all", "--cross-validate", "--summary", str(summary), "--quiet")
    limits = ("--max-per-octant", "4", "--min-holes", "2", "--min-octants", "2")
    assert main(words(files, out, *how, *more, *limits)) == 0
    got = pd.read_csv(out)
    new = [name for name in got if name.startswith("CU_")]
    assert new == [
        *("CU_estimate", "CU_variance", "CU_efficiency", "CU_slope"),
        *("CU_simple", "CU_inverse_distance", "CU_nearest", "CU_samples", "CU_flag"),
    ]
    assert got.CU_efficiency.max() <= 1
    told = json.loads(summary.read_text(encoding="utf-8"))
    assert told["support"] == {"block_size": [8.0, 8.0, 4.0], "discretised": [2, 2, 2]}
    assert told["neighbourhood"]["min_octants"] == 2
    # The nearest sample is the worst of the estimators: its error has that sample's too.
    errors = told["cross_validation"]
    assert errors["nearest"]["rmse"] > errors["rmse"]
    capsys.readouterr()
    for more, said in (
        (("--discretise", "2,2,2"), "--discretise needs --block-size"),
        (("--block-size", "8,8,4", "--discretise", "2,2"), "three numbers such as 3,3,3"),
        (("--block-size", "8,8,0"), "block_size must have sides above 0"),
        (("--also", "kriging"), "--also takes other methods than --method"),
    ):
        assert main(words(files, tmp_path / "no.csv", "--quiet", *more)) == 2
        assert said in capsys.readouterr().err


def test_the_report_has_curves_swaths_tonnage_and_settings(files, tmp_path: Path) -> None:
    out, page = tmp_path / "out.csv", tmp_path / "r.html"
    how = ("--variogram", files["v.json"], "--decluster", "auto", "--quiet")
    assert main(words(files, out, "--report", str(page), *how)) == 0
    told = page.read_text(encoding="utf-8")
    for title in ("Estimation of CU", "Settings and figures of the run", "Variograms", "Swaths"):
        assert title in told
    for item in ("search radii", "structure 1", "declustered mean of samples", "fewest holes"):
        assert f"<td>{item}" in told
    assert told.count('<figure class="drawn">') >= 3
    # The verdict is that of assess with the same model.
    assert "What unfolding is expected to gain" in told
    assert "nine of ten samples lie within" in told


def test_realisations_are_columns(files, tmp_path: Path, capsys) -> None:
    out, how = tmp_path / "out.csv", ("--variogram", files["v.json"], "--quiet")
    assert main(words(files, out, "--realisations", "2", *how)) == 0
    got = pd.read_csv(out)
    known = got.CU_flag == "estimated"
    assert (got[["CU_r1", "CU_r2"]].notna().all(axis=1) == known).all()
    assert got.CU_r1[known].std() > got.CU_estimate[known].std()  # estimates are smooth
    capsys.readouterr()
    for more, said in (
        (("--realisations", "0"), "--realisations needs a whole number of 1 or more"),
        (("--realisations", "2", "--block-size", "8,8,4"), "leave out --block-size"),
        (("--realisations", "2", "--method", "nearest"), "--realisations need a variogram"),
    ):
        assert main(words(files, tmp_path / "no.csv", "--quiet", *more)) == 2
        assert said in capsys.readouterr().err


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
        (("--position-error", "1"), "--position-error needs two numbers of 0 or more"),
        (("--position-error", "1,-2"), "--position-error needs two numbers of 0 or more"),
        (("--position-error", "none.json"), "none.json: no such file"),
        (("--grade", "AU"), "no column 'AU'"),
        (("--grade", "cu"), "no column 'cu' (did you mean 'CU'?)"),
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


# ------------------------------------------------- whole models, wall rock, values as they stand


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder: the map of an arch of blocks, a model with waste around it, samples."""
    folder = tmp_path_factory.mktemp("model")
    cells = grid_cells(24, 10, 4)
    cells[:, 2] += 3 - np.abs(cells[:, 0] - 12) // 4
    gu.unfold(cells * 10.0).save(folder / "m.npz")
    own = {tuple(cell) for cell in cells.tolist()}
    box = grid_cells(30, 16, 16) - 3
    frame = pd.DataFrame(box * 10.0, columns=list("xyz"))
    frame["ROCK"] = ["ORE" if tuple(cell) in own else "WASTE" for cell in box.tolist()]
    frame.to_csv(folder / "full.csv", index=False)
    # A hole through every third column, down through the ore (1 g/t) into barren wall rock.
    at = grid_cells(8, 3, 20) * [30.0, 30.0, 5.0] + [0, 0, -15.0]
    at = at[np.abs(at[:, 2] % 10 - 5) > 0]  # not on the face of a block
    ore = [tuple(np.rint(p / 10).astype(int)) in own for p in at]
    samples = pd.DataFrame(at, columns=list("xyz")).assign(AU=np.where(ore, 1.0, 0.0), ORE=ore)
    samples["hole"] = [f"{x:.0f}/{y:.0f}" for x, y in at[:, :2]]
    samples.to_csv(folder / "s.csv", index=False)
    return folder


def estimated(model: Path, out: Path, *more: str, samples: str = "s.csv") -> list[str]:
    inputs = [str(model / "m.npz"), str(model / samples), str(model / "full.csv")]
    how = ["--method", "inverse_distance", "--radii", "60,60,60"]
    return ["estimate", *inputs, "-o", str(out), "--grade", "AU", *how, *more]


def test_waste_of_a_whole_model_is_not_estimated(model, tmp_path: Path, capsys) -> None:
    assert main(estimated(model, tmp_path / "o.csv")) == 0
    got = pd.read_csv(tmp_path / "o.csv")
    waste = got["ROCK"] == "WASTE"
    assert set(got.loc[~waste, "AU_flag"]) == {"estimated"}
    assert set(got.loc[waste, "AU_flag"]) == {"outside_body", "outside_map"}
    assert got.loc[waste, "AU_estimate"].isna().all()
    assert set(got["location"]) == {"inside", "extrapolated", "outside"}
    said = capsys.readouterr().err
    assert "blocks are not estimated: outside_body; --all-blocks estimates them too" in said
    assert main(estimated(model, tmp_path / "all.csv", "--all-blocks")) == 0
    every = pd.read_csv(tmp_path / "all.csv")
    assert set(every.loc[every["location"] != "outside", "AU_flag"]) == {
        *("estimated", "too_few_samples")
    }
    assert every.loc[waste, "AU_estimate"].notna().any()
    assert main(estimated(model, tmp_path / "w.csv", "--where", "ROCK=ORE")) == 0
    chosen = pd.read_csv(tmp_path / "w.csv")
    assert set(chosen.loc[waste, "location"]) == {"not selected"}
    pd.testing.assert_series_equal(chosen["AU_estimate"], got["AU_estimate"])


def test_samples_in_wall_rock_are_left_out(model, tmp_path: Path, capsys) -> None:
    s = str(tmp_path / "s.json")
    assert main(estimated(model, tmp_path / "o.csv", "--summary", s)) == 0
    ore = pd.read_csv(model / "s.csv")["ORE"]
    facts = json.loads(Path(s).read_text())
    assert facts["samples"]["used"] == ore.sum()
    assert facts["samples"]["outside_body"] + facts["samples"]["outside_map"] == (~ore).sum()
    assert facts["mean_of_blocks"] == 1.0  # every sample of ore is 1 g/t
    # They lie in the middle of the cells of waste: half a block off, none nearer.
    said = capsys.readouterr().err
    assert "samples lie outside the body (wall rock): left out; --soft-boundary B lets in" in said
    more = ("--summary", s, "--overwrite", "--soft-boundary", "1")
    assert main(estimated(model, tmp_path / "o.csv", *more)) == 0
    soft = json.loads(Path(s).read_text())
    assert soft["samples"]["soft_boundary"] > 0
    assert soft["mean_of_blocks"] < 1


def test_samples_just_outside_whole_blocks_are_counted_apart(model) -> None:
    samples = pd.read_csv(model / "s.csv")
    ore = samples[samples["ORE"]]
    # One more sample under every hole's lowest block of ore, 3 of 10 m below its lower face.
    below = ore.sort_values("z").groupby("hole").head(1).assign(z=lambda lowest: lowest["z"] - 8)
    both = pd.concat([ore, below])
    found = flat_samples(gu.load(model / "m.npz"), both, grade="AU", soft_boundary=0.0)
    assert len(below) == found.wall_rock == found.beside == 24
    assert found.facts()["outside_body_within_half_a_block"] == 24
    (line,) = found.warnings("AU")
    assert "; 24 of them (100%) lie within half a block of it" in line
    assert line.endswith("--soft-boundary 0.5 lets these in")
    soft = flat_samples(gu.load(model / "m.npz"), both, grade="AU", soft_boundary=0.5)
    assert (soft.let_in, soft.wall_rock, soft.beside) == (24, 0, 0)


def test_an_estimate_that_tells_nothing_is_warned_of(model, tmp_path: Path, capsys) -> None:
    samples = pd.read_csv(model / "s.csv")
    samples["AU"] = np.random.default_rng(3).normal(2, 1, len(samples)).round(3)
    samples.to_csv(model / "noise.csv", index=False)
    s = ("--cross-validate", "--summary", str(tmp_path / "s.json"))
    assert main(estimated(model, tmp_path / "o.csv", *s, samples="noise.csv")) == 0
    told = capsys.readouterr().err
    # 24 holes: chance gives up to 1 / sqrt(24).
    assert "; below 0.2, for so many holes, it may be chance: the estimates tell next to" in told
    assert "warning: cross-validation: the estimates at" in told
    facts = json.loads((tmp_path / "s.json").read_text())
    assert abs(facts["cross_validation"]["correlation"]) < 0.2
    assert facts["warnings"][-1].startswith("cross-validation: ")
    good, poor = cross_validation_told(Scores(100, 0, 0.3, 0.0, 1.0, 0.61), 25)
    assert not poor
    assert good == (
        "cross-validation: the estimates at 100 samples of 25 left-out holes have a correlation "
        "of 0.61 with the grades and a root mean square error of 0.3"
    )
    # Estimates that are all the same have no correlation.
    assert cross_validation_told(Scores(9, 0, 0.3, 0.0, 1.0, float("nan")), 25)[1]


def test_samples_that_all_lie_outside_are_an_error(model, tmp_path: Path, capsys) -> None:
    far = pd.read_csv(model / "s.csv")
    far["z"] = 130.0  # the highest blocks end at z = 65: their centres lie at 60
    far.to_csv(tmp_path / "far.csv", index=False)
    words = estimated(model, tmp_path / "o.csv")
    words[2] = str(tmp_path / "far.csv")
    assert main(words) == 2
    # Of holes at y = 0; the blocks under x = 90, 120 and 150 are equally high.
    said = capsys.readouterr().err
    assert re.search(r"the nearest, at \(\d+, 0, 130\), is 65 \(6.5 blocks\) away", said)


@pytest.mark.parametrize(
    ("word", "more", "used"),
    [
        ("-", (), 1),
        ("<0.01", (), 1),
        ("<0.01", ("--below-detection", "half"), 0),
        ("-99", ("--missing", "-99,-999,-"), 1),
    ],
)
def test_codes_in_samples_are_read_as_in_assays(
    word: str, more: tuple[str, ...], used: int, model, tmp_path: Path, capsys
) -> None:
    samples = pd.read_csv(model / "s.csv", dtype=str)
    first = samples.index[samples["ORE"] == "True"][0]
    samples.loc[first, "AU"] = word
    samples.to_csv(model / "codes.csv", index=False)
    s = str(tmp_path / "s.json")
    words = estimated(model, tmp_path / "o.csv", "--summary", s, *more, samples="codes.csv")
    assert main(words) == 0
    facts = json.loads(Path(s).read_text())
    assert facts["samples"]["without_grade"] == used
    assert pd.read_csv(tmp_path / "o.csv")["AU_estimate"].min() >= 0
    said = capsys.readouterr().err
    assert (f"the first '{word}' at data row {first + 1}" in said) != (word == "-99")


def test_negative_grades_are_told_and_words_are_refused(model, tmp_path: Path, capsys) -> None:
    samples = pd.read_csv(model / "s.csv", dtype=str)
    ore = samples["ORE"] == "True"
    samples.loc[samples.index[ore][0], "AU"] = "-99"
    samples.to_csv(model / "codes.csv", index=False)
    assert main(estimated(model, tmp_path / "o.csv", samples="codes.csv")) == 0
    assert "1 of" in (said := capsys.readouterr().err)
    assert "values is negative, the first '-99'" in said
    samples["AU"] = np.where(np.arange(len(samples)) % 3, "BDL", samples["AU"])
    samples.to_csv(model / "codes.csv", index=False)
    assert main(estimated(model, tmp_path / "p.csv", samples="codes.csv")) == 2
    said = capsys.readouterr().err
    assert "codes.csv: column 'AU' is a grade, but" in said
    assert "the first 'BDL' at data row 2" in said


def test_codes_in_coordinates_are_told(model, tmp_path: Path, capsys) -> None:
    samples = pd.read_csv(model / "s.csv")
    samples.loc[7, "z"] = -999
    samples.to_csv(model / "z.csv", index=False)
    assert main(estimated(model, tmp_path / "o.csv", samples="z.csv")) == 0
    said = capsys.readouterr().err
    assert "z.csv: 1 row has -999 as z, far from all others" in said
    assert "data row 8; --missing -999 --drop-invalid, or" in said
    more = ("--missing", "-999", "--overwrite")
    assert main(estimated(model, tmp_path / "o.csv", *more, samples="z.csv")) == 2
    assert "1 of 240 rows has a missing or infinite coordinate: data row 8 (" in (
        capsys.readouterr().err
    )
    more = (*more, "--drop-invalid")
    assert main(estimated(model, tmp_path / "o.csv", *more, samples="z.csv")) == 0
    assert "1 row without finite coordinates left out: data row 8" in capsys.readouterr().err


def test_columns_of_rock_are_no_grades(model, tmp_path: Path, capsys) -> None:
    samples = pd.read_csv(model / "s.csv")
    samples["ZONE"] = np.where(samples["x"] > 100, "OX", "SUL")
    samples["ROCK CODE"] = np.where(samples["x"] > 100, 1, 2)
    samples.to_csv(model / "rock.csv", index=False)
    words = estimated(model, tmp_path / "o.csv", samples="rock.csv")
    words[words.index("--grade") + 1] = "ZONE"
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "column 'ZONE' holds words, such as SUL, OX, and no number: it is no grade; col" in said
    assert re.search(r"columns of numbers: .*\bAU\b.*; --samples-where \"ZONE=...\" chooses", said)
    assert said.count("\n") == 1
    words[2:4] = reversed(words[2:4])  # BLOCKS before SAMPLES
    assert main(words) == 2
    assert "rock.csv has it: were two files swapped? SAMPLES comes" in capsys.readouterr().err
    words[2:4] = reversed(words[2:4])
    words[words.index("--grade") + 1] = "ROCK CODE"
    assert main(words) == 0
    said = capsys.readouterr().err
    assert "column 'ROCK CODE' holds 2 whole numbers (1, 2) and is named as a code of rock" in said


def test_caps_and_declustering_are_in_the_summary(model, tmp_path: Path, capsys) -> None:
    samples = pd.read_csv(model / "s.csv")
    ore = samples.index[samples["ORE"]]
    samples.loc[ore[0], "AU"] = 50.0
    cluster = samples.loc[[ore[0]] * 20].assign(x=lambda f: f["x"] + np.linspace(-1, 1, 20))
    pd.concat([samples, cluster]).to_csv(model / "codes.csv", index=False)
    s = str(tmp_path / "s.json")
    more = ("--cap", "AU=5", "--decluster", "30,30,30", "--summary", s)
    assert main(estimated(model, tmp_path / "o.csv", *more, samples="codes.csv")) == 0
    facts = json.loads(Path(s).read_text())
    cap = facts["samples"]["values"]["cap"]
    assert (cap["changed"], cap["value"]) == (21, 5)
    assert cap["mean_after"] < cap["mean_before"]
    assert pd.read_csv(tmp_path / "o.csv")["AU_estimate"].max() <= 5
    found = facts["declustered"]
    assert 1 < found["mean"] < found["plain_mean"] == facts["mean_of_samples"]
    assert "AU was capped at 5: 21 of" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--soft-boundary", "-1"), "--soft-boundary needs 0 or more blocks"),
        (("--decluster", "0,1,1"), "--decluster needs sides above 0"),
        (("--cap", "AU"), "--cap needs COLUMN=VALUE"),
        (("--cap", "AU=px"), "--cap: the cap of AU must be a number or a percentile"),
        (("--cap", "CU=3"), "no column 'CU' to cap"),
        (("--below-detection", "none"), "--below-detection must be one of missing, half, zero"),
    ],
)
def test_options_for_values_are_checked(
    more: tuple[str, ...], message: str, model, tmp_path: Path, capsys
) -> None:
    assert main(estimated(model, tmp_path / "o.csv", *more)) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("command", ["estimate", "map"])
def test_blocks_of_another_place_are_an_error(files, tmp_path: Path, capsys, command: str) -> None:
    far = pd.read_csv(files["blocks.csv"])
    far.iloc[:, :3] += 1e5
    far.to_csv(tmp_path / "far.csv", index=False)
    out = tmp_path / "out.csv"
    argv = words(files | {"blocks.csv": str(tmp_path / "far.csv")}, out, "--quiet")
    if command == "map":
        argv = ["map", files["m.npz"], str(tmp_path / "far.csv"), "-o", str(out), "--quiet"]
    assert main(argv) == 2
    assert f"the map reaches none of the {len(far)}" in capsys.readouterr().err
    assert not out.exists()
