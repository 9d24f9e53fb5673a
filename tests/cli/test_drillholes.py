"""Drill holes on the command line, with the body and its map."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, gu.Unfolding, pd.DataFrame]:
    """A small fold, and holes whose midpoints are blocks: straight down from 50 above each."""
    folder = tmp_path_factory.mktemp("holes")
    blocks = gu.simulate("sim_case_1", blocks=3000).frame(4)
    blocks.to_csv(folder / "X.csv", index=False)
    chosen = blocks.iloc[::300].reset_index(drop=True)
    names = [f"H{k}" for k in range(len(chosen))]
    xyz = chosen[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    pd.DataFrame({"hole": names, "x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2] + 50}).to_csv(
        folder / "collar.csv", index=False
    )
    pd.DataFrame({"hole": names, "at": 0, "azimuth": 0, "dip": -90}).to_csv(
        folder / "survey.csv", index=False
    )
    pd.DataFrame({"hole": names, "from": 49, "to": 51, "au": 1.5}).to_csv(
        folder / "assay.csv", index=False
    )
    return folder, gu.unfold(blocks[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()), blocks


def test_samples_and_traces_go_with_the_body(
    body: tuple[Path, gu.Unfolding, pd.DataFrame], capsys: pytest.CaptureFixture[str]
) -> None:
    import pyvista

    folder, unfolding, _ = body
    tables = [str(folder / f"{kind}.csv") for kind in ("collar", "survey", "assay")]
    argv = ["unfold", str(folder / "X.csv"), "-o", str(folder / "Y.csv"), "--holes", *tables]
    argv += ["--samples-out", str(folder / "S.csv"), "--traces-out", str(folder / "T.vtp")]
    argv += ["--map", str(folder / "m.npz"), "--summary", str(folder / "s.json")]
    assert main(argv) == 0
    err = capsys.readouterr().err
    assert "no dip is positive" in err
    samples = pd.read_csv(folder / "S.csv")
    flat = samples[["unfolded_x", "unfolded_y", "unfolded_z"]].to_numpy()
    # Midpoints are blocks but for rounding of z + 50 - 50, 1e-14, so they land on them.
    np.testing.assert_allclose(flat, unfolding.points[::300], rtol=0, atol=1e-9)
    assert set(samples["location"]) == {"inside"}
    lines = pyvista.read(folder / "T.vtp")
    assert lines.n_lines == len(samples)
    assert list(lines.cell_data["hole"]) == samples["hole"].tolist()
    image = unfolding.to_flat(np.asarray(lines.points))
    np.testing.assert_allclose(lines.point_data["unfolded"], image, rtol=0, atol=1e-9)
    summary = json.loads((folder / "s.json").read_text())
    assert summary["drillholes"]["holes"] == len(samples)
    assert summary["drillholes"]["samples"] == {
        "points": len(samples),
        "extrapolated": 0,
        "outside": 0,
    }
    assert any("no dip is positive" in line for line in summary["warnings"])

    # The saved map carries them alike, and traces as a table have both spaces.
    argv = ["map", str(folder / "m.npz"), "--holes", *tables, "--no-dip-positive-down"]
    argv += ["--samples-out", str(folder / "S2.csv"), "--traces-out", str(folder / "T.csv")]
    assert main(argv) == 0
    assert (folder / "S2.csv").read_text() == (folder / "S.csv").read_text()
    traces = pd.read_csv(folder / "T.csv")
    np.testing.assert_array_equal(traces[["x", "y", "z"]], np.asarray(lines.points))
    np.testing.assert_array_equal(
        traces[["unfolded_x", "unfolded_y", "unfolded_z"]], lines.point_data["unfolded"]
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--composite", "2"], "--composite needs --holes"),
        (["--traces-out", "t.csv"], "--traces-out needs --holes"),
        (["--holes", "c.csv", "s.csv", "a.csv"], "needs --samples-out or --traces-out"),
        (
            ["--holes", "c", "s", "a", "--samples", "p.csv", "--samples-out", "q.csv"],
            "exclude each other",
        ),
    ],
)
def test_hole_options_that_do_not_go_together(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["unfold", "x.csv", "-o", "y.csv", *options]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["p.csv"], "map needs POINTS and -o OUT, or --holes"),
        ([], "the following arguments are required: POINTS"),
        (
            ["--holes", "c.csv", "s.csv", "a.csv", "--samples-out", "q.csv", "-o", "r.csv"],
            "map needs POINTS and -o OUT, or --holes",
        ),
        (["--samples-out", "q.csv", "p.csv", "-o", "r.csv"], "--samples-out needs --holes"),
        (
            ["--holes", "c.csv", "s.csv", "a.csv", "--samples-out", "q.csv", "--inverse"],
            "without --inverse",
        ),
    ],
)
def test_map_options_that_do_not_go_together(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", "m.npz", *options]) == 2
    assert words in capsys.readouterr().err


def test_bad_hole_options_are_one_line(
    body: tuple[Path, gu.Unfolding, pd.DataFrame], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = body[0]
    tables = [str(folder / f"{kind}.csv") for kind in ("collar", "survey", "assay")]
    argv = ["unfold", str(folder / "X.csv"), "-o", str(folder / "Z.csv"), "--holes", *tables]
    argv += ["--samples-out", str(folder / "Z2.csv")]
    for more, words in (
        (["--composite", "long"], "needs a length"),
        (["--composite", "-3"], "above 0"),
        (["--holes-columns", "dip"], "FIELD=NAME"),
        (["--holes-columns", "slope=dip"], "no field 'slope'"),
        (["--dip-positive-down", "--strict"], "every hole goes up"),
    ):
        assert main([*argv, *more]) == 2
        assert words in capsys.readouterr().err
        assert not (folder / "Z.csv").exists()
