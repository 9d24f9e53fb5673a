"""The frame in the columns of a rotated Datamine model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.errors import InputError
from geounfold.io.packages.datamine import frame_in
from tests.shapes import grid_cells

PLACE = np.array([412000.0, 6815600.0, 250.0])
CORNER = np.array([1000.0, 2000.0, 0.0])


def model(angle: float = 30.0, axis: float = 3.0, corner: np.ndarray = CORNER) -> pd.DataFrame:
    """Return a slab of 24 x 18 x 3 blocks in its own coordinates, as Datamine writes it."""
    own = (grid_cells(24, 18, 3) + 0.5) * 10.0 + corner
    frame = pd.DataFrame(own, columns=["XC", "YC", "ZC"])
    fixed = {"X0": PLACE[0], "Y0": PLACE[1], "Z0": PLACE[2]}
    fixed |= {"ANGLE1": angle, "ANGLE2": 0, "ANGLE3": 0}
    fixed |= {"ROTAXIS1": axis, "ROTAXIS2": 0, "ROTAXIS3": 0}
    fixed |= {"XMORIG": corner[0], "YMORIG": corner[1], "ZMORIG": corner[2], "XINC": 10}
    return frame.assign(**fixed)


def world(frame: pd.DataFrame, angle: float, corner: np.ndarray = CORNER) -> np.ndarray:
    """Return world coordinates by hand: y of the model points so many degrees east of north."""
    x, y, z = (frame[["XC", "YC", "ZC"]].to_numpy() - corner).T
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    return np.column_stack([x * cosine + y * sine, y * cosine - x * sine, z]) + PLACE


@pytest.mark.parametrize("corner", [CORNER, np.zeros(3)])
@pytest.mark.parametrize("angle", [30.0, -75.0, 0.0, 450.0])
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_own_coordinates_are_moved_to_the_world(tmp_path, kind, angle, corner) -> None:
    frame = model(angle, corner=corner)
    path = tmp_path / f"m.{kind}"
    frame.to_csv(path, index=False) if kind == "csv" else frame.to_parquet(path)
    found = frame_in(path)
    assert found is not None
    assert "--origin and --rotation" in found.note
    own = frame[["XC", "YC", "ZC"]].to_numpy()
    np.testing.assert_allclose(found.frame.to_world(own), world(frame, angle, corner), atol=1e-6)


def test_unfold_and_map_use_the_world(tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    frame = model()
    frame.to_csv("m.csv", index=False)
    assert main(["unfold", "m.csv", "-o", "o.csv", "--map", "m.npz", "--summary", "s.json"]) == 0
    assert "note: m.csv: XC, YC, ZC are the rotated model's own" in capsys.readouterr().err
    out = pd.read_csv("o.csv")
    np.testing.assert_allclose(out[["world_x", "world_y", "world_z"]], world(frame, 30), atol=1e-6)
    pd.DataFrame(world(frame, 30), columns=list("xyz")).to_csv("w.csv", index=False)
    assert main(["map", "m.npz", "w.csv", "-o", "a.csv"]) == 0
    assert main(["map", "m.npz", "m.csv", "-o", "b.csv"]) == 0
    flat = ["unfolded_x", "unfolded_y", "unfolded_z"]
    assert np.allclose(pd.read_csv("a.csv")[flat], pd.read_csv("b.csv")[flat], atol=1e-5)
    assert np.allclose(pd.read_csv("a.csv")[flat], out[flat], atol=1e-5)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"ROTAXIS1": 1.0}, "turned by 30 about axis 1"),
        ({"ANGLE2": 10.0, "ROTAXIS2": 1.0}, "10 about axis 1"),
        ({"X0": np.arange(1296.0)}, "vary"),
        ({"Y0": np.nan}, "vary or are empty"),
    ],
)
def test_what_is_not_sure_is_asked_for(tmp_path: Path, changed, words) -> None:
    model().assign(**changed).to_csv(tmp_path / "m.csv", index=False)
    with pytest.raises(InputError, match=rf"{words}.*--origin X,Y,Z and --rotation"):
        frame_in(tmp_path / "m.csv")


def test_models_that_are_not_turned_have_no_frame(tmp_path: Path) -> None:
    model(0.0).assign(XMORIG=PLACE[0], YMORIG=PLACE[1], ZMORIG=PLACE[2]).to_csv(
        tmp_path / "a.csv", index=False
    )
    model().assign(XWORLD=1.0, YWORLD=2.0, ZWORLD=3.0).to_csv(tmp_path / "b.csv", index=False)
    model()[["XC", "YC", "ZC", "XINC"]].to_csv(tmp_path / "c.csv", index=False)
    assert [frame_in(tmp_path / f"{name}.csv") for name in "abc"] == [None, None, None]


@pytest.mark.parametrize("columns", [None, "X,Y,DEPTH"])
def test_depths_are_refused_with_the_way_out(tmp_path: Path, columns, capsys) -> None:
    (tmp_path / "d.csv").write_text("X,Y,DEPTH\n1,2,3\n")
    argv = ["unfold", str(tmp_path / "d.csv"), "-o", str(tmp_path / "o.csv")]
    assert main([*argv, *([] if columns is None else ["--columns", columns])]) == 2
    assert "'DEPTH' counts downwards" in capsys.readouterr().err
