"""A body of several sheets: each is unfolded and proved, and carried by its own map."""

import io

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import geounfold as gu
from geounfold.errors import GeounfoldError, OptionError
from geounfold.unfolding import run
from tests.body.parts.bodies import SIDE, fault, y_branch


@pytest.fixture(scope="module")
def branch():
    """A body with a branch, and its unfolding."""
    body = y_branch()
    return body, gu.unfold(body.points)


def test_each_part_is_proved_and_right(branch):
    body, u = branch
    assert u.injective
    assert u.body_part.max() == 1
    x, _, z = body.points.T
    a, main = np.radians(60), u.body_part == 0
    t = z - 10 * np.sin(x / 100)
    own = np.where(main, (t + 15) / 30, (10 - (x * np.sin(a) - t * np.cos(a))) / 20)
    for part in (0, 1):  # measured: 0.023 and 0.034; as one sheet 1.0
        mine = u.body_part == part
        err = [np.abs(s[mine] - own[mine]).mean() for s in (u.stratigraphic, 1 - u.stratigraphic)]
        assert min(err) < 0.06


def test_every_block_is_carried_by_its_part_and_comes_back(branch):
    body, u = branch
    assert u.carried.placed.all()
    assert u.round_trip_max < 1e-6 * SIDE
    x = u.points[:, 0]
    parts = [x[u.body_part == k] for k in (0, 1)]
    assert parts[0].max() < parts[1].min()  # flat images lie side by side
    near = body.points + np.array([0.2, -0.1, 0.1]) * SIDE
    flat = u.to_flat(near)
    inside = np.isfinite(flat).all(axis=1)
    assert inside.mean() > 0.99
    assert_allclose(u.to_folded(flat[inside]), near[inside], atol=1e-6)


def test_the_saved_map_carries_by_part(branch, tmp_path):
    body, u = branch
    u.save(tmp_path / "m.npz")
    again = gu.load(tmp_path / "m.npz")
    assert_array_equal(again.to_flat(body.points), u.points)
    stream = io.BytesIO()
    again.save(stream)
    assert stream.getvalue() == (tmp_path / "m.npz").read_bytes()


def test_summary_and_warnings_name_parts_and_junctions(branch):
    _, u = branch
    summary = u.summary()
    assert summary["bodies"] == 1
    assert [row["part"] for row in summary["parts"]] == [0, 1]
    assert [row["outcome"] for row in summary["parts"]] == ["proved", "proved"]
    assert sum(row["blocks"] for row in summary["parts"]) == summary["points"]
    assert [row["thickness"] for row in summary["parts"]] == pytest.approx([30, 20], rel=0.1)
    told = [w for w in summary["warnings"] if "2 sheets meet at" in w]
    assert told == [
        f"{u.junctions[0].sentence}; each was unfolded by itself, and stratigraphic is per part"
    ]
    assert summary["junctions"][0]["kind"] == "branch"


def test_one_fits_one_sheet_and_is_checked():
    body = fault()
    u = gu.unfold(body.points, parts="one", allow_uncertified=True)
    assert u.junctions == ()
    assert u.summary()["parts"] == []
    assert u.body_part.max() == 0
    with pytest.raises(OptionError, match="parts must be one of auto, one"):
        gu.UnfoldOptions(parts="two")


def test_a_part_that_fails_is_named_with_its_junction(monkeypatch):
    def failing(body, *rest):
        raise GeounfoldError("no sheet here")

    monkeypatch.setattr(run, "fit", failing)
    with pytest.raises(GeounfoldError, match=r"part 0 of 2 sheet parts .*2 sheets meet at .*step"):
        gu.unfold(fault().points)


def test_whole_bodies_keep_their_map_file():
    u = gu.unfold(gu.simulate("slab").folded)
    stream = io.BytesIO()
    u.save(stream)
    stream.seek(0)
    with np.load(stream) as arrays:
        assert int(arrays["version"]) == 6  # with the body's cells, and no parts
        assert len(arrays["vertex_part"]) == 0
    assert u.summary()["parts"] == []
