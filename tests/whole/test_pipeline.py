"""The whole unfolding: truths, invariances, datums, bodies, reference surfaces, errors."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import geounfold as gu
from geounfold.errors import ControlMeshError, InputError, OptionError
from geounfold.geometry.measures import tet_volumes
from geounfold.mapping.carried import few
from geounfold.methods import METHODS
from geounfold.methods.sheet.meshing import build
from geounfold.synthetic import simulate
from geounfold.unfolding import measured

# A lattice that cuts a plunging fold, a grid folded whole, a lattice turned in all three axes.
BODIES = {"plunging": 12000, "sim_case_1": None, "rotated_lattice": 12000}


def blocks(name):
    kind = {} if BODIES[name] is None else {"blocks": BODIES[name]}
    body = simulate(name, **kind)
    # Tables hold four decimals; an exactly symmetric body has no orientation of its own.
    return body.folded.round(4), body.truth, body


@pytest.fixture(scope="module", params=BODIES)
def case(request):
    X, W, body = blocks(request.param)
    return X, W, body, gu.unfold(X)


def size(points):
    return float(np.ptp(points, axis=0).max())


def test_truth_is_reached(case):
    X, W, _, u = case
    # In blocks.  Measured 0.002 to 0.050; doing nothing scores 2.95 to 4.5.
    rms = gu.aligned_rms(u.points, W) / u.frame.scale
    nothing = gu.aligned_rms(X, W) / u.frame.scale
    assert rms < 0.1
    assert nothing > 20 * rms
    assert u.outside_share == 0
    assert u.control.inverted_folded == u.control.inverted_unfolded == 0
    assert u.round_trip_max < 1e-9 * size(X)


def test_stratigraphic_runs_from_footwall_to_hanging_wall(case):
    _, W, body, u = case
    thickness = float(np.median(body.top - body.bottom)) / u.frame.scale
    # Horizons within 0.1 block on average (measured 0.01 to 0.04); turned over it would be 3.
    off = np.abs(u.stratigraphic - body.stratigraphic) * thickness
    assert off.mean() < 0.1
    assert np.corrcoef(u.points[:, 2], W[:, 2])[0, 1] > 0.99


def test_rigid_motion_changes_only_rounding(case):
    X, _, _, u = case
    turn = Rotation.from_euler("zyx", [50, 15, -20], degrees=True).as_matrix()
    moved = gu.unfold(X @ turn.T + [431_000.0, 7_400_000.0, 900.0])
    # Measured 4e-12 to 2e-7 of the body's size; rounding of the input is 1e-9 m in 600 m.
    assert np.abs(moved.points - u.points).max() < 1e-6 * size(X)


def test_row_order_permutes_the_answer(case):
    X, _, _, u = case
    order = np.random.default_rng(1).permutation(len(X))
    assert np.abs(gu.unfold(X[order]).points - u.points[order]).max() < 1e-6 * size(X)


def test_units_and_offsets_scale_the_answer(case):
    X, _, _, u = case
    feet = 1 / 0.3048
    other = gu.unfold(X * feet + [1e7, -2e6, 5e3])
    assert np.abs(other.points / feet - u.points).max() < 1e-6 * size(X)


def test_same_input_gives_the_same_bits():
    X, _, _ = blocks("plunging")
    first, second = gu.unfold(X), gu.unfold(X)
    assert np.array_equal(first.points, second.points)
    assert np.array_equal(first.control.unfolded.V, second.control.unfolded.V)


def test_a_flat_slab_stays_as_it_is():
    body = simulate("slab", blocks=5000)
    u = gu.unfold(body.folded)
    # Nothing to unfold: what is left is the spline's fit of a plane, measured 0.003 blocks.
    assert gu.aligned_rms(u.points, body.folded) < 0.01 * u.frame.scale
    assert np.abs(u.columns["volume_ratio"] - 1).max() < 1e-3


@pytest.fixture(scope="module")
def swelling():
    return simulate("swelling", blocks=12000).folded


@pytest.mark.parametrize("datum", ["top", "bottom", "proportional"])
def test_datum_makes_that_surface_flat(swelling, datum):
    u = gu.unfold(swelling, datum=datum)
    flat = {"top": ["top"], "bottom": ["bottom"], "proportional": ["top", "bottom"]}[datum]
    for name in ("top", "mid", "bottom"):
        z = u.surfaces[name].unfolded.V[:, 2]
        if name in flat:
            assert np.ptp(z) < 1e-9 * size(swelling)
        elif datum != "proportional":
            assert np.ptp(z) > 0.5 * u.frame.scale
    assert (tet_volumes(u.control.unfolded.V, u.control.unfolded.T) > 0).all()
    assert u.round_trip_max < 1e-9 * size(swelling)


def test_up_decides_the_top_and_never_mirrors(swelling):
    u, down = gu.unfold(swelling), gu.unfold(swelling, up=(0.0, 0.0, -1.0))
    assert np.allclose(down.stratigraphic, 1 - u.stratigraphic, atol=1e-12)
    assert np.allclose(down.points, u.points * [1, -1, -1], atol=1e-9)
    assert np.corrcoef(u.stratigraphic, swelling[:, 2])[0, 1] > 0
    assert np.linalg.norm(down.top.folded.V - u.bottom.folded.V) == 0


def test_data_frame_and_other_points(swelling):
    table = pd.DataFrame(swelling, columns=["XC", "YC", "ZC"]).assign(grade=1.0)
    u = gu.unfold(table)
    assert np.array_equal(u.points, gu.unfold(swelling).points)
    some = swelling[::50] + 0.3
    assert np.abs(u.to_folded(u.to_flat(some)) - some).max() < 1e-9 * size(swelling)


def test_saved_map_gives_the_same_points(swelling, tmp_path):
    u = gu.unfold(swelling)
    u.save(tmp_path / "m.npz")
    assert np.array_equal(gu.load(tmp_path / "m.npz").to_flat(swelling), u.points)


def test_summary_is_json_and_holds_the_promised_keys(swelling):
    u = gu.unfold(swelling)
    summary = json.loads(json.dumps(u.summary()))
    promised = (
        "version options points seconds peak_memory_mb hull top bottom flattening control_mesh "
        "inverted_folded inverted_unfolded injective outside_share round_trip_max nmd warnings"
    )
    assert set(promised.split()) <= set(summary)
    assert {"faces", "volume", "closed", "manifold"} <= set(summary["hull"])
    assert set(summary["nmd"]) == {"mean", "std", "p95", "max", "sample", "standard_error"}
    hull = summary["hull"]
    assert hull["volume"] == pytest.approx(hull["blocks_volume"], rel=0.1)
    assert "epsilon" in repr(u)
    # The blocks' volume, not that of the control mesh, which reaches past them.
    volume = len(swelling) * np.prod(summary["lattice"]["steps"])
    assert summary["body_volume"]["folded"] == pytest.approx(volume, rel=1e-9)
    assert summary["body_volume"]["unfolded"] == pytest.approx(volume, rel=0.02)
    assert summary["control_mesh"]["volume_folded"] > 1.05 * volume


def test_duplicates_are_kept_and_counted(swelling):
    twice = np.concatenate([swelling, swelling[:7]])
    u = gu.unfold(twice)
    assert len(u.points) == len(twice)
    assert any(w.startswith("7 points repeat") for w in u.summary()["warnings"])


def test_several_bodies(swelling):
    other = simulate("slab", blocks=3000).folded + np.array([0.0, 2000.0, 0.0])
    both = np.concatenate([swelling, other])
    with pytest.raises(InputError, match="2 separate bodies"):
        gu.unfold(both)
    one = gu.unfold(both, body=0)
    assert (one.location[: len(swelling)] == "inside").all()
    assert any("not part of the unfolded body" in w for w in one.summary()["warnings"])
    x, y, z = other[0]
    place = rf"{len(other)} points are not part .*, the first at \({x:.10g}, {y:.10g}, {z:.10g}\)"
    assert any(re.match(place, w) for w in one.summary()["warnings"])
    every = gu.unfold(both, body="all")
    assert every.outside_share == 0
    assert every.round_trip_max < 1e-9 * size(both)
    # Side by side: no block of one body lies among the other's.
    first, second = every.points[: len(swelling)], every.points[len(swelling) :]
    apart = first[:, 0].min() > second[:, 0].max() or second[:, 0].min() > first[:, 0].max()
    assert apart
    with pytest.raises(OptionError, match="body"):
        gu.unfold(both, body=5)


def test_reference_surfaces_in_place_of_a_hull():
    body = simulate("plunging", blocks=12000)
    top, bottom = (body.horizon(side, 15.0)[0] for side in ("top", "bottom"))
    u = gu.unfold(body.folded, top=top, bottom=(bottom.V, bottom.F))
    assert u.hull is None
    # Measured 0.04 blocks; doing nothing scores 4.5.
    assert gu.aligned_rms(u.points, body.truth) < 0.1 * u.frame.scale
    with pytest.raises(InputError, match="both or neither"):
        gu.unfold(body.folded, top=top)
    far = top.with_vertices(top.V + np.array([1e5, 0.0, 0.0]))
    with pytest.raises(InputError, match="face each other"):
        gu.unfold(body.folded, top=far, bottom=bottom)


def test_inverted_tetrahedra_are_an_error_unless_allowed(swelling, monkeypatch):
    sound = METHODS["sheet"]

    def spoiled(*args):
        result = sound.fit(*args)
        V = np.array(result.control.unfolded.V)
        V[:, 2] *= -1
        unfolded = result.control.unfolded.with_vertices(V)
        return replace(result, control=replace(result.control, unfolded=unfolded), shell=None)

    monkeypatch.setitem(METHODS, "sheet", replace(sound, fit=spoiled))
    with pytest.raises(ControlMeshError, match=r"inverted in the unfolded space.* around"):
        gu.unfold(swelling)
    u = gu.unfold(swelling, allow_uncertified=True)
    assert u.control.inverted_unfolded > 0
    assert not u.summary()["injective"]
    assert any("inverted" in w for w in u.summary()["warnings"])


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("method", "magic"),
        ("flattener", "iron"),
        ("hull", "convex"),
        ("split", "half"),
        ("datum", "sea"),
        ("up", (0.0, 0.0, 0.0)),
        ("up", (0.0, np.nan, 1.0)),
        ("body", -1),
        ("body", "both"),
        ("neighbours", 0),
        ("reach", -1.0),
        ("reach", np.inf),
    ],
)
def test_option_values_are_checked(option, value):
    with pytest.raises(OptionError, match=option):
        gu.UnfoldOptions(**{option: value})


def test_torn_blocks_are_an_error_unless_allowed(swelling, monkeypatch):
    # The bodies that were torn once unfold now; what is torn, test_quality.py tests.
    many = few(len(swelling)) + 1
    monkeypatch.setattr(measured, "torn_blocks", lambda *_: np.arange(many))
    with pytest.raises(ControlMeshError, match=rf"{many} of .* torn from their neighbours, around"):
        gu.unfold(swelling)
    u = gu.unfold(swelling, allow_uncertified=True)
    assert u.summary()["torn"] == many
    assert any("torn" in w for w in u.summary()["warnings"])


def test_a_few_torn_blocks_are_left_empty_and_told(swelling, monkeypatch):
    monkeypatch.setattr(measured, "torn_blocks", lambda *_: np.array([3, 8]))
    u = gu.unfold(swelling)
    assert np.flatnonzero(u.location == "outside").tolist() == [3, 8]
    assert np.isnan(u.points[[3, 8]]).all()
    assert np.isnan(u.columns["nmd_error"][[3, 8]]).all()
    assert u.certificate["injective"]
    assert any("2 of" in w and "left empty" in w for w in u.summary()["warnings"])


@pytest.mark.slow
def test_blocks_out_of_reach_are_an_error_unless_allowed(swelling, monkeypatch):
    # A control mesh two blocks short of the body's top and bottom, and nothing around it.
    monkeypatch.setattr(build, "PAD", -2.0)
    monkeypatch.setattr(build, "PAD_CAPPED", -2.0)
    with pytest.raises(ControlMeshError, match=r"lie outside the control mesh.*around"):
        gu.unfold(swelling, reach=0.0)
    u = gu.unfold(swelling, reach=0.0, allow_uncertified=True)
    empty = u.location == "outside"
    assert 0.02 < empty.mean() < 0.5  # more than tents are raised over; some of nine layers
    assert np.isnan(u.points[empty]).all()
    assert np.isnan(u.columns["nmd_error"][empty]).all()
    assert np.isfinite(u.points[~empty]).all()
    assert u.summary()["outside"]["empty"] == empty.sum()
    assert any("left empty" in w for w in u.summary()["warnings"])
    # The same with a shell: every block has a place.
    assert (gu.unfold(swelling).location != "outside").all()


def test_the_thesis_method_reaches_its_figures():
    body = simulate("sim_case_1")
    u = gu.unfold(body.folded, method="thesis")
    # The thesis's own code, its alpha mended, scores 0.0259 and 0.0318 on this body.
    assert gu.epsilon(body.truth, u.points).mean() <= 0.026
    assert u.quality.nmd.mean <= 0.032
    assert u.outside_share == 0
    assert set(u.surfaces) == {"top", "bottom"}
    assert u.summary()["method"]["thickness"] > 0


def test_the_thesis_method_takes_no_reference_surfaces():
    body = simulate("plunging", blocks=6000)
    top, bottom = (body.horizon(side, 30.0)[0] for side in ("top", "bottom"))
    with pytest.raises(OptionError, match="--method sheet"):
        gu.unfold(body.folded, method="thesis", top=top, bottom=bottom)


@pytest.mark.parametrize("hull", ["alpha", "ball_pivoting", "poisson"])
def test_other_hulls_come_to_the_same_answer(hull):
    body = simulate("plunging", blocks=12000)
    usual, other = gu.unfold(body.folded), gu.unfold(body.folded, hull=hull)
    assert other.hull.method == hull
    figures = [
        (gu.epsilon(body.truth, u.points).mean(), gu.aligned_rms(u.points, body.truth))
        for u in (usual, other)
    ]
    # Measured within 5 % on four bodies: the blocks themselves decide.  The target is 1.5 times.
    assert figures[1][0] < 1.5 * figures[0][0]
    assert figures[1][1] < 1.5 * figures[0][1]
