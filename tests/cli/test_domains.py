"""A model of four domains in one command: two lodes that touch, a folded seam, waste."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from tests.cli.domains import four_domains
from tests.shapes import grid_cells

FLAT = ["unfolded_x", "unfolded_y", "unfolded_z"]
LODES = ("LODE 1", "LODE 2", "SEAM")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the model, its unfolded table, its map file and its summary."""
    path = tmp_path_factory.mktemp("domains")
    four_domains().to_csv(path / "model.csv", index=False)
    words = ["unfold", str(path / "model.csv"), "-o", str(path / "flat.csv"), "--by", "domain"]
    more = ["--map", str(path / "m.npz"), "--summary", str(path / "s.json"), "--quiet"]
    assert main([*words, *more, "--where", "DOMAIN != WASTE"]) == 0
    return path


def test_every_domain_is_unfolded_on_its_own(folder: Path) -> None:
    model, flat = pd.read_csv(folder / "model.csv"), pd.read_csv(folder / "flat.csv")
    pd.testing.assert_frame_equal(flat[[*model]], model)  # rows and columns as given, in order
    waste = flat["DOMAIN"] == "WASTE"
    assert (flat.loc[waste, "location"] == "not selected").all()
    assert flat.loc[waste, FLAT].isna().all(axis=None)
    for name in LODES:
        rows = flat["DOMAIN"] == name
        alone = gu.unfold(model.loc[rows, ["x", "y", "z"]])
        np.testing.assert_array_equal(flat.loc[rows, FLAT], alone.points)
        assert set(flat.loc[rows, "location"]) == {"inside"}
    told = json.loads((folder / "s.json").read_text())
    assert [row["domain"] for row in told["domains"]] == list(LODES)
    assert {row["outcome"] for row in told["domains"]} == {"proved"}
    assert [row["blocks"] for row in told["domains"]] == [1152, 1152, 864]  # 24 x 12 x 4, x 3
    assert told["by"] == "DOMAIN"
    assert set(told["summaries"]) == set(LODES)


@pytest.mark.slow
def test_blocks_and_samples_of_domains_get_standard_deviations(
    folder: Path, tmp_path: Path
) -> None:
    model = pd.read_csv(folder / "model.csv")
    rows = model[model["DOMAIN"] == "SEAM"].iloc[:5]
    rows.to_csv(tmp_path / "q.csv", index=False)
    words = ["unfold", str(folder / "model.csv"), "-o", str(tmp_path / "o.csv"), "--by", "DOMAIN"]
    more = ["--samples", str(tmp_path / "q.csv"), "--samples-out", str(tmp_path / "qo.csv")]
    more += ["--where", "DOMAIN != WASTE", "--uncertainty", "6", "--quiet"]
    assert main([*words, *more]) == 0
    flat, carried = pd.read_csv(tmp_path / "o.csv"), pd.read_csv(tmp_path / "qo.csv")
    for name in ("sd_along", "sd_across"):
        assert (flat[name].notna() == (flat["DOMAIN"] != "WASTE")).all()
        # The samples are blocks: they have their blocks' values.
        np.testing.assert_allclose(carried[name], flat.loc[rows.index, name], rtol=1e-5)


def test_a_domain_that_fails_leaves_the_others_standing(folder: Path, capsys) -> None:
    out = folder / "all.csv"
    words = ["unfold", str(folder / "model.csv"), "-o", str(out), "--by", "DOMAIN", "--json"]
    assert main(words) == 1
    said = capsys.readouterr()
    assert "1 of 4 domains failed, the others are there: WASTE: " in said.err
    told = json.loads(said.out)
    waste = (
        "DOMAIN WASTE (11952 blocks; its name means waste) is unfolded as a body too: leave it out "
        'by --where "DOMAIN!=WASTE"'
    )
    assert told["warnings"][0] == waste
    assert said.err.index(f"warning: {waste}") < said.err.index("domains failed")
    assert said.err.rstrip().endswith('--where "DOMAIN!=WASTE" leaves out what is no body')
    rows = {row["domain"]: row for row in told["domains"]}
    assert rows["WASTE"]["outcome"] == "failed"
    assert rows["WASTE"]["error"]
    every, flat = pd.read_csv(out), pd.read_csv(folder / "flat.csv")
    pd.testing.assert_frame_equal(every[FLAT], flat[FLAT])
    assert set(every.loc[every["DOMAIN"] == "WASTE", "location"]) == {"elsewhere"}


def test_if_all_domains_fail_nothing_is_written(folder: Path, capsys) -> None:
    out = folder / "none.csv"
    words = ["unfold", str(folder / "model.csv"), "-o", str(out), "--by", "DOMAIN"]
    assert main([*words, "--where", "DOMAIN=WASTE"]) == 2
    assert "DOMAIN WASTE: " in capsys.readouterr().err
    assert not out.exists()


def test_the_library_gives_the_same(folder: Path, tmp_path: Path) -> None:
    model = pd.read_csv(folder / "model.csv")
    told: list[str] = []
    found = gu.unfold_domains(model, "domain", where="DOMAIN!=WASTE", progress=told.append)
    assert {name.partition(":")[0] for name in told} == set(LODES)
    flat = pd.read_csv(folder / "flat.csv")
    pd.testing.assert_frame_equal(
        found.table[[*FLAT, "location", "stratigraphic"]],
        flat[[*FLAT, "location", "stratigraphic"]],
        check_dtype=False,
    )
    assert list(found) == list(LODES)
    assert found.rows["outcome"].tolist() == ["proved"] * 3
    found.save(tmp_path / "m.npz")
    assert (tmp_path / "m.npz").read_bytes() == (folder / "m.npz").read_bytes()
    with pytest.raises(gu.InputError, match="load_domains"):
        gu.load(tmp_path / "m.npz")
    saved = gu.load_domains(tmp_path / "m.npz")
    assert isinstance(saved, gu.DomainMap)
    points = model[["x", "y", "z"]].to_numpy(float)
    image = saved.to_flat(points, model["DOMAIN"])
    np.testing.assert_array_equal(image, flat[FLAT])
    ore = model["DOMAIN"] != "WASTE"
    back = saved.to_folded(image[ore], model["DOMAIN"][ore])
    np.testing.assert_allclose(back, points[ore], atol=1e-8)
    with pytest.raises(gu.GeounfoldError, match="WASTE"):
        gu.unfold_domains(model, "DOMAIN", where="DOMAIN=WASTE")
    with pytest.raises(gu.InputError, match="no column 'DOMAN'; did you mean DOMAIN"):
        gu.unfold_domains(model, "DOMAN")


def test_map_there_and_back_by_the_same_column(folder: Path, tmp_path: Path, capsys) -> None:
    m, out, back = str(folder / "m.npz"), str(tmp_path / "o.csv"), str(tmp_path / "b.csv")
    assert main(["map", m, str(folder / "model.csv"), "-o", out]) == 0
    assert "rows are of domains that the map does not hold (WASTE)" in capsys.readouterr().err
    flat, carried = pd.read_csv(folder / "flat.csv"), pd.read_csv(out)
    np.testing.assert_array_equal(carried[FLAT], flat[FLAT])
    waste = carried["DOMAIN"] == "WASTE"
    assert set(carried.loc[waste, "location"]) == {"elsewhere"}
    carried[~waste].to_csv(out, index=False)
    assert main(["map", m, out, "--inverse", "-o", back]) == 0
    found = pd.read_csv(back)
    np.testing.assert_allclose(
        found[["folded_x", "folded_y", "folded_z"]], found[["x", "y", "z"]], atol=1e-8
    )
    assert main(["map", m, out, "-o", back, "--overwrite", "--domain", "LODE 3"]) == 2
    assert "no domain 'LODE 3'; did you mean LODE" in capsys.readouterr().err


def test_points_without_the_column_go_by_place(folder: Path, tmp_path: Path, capsys) -> None:
    flat = pd.read_csv(folder / "flat.csv")
    ore = flat["DOMAIN"] != "WASTE"
    bare, out = tmp_path / "bare.csv", tmp_path / "o.csv"
    flat.loc[ore, ["x", "y", "z"]].to_csv(bare, index=False)
    assert main(["map", str(folder / "m.npz"), str(bare), "-o", str(out)]) == 0
    assert "no column 'DOMAIN': each point was given to the domain" in capsys.readouterr().err
    carried = pd.read_csv(out)
    assert carried["DOMAIN"].tolist() == flat.loc[ore, "DOMAIN"].tolist()
    np.testing.assert_array_equal(carried[FLAT], flat.loc[ore, FLAT])
    carried[FLAT].to_csv(bare, index=False)
    inverse = ["map", str(folder / "m.npz"), str(bare), "--inverse", "-o", str(out)]
    assert main([*inverse, "--overwrite"]) == 2
    assert "no column 'DOMAIN'" in capsys.readouterr().err


def test_estimates_of_a_domain_are_those_of_its_own_samples(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("gstlearn", reason="the extra geostat is not installed")
    model = pd.read_csv(folder / "model.csv")
    samples, blocks = tmp_path / "s.csv", tmp_path / "b.csv"
    model[model["DOMAIN"] != "WASTE"].iloc[::7].to_csv(samples, index=False)
    model.drop(columns="AU").to_csv(blocks, index=False)
    out, s = tmp_path / "o.csv", tmp_path / "s.json"
    words = ["estimate", str(folder / "m.npz"), str(samples), str(blocks), "-o", str(out)]
    how = ["--grade", "AU", "--method", "inverse_distance", "--radii", "90,90,90"]
    assert main([*words, *how, "--summary", str(s), "--quiet"]) == 0
    found = pd.read_csv(out)
    ore = model["DOMAIN"] != "WASTE"
    # Every domain has one grade; blocks of the next domain, 10 m away, change nothing.
    np.testing.assert_allclose(found.loc[ore, "AU_estimate"], model.loc[ore, "AU"], rtol=1e-12)
    assert set(found.loc[~ore, "location"]) == {"elsewhere"}
    told = json.loads(s.read_text())
    assert [row["mean_of_blocks"] for row in told["domains"]] == pytest.approx([1, 2, 3])
    # A domain without samples fails by name, and the others stand.
    few = pd.read_csv(samples)
    few[few["DOMAIN"] != "SEAM"].to_csv(samples, index=False)
    assert main([*words, *how, "--overwrite", "--quiet"]) == 1
    left = pd.read_csv(out)
    assert set(left.loc[left["DOMAIN"] == "SEAM", "location"]) == {"elsewhere"}
    assert left.loc[left["DOMAIN"] == "LODE 1", "AU_estimate"].notna().all()


def test_grids_and_values_keep_to_their_domains(folder: Path, tmp_path: Path) -> None:
    m, flat = str(folder / "m.npz"), str(folder / "flat.csv")
    grid, moved = str(tmp_path / "g.csv"), str(tmp_path / "t.csv")
    sizes = ["--sizes", "10,10,5"]
    assert main(["grid", flat, "-o", grid, *sizes, "--map", m, "--quiet"]) == 0
    made = pd.read_csv(grid)
    assert set(made["DOMAIN"]) == set(LODES)
    words = ["transfer", m, str(folder / "model.csv"), grid, "-o", moved, "--values", "AU"]
    assert main([*words, "--to", "unfolded", "--quiet"]) == 0
    found = pd.read_csv(moved).dropna(subset=["AU"])
    means = found.groupby("DOMAIN")["AU"]
    assert means.min().tolist() == means.max().tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("--report r.html", "--report is for one body: go without --by"),
        ("--mesh c.vtu", "--mesh is for one body"),
        ("--crosscheck", "--crosscheck is for one body"),
    ],
)
def test_options_of_one_body_are_refused(more: str, message: str, folder: Path, capsys) -> None:
    words = ["unfold", str(folder / "model.csv"), "-o", str(folder / "x.csv"), "--by", "DOMAIN"]
    assert main([*words, *more.split()]) == 2
    assert message in capsys.readouterr().err


def test_maps_of_one_body_and_of_several_are_told_apart(
    folder: Path, tmp_path: Path, capsys
) -> None:
    m = str(folder / "m.npz")
    (tmp_path / "w.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "120 60 30\n130 60 30\n120 70 30\n3 0 1 2\n"
    )
    wire = ["map", m, str(tmp_path / "w.ply"), "-o", str(tmp_path / "o.ply")]
    assert main(wire) == 2
    assert "holds the maps of 3 domains (LODE 1, LODE 2, SEAM)" in capsys.readouterr().err
    assert main([*wire, "--domain", "LODE 1"]) == 0
    broken = tmp_path / "b.npz"
    broken.write_bytes((folder / "m.npz").read_bytes()[:-2000])
    assert main(["map", str(broken), str(folder / "model.csv"), "-o", str(tmp_path / "o.csv")]) == 2
    one = tmp_path / "one.npz"
    gu.load_domains(folder / "m.npz")["SEAM"].save(one)
    words = ["map", str(one), str(folder / "model.csv"), "-o", str(tmp_path / "o.csv")]
    assert main([*words, "--by", "DOMAIN"]) == 2
    assert "--by needs a map of domains" in capsys.readouterr().err


def test_holes_and_samples_without_the_column_are_told(
    folder: Path, tmp_path: Path, capsys
) -> None:
    model = pd.read_csv(folder / "model.csv")
    seam = model[model["DOMAIN"] == "SEAM"].iloc[::50]
    seam[["x", "y", "z"]].to_csv(tmp_path / "q.csv", index=False)
    words = ["unfold", str(folder / "model.csv"), "-o", str(tmp_path / "o.csv"), "--by", "DOMAIN"]
    more = ["--samples", str(tmp_path / "q.csv"), "--samples-out", str(tmp_path / "qo.csv")]
    assert main([*words, *more, "--where", "DOMAIN=SEAM"]) == 0
    assert "the samples: no column 'DOMAIN': each point was given" in capsys.readouterr().err
    found = pd.read_csv(tmp_path / "qo.csv")
    assert set(found["DOMAIN"]) == {"SEAM"}
    flat = pd.read_csv(folder / "flat.csv").loc[seam.index, FLAT]
    np.testing.assert_array_equal(found[FLAT], flat)


@pytest.mark.parametrize(
    ("by", "message"),
    [
        ("DOMAN", "model.csv: no column 'DOMAN'; did you mean DOMAIN?"),
        ("EMPTY", "model.csv: column 'EMPTY' has no value in any row that is chosen"),
        ("ID", "column 'ID' has 1200 different values (0, 1, 2, ...)"),
    ],
)
def test_columns_that_are_no_domains(by: str, message: str, tmp_path: Path, capsys) -> None:
    frame = pd.DataFrame(grid_cells(20, 20, 3), columns=list("xyz"))
    frame.assign(DOMAIN="A", EMPTY="", ID=np.arange(1200)).to_csv(
        tmp_path / "model.csv", index=False
    )
    words = ["unfold", str(tmp_path / "model.csv"), "-o", str(tmp_path / "o.csv"), "--by", by]
    assert main(words) == 2
    assert message in capsys.readouterr().err
