"""Every method of whole bodies: the same tests for all."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import InputError, OptionError
from geounfold.geometry.measures import tet_volumes
from geounfold.methods import (
    METHODS,
    IsomapMethodOptions,
    PointwiseMap,
    VerticalOptions,
    VolumetricOptions,
)
from geounfold.methods.contract import carried_pair
from geounfold.unfolding import options
from tests.methods.bodies import tent, unfold
from tests.shapes import box

POINTWISE = [name for name, method in METHODS.items() if not method.control]

EVERY = list(METHODS)


def size(points):
    return float(np.ptp(points, axis=0).max())


def test_the_table_is_what_options_offer():
    assert set(EVERY) == {
        *("sheet", "thesis", "ufo", "stratigraphic", "shear", "volumetric", "isomap")
    }
    assert options.VALID["method"] == tuple(METHODS)
    assert {m.name for m in METHODS.values()} == set(METHODS)
    for method in METHODS.values():
        assert hasattr(gu.UnfoldOptions(), method.options)


@pytest.mark.parametrize("method", EVERY)
def test_a_flat_slab_stays_as_it_is(method):
    # Turned within its plane by 0.5 radians, so that nothing lies along an axis.
    W = box(30, 20, 5)
    turn = Rotation.from_euler("z", 0.5).as_matrix()
    u = unfold(W @ turn.T * 10 + [300.0, 400, 50], method)
    # Blocks.  Measured 0.002 to 0.003 (sheet, ufo, volumetric), 0.007 (shear), 0.013
    # (stratigraphic); 0.049 (thesis: an alpha shape's rim); 0.19 (isomap: a path along a graph is
    # longer than the line it follows, by up to 2.8 % of 15 blocks).
    rms = gu.aligned_rms(u.points, W * 10) / 10
    assert rms < {"thesis": 0.08, "isomap": 0.4}.get(method, 0.02)
    assert u.outside_share == 0
    assert np.corrcoef(u.points[:, 2], W[:, 2])[0, 1] > 0.999
    # Of five layers the centres lie at 0.1, 0.3 ... 0.9.  Measured 0.015; 0.04 and 0.09.
    off = np.abs(u.stratigraphic - (W[:, 2] + 2.5) / 5)
    assert off.max() < {"thesis": 0.06, "isomap": 0.15}.get(method, 0.03)
    # Never mirrored: the linear map from truth to answer has a positive determinant.
    linear = np.linalg.lstsq(W, u.points - u.points.mean(axis=0), rcond=None)[0]
    assert np.linalg.det(linear) > 0


@pytest.mark.parametrize("method", EVERY)
def test_order_motion_and_unit_change_nothing(method, plunging, unfolded):
    X = plunging
    first = unfolded(method)
    order = np.random.default_rng(1).permutation(len(X))
    turn = Rotation.from_euler("zyx", [50, 15, -20], degrees=True).as_matrix()
    moved = (X @ turn.T + [431_000.0, 7_400_000.0, 900.0])[order] / 0.3048
    other = unfold(moved, method, up=tuple(turn[:, 2]))
    # The bound of the whole library: rounding of the input is 1e-9 m in 300 m.
    assert np.abs(other.points * 0.3048 - first.points[order]).max() < 1e-6 * size(X)
    assert np.abs(other.stratigraphic - first.stratigraphic[order]).max() < 1e-6
    assert np.array_equal(unfold(X, method).points, first.points)


@pytest.mark.parametrize("method", EVERY)
def test_columns_summary_and_other_points(method, plunging, unfolded):
    u = unfolded(method)
    n = len(plunging)
    assert list(u.columns) == ["volume_ratio", "nmd_error", "stretch_min", "stretch_max", "shear"]
    for column in (u.stratigraphic, *u.columns.values()):
        assert column.shape == (n,)
        assert np.isfinite(column).all()
    summary = json.loads(json.dumps(u.summary()))
    assert summary["options"]["method"] == method
    assert {"top", "bottom", "nmd", "volume_change", "torn"} <= set(summary)
    # Every method keeps volumes of this gentle body to some per cent.
    assert abs(summary["volume_unfolded"] / summary["volume_folded"] - 1) < 0.1
    assert summary["inverted_folded"] == summary["inverted_unfolded"] == 0
    # Points between blocks lie between them, too: within a block of the next one's image.
    between = plunging[:50] + np.array([1.0, -1.0, 0.5])
    assert np.linalg.norm(u.to_flat(between) - u.points[:50], axis=1).max() < u.frame.scale
    far = plunging[:1] + 1000 * u.frame.scale
    assert np.isnan(u.to_flat(far)).all()


@pytest.mark.parametrize("method", ["sheet", "ufo", "volumetric"])
def test_control_meshes_are_proved_saved_and_inverted(method, plunging, tmp_path, unfolded):
    u = unfolded(method)
    assert u.injective
    assert u.round_trip_max < 1e-9 * size(plunging)
    u.save(tmp_path / "m.npz")
    assert np.array_equal(gu.load(tmp_path / "m.npz").to_flat(plunging), u.points)
    assert (tet_volumes(u.control.unfolded.V, u.control.unfolded.T) > 0).all()


@pytest.mark.parametrize("method", POINTWISE)
def test_without_a_control_mesh_nothing_is_proved(method, plunging, tmp_path, unfolded):
    with pytest.raises(OptionError, match=f"method {method} .*nothing is proved.*--allow-unc"):
        gu.unfold(plunging, method=method)
    with pytest.raises(OptionError, match="no prisms to go by"):
        unfold(plunging, method, coordinates="mvc")
    u = unfolded(method)
    reason = f"method {method} has no control mesh: nothing is proved"
    assert not u.summary()["injective"]
    assert u.certificate.faults == [reason]
    assert u.certificate["reason"] == reason
    assert any(reason in warning for warning in u.summary()["warnings"])
    assert u.summary()["control_mesh"] is None
    assert "not proved" in repr(u)
    assert isinstance(u.map, PointwiseMap)
    with pytest.raises(OptionError, match="cannot be saved: use --method sheet"):
        u.save(tmp_path / "m.npz")
    assert not (tmp_path / "m.npz").exists()
    with pytest.raises(OptionError, match="there is none to return"):
        _ = u.control


@pytest.mark.parametrize("method", ["shear", "stratigraphic"])
@pytest.mark.parametrize("datum", ["mid", "top", "bottom", "proportional"])
def test_rules_with_a_way_back_come_back(method, datum, plunging):
    u = unfold(plunging, method, datum=datum)
    assert u.round_trip_max < 1e-9 * size(plunging)
    some = np.concatenate([u.points[:5], np.full((1, 3), np.nan)])
    back = u.to_folded(some)
    assert_allclose(back[:5], plunging[:5], atol=1e-6)
    assert np.isnan(back[5]).all()
    place = {"top": 1, "bottom": 0}
    if datum in place and method == "shear":
        # That surface is level.
        z = u.surfaces[datum].unfolded.V[:, 2]
        assert np.ptp(z) < 1e-6 * size(plunging)


def test_isomap_has_no_way_back(unfolded):
    u = unfolded("isomap")
    assert u.round_trip_max is None
    assert u.summary()["round_trip_max"] is None
    assert "no way back" in u._repr_html_()
    with pytest.raises(InputError, match="isomap has no way back: use --method sheet"):
        u.to_folded(u.points)
    with pytest.raises(InputError, match="no way back"):
        u.map.rule.to_folded(u.points)


@pytest.mark.parametrize("method", EVERY)
def test_up_turns_the_answer_over_without_mirroring(method, plunging, unfolded):
    u, down = unfolded(method), unfold(plunging, method, up=(0.0, 0.0, -1.0))
    assert_allclose(down.stratigraphic, 1 - u.stratigraphic, atol=1e-9)
    assert_allclose(down.points, u.points * [1, -1, -1], atol=1e-6)


@pytest.mark.parametrize("method", POINTWISE)
def test_rules_unfold_one_body_at_a_time(method):
    W = box(16, 10, 3)
    two = np.concatenate([W, W + np.array([40.0, 0, 0])])
    with pytest.raises(OptionError, match=r"one body at a time.*choose one by --body"):
        unfold(two, method, body="all")
    if method != "isomap":
        apart = unfold(two, method, body=0).location == "outside"
        assert apart.sum() == len(W)


def test_surfaces_leave_out_what_has_no_image():
    def to_flat(P):
        return SimpleNamespace(points=np.where(P[:, :1] < -0.5, np.nan, P))

    pair = carried_pair(tent(0.5), SimpleNamespace(to_flat=to_flat))
    assert len(pair.folded.F) == 2
    assert_allclose(pair.folded.V, pair.unfolded.V)
    assert pair.flattening is None


@pytest.mark.parametrize(
    ("kind", "name", "value", "words"),
    [
        (VerticalOptions, "vertical_options.axis", "sideways", "one of up, across"),
        (VolumetricOptions, "volumetric_options.max_iter", 0, "a whole number of 1 or more"),
        (VolumetricOptions, "volumetric_options.max_iter", 1.5, "a whole number of 1 or more"),
        (VolumetricOptions, "volumetric_options.tol", 0.0, "a number above 0"),
        (VolumetricOptions, "volumetric_options.tol", True, "a number above 0"),
        (VolumetricOptions, "volumetric_options.weight", np.inf, "a number above 0"),
        (IsomapMethodOptions, "isomap_options.neighbours", 2, "a whole number of 3 or more"),
        (IsomapMethodOptions, "isomap_options.landmarks", "3", "a whole number of 4 or more"),
    ],
)
def test_bad_options_are_refused(kind, name, value, words):
    with pytest.raises(OptionError) as refused:
        kind(**{name.split(".")[1]: value})
    assert str(refused.value) == f"{name} must be {words}, but is {value!r}"


def test_the_command_line_takes_every_method(plunging, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pd.DataFrame(plunging, columns=["x", "y", "z"]).to_csv("x.csv", index=False)
    argv = ["unfold", "x.csv", "--method", "stratigraphic", "-o", "y.csv"]
    assert main(argv) == 2
    assert "--allow-uncertified" in capsys.readouterr().err
    for option in ("--map", "--mesh"):
        file = {"--map": "m.npz", "--mesh": "m.vtu"}[option]
        assert main([*argv, "--allow-uncertified", option, file]) == 2
        assert f"{option} has nothing to write: use --method sheet" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x.csv"]
    samples = ["--samples", "x.csv", "--samples-out", "q.csv", "--summary", "s.json"]
    assert main([*argv, "--allow-uncertified", *samples]) == 0
    assert "nothing is proved" in capsys.readouterr().err
    assert json.loads((tmp_path / "s.json").read_text())["injective"] is False
    head = (tmp_path / "y.csv").read_text().splitlines()[0]
    assert "unfolded_z,stratigraphic,location,mesh_distance,volume_ratio" in head
    assert (tmp_path / "q.csv").exists()
