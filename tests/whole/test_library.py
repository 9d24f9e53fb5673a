"""The library's manners: pandas, pipelines, pyvista, how an answer introduces itself."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.errors import InputError, OptionError
from geounfold.io.result_columns import FOLDED, UNFOLDED
from geounfold.unfolding.notebook_card import Facts

PLACE = [*UNFOLDED, "stratigraphic", "location", "mesh_distance"]


@pytest.fixture(scope="module")
def blocks() -> pd.DataFrame:
    """A block model as users have them: shuffled rows, odd index, many types."""
    folded = gu.simulate("sim_case_1", blocks=2000).folded
    n = len(folded)
    frame = pd.DataFrame(
        {
            "IJK": np.arange(n, dtype=np.int32),
            "XC": folded[:, 0],
            "rock": pd.Categorical(np.where(folded[:, 2] > 0, "ore", "waste")),
            "YC": folded[:, 1],
            "ZC": folded[:, 2],
            "Au": pd.array(np.where(np.arange(n) % 7, 1.5, np.nan), dtype="Float64"),
            "mined": np.arange(n) % 2 == 0,
            "when": pd.Timestamp("2020-01-01"),
            "shear": "mine",  # called as a result
        },
        index=pd.Index([f"b{k // 2}" for k in range(n)], name="block"),  # each twice
    )
    return frame.iloc[np.random.default_rng(3).permutation(n)]


@pytest.fixture(scope="module")
def unfolded(blocks: pd.DataFrame) -> gu.Unfolding:
    return gu.unfold(blocks)


# ----------------------------------------------------------------------------------------- pandas


def test_the_table_is_the_one_given_and_the_results(
    blocks: pd.DataFrame, unfolded: gu.Unfolding
) -> None:
    table = unfolded.table
    same = [name for name in blocks if name != "shear"]
    pd.testing.assert_frame_equal(table[same], blocks[same])
    assert list(table)[: len(blocks.columns)] == list(blocks)
    added = [*PLACE, "volume_ratio", "nmd_error", "stretch_min", "stretch_max"]
    assert list(table)[len(blocks.columns) :] == added
    np.testing.assert_array_equal(table[list(UNFOLDED)], unfolded.points)
    np.testing.assert_array_equal(table["shear"], unfolded.columns["shear"])
    assert (table["location"] == "inside").all()


def test_the_frame_given_is_left_alone_and_later_changes_do_not_matter(
    unfolded: gu.Unfolding, blocks: pd.DataFrame
) -> None:
    assert not set(PLACE) & set(blocks)
    frame = blocks.copy()
    answer = gu.unfold(frame)
    frame["Au"] = 0.0
    assert answer.table["Au"].isna().any()
    np.testing.assert_array_equal(answer.points, unfolded.points)


def test_the_table_of_an_array(unfolded: gu.Unfolding) -> None:
    table = gu.unfold(unfolded.folded).table
    assert list(table)[:9] == ["x", "y", "z", *PLACE]
    np.testing.assert_array_equal(table[["x", "y", "z"]], unfolded.folded)


def test_frames_are_carried_there_and_back(blocks: pd.DataFrame, unfolded: gu.Unfolding) -> None:
    samples = blocks[["Au", "XC", "YC", "ZC"]].iloc[10:60]
    flat = unfolded.transform(samples)
    assert list(flat) == ["Au", "XC", "YC", "ZC", *PLACE]
    pd.testing.assert_frame_equal(flat[list(samples)], samples)
    np.testing.assert_array_equal(flat[list(UNFOLDED)], unfolded.points[10:60])
    # The unfolded columns are those meant, though XC, YC and ZC are there too.
    back = unfolded.inverse_transform(flat.drop(columns="stratigraphic"))
    assert back.index.equals(samples.index)
    assert list(back) == [*flat.drop(columns="stratigraphic"), *FOLDED]
    # Exact but for rounding of coordinates near 1e3: the map goes both ways.
    np.testing.assert_allclose(back[list(FOLDED)], samples[["XC", "YC", "ZC"]], atol=1e-6)


def test_arrays_are_carried_as_to_flat_does(unfolded: gu.Unfolding) -> None:
    points = unfolded.folded[:20]
    flat = unfolded.transform(points)
    assert isinstance(flat, np.ndarray)
    np.testing.assert_array_equal(flat, unfolded.to_flat(points))
    np.testing.assert_array_equal(unfolded.inverse_transform(flat), unfolded.to_folded(flat))


def test_what_lies_too_far_is_missing_and_says_so(unfolded: gu.Unfolding) -> None:
    far = pd.DataFrame([[1e6, 0.0, 0.0]], columns=["x", "y", "z"], index=[7])
    flat = unfolded.transform(far)
    assert flat.loc[7, "location"] == "outside"
    assert flat[list(UNFOLDED)].isna().all(axis=None)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (pd.DataFrame({"a": [1.0], "b": [1.0], "c": [1.0]}), "no coordinate columns"),
        (pd.DataFrame({"x": [1.0], "y": ["pit"], "z": [1.0]}), "column 'y' is not numeric"),
        (pd.DataFrame({"x": [1.0], "y": [np.nan], "z": [1.0]}), "finite"),
    ],
)
def test_frames_that_cannot_be_carried(
    frame: pd.DataFrame, words: str, unfolded: gu.Unfolding
) -> None:
    with pytest.raises(InputError, match=words):
        unfolded.transform(frame)


# -------------------------------------------------------------------------------------- pipelines


def test_an_unfolder_is_an_unfolding(blocks: pd.DataFrame, unfolded: gu.Unfolding) -> None:
    unfolder = gu.Unfolder()
    flat = unfolder.fit_transform(blocks)
    assert list(flat) == list(UNFOLDED) == list(unfolder.get_feature_names_out())
    assert flat.index.equals(blocks.index)
    np.testing.assert_array_equal(flat, unfolded.points)
    assert unfolder.n_features_in_ == len(blocks.columns)
    back = unfolder.inverse_transform(flat)
    assert list(back) == list(FOLDED)
    np.testing.assert_array_equal(unfolder.transform(unfolded.folded), unfolded.points)


def test_its_parameters_are_the_options(unfolded: gu.Unfolding) -> None:
    unfolder = gu.Unfolder(datum="top")
    assert unfolder.get_params() == {
        **{name: getattr(gu.UnfoldOptions(), name) for name in gu.UnfoldOptions().as_dict()},
        "datum": "top",
    }
    assert repr(unfolder) == "Unfolder(datum='top')"
    assert unfolder.set_params(datum="mid", reach=1.0) is unfolder
    assert repr(unfolder) == "Unfolder(reach=1.0)"
    with pytest.raises(OptionError, match="there is no option depth; valid: method, flattener"):
        unfolder.set_params(depth=3)
    with pytest.raises(OptionError, match="datum must be one of"):
        gu.Unfolder(datum="middle").fit(unfolded.folded)
    with pytest.raises(InputError, match="call fit first"):
        unfolder.transform(unfolded.folded)


def test_it_drops_into_scikit_learn(blocks: pd.DataFrame, unfolded: gu.Unfolding) -> None:
    base = pytest.importorskip("sklearn.base", reason="scikit-learn is not installed")
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.neighbors import KNeighborsRegressor
    from sklearn.pipeline import make_pipeline

    original = gu.Unfolder(datum="top", body=0)
    copy = base.clone(original)
    assert copy is not original
    assert copy.get_params() == original.get_params()

    # The layer as target: flat neighbours know it, whatever the fold.
    layer = unfolded.stratigraphic
    pipe = make_pipeline(gu.Unfolder(), KNeighborsRegressor(n_neighbors=1))
    for X in (blocks, unfolded.folded):
        pipe.fit(X, layer)
        # Each block is its own nearest neighbour.
        np.testing.assert_array_equal(pipe.predict(X), layer)
    assert pipe.set_params(unfolder__reach=2.0).get_params()["unfolder__reach"] == 2.0
    assert base.clone(pipe).fit(blocks, layer).predict(blocks[:5]).shape == (5,)
    both = TransformedTargetRegressor(KNeighborsRegressor(1), transformer=gu.Unfolder())
    both.fit(unfolded.folded, unfolded.folded)
    # A target there and back: to 1e-6 of coordinates near 1e3, the map's own exactness.
    np.testing.assert_allclose(both.predict(unfolded.folded), unfolded.folded, atol=1e-6)


# ---------------------------------------------------------------------------------------- pyvista


def test_points_for_pyvista(blocks: pd.DataFrame, unfolded: gu.Unfolding) -> None:
    pytest.importorskip("pyvista")
    folded = unfolded.to_pyvista()
    np.testing.assert_array_equal(folded.points, unfolded.folded)
    np.testing.assert_array_equal(folded.point_data["unfolded"], unfolded.points)
    assert set(folded.point_data.keys()) == {*unfolded.table, "unfolded"}
    np.testing.assert_array_equal(folded.point_data["IJK"], blocks["IJK"])
    np.testing.assert_array_equal(folded.point_data["mined"], blocks["mined"])
    gold = blocks["Au"].to_numpy(np.float64, na_value=np.nan)
    np.testing.assert_array_equal(folded.point_data["Au"], gold)
    assert list(folded.point_data["rock"][:9]) == list(blocks["rock"][:9])
    assert list(folded.point_data["location"][:1]) == ["inside"]
    flat = unfolded.to_pyvista("unfolded")
    np.testing.assert_array_equal(flat.points, unfolded.points)
    np.testing.assert_array_equal(flat.point_data["folded"], unfolded.folded)
    with pytest.raises(OptionError, match="space must be folded or unfolded"):
        unfolded.to_pyvista("flat")  # type: ignore[arg-type]


def test_meshes_for_pyvista(unfolded: gu.Unfolding) -> None:
    pytest.importorskip("pyvista")
    control = unfolded.control
    for space, here, there in (
        ("folded", control.folded, control.unfolded),
        ("unfolded", control.unfolded, control.folded),
    ):
        grid = control.to_pyvista(space)
        other = "unfolded" if space == "folded" else "folded"
        np.testing.assert_array_equal(grid.points, here.V)
        np.testing.assert_array_equal(grid.point_data[other], there.V)
        # Right-handed in VTK's sense too: volumes with their sign add up to the body's.
        sizes = grid.compute_cell_sizes(length=False, area=False)["Volume"]
        assert sizes.min() > 0
        name = "volume_folded" if space == "folded" else "volume_unfolded"
        assert sizes.sum() == pytest.approx(unfolded.summary()["control_mesh"][name], rel=1e-9)
    for pair in (unfolded.top, unfolded.bottom):
        surface = pair.to_pyvista()
        assert surface.is_all_triangles
        np.testing.assert_array_equal(surface.regular_faces, pair.folded.F)
        np.testing.assert_array_equal(surface.point_data["unfolded"], pair.unfolded.V)
        np.testing.assert_array_equal(pair.to_pyvista("unfolded").points, pair.unfolded.V)
    hull = unfolded.hull_mesh.to_pyvista()
    assert hull.n_open_edges == 0
    flat = gu.TriMesh(np.array([[0.0, 0], [1, 0], [0, 1]]), np.array([[0, 1, 2]])).to_pyvista()
    np.testing.assert_array_equal(flat.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


# ----------------------------------------------------------------------------------- how it looks


FACTS = Facts(
    points=21600,
    bodies=2,
    outside=3,
    method="sheet",
    faults=(),
    checked=12345,
    epsilon=0.0152,
    epsilon_p95=0.04,
    volume=1.001,
    trust="good",
    round_trip=2e-11,
    seconds=2.25,
    warnings=(),
)


class _Words(HTMLParser):
    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def test_one_line_says_whether_to_trust_it(unfolded: gu.Unfolding) -> None:
    assert FACTS.line() == (
        "<Unfolding of 21600 points by sheet: proved one-to-one; epsilon 0.0152, 3 outside>"
    )
    assert "proved one-to-one, 1 warning;" in replace(FACTS, warnings=["a"]).line()
    assert "proved one-to-one, 2 warnings;" in replace(FACTS, warnings=["a", "b"]).line()
    assert (
        ": not proved one-to-one;" in replace(FACTS, faults=["8 inverted"], warnings=["a"]).line()
    )
    n = len(unfolded.folded)
    told = "proved one-to-one, 1 warning;"  # the column rock varies, and no rows were chosen
    line = rf"<Unfolding of {n} points by sheet: {told} epsilon 0\.\d{{4}}, 0 outside>"
    assert re.fullmatch(line, repr(unfolded))
    assert "column rock (ore 1764, waste 180) varies" in unfolded.summary()["warnings"][0]


def test_notebooks_show_a_table(unfolded: gu.Unfolding) -> None:
    page = _Words(FACTS.html())
    assert not page.open
    text = " ".join(page.words)
    for words in ("12,345 tetrahedra", "21,600 in 2 bodies, 3 outside", "2e-11", "0.0400 95th"):
        assert words in text
    hostile = replace(FACTS, faults=["<b>8 & 9"], warnings=["<script>"]).html()
    assert "<script>" not in hostile
    assert "&lt;script&gt;" in hostile
    assert "<b>8 & 9" in " ".join(_Words(hostile).words)
    shown = unfolded._repr_html_()
    assert not _Words(shown).open
    assert len(shown) < 2000  # a small table, not a report
    assert "color" not in shown  # it takes the page's, light or dark


# ------------------------------------------------------------------------------------------ types


USER = """
from typing import assert_type

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import geounfold as gu

points: NDArray[np.float64] = np.zeros((9, 3))
frame = pd.DataFrame(points, columns=["x", "y", "z"])
body = gu.simulate("sim_case_1")
u = gu.unfold(frame, gu.UnfoldOptions(datum="top"), reach=2.0)
assert_type(u, gu.Unfolding)
assert_type(u.table, pd.DataFrame)
assert_type(u.transform(frame), pd.DataFrame)
assert_type(u.transform(points), NDArray[np.float64])
assert_type(u.inverse_transform(frame), pd.DataFrame)
assert_type(gu.Unfolder(datum="top").fit(frame).transform(frame), pd.DataFrame)
assert_type(gu.Unfolder().fit_transform(points), NDArray[np.float64])
assert_type(gu.load("m.npz").to_flat(points), NDArray[np.float64])
assert_type(gu.flatten(u.top.folded).uv, NDArray[np.float64])
assert_type(gu.compare(points), pd.DataFrame)
assert_type(gu.epsilon(points, u.points), NDArray[np.float64])
print(u.control.to_pyvista("unfolded"), u.to_pyvista(), body.folded, u.certificate.injective)
"""


@pytest.mark.slow
def test_users_strict_mypy_is_content(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed")
    (tmp_path / "user.py").write_text(USER)
    (tmp_path / "wrong.py").write_text(f"{USER}u.transform(3)\nu.to_pyvista('flat')\n")
    root = str(Path(gu.__file__).parent.parent)
    flags = ["--strict", "--config-file=", "--cache-dir", str(tmp_path / "cache")]
    flags += ["--follow-imports=silent", "--ignore-missing-imports"]

    def checked(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "mypy", *flags, name],
            cwd=tmp_path,
            env={"MYPYPATH": root, "PATH": ""},
            capture_output=True,
            text=True,
            check=False,
        )

    done = checked("user.py")
    assert done.returncode == 0, done.stdout + done.stderr
    done = checked("wrong.py")  # the type hints have an effect
    assert done.stdout.count("error:") == 2, done.stdout
