"""Every method of whole bodies: the same tests for all, and what each is exact on."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import FlatteningError, InputError, OptionError, SplitError
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import TriMesh
from geounfold.methods import (
    METHODS,
    IsomapMethodOptions,
    PointwiseMap,
    VerticalOptions,
    VolumetricOptions,
    isomap,
    volumetric,
)
from geounfold.methods.contract import carried_pair
from geounfold.methods.turned_over import TurnedOver
from geounfold.methods.vertical_heights import HeightField
from geounfold.synthetic import simulate
from geounfold.unfolding import options

POINTWISE = [name for name, method in METHODS.items() if not method.control]
EVERY = list(METHODS)


QUICK = VolumetricOptions(max_iter=1)  # one step takes as long as all else
_known = {}


def unfold(X, method, **how):
    how = {"volumetric_options": QUICK, "allow_uncertified": True, **how}
    return gu.unfold(X, method=method, **how)


def unfolded(X, method):
    """The plunging body's unfolding, made once."""
    if method not in _known:
        _known[method] = unfold(X, method)
    return _known[method]


def size(points):
    return float(np.ptp(points, axis=0).max())


def grid(*counts):
    """Centroids of blocks of side 1, (n, 3), about the origin."""
    axes = [np.arange(n) - (n - 1) / 2 for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_the_table_is_what_options_offer():
    assert set(EVERY) == {
        *("sheet", "thesis", "ufo", "stratigraphic", "shear", "volumetric", "isomap")
    }
    assert options.VALID["method"] == tuple(METHODS)
    assert {m.name for m in METHODS.values()} == set(METHODS)
    for method in METHODS.values():
        assert hasattr(gu.UnfoldOptions(), method.options)


# ------------------------------------------------------------------------------ the same for all


@pytest.mark.parametrize("method", EVERY)
def test_a_flat_slab_stays_as_it_is(method):
    # Turned within its plane by 0.5 radians, so that nothing lies along an axis.
    W = grid(30, 20, 5)
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


@pytest.fixture(scope="module")
def plunging():
    """Blocks of 10 m on a lattice that cuts a plunging fold; no two of its sides are alike."""
    P = grid(30, 17, 24) + 0.5
    height = 3 * np.sin(P[:, 0] / 7) + 0.15 * P[:, 1]
    return P[np.abs(P[:, 2] - height) < 2.4] * 10


@pytest.mark.parametrize("method", EVERY)
def test_order_motion_and_unit_change_nothing(method, plunging):
    X = plunging
    first = unfolded(X, method)
    order = np.random.default_rng(1).permutation(len(X))
    turn = Rotation.from_euler("zyx", [50, 15, -20], degrees=True).as_matrix()
    moved = (X @ turn.T + [431_000.0, 7_400_000.0, 900.0])[order] / 0.3048
    other = unfold(moved, method, up=tuple(turn[:, 2]))
    # The bound of the whole library: rounding of the input is 1e-9 m in 300 m.
    assert np.abs(other.points * 0.3048 - first.points[order]).max() < 1e-6 * size(X)
    assert np.abs(other.stratigraphic - first.stratigraphic[order]).max() < 1e-6
    assert np.array_equal(unfold(X, method).points, first.points)


@pytest.mark.parametrize("method", EVERY)
def test_columns_summary_and_other_points(method, plunging):
    u = unfolded(plunging, method)
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
def test_control_meshes_are_proved_saved_and_inverted(method, plunging, tmp_path):
    u = unfolded(plunging, method)
    assert u.injective
    assert u.round_trip_max < 1e-9 * size(plunging)
    u.save(tmp_path / "m.npz")
    assert np.array_equal(gu.load(tmp_path / "m.npz").to_flat(plunging), u.points)
    assert (tet_volumes(u.control.unfolded.V, u.control.unfolded.T) > 0).all()


@pytest.mark.parametrize("method", POINTWISE)
def test_without_a_control_mesh_nothing_is_proved(method, plunging, tmp_path):
    with pytest.raises(OptionError, match=f"method {method} .*nothing is proved.*--allow-unc"):
        gu.unfold(plunging, method=method)
    with pytest.raises(OptionError, match="no prisms to go by"):
        unfold(plunging, method, coordinates="mvc")
    u = unfolded(plunging, method)
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


def test_isomap_has_no_way_back(plunging):
    u = unfolded(plunging, "isomap")
    assert u.round_trip_max is None
    assert u.summary()["round_trip_max"] is None
    assert "no way back" in u._repr_html_()
    with pytest.raises(InputError, match="isomap has no way back: use --method sheet"):
        u.to_folded(u.points)
    with pytest.raises(InputError, match="no way back"):
        u.map.rule.to_folded(u.points)


@pytest.mark.parametrize("method", EVERY)
def test_up_turns_the_answer_over_without_mirroring(method, plunging):
    u, down = unfolded(plunging, method), unfold(plunging, method, up=(0.0, 0.0, -1.0))
    assert_allclose(down.stratigraphic, 1 - u.stratigraphic, atol=1e-9)
    assert_allclose(down.points, u.points * [1, -1, -1], atol=1e-6)


@pytest.mark.parametrize("method", POINTWISE)
def test_rules_unfold_one_body_at_a_time(method):
    W = grid(16, 10, 3)
    two = np.concatenate([W, W + np.array([40.0, 0, 0])])
    with pytest.raises(OptionError, match=r"one body at a time.*choose one by --body"):
        unfold(two, method, body="all")
    if method != "isomap":
        apart = unfold(two, method, body=0).location == "outside"
        assert apart.sum() == len(W)


# ------------------------------------------------------------------------- what each is exact on


def inner(W, margin=2.0):
    """Whether blocks lie off the outline of their body, where no hull ends."""
    low, high = W[:, :2].min(axis=0) + margin, W[:, :2].max(axis=0) - margin
    return ((W[:, :2] > low) & (W[:, :2] < high)).all(axis=1)


def test_shear_is_exact_on_vertical_shear():
    W = grid(44, 24, 5)
    rise = 3 * np.sin(W[:, 0] / 7) + 0.2 * W[:, 1]
    u = unfold(W + np.outer(rise, [0, 0, 1]), "shear")
    # Measured 0.02 blocks, the fitted surfaces' error; slopes reach 25 degrees, and the sheet
    # method, which slips along the layers, is off by 0.9.
    assert gu.aligned_rms(u.points[inner(W)], W[inner(W)]) / u.frame.scale < 0.06
    # x and y are kept to the last digit, but for the frame's rigid motion.
    flat, given = (P[:, :2] - P[:, :2].mean(axis=0) for P in (u.points, W))
    gram, wanted = (P[::7] @ P[::11].T for P in (flat, given))
    assert_allclose(gram, wanted, atol=1e-9)
    assert_allclose(u.columns["volume_ratio"], 1, atol=0.05)


def test_stratigraphic_is_exact_on_proportional_layers():
    W = grid(44, 24, 5)

    def at(xy, share):
        thick, floor = 5 + 1.5 * np.sin(xy[:, 0] / 7), 2 * np.cos(xy[:, 1] / 8)
        return np.column_stack([xy, floor + share * thick])

    share = (W[:, 2] + 2.5) / 5
    # Reference surfaces given, two blocks wider than the body: how far a hull runs off blocks that
    # lie more closely here than there is no matter of the method.
    plan = grid(48, 28, 1)[:, :2]
    k = np.arange(48 * 28).reshape(48, 28)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    u = unfold(at(W[:, :2], share), "stratigraphic", top=(at(plan, 1), F), bottom=(at(plan, 0), F))
    # Measured 0.001, 0.005 at most; true thickness in place of the proportional one is 0.08 off.
    assert np.abs(u.stratigraphic - share).max() < 0.02
    # z is the share times the mean thickness, level at the mean of the two surfaces.
    mean = np.ptp(u.points[:, 2]) / np.ptp(u.stratigraphic)
    assert_allclose(u.points[:, 2], (u.stratigraphic - 0.5) * mean, atol=1e-9)
    assert mean == pytest.approx(
        at(W[:, :2], 1.0)[:, 2].mean() - at(W[:, :2], 0.0)[:, 2].mean(), abs=0.05
    )


def test_ufo_is_exact_on_the_reference_surface_of_a_cylinder():
    W = grid(44, 20, 5)
    R = 24.0
    angle = W[:, 0] / R  # 105 degrees between the limbs
    out = (R + W[:, 2])[:, None] * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    X = out + np.outer(W[:, 1], [0, 1, 0])
    u = gu.unfold(X, method="ufo")
    scale = u.frame.scale
    at = W[:, 2] == 0
    # Blocks of the middle layer lie on the surface: measured 0.01 blocks.
    assert gu.aligned_rms(u.points[at], W[at]) / scale < 0.04
    # The others keep their anchor and their height: no slip, W as it is.
    assert gu.aligned_rms(u.points, W) / scale < 0.04
    # Lengths along a layer at height t were R + t for R: the volume of the blocks above shrinks.
    ratio = u.columns["volume_ratio"]
    for t in (-2.0, 0.0, 2.0):
        mine = (W[:, 2] == t) & inner(W)
        assert ratio[mine].mean() == pytest.approx(R / (R + t), abs=0.02)
    assert u.fits[0].notes["reference"] == "mid"


def test_volumetric_strains_less_than_what_it_starts_from(plunging):
    u = unfolded(plunging, "volumetric")
    notes = u.fits[0].notes
    before, after = notes["energy"]
    assert 6 < after < before  # 6: the energy of an isometry
    assert notes["iterations"] == QUICK.max_iter
    z = u.control.unfolded.V[:, 2] / u.frame.scale
    low, high = (z[np.abs(z - e) < 0.5] for e in (z.min(), z.max()))
    # Top and bottom are drawn to planes, softly: measured within 0.02 blocks.
    assert max(np.ptp(low), np.ptp(high)) < 0.1


def test_volumetric_says_when_it_stops_early(plunging):
    u = unfolded(plunging, "volumetric")
    assert not u.fits[0].notes["converged"]
    assert any("stopped after 1 steps" in warning for warning in u.summary()["warnings"])


def test_volumetric_stops_where_nothing_moves():
    u = gu.unfold(grid(16, 10, 3), method="volumetric")
    assert u.fits[0].notes["converged"]
    assert u.fits[0].notes["moved_last"] <= VolumetricOptions().tol
    assert u.summary()["warnings"] == []


def test_volumetric_refuses_an_inverted_start(monkeypatch, plunging):
    def mirrored(body):
        anchored = sound(body)
        return replace(anchored, uv=anchored.uv * [1, -1])

    sound = volumetric.anchor
    monkeypatch.setattr(volumetric, "anchor", mirrored)
    with pytest.raises(FlatteningError, match=r"tetrahedra are inverted.*--flattener"):
        gu.unfold(plunging, method="volumetric")


def test_volumetric_names_libigls_failure(monkeypatch, plunging):
    class Broken:
        def __init__(self, *_):
            pass

        def __call__(self, *_):
            raise volumetric.BackendError("libigl's slim_solve returned positions not finite")

    monkeypatch.setattr(volumetric, "SlimTets", Broken)
    with pytest.raises(FlatteningError, match="volumetric: libigl's slim_solve"):
        gu.unfold(plunging, method="volumetric")


# -------------------------------------------------------------------------- bodies they cannot do


@pytest.mark.parametrize("method", ["shear", "stratigraphic"])
def test_overhangs_are_counted(method):
    body = simulate("recumbent", blocks=4000)
    u = unfold(body.folded, method)
    count = u.fits[0].notes["ambiguous"]
    # Limbs overturned to 100 degrees cover each other over most of the plan: measured 80 %.
    assert 0.3 * len(body.folded) < count < len(body.folded)
    said = f"{count} of {len(body.folded)} blocks stand where a vertical line meets"
    assert any(said in warning for warning in u.summary()["warnings"])
    assert u.summary()["method"]["ambiguous"] == count
    # What such a tool gives is no unfolding: blocks by blocks off, where the sheet is within 1.
    assert gu.aligned_rms(u.points, body.truth) / u.frame.scale > 5


@pytest.mark.parametrize("method", ["shear", "stratigraphic"])
def test_a_standing_sheet_is_refused(method):
    X = grid(30, 20, 4)[:, [0, 2, 1]]  # thin along y
    with pytest.raises(SplitError, match=r"stands on end.*turn --up across it"):
        unfold(X, method)
    # Along the axis across the body it is a slab.
    u = unfold(X, method, vertical_options=VerticalOptions(axis="across"))
    assert gu.aligned_rms(u.points, X) / u.frame.scale < 0.02


def test_a_top_beside_its_bottom_is_refused(monkeypatch):
    from geounfold.methods import vertical_heights

    def parted(self, xy):
        n = len(xy)
        return vertical_heights.VerticalColumn(
            np.zeros(n), np.ones(n), np.zeros(n, bool), np.zeros(n, bool)
        )

    monkeypatch.setattr(vertical_heights.VerticalRule, "column", parted)
    with pytest.raises(SplitError, match="vertically over the bottom nowhere"):
        unfold(grid(20, 14, 4), "shear")


def test_crossed_columns_are_left_empty_and_counted(monkeypatch):
    from geounfold.methods import vertical_heights

    sound = vertical_heights.VerticalRule.column

    def crossed(self, xy):
        at = sound(self, xy)
        return at._replace(top=np.where(xy[:, 0] > 8.2, at.bottom - 1, at.top))

    monkeypatch.setattr(vertical_heights.VerticalRule, "column", crossed)
    u = unfold(grid(20, 14, 4), "shear")
    empty = u.location == "outside"
    # Whole rows of 14 by 4 blocks at the end of the longest axis: one or two, by where the frame
    # has its origin.
    assert empty.sum() in (56, 112)
    assert np.isnan(u.points[empty]).all()
    assert u.fits[0].notes["crossed"] == empty.sum()
    assert any("bottom lies over the top" in w for w in u.summary()["warnings"])


# ------------------------------------------------------------------------------------------ parts


def tent(slope):
    """Two triangles over the unit square whose ridge runs along y at x = 0."""
    V = np.array([[-1.0, 0, -slope], [0, 0, 0], [0, 1, 0], [-1, 1, -slope], [1, 0, 0], [1, 1, 0]])
    return TriMesh(V, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])


def test_heights_are_met_continued_and_told_apart():
    field = HeightField(tent(0.5), 1)
    at = field.at(np.array([[-0.5, 0.5], [0.5, 0.25], [-3.0, 0.5], [3.0, 0.5]]))
    # On the plane z = x / 2, on z = 0; and beyond their borders on the same planes.
    assert_allclose(at.z, [-0.25, 0, -1.5, 0], atol=1e-12)
    assert at.met.tolist() == [True, True, False, False]
    assert not at.several.any()
    steep = HeightField(tent(5.0), 1).at(np.array([[-3.0, 0.5]]))
    # Continued level, not down to -15: at the mean height of the border's triangle.
    assert -5 <= steep.z[0] < 0
    over = tent(0.5)
    two = TriMesh(
        np.concatenate([over.V, over.V + np.array([0, 0, 2])]), np.concatenate([over.F, over.F + 6])
    )
    for side, z in ((1, 2.0), (-1, 0.0)):
        found = HeightField(two, side).at(np.array([[0.5, 0.5]]))
        assert found.z[0] == pytest.approx(z)
        assert found.several.all()


def test_landmark_isomap_of_a_plane():
    rng = np.random.default_rng(4)
    xy = grid(30, 20, 1)[:, :2] + rng.uniform(-0.3, 0.3, (600, 2))
    P = np.column_stack([xy, 0.3 * xy[:, 0]])  # a slope: lengths along x grow by 4.4 %
    true = np.column_stack([xy[:, 0] * np.hypot(1, 0.3), xy[:, 1]])
    spread = np.linalg.norm(true - true.mean(axis=0), axis=1).mean()
    for landmarks in (600, 60):
        uv, count = isomap.landmark_isomap(P, IsomapMethodOptions(landmarks=landmarks))
        assert count == landmarks
        off = gu.aligned_rms(*(np.column_stack([a, np.zeros(600)]) for a in (uv, true)))
        # Mirrored answers come out as they come: either way round is an answer.
        other = np.column_stack([uv * [1, -1], np.zeros(600)])
        off = min(off, gu.aligned_rms(other, np.column_stack([true, np.zeros(600)])))
        # Paths zigzag: 2 % longer than lines.  Measured 0.2 of 10.5; a wrong scaling is off by 10.
        assert off < 0.04 * spread


def test_isomap_places_by_distances_exactly():
    rng = np.random.default_rng(8)
    at = rng.normal(size=(40, 12, 3))
    true = rng.normal(size=(40, 3))
    distance = np.linalg.norm(at - true[:, None], axis=2)
    start = true + 0.3 * rng.normal(size=(40, 3))
    found = isomap._trilaterated(start, at, distance, np.ones((40, 12)))
    # Distances to points at their true places have their least sum, zero, at the truth alone.
    assert_allclose(found, true, atol=1e-8)


def test_isomap_takes_equally_near_points_together():
    P = grid(8, 8, 1)
    graph = isomap._graph(P, 5)
    # Four at 1, then four at 1.41: the fifth is one of these, so all of them are taken.
    inside = np.flatnonzero(np.abs(P[:, :2]).max(axis=1) < 2.6)
    assert (np.diff(graph.indptr)[inside] == 8).all()
    assert (graph != graph.T).nnz == 0


def test_isomap_refuses_a_graph_in_pieces_and_a_line():
    apart = np.concatenate([grid(6, 6, 1), grid(6, 6, 1) + np.array([50.0, 0, 0])])
    with pytest.raises(FlatteningError, match="falls into 2 parts; raise neighbours"):
        isomap.landmark_isomap(apart, IsomapMethodOptions())
    with pytest.raises(FlatteningError, match="the distances span no plane"):
        isomap.landmark_isomap(grid(2, 1, 1), IsomapMethodOptions())


def test_blocks_off_by_more_than_allowed_are_placed_again():
    P = grid(6, 6, 3)
    flat = P.copy()
    flat[50] += [0, 0, 9.0]
    sound = isomap._sound(P, flat, IsomapMethodOptions(near=8))
    assert not sound[50]
    assert sound.sum() > len(P) / 2
    assert isomap._sound(P, P, IsomapMethodOptions(near=8)).all()


def test_turned_over_is_a_half_turn():
    rule = SimpleNamespace(
        way_back=True,
        to_flat=lambda P: SimpleNamespace(points=P, stratigraphic=P[:, 2], anchored=P[:, 0] > 0),
        to_folded=lambda Q: Q,
    )
    over = TurnedOver(rule)
    P = np.array([[1.0, 2, 0.3]])
    assert over.to_flat(P).points.tolist() == [[1, -2, -0.3]]
    assert over.to_flat(P).stratigraphic.tolist() == [0.7]
    assert over.to_folded(over.to_flat(P).points).tolist() == P.tolist()
    assert over.way_back


def test_surfaces_leave_out_what_has_no_image():
    def to_flat(P):
        return SimpleNamespace(points=np.where(P[:, :1] < -0.5, np.nan, P))

    pair = carried_pair(tent(0.5), SimpleNamespace(to_flat=to_flat))
    assert len(pair.folded.F) == 2
    assert_allclose(pair.folded.V, pair.unfolded.V)
    assert pair.flattening is None


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (VerticalOptions, "axis", "sideways"),
        (VolumetricOptions, "max_iter", 0),
        (VolumetricOptions, "tol", 0.0),
        (VolumetricOptions, "weight", np.inf),
        (IsomapMethodOptions, "neighbours", 2),
        (IsomapMethodOptions, "landmarks", 3),
        (IsomapMethodOptions, "near", 3),
        (IsomapMethodOptions, "rounds", 0),
        (IsomapMethodOptions, "largest", np.nan),
    ],
)
def test_bad_options_are_refused(kind, field, value):
    with pytest.raises(OptionError, match=f"{field} must be"):
        kind(**{field: value})


# --------------------------------------------------------------------------------- command line


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
