"""Block models: turned frames, sub-blocks, and values moved between the spaces."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import geounfold as gu
from geounfold.body.block_model import BlockModel, regular_grid
from geounfold.body.model_frame import axes_from_angles
from geounfold.cli import main
from geounfold.errors import InputError, OptionError
from geounfold.estimation.transfer import transfer
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.block_sizes import block_model, size_columns

TURNED = axes_from_angles(37.0, plunge=-12.0, dip=20.0)
UTM = np.array([412_300.0, 6_815_700.0, 1_400.0])


def _sub_blocked(seed: int, axes: Floats = TURNED) -> BlockModel:
    """Return parents of 20 x 10 x 5 m, some of them cut in halves, some of those again."""
    rng = np.random.default_rng(seed)
    corner = np.stack(np.meshgrid(*map(np.arange, (5, 4, 3)), indexing="ij"), -1).reshape(-1, 3)
    low, side = corner * np.array([20.0, 10.0, 5.0]), np.tile([20.0, 10.0, 5.0], (len(corner), 1))
    for _ in range(3):
        cut = rng.random(len(low)) < 0.3
        axis = rng.integers(3, size=len(low))
        half = np.where(np.arange(3) == axis[:, None], 0.5, 1.0)
        shift = np.where(np.arange(3) == axis[:, None], side / 2, 0.0)
        small = side * half
        low = np.concatenate([low[~cut], low[cut], (low + shift)[cut]])
        side = np.concatenate([side[~cut], small[cut], small[cut]])
    return BlockModel(UTM + (low + side / 2) @ axes, side, axes)


def _by_force(model: BlockModel, points: Floats) -> Ints:
    own = (points[:, None] - model.centroids[None]) @ model.axes.T
    inside = (np.abs(own) <= model.sizes / 2).all(axis=2)
    return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


# ------------------------------------------------------------------------------------ frames


@given(st.floats(-360, 360), st.floats(-90, 90), st.floats(-90, 90))
def test_axes_are_a_rotation(bearing: float, plunge: float, dip: float) -> None:
    axes = axes_from_angles(bearing, plunge, dip)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(axes), 1.0)


def test_each_angle_turns_what_it_says() -> None:
    # East is world x: a bearing of 90 points the model's y axis there, its x axis then to south.
    assert np.allclose(axes_from_angles(90.0), [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    # A plunge of 30 lowers the y axis by sin 30 = 0.5, and leaves x level.
    plunging = axes_from_angles(0.0, plunge=30.0)
    assert np.isclose(plunging[1, 2], -0.5)
    assert np.isclose(plunging[0, 2], 0.0)
    # A dip of 30 lowers the x axis, and does not move y.
    dipping = axes_from_angles(0.0, dip=30.0)
    assert np.isclose(dipping[0, 2], -0.5)
    assert np.allclose(dipping[1], [0, 1, 0])


@pytest.mark.parametrize(
    ("angles", "says"), [((np.nan, 0, 0), "finite"), ((0, 91, 0), "within 90"), ((0, -95, 0), "90")]
)
def test_angles_refused(angles: tuple[float, float, float], says: str) -> None:
    with pytest.raises(OptionError, match=says):
        axes_from_angles(*angles)


# ------------------------------------------------------------------------------------ blocks


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_points_are_found_as_by_force(seed: int) -> None:
    model = _sub_blocked(seed)
    rng = np.random.default_rng(seed + 1)
    own = rng.uniform([-5, -5, -5], [105, 45, 20], size=(400, 3))  # the model is 100 x 40 x 15 m
    points = UTM + own @ model.axes
    found = model.locate(points)
    assert np.array_equal(found, _by_force(model, points))
    assert (found >= 0).any()
    assert (found < 0).any()


def test_a_point_on_a_face_has_one_block_whatever_the_order() -> None:
    model = BlockModel(np.array([[1.5, 0.5, 0.5], [0.5, 0.5, 0.5]]), np.ones((2, 3)))
    face = np.array([[1.0, 0.5, 0.5]])
    assert model.locate(face).tolist() == [1]  # the lower one along x
    swapped = BlockModel(model.centroids[::-1].copy(), model.sizes)
    assert swapped.locate(face).tolist() == [0]


def test_parts_fill_their_block() -> None:
    model = _sub_blocked(3)
    parts = model.sub_points(4, slice(0, len(model)))
    assert parts.shape == (len(model), 64, 3)  # 4^3
    # Coordinates of 7e6 m are rounded to 1e-9 m.
    assert np.abs(parts.mean(axis=1) - model.centroids).max() < 1e-7
    home = model.locate(parts.reshape(-1, 3)).reshape(parts.shape[:2])
    assert (home == np.arange(len(model))[:, None]).all()


@pytest.mark.parametrize(
    ("centroids", "sizes", "says"),
    [
        (np.zeros((2, 3)), np.array([[1.0, 1, 1], [1, 0, 1]]), "data row 2"),
        (np.zeros((2, 3)), np.array([[1.0, 1, 1], [1, np.nan, 1]]), "positive"),
        (np.zeros((2, 3)), np.ones((1, 3)), "sizes must have shape"),
        (np.zeros((2, 2)), np.ones((2, 2)), "centroids must have shape"),
        (np.full((1, 3), np.inf), np.ones((1, 3)), "finite"),
    ],
)
def test_boxes_refused(centroids: Floats, sizes: Floats, says: str) -> None:
    with pytest.raises(InputError, match=says):
        BlockModel(centroids, sizes)


def test_thousands_of_blocks_in_one_place_are_refused() -> None:
    model = BlockModel(np.zeros((5000, 3)), np.ones((5000, 3)))
    with pytest.raises(InputError, match="5000 blocks lie in one place"):
        model.locate(np.zeros((1, 3)))


def test_a_grid_covers_its_points_and_fits_the_next() -> None:
    points = np.random.default_rng(0).uniform(-40, 70, size=(500, 3))
    grid = regular_grid(np.concatenate([points, [[np.nan] * 3]]), np.array([10.0, 7.0, 3.0]))
    assert (grid.locate(points) >= 0).all()
    faces = (grid.centroids - grid.sizes / 2) / grid.sizes
    assert np.abs(faces - np.rint(faces)).max() < 1e-9
    low, high = points.min(axis=0), points.max(axis=0)
    assert (grid.centroids.min(axis=0) - grid.sizes[0] / 2 >= low - grid.sizes[0]).all()
    assert (grid.centroids.max(axis=0) + grid.sizes[0] / 2 <= high + grid.sizes[0]).all()


@pytest.mark.parametrize(
    ("points", "sizes", "says"),
    [
        (np.zeros((1, 3)), [1.0, 0.0, 1.0], "three positive sides"),
        (np.full((1, 3), np.nan), [1.0, 1.0, 1.0], "no point"),
        (np.array([[0.0] * 3, [1e4] * 3]), [1.0, 1.0, 1.0], "larger blocks"),
    ],
)
def test_grids_refused(points: Floats, sizes: list[float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        regular_grid(points, np.array(sizes))


# ------------------------------------------------------------------------------------- sizes


@pytest.mark.parametrize(
    "names", [("XINC", "YINC", "ZINC"), ("dx", "dy", "dz"), ("Size X", "Size_Y", "size_z (m)")]
)
def test_sides_are_found_by_name(names: tuple[str, str, str]) -> None:
    assert size_columns(["IJK", "x", "y", "z", *names]) == names
    frame = pd.DataFrame(dict(zip(names, ([4.0, 2.0], [3.0, 3.0], [1.0, 5.0]), strict=True)))
    model = block_model(frame, np.zeros((2, 3)), axes=np.eye(3))
    assert model.sizes.tolist() == [[4, 3, 1], [2, 3, 5]]
    assert model.volumes.tolist() == [12, 30]


def test_sides_and_turn_are_measured_where_nothing_tells_them() -> None:
    k = np.stack(np.meshgrid(*map(np.arange, (9, 8, 7)), indexing="ij"), -1).reshape(-1, 3)
    axes = axes_from_angles(25.0)
    model = block_model(pd.DataFrame(index=range(len(k))), UTM + (k * [20, 10, 5]) @ axes)
    assert np.allclose(model.sizes, [20, 10, 5], rtol=1e-6)
    assert np.allclose(model.axes, axes, atol=1e-6)


def test_sides_refused() -> None:
    scattered = np.random.default_rng(0).random((500, 3))
    with pytest.raises(InputError, match="--sizes"):
        block_model(pd.DataFrame(index=range(500)), scattered)
    with pytest.raises(InputError, match="no column c"):
        block_model(pd.DataFrame({"a": [1.0], "b": [1.0]}), np.zeros((1, 3)), ("a", "b", "c"))
    with pytest.raises(InputError, match="several columns"):
        size_columns(["dx", "dy", "dz", "xinc", "yinc", "zinc"])


# ----------------------------------------------------------------------------------- transfer


def test_volume_times_value_is_kept_where_both_fill_the_same_space() -> None:
    fine, coarse = _sub_blocked(5), _sub_blocked(11)
    grades = np.random.default_rng(5).lognormal(size=(len(fine), 2))
    moved = transfer(fine, grades, coarse, lambda points: points, split=8)
    # Sides are halved three times at most: with eighths every part lies in one source block.
    assert np.allclose(moved.share, 1.0)
    assert np.allclose(moved.carried, moved.total, rtol=1e-12)


def test_a_linear_field_goes_through_a_turn() -> None:
    source = regular_grid(np.array([[-30.0] * 3, [30.0] * 3]), np.full(3, 1.0))
    field = source.centroids @ np.array([0.3, -0.2, 0.5])
    target = BlockModel(np.zeros((1, 3)), np.full((1, 3), 8.0))
    moved = transfer(source, field[:, None], target, lambda p: p @ TURNED.T)
    # Parts lie symmetrically about the centre, where the field is 0; cells lie so too.
    assert abs(float(moved.means[0, 0])) < 1e-9


def test_what_has_no_value_is_counted_not_made_up() -> None:
    source = BlockModel(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]]), np.ones((2, 3)))
    target = BlockModel(
        np.array([[1.0, 0.5, 0.5], [1.5, 0.5, 0.5], [9.0, 0.5, 0.5]]),
        np.array([[2.0, 1, 1], [1, 1, 1], [1, 1, 1]]),
    )
    moved = transfer(source, np.array([[2.0], [np.nan]]), target, lambda points: points)
    assert moved.share[:, 0].tolist() == [0.5, 0.0, 0.0]
    assert moved.assigned[:, 0].tolist() == [True, False, False]
    assert moved.means[0, 0] == 2.0
    assert np.isnan(moved.means[1:, 0]).all()
    assert moved.carried.tolist() == moved.total.tolist() == [2.0]  # of the one block with a value


@pytest.mark.parametrize(
    ("values", "split", "says"),
    [
        (np.zeros((2, 1)), 4, "one row per source block"),
        (np.zeros(1), 4, "must have shape"),
        (np.full((1, 1), np.inf), 4, "finite"),
        (np.zeros((1, 1)), 0, "split must be 1 or more"),
    ],
)
def test_transfers_refused(values: Floats, split: int, says: str) -> None:
    one = BlockModel(np.zeros((1, 3)), np.ones((1, 3)))
    with pytest.raises((InputError, OptionError), match=says):
        transfer(one, values, one, lambda points: points, split=split)


def test_metal_is_kept_from_the_fold_to_the_grid_and_back(tmp_path: Path) -> None:
    """The whole street by the command line, as a user would go it."""
    folded, flat, saved = (str(tmp_path / n) for n in ("folded.csv", "flat.csv", "map.npz"))
    body = gu.simulate("plunging", blocks=6000)
    frame = pd.DataFrame(body.folded, columns=["x", "y", "z"])
    frame["au"] = 2 + np.sin(body.truth[:, 0] / 80) + body.stratigraphic
    frame.to_csv(folded, index=False)
    assert main(["unfold", folded, "-o", flat, "--map", saved, "--quiet"]) == 0
    grid, onto, back = (str(tmp_path / n) for n in ("grid.csv", "onto.csv", "back.csv"))
    words = ["grid", flat, "-o", grid, "--sizes", "5,5,5", "--map", saved, "--quiet"]
    assert main(words) == 0
    there = str(tmp_path / "there.json")
    words = ["transfer", saved, folded, grid, "--to", "unfolded", "--values", "au", "-o", onto]
    assert main([*words, "--summary", there, "--quiet"]) == 0
    moved = json.loads(Path(there).read_text())["values"]["au"]
    # Flexural slip keeps volume; the unfolding's own volume change is below 1 %, and cells of 5 m
    # cut in 1.25 m parts follow blocks of 10 m (0.2 % measured).
    assert moved["target_total"] == pytest.approx(moved["source_total"], rel=0.01)
    home = str(tmp_path / "home.json")
    words = ["transfer", saved, onto, folded, "--values", "au", "-o", back, "--summary", home]
    assert main([*words, "--quiet"]) == 0
    result = pd.read_csv(back)
    assert json.loads(Path(home).read_text())["values"]["au"]["unassigned"] == 0
    assert (result["au_share"] > 0).all()
    # Grades vary by 1/80 a metre along and 1/60 across: a block of 10 m and back through cells
    # of 5 m differs by less than the change over one block.
    assert np.abs(result["au"] - frame["au"]).max() < 10 / 80 + 10 / 60
    total = (result["au"] * 1000).sum()
    assert total == pytest.approx((frame["au"] * 1000).sum(), rel=0.01)


@pytest.mark.parametrize("how", ["columns", "lengths"])
def test_unfold_tells_volumes_where_sides_are_known(tmp_path: Path, how: str) -> None:
    body = gu.simulate("plunging", blocks=4000)  # blocks of 10 m
    frame = pd.DataFrame(body.folded, columns=["x", "y", "z"])
    words = ["--sizes", "10,10,10"]
    if how == "columns":
        frame[["XINC", "YINC", "ZINC"]] = 10.0
        frame.loc[3, "YINC"] = 0.0
        words = []
    blocks, flat, summary = (str(tmp_path / n) for n in ("b.csv", "f.csv", "s.json"))
    frame.to_csv(blocks, index=False)
    run = ["unfold", blocks, "-o", flat, "--summary", summary, "--quiet", *words]
    assert main(run) == 0
    result, facts = pd.read_csv(flat), json.loads(Path(summary).read_text())
    known = result["block_volume"].notna()
    assert (result.loc[known, "block_volume"] == 1000).all()
    assert known.sum() == len(frame) - (how == "columns")
    expected = result["block_volume"] * result["volume_ratio"]
    pd.testing.assert_series_equal(result["unfolded_volume"], expected, check_names=False)
    told = facts["block_volumes"]
    assert told["folded"] == 1000 * known.sum()
    assert told["without_sides"] == (how == "columns")
    # Flexural slip keeps volume: what is left is tetrahedra for curved prisms, below 1 %.
    assert told["unfolded"] == pytest.approx(told["folded"], rel=0.01)
    assert any("no positive sides" in w for w in facts["warnings"]) == (how == "columns")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["unfold", "P", "-o", "O.csv", "--sizes", "a,b,c"], "no column 'a' for --sizes"),
        (["unfold", "P", "-o", "O.csv", "--sizes", "1,0,1"], "three positive lengths"),
        (["grid", "P", "-o", "G.csv", "--sizes", "5,5"], "--sizes needs three finite numbers"),
        (["grid", "P", "-o", "G.csv", "--sizes", "5,5,-1"], "three positive sides"),
        (["transfer", "M.npz", "P", "P", "-o", "O.csv", "--values", "au"], "M.npz"),
        (
            ["transfer", "P", "P", "P", "-o", "O.csv", "--values", "v", "--to", "there"],
            "folded or unfolded",
        ),
        (["transfer", "P", "P", "P", "-o", "O.csv", "--values", "v", "--split", "0"], "--split"),
        (["transfer", "P", "P", "P", "-o", "O.csv", "--values", "w"], "no column 'w'"),
        (["transfer", "P", "P", "P", "-o", "O.csv", "--values", "v,v"], "different column names"),
        (
            ["transfer", "P", "P", "P", "-o", "O.csv", "--values", "v", "--rotation", "east"],
            "--rotation needs three finite numbers",
        ),
    ],
)
def test_commands_refuse_in_one_line(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = tmp_path / "p.csv"
    points.write_text("x,y,z,v\n0,0,0,1\n1,0,0,2\n")
    at = {"P": str(points), "G.csv": str(tmp_path / "G.csv"), "O.csv": str(tmp_path / "O.csv")}
    assert main([at.get(word, word) for word in words]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (tmp_path / "O.csv").exists()
