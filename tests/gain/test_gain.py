"""The verdict before the work, and the comparison by left-out holes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import InputError
from geounfold.estimation import Structure, Variogram
from geounfold.gain.arms import limbs_of, places_of, rotation_of, turn_between
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic import GradeField, drill

pytest.importorskip("gstlearn", reason="the extra geostat is not installed")


def drilled(name: str, ranges: tuple[float, float, float], spacing: float) -> tuple:
    body = gu.simulate(name, blocks=6000)
    field = GradeField("spherical", ranges, seed=2, mean=1.0, deviation=0.4)
    samples = gu.read_drillholes(*drill(body, field, spacing, seed=1)).samples(8.0)
    return body, gu.unfold(body.folded), samples


@pytest.fixture(scope="module")
def flat() -> tuple:
    return drilled("slab", (120.0, 120.0, 15.0), 60.0)


@pytest.fixture(scope="module")
def fold() -> tuple:
    return drilled("steep", (300.0, 300.0, 30.0), 40.0)


def test_normals_are_those_of_the_layer(fold: tuple) -> None:
    body, u, samples = fold
    own, there = places_of(u.map, samples[["x", "y", "z"]].to_numpy())
    truth, _ = body.sheet.unfold(own.folded)
    steps = [np.array([2.0, 0, 0]), np.array([0, 2.0, 0])]
    images = [body.sheet.fold(truth + s) - body.sheet.fold(truth - s) for s in steps]
    true = np.cross(*images)
    true /= np.linalg.norm(true, axis=1)[:, None]
    off = np.degrees(np.arccos(np.clip((own.normal * true).sum(axis=1), -1, 1)))
    assert there.mean() > 0.99
    assert np.quantile(off, 0.9) < 6  # measured 2.6; of the mean plane it is 70
    # A quarter of the wave turns the layer from the crest to a limb of 70 degrees.
    assert turn_between(own, 20.0) < turn_between(own, 100.0)


def test_a_rotation_has_the_normal_as_its_third_axis() -> None:
    rng = np.random.default_rng(0)
    for normal in rng.normal(size=(20, 3)):
        normal = normal / np.linalg.norm(normal)
        third = rotation_from_angles(*rotation_of(normal))[2]
        assert np.abs(third @ normal) == pytest.approx(1, abs=1e-12)


def test_limbs_are_the_dips_that_are_there() -> None:
    rng = np.random.default_rng(0)
    dips = np.radians(rng.choice([-60.0, 60.0], 200) + rng.normal(0, 5, 200))
    limbs = limbs_of(np.column_stack([np.sin(dips), np.zeros(200), np.cos(dips)]))
    found = sorted(np.degrees(np.arctan2(limbs.axes[:, 0], limbs.axes[:, 2])))
    assert np.allclose(found, [-60, 60], atol=2)
    assert len(limbs_of(np.tile([0.0, 0.0, 1.0], (9, 1))).axes) == 1


def test_a_plane_serves_on_a_slab(flat: tuple) -> None:
    _, u, samples = flat
    found = gu.assess(u, samples, grade="grade")
    assert found.verdict.startswith("a plane serves as well here")
    assert found.gains.loc["plane", "gain"] < 0.01
    assert found.gains.loc["isotropic", "gain"] > 0.03
    assert found.turn_in_range < 2
    assert found.limbs == 1
    assert (found.gains["low"] <= found.gains["gain"]).all()


def test_unfolding_pays_on_steep_limbs(fold: tuple) -> None:
    _, u, samples = fold
    model = Variogram(0.0, (Structure("spherical", 0.16, (300.0, 300.0, 30.0)),))
    found = gu.assess(u, samples, grade="grade", variogram=model)
    assert found.verdict.startswith("unfolding is expected to pay here")
    assert found.gains.loc["plane", "gain"] > 0.1
    noisy = Variogram(0.12, (Structure("spherical", 0.04, (60.0, 60.0, 6.0)),))
    less = gu.assess(u, samples, grade="grade", variogram=noisy)
    assert less.gains.loc["plane", "gain"] < 0.5 * found.gains.loc["plane", "gain"]
    assert less.turn_in_range < found.turn_in_range


def test_the_rows_order_does_not_matter(fold: tuple) -> None:
    _, u, samples = fold
    mixed = samples.sample(frac=1, random_state=0)
    a, b = (gu.assess(u, s, grade="grade").gains["gain"] for s in (samples, mixed))
    np.testing.assert_allclose(a, b, atol=0.02)  # which samples choose the plane is drawn by row


def test_left_out_holes_favour_what_is_true(flat: tuple) -> None:
    _, u, samples = flat
    found = gu.study_holes(u, samples, ["grade"])
    rows = found.errors.set_index("arm")
    # On a slab stratigraphic and unfolded coordinates are the same but for the map's rounding.
    assert rows.loc["stratigraphic", "rmse"] == pytest.approx(
        rows.loc["unfolded", "rmse"], rel=0.02
    )
    assert rows.loc["isotropic", "rmse"] > rows.loc["unfolded", "rmse"]
    assert rows.loc["unfolded", "gain"] == 0
    assert (rows["low"] <= rows["gain"]).all()
    assert (rows["gain"] <= rows["high"]).all()
    assert len(found.verdicts()) == 1


def test_too_few_holes_are_refused(flat: tuple) -> None:
    _, u, samples = flat
    few = samples[samples["hole"].isin(samples["hole"].unique()[:2])]
    with pytest.raises(InputError, match="three holes or more in the body, not of 2"):
        gu.assess(u, few, grade="grade")
    with pytest.raises(InputError, match="2 holes with samples in the body, but a"):
        gu.study_holes(u, few, ["grade"])
    with pytest.raises(InputError, match="hole column"):
        gu.assess(u, samples.drop(columns="hole"), grade="grade")
    with pytest.raises(InputError, match="pure nugget"):
        gu.assess(u, samples, grade="grade", variogram=Variogram(1.0, ()))
    with pytest.raises(InputError, match="needs a grade"):
        gu.study_holes(u, samples, [])


# ------------------------------------------------------------------------------ the command line


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory, flat: tuple) -> Path:
    folder = tmp_path_factory.mktemp("gain")
    body, u, samples = flat
    u.save(folder / "m.npz")
    samples.to_csv(folder / "samples.csv", index=False)
    field = GradeField("spherical", (120.0, 120.0, 15.0), seed=2, mean=1.0, deviation=0.4)
    tables = drill(body, field, 60.0, seed=1)
    for name, table in zip(("collar", "survey", "assay"), tables, strict=True):
        table.to_csv(folder / f"{name}.csv", index=False)
    return folder


def test_assess_prints_its_verdict(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["assess", str(files / "m.npz"), str(files / "samples.csv"), "--grade", "grade"]
    assert main([*argv, "--summary", str(files / "a.json")]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[-1].startswith("a plane serves as well here")
    assert (files / "a.json").stat().st_size > 0


def test_assess_takes_a_model(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = Variogram(0.3, (Structure("spherical", 0.7, (90.0, 90.0, 12.0)),))
    (files / "v.toml").write_text(model.to_toml(), encoding="utf-8")
    argv = ["assess", str(files / "m.npz"), str(files / "samples.csv"), "--grade", "grade"]
    assert main([*argv, "--variogram", str(files / "v.toml")]) == 0
    out = capsys.readouterr().out
    assert "over the range of 90 " in out
    assert "nugget 30%" in out
    assert main([*argv, "--variogram", str(files / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err


def test_the_page_of_a_study_loads_nothing(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables = [str(files / f"{name}.csv") for name in ("collar", "survey", "assay")]
    page = files / "p.html"
    argv = ["study-holes", *tables, "--body", str(files / "m.npz"), "--grade", "grade"]
    argv += ["--composite", "8", "-o", str(page), "--table", str(files / "t.csv")]
    assert main(argv) == 0
    text = page.read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)=|url\(|https?://(?!www\.w3\.org)", text)
    table = pd.read_csv(files / "t.csv")
    assert f"{table['rmse'].iloc[0]:.4g}" in text
    assert "grade: unfolded has" in capsys.readouterr().out
    first = page.read_bytes()
    assert main([*argv, "--overwrite"]) == 0
    assert page.read_bytes() == first


def test_too_few_holes_are_told_before_the_body_is_read(files: Path, tmp_path, capsys) -> None:
    # The body is no map: an error about the holes shows that it was not reached.
    (tmp_path / "body.npz").write_text("none")
    for name in ("collar", "survey", "assay"):
        table = pd.read_csv(files / f"{name}.csv")
        some = table["hole"].isin(sorted(table["hole"].unique())[:6])
        table[some].to_csv(tmp_path / f"{name}.csv", index=False)
    tables = [str(tmp_path / f"{name}.csv") for name in ("collar", "survey", "assay")]
    argv = ["study-holes", *tables, "--body", str(tmp_path / "body.npz"), "--grade", "grade"]
    assert main([*argv, "-o", str(tmp_path / "p.html")]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert (
        "grade: 6 holes with values, but a comparison that leaves out whole holes needs 10" in said
    )
    samples = pd.read_csv(files / "samples.csv")
    samples[samples["hole"] == samples["hole"].iloc[0]].to_csv(tmp_path / "s.csv", index=False)
    argv = ["assess", str(tmp_path / "body.npz"), str(tmp_path / "s.csv"), "--grade", "grade"]
    assert main(argv) == 2
    assert "three holes or more with values, not of 1" in capsys.readouterr().err


BAD = [
    (["--grade", "grade"], "needs --body, --code or --cut-off"),
    (["--grade", "grade", "--body", "{}/m.npz", "--code", "ORE"], "one of them"),
    (["--grade", ",", "--body", "{}/m.npz"], "--grade needs columns"),
    (["--grade", "graed", "--body", "{}/m.npz"], "no grade 'graed'; did you mean grade"),
    (["--grade", "grade", "--body", "{}/none.npz"], "none.npz"),
    (["--grade", "grade", "--body", "{}/m.npz", "--composite", "x"], "--composite needs a number"),
]


@pytest.mark.parametrize(("more", "line"), BAD)
def test_bad_words_end_in_one_line(
    files: Path, more: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tables = [str(files / f"{name}.csv") for name in ("collar", "survey", "assay")]
    words = [word.format(files) for word in more]
    assert main(["study-holes", *tables, "-o", str(files / "bad.html"), *words]) == 2
    err = capsys.readouterr().err.strip().splitlines()
    assert line in err[-1]
    assert all(other.startswith("geounfold: warning") for other in err[:-1])
