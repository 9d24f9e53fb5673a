"""Block models in coordinates of their own: --origin and --rotation, and the library's frames."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import OptionError
from geounfold.io.tables import large

ORIGIN = (412_300.5, 6_815_700.25, 1_400.0)  # UTM-like
ANGLES = (37.0, -12.0, 20.0)
WHERE = ["--origin", ",".join(map(str, ORIGIN)), "--rotation", ",".join(map(str, ANGLES))]
FLAT = ["unfolded_x", "unfolded_y", "unfolded_z"]
WORLD = ["world_x", "world_y", "world_z"]
OWN = ["XC", "YC", "ZC"]


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """Return a body in both kinds of coordinates, and what unfolding makes of each."""
    folder = tmp_path_factory.mktemp("frames")
    frame = gu.ModelFrame.turned(ORIGIN, *ANGLES)
    own = gu.simulate("plunging", width=150.0).folded  # cubes of 10 m, in their lattice's axes
    own = own - own.min(axis=0)
    world = frame.to_world(own)
    names = {"own.csv": (OWN, own), "world.csv": (list("xyz"), world)}
    for name, (columns, points) in names.items():
        table = pd.DataFrame(points, columns=columns).assign(IJK=np.arange(len(points)), XINC=10.0)
        table.assign(YINC=10.0, ZINC=10.0).to_csv(folder / name, index=False)
    out = ["-o", str(folder / "from_own.csv"), "--map", str(folder / "own.npz")]
    summary = ["--summary", str(folder / "own.json")]
    assert main(["unfold", str(folder / "own.csv"), *out, *summary, *WHERE]) == 0
    assert main(["unfold", str(folder / "world.csv"), "-o", str(folder / "from_world.csv")]) == 0
    return SimpleNamespace(folder=folder, frame=frame, own=own, world=world)


def test_a_frame_goes_both_ways_and_leaves_lengths() -> None:
    frame = gu.ModelFrame.turned(ORIGIN, *ANGLES)
    own = np.random.default_rng(0).uniform(-500, 500, (100, 3))
    world = frame.to_world(own)
    # 7e6 m are resolved to 1e-9 m.
    assert_allclose(frame.to_own(world), own, rtol=0, atol=1e-8)
    assert_allclose(frame.to_world(np.zeros((1, 3)))[0], ORIGIN, rtol=0, atol=0)
    apart = np.linalg.norm(np.diff(own, axis=0), axis=1)
    assert_allclose(np.linalg.norm(np.diff(world, axis=0), axis=1), apart, rtol=0, atol=1e-8)
    # Whichever points come with it, a point's numbers are the same.
    assert_array_equal(frame.to_world(own[7:12]), world[7:12])


@pytest.mark.parametrize(
    ("origin", "axes", "says"),
    [
        ([0.0, np.nan, 0.0], np.eye(3), "three numbers"),
        ([0.0, 1e16, 0.0], np.eye(3), "within 1e"),
        ([0.0, 0.0], np.eye(3), "three numbers"),
        ([0.0, 0.0, 0.0], 2 * np.eye(3), "perpendicular rows of unit length"),
        ([0.0, 0.0, 0.0], np.diag([1.0, 1.0, -1.0]), "mirror"),
    ],
)
def test_frames_refused(origin: list[float], axes: np.ndarray, says: str) -> None:
    with pytest.raises(OptionError, match=says):
        gu.ModelFrame(np.array(origin), axes)


def test_local_blocks_come_out_as_the_same_blocks_in_world_coordinates(
    body: SimpleNamespace,
) -> None:
    here = pd.read_csv(body.folder / "from_own.csv")
    there = pd.read_csv(body.folder / "from_world.csv")
    size = np.ptp(body.world, axis=0).max()
    # The project's bound for a rigid motion of the input: 1e-6 of the size.
    assert_allclose(here[FLAT], there[FLAT], rtol=0, atol=1e-6 * size)
    assert_allclose(here[WORLD], body.world, rtol=0, atol=1e-8)
    assert_array_equal(here[OWN].to_numpy(), pd.read_csv(body.folder / "own.csv")[OWN].to_numpy())
    assert_array_equal(here["IJK"], np.arange(len(here)))
    assert_allclose(here["block_volume"], 1000.0)  # the cubes of 10 m
    read = json.loads((body.folder / "own.json").read_text())["input"]
    assert read["origin"] == list(ORIGIN)
    assert_allclose(read["axes"], gu.axes_from_angles(*ANGLES))


def test_the_map_is_the_world_s_and_takes_either_kind(
    body: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted = gu.load(body.folder / "own.npz")
    wanted = pd.read_csv(body.folder / "from_own.csv")
    assert_allclose(fitted.to_flat(body.world), wanted[FLAT], rtol=0, atol=1e-8)
    run = ["map", str(body.folder / "own.npz")]
    for batch in (1 << 17, 1_000):  # read whole, and in batches
        monkeypatch.setattr(large, "BATCH", batch)
        monkeypatch.setattr(large, "LARGE", 0 if batch == 1_000 else 1 << 24)
        out = body.folder / f"carried_{batch}.csv"
        assert main([*run, str(body.folder / "own.csv"), "-o", str(out), *WHERE]) == 0
        carried = pd.read_csv(out)
        assert_allclose(carried[FLAT], wanted[FLAT], rtol=0, atol=1e-8)
        assert_allclose(carried[WORLD], body.world, rtol=0, atol=1e-8)


def test_results_are_read_in_world_coordinates_next_time(body: SimpleNamespace) -> None:
    out = body.folder / "again.csv"
    run = ["map", str(body.folder / "own.npz"), str(body.folder / "from_own.csv")]
    assert main([*run, "-o", str(out)]) == 0  # without --origin: world_x/y/z stand beside XC/YC/ZC
    wanted = pd.read_csv(body.folder / "from_own.csv")
    assert_allclose(pd.read_csv(out)[FLAT], wanted[FLAT], rtol=0, atol=1e-8)


def test_values_come_back_to_local_blocks(body: SimpleNamespace) -> None:
    grid = body.folder / "grid.csv"
    flat = body.folder / "from_own.csv"
    made = ["grid", str(flat), "-o", str(grid), "--sizes", "10,10,5", "--overwrite"]
    assert main([*made, "--map", str(body.folder / "own.npz")]) == 0
    table = pd.read_csv(grid)
    table.assign(height=table["z"]).to_csv(grid, index=False)
    shares = {}
    for name, where in (("own", WHERE), ("world", WHERE[2:])):
        out = body.folder / f"back_{name}.csv"
        run = [
            "transfer",
            str(body.folder / "own.npz"),
            str(grid),
            str(body.folder / f"{name}.csv"),
        ]
        assert main([*run, "-o", str(out), "--values", "height", *where]) == 0
        shares[name] = pd.read_csv(out)
    # One of a block's 64 parts may fall on the other side of a face by rounding: 5 m / 64.
    assert_allclose(shares["own"]["height"], shares["world"]["height"], rtol=0, atol=5 / 64 + 1e-6)
    assert_allclose(shares["own"][WORLD], body.world, rtol=0, atol=1e-8)
    # A block's height is the mean over its parts of the grid blocks' heights, 5 m thick.
    there = pd.read_csv(flat)["unfolded_z"]
    known = shares["own"]["height_share"] == 1
    assert known.mean() > 0.5
    assert np.abs(shares["own"]["height"] - there)[known].max() < 5


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--rotation", "10,0,0"], "give --origin too"),
        (["--origin", "1,2"], "--origin needs three finite numbers"),
        (["--origin", "0,0,nan"], "--origin needs three finite numbers"),
        (["--origin", "0,0,0", "--rotation", "0,95,0"], "within 90"),
        (["--origin", "0,0,0", "--rotation", "x"], "--rotation needs three finite numbers"),
    ],
)
def test_bad_frames_are_one_line_and_status_2(
    body: SimpleNamespace, capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    out = body.folder / "none.csv"
    for run in (
        ["unfold", str(body.folder / "own.csv"), "-o", str(out)],
        ["map", str(body.folder / "own.npz"), str(body.folder / "own.csv"), "-o", str(out)],
    ):
        capsys.readouterr()
        assert main([*run, *words]) == 2
        said = capsys.readouterr().err.strip()
        assert says in said
        assert "\n" not in said
        assert not out.exists()


def test_no_origin_on_the_way_back(
    body: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    run = ["map", str(body.folder / "own.npz"), str(body.folder / "from_own.csv"), "--inverse"]
    assert main([*run, "-o", str(body.folder / "none.csv"), *WHERE]) == 2
    assert "without --inverse" in capsys.readouterr().err


def test_columns_of_the_world_come_first_unless_the_model_s_own_are_wanted() -> None:
    from geounfold.io.coordinate_columns import coordinate_columns

    names = ["X", "Y", "Z", "X_World", "Y_World", "Z_World"]
    assert coordinate_columns(names) == (3, 4, 5)
    assert coordinate_columns(names, own=True) == (0, 1, 2)
    with pytest.raises(gu.InputError, match="no coordinate columns"):
        coordinate_columns(names[3:], own=True)
