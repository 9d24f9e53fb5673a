"""Limits of a block model: a rim that the user knows to be a cut is no pinch-out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.faults.limit_rims import limits_told
from geounfold.geometry.mesh import Floats, Ints
from geounfold.quality.flat_truth import flat_rms
from geounfold.synthetic.body import Sheet
from geounfold.synthetic.catalogue import CASES
from tests.shapes import box

SQUARE = np.array([[[0.0, 0, 0], [0, 9, 0]], [[9, 0, 0], [9, 9, 0]]])


def grid(places: Floats) -> tuple[Floats, Ints]:
    """Return a surface over places (n, m, 3)."""
    k = np.arange(places[..., 0].size).reshape(places.shape[:2])
    p, q, r, s = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    F = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
    return places.reshape(-1, 3), F


def oblique_end() -> tuple[Floats, Ints]:
    """Return the plane that cuts the body `oblique_cut` off, folded with it."""
    spec = CASES["oblique_cut"]
    (cut,) = spec.outline
    v, w = np.meshgrid(np.linspace(-40, 440, 49), np.linspace(-90, 90, 41), indexing="ij")
    u = spec.length - cut.setback - w * np.tan(np.radians(cut.angle))
    truth = np.stack([u, v, w], axis=2)
    return grid(Sheet(spec).fold(truth.reshape(-1, 3)).reshape(truth.shape))


def test_a_known_oblique_cut_is_no_pinch_out() -> None:
    # Without the limit the body's rms is 0.65 blocks: the wedge is bent towards its tip.
    body = gu.simulate("oblique_cut")
    found = gu.unfold(body.folded, limits=[("end", *oblique_end())])
    side = float(np.prod(body.steps) ** (1 / 3))
    assert found.certificate.injective
    assert flat_rms(found.points, body.truth) / side < 0.15
    assert found.summary()["limits"] == ["end"]


def slanted() -> Floats:
    """Return a plane layer that dips 45 degrees, 10 blocks thick, cut off upright at x = 20."""
    points = box(40, 20, 80)
    return points[np.abs(points[:, 0] + points[:, 2]) < 7]


@pytest.mark.parametrize(
    "limits",
    [
        [None, 20, None, None, None, None],
        ",20,,,,",
        np.array([[-200.0, -99], [20, -99], [20, 99], [-200, 99]]),
    ],
    ids=["box", "text", "polygon"],
)
def test_a_box_and_a_polygon_name_the_side_at_which_blocks_end(limits: object) -> None:
    points = slanted()
    found = gu.unfold(points, limits=[limits])
    assert len(found.summary()["limits"]) == 1
    # The cut has 13 x 20 faces of blocks, the rim 2 x 13 x (20 + 40): a sixth; the hull rounds
    # its edges (measured: 0.169).
    (rim,) = (row for row in found.summary()["limit_rims"] if row["used"])
    assert rim["blocks"] == 260
    assert rim["rim_share"] == pytest.approx(1 / 6, abs=0.01)
    # The layer is plane: its level is linear across it, to a hundredth where the model was cut.
    level = (points[:, 0] + points[:, 2]) / np.sqrt(2)
    near = points[:, 0] > 5
    fit = np.polyfit(level[~near], found.stratigraphic[~near], 1)
    off = found.stratigraphic[near] - np.polyval(fit, level[near])
    assert np.abs(off).mean() < 0.01


def test_a_body_without_limits_is_as_before() -> None:
    assert "limits" not in gu.unfold(slanted()).summary()


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ([[None, 500, None, None, None, None]], "no block is near a side"),
        ([[None, 5, None, None, None, None]], r"cuts through the body: .* Give a fault"),
        ([[None] * 6], "the box has no side"),
        ([[500, None, None, None, None, None]], "the box holds no block"),
        ([[9, 3, None, None, None, None]], "the box ends in x at 3 before 9"),
        ([], "limits is empty"),
        ([np.array([[0.0, 0], [1, 1]])], "three or more corners"),
        ([("far", *grid(SQUARE + 1e3))],
         r"limit far: no block is near it \(the nearest is \d+"),
    ],
)  # fmt: skip
def test_limits_that_are_none_are_refused(limits: list[object], message: str) -> None:
    with pytest.raises(gu.GeounfoldError, match=message):
        gu.unfold(slanted(), limits=limits)


def test_limits_do_not_go_with_given_horizons_or_other_methods() -> None:
    plane = grid(
        np.zeros((2, 2, 3)) + np.eye(2, 3)[:, None] * 9 + np.eye(3)[1] * np.arange(2)[:, None]
    )
    limits = [None, 20, None, None, None, None]
    with pytest.raises(gu.OptionError, match="leave out one"):
        gu.unfold(slanted(), limits=[limits], top=plane, bottom=plane)
    with pytest.raises(gu.OptionError, match="not to isomap"):
        gu.unfold(slanted(), limits=[limits], method="isomap", allow_uncertified=True)


def test_limits_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pd.DataFrame(slanted(), columns=["x", "y", "z"]).to_csv(tmp_path / "b.csv", index=False)
    corners = pd.DataFrame({"X": [-99, 20, 20, -99], "Y": [-99, -99, 99, 99]})
    corners.to_csv(tmp_path / "licence.csv", index=False)
    run = ["unfold", str(tmp_path / "b.csv"), "-o", str(tmp_path / "o.csv"), "--quiet"]
    summary = ["--summary", str(tmp_path / "s.json"), "--limits", str(tmp_path / "licence.csv")]
    assert main([*run, *summary]) == 0
    assert json.loads((tmp_path / "s.json").read_text())["limits"] == ["licence side 2"]
    # A block off the cut, a limit does nothing: the hull's faces are 1.3 blocks away.
    assert main([*run[:-1], "--overwrite", *summary[:2], "--limits", "-99,21,,,,"]) == 0
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["limits"] == ["east"]
    told = capsys.readouterr().err
    assert "limit east takes 0.0% of the rim and changes little or nothing: the rim" in told
    assert "looks at it is 1.3" in told
    assert limits_told(found["limit_rims"]) == (
        "east takes 0% of the rim (0 blocks), 1 side near no block"
    )
    assert main([*run, "--overwrite", "--limits", str(tmp_path / "absent.ts")]) == 2
    assert "absent.ts" in capsys.readouterr().err
    (tmp_path / "k.csv").write_text("east;north\n1;2\n")
    assert main([*run, "--overwrite", "--limits", str(tmp_path / "k.csv")]) == 2
    assert "with columns x and y, a corner per row; it has: east, north" in capsys.readouterr().err
    assert main([*run, "--overwrite", "--limits", ",20,,,,", "--by", "x"]) == 2
    assert "--limits are of one body" in capsys.readouterr().err
