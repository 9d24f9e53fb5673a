"""The thesis's method: what it must keep, what it gets wrong by design, what it refuses."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from geounfold.backends.igl import TetIndex, barycentric_in_tets
from geounfold.errors import ControlMeshError, InputError, NoSheetError, OptionError, SplitError
from geounfold.flattening import FLATTENERS, Stop, flatten
from geounfold.geometry.measures import enclosed_volume, tet_volumes
from geounfold.geometry.mesh import TriMesh
from geounfold.methods import thesis
from geounfold.methods.thesis import ThesisOptions, build, joint, surfaces, thesis_control
from geounfold.surfaces.hull import extract_hull
from tests.places import acceptance
from tests.shapes import rotation

UP = np.array([0.0, 0.0, 1.0])


def epsilon(A, B, k=26):
    """Equation 2.4 of the thesis, written out once more so as not to trust the product's."""
    ids = cKDTree(A).query(A, k=k + 1)[1][:, 1:]
    a, b = (np.linalg.norm(P[:, None] - P[ids], axis=2).mean(axis=1) for P in (A, B))
    return np.abs(a - b) / a


def closed(top, bottom):
    """Closed hull between two grids (nx, ny, 3), outward; walls split into unit rows."""
    nx, ny, _ = top.shape
    height = float(np.abs(top - bottom)[..., 2].max())
    rows = max(2, round(height))
    layers = [bottom + f * (top - bottom) for f in np.linspace(0, 1, rows + 1)]
    node = np.arange(nx * ny).reshape(nx, ny)
    n = nx * ny

    def quads(a, b, c, d):
        q = [np.ravel(v) for v in (a, b, c, d)]
        return np.concatenate([np.stack(q[:3], 1), np.stack([q[0], q[2], q[3]], 1)])

    lid = quads(node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
    edge = np.concatenate([node[:-1, 0], node[-1, :-1], node[:0:-1, -1], node[0, :0:-1]])
    ahead = np.roll(edge, -1)
    F = [lid[:, ::-1], lid + rows * n]
    F += [
        quads(edge + k * n, ahead + k * n, ahead + (k + 1) * n, edge + (k + 1) * n)
        for k in range(rows)
    ]
    faces = np.concatenate(F)
    V = np.concatenate([layer.reshape(-1, 3) for layer in layers])
    used, inverse = np.unique(faces, return_inverse=True)
    mesh = TriMesh(V[used], inverse.reshape(-1, 3))
    assert enclosed_volume(mesh.V, mesh.F) > 0
    return mesh


def grid(u, v):
    return np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)


def body(profile, length, width, thick):
    """Hull and blocks of a sheet along ``profile(s, t) -> (x, z)``; also the blocks' truth."""
    s, y = np.arange(0, length + 0.5), np.arange(0, width + 0.5)

    def surface(t):
        S, Y = np.moveaxis(grid(s, y), -1, 0)
        x, z = profile(S, t)
        return np.stack([x, Y, z], axis=-1)

    u, v, w = (np.arange(0.5, n) for n in (length, width, thick))
    S, Y, T = (a.ravel() for a in np.meshgrid(u, v, w - thick / 2, indexing="ij"))
    x, z = profile(S, T)
    hull = closed(surface(thick / 2), surface(-thick / 2))
    return hull, np.stack([x, Y, z], axis=1), np.stack([S, Y, T], axis=1)


def flat(s, t):
    return s, t + 0 * s


def waves(steepest, length, periods=1):
    """Profile whose heading swings to +-``steepest`` radians; level at both ends."""
    fine = np.linspace(0, length, 4001)
    heading = steepest * np.sin(2 * np.pi * periods * fine / length)
    x, z = (
        np.concatenate([[0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(fine))])
        for f in (np.cos(heading), np.sin(heading))
    )

    def profile(s, t):
        a = np.interp(s, fine, heading)
        return np.interp(s, fine, x) - t * np.sin(a), np.interp(s, fine, z) + t * np.cos(a)

    return profile


def vertical_body(height, nx=40, ny=24, thick=5.0):
    """Hull and blocks under a vertical outline, between ``height(x)`` -+ ``thick / 2``."""
    xy = grid(np.arange(nx + 1.0), np.arange(ny + 1.0))
    z = height(xy[..., 0])
    top, bottom = (np.dstack([xy, z + q]) for q in (thick / 2, -thick / 2))
    q = grid(np.arange(0.5, nx), np.arange(0.5, ny)).reshape(-1, 2)
    levels = np.arange(0.5, thick) - thick / 2
    blocks = np.concatenate([np.column_stack([q, height(q[:, 0]) + t]) for t in levels])
    return closed(top, bottom), blocks


def carried(control, P):
    """Unfolded positions of points, all of which must lie inside."""
    index = TetIndex(control.folded.V, control.folded.T)
    element = index.locate(P)
    assert (element >= 0).all()
    corner = control.folded.T[element]
    share = barycentric_in_tets(P, control.folded.V, corner)
    return (
        np.einsum("ij,ijk->ik", share, control.unfolded.V[corner]),
        np.einsum("ij,ij->i", share, control.stratigraphic[corner]),
    )


def gram(P):
    Q = P - P.mean(axis=0)
    return Q[::7] @ Q[::11].T


GENTLE = body(waves(0.4, 60), 60, 24, 5)  # dips to 23 degrees


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_a_flat_slab_comes_back_exactly(seed):
    hull, P, W = body(flat, 24, 15, 4)
    turn = np.eye(3) if seed is None else rotation(seed)
    shift = np.zeros(3) if seed is None else np.array([30.0, -20.0, 7.0])
    hull = hull.with_vertices(hull.V @ turn.T + shift)
    mesh = thesis_control(P @ turn.T + shift, hull, up=turn @ UP)
    Y, level = carried(mesh.control, P @ turn.T + shift)
    # Rounding: 1e-12 at coordinates of 40; any wrong height or slope shows at 1e-2 and more.
    # Gram matrices also see a mirrored answer once z is compared by itself.
    assert_allclose(gram(Y), gram(W), atol=1e-8)
    assert_allclose(Y[:, 2], W[:, 2], atol=1e-9)
    assert_allclose(level, W[:, 2] / 4 + 0.5, atol=1e-9)
    assert mesh.thickness == pytest.approx(4, abs=1e-9)
    assert np.linalg.det(np.linalg.lstsq(W - W.mean(0), Y - Y.mean(0), rcond=None)[0]) > 0


def test_a_gentle_fold_is_within_the_thesis_figures():
    hull, P, W = GENTLE
    mesh = thesis_control(P, hull)
    Y, _ = carried(mesh.control, P)
    # The thesis prints 0.0227 and 0.0257 for its first, gentle case; the targets leave a little.
    assert epsilon(W, Y).mean() <= 0.026
    assert epsilon(P, Y).mean() <= 0.032
    # The fold of 11 blocks' height is taken out but for the thickness, 5.19 for 5: 0.12 blocks.
    assert np.abs(Y[:, 2] - W[:, 2]).max() < 0.2
    assert np.ptp(P[:, 2]) > 11
    assert (mesh.control.inverted_folded, mesh.control.inverted_unfolded) == (0, 0)


@pytest.mark.parametrize("dip", [0, 20, 35])
def test_thickness_on_a_slope_is_wrong_as_the_theory_says(dip):
    # Kept defect: vertical thickness, t / cos(dip), under a vertical outline.
    vertical = 5.0 / np.cos(np.radians(dip))
    hull, P = vertical_body(lambda x: np.tan(np.radians(dip)) * x, thick=vertical)
    along = thesis_control(P, hull, UP, ThesisOptions(axis="up"))
    assert along.thickness == pytest.approx(vertical, rel=1e-9)
    # Paired across the layers, the same dip does no harm.
    hull, P, _ = body(flat, 40, 24, 5)
    c, d = np.cos(np.radians(dip)), np.sin(np.radians(dip))
    turn = np.array([[c, 0, -d], [0, 1, 0], [d, 0, c]])
    across = thesis_control(P @ turn.T, hull.with_vertices(hull.V @ turn.T), UP)
    assert across.thickness == pytest.approx(5.0, rel=1e-9)


def test_varying_thickness_is_lost():
    # Kept defect: both sheets are flat, so a lens comes out as a slab.
    xy = grid(np.arange(41.0), np.arange(25.0))
    half = 1.5 + 2.5 * np.sin(np.pi * xy[..., 0] / 40) ** 2
    hull = closed(np.dstack([xy, half]), np.dstack([xy, -half]))
    x, y, t = (
        a.ravel()
        for a in np.meshgrid(np.arange(0.5, 40), np.arange(0.5, 24), [-0.9, 0, 0.9], indexing="ij")
    )
    P = np.column_stack([x, y, t * (1.5 + 2.5 * np.sin(np.pi * x / 40) ** 2)])
    mesh = thesis_control(P, hull)
    Y, level = carried(mesh.control, P)
    # 0.95 of the way up wherever it is, where true thickness runs from 3 to 8 blocks; linear
    # interpolation on edges of a block leaves 0.004.
    assert_allclose(level[t > 0.5], 0.95, atol=0.02)
    assert np.ptp(Y[t > 0.5, 2]) < 0.02 * mesh.thickness


@pytest.mark.parametrize("axis", ["principal", "up"])
@pytest.mark.parametrize(
    "make",
    [
        lambda: GENTLE,
        lambda: body(waves(0.7, 80, 2), 80, 24, 5),  # dips to 40 degrees
        lambda: body(flat, 24, 15, 2),
        lambda: (*vertical_body(lambda x: 6 * np.sin(x / 6)), None),
    ],
    ids=["gentle", "waves", "thin", "vertical"],
)
def test_every_block_lies_in_the_mesh(make, axis):
    hull, P, _ = make()
    mesh = thesis_control(P, hull, options=ThesisOptions(axis=axis))
    # Half a block around the centroids is inside as well (corners of the blocks above, below).
    for step in (0, 0.49, -0.49):
        Y, _ = carried(mesh.control, P + step * UP * (axis == "up"))
        assert np.isfinite(Y).all()
    assert mesh.control.inverted_folded == 0
    assert mesh.control.inverted_unfolded == 0


def test_blocks_past_the_hull_are_held_too():
    hull, _, W = body(flat, 24, 15, 4)
    past = np.concatenate([W, [[-2.5, 7, 0], [12, 17.2, 1], [12, 7, 5.5], [26, 17, -4]]])
    mesh = thesis_control(past, hull, options=ThesisOptions(axis="up"))
    Y, level = carried(mesh.control, past)
    # The continuation of a flat slab is flat: exact but for rounding.
    assert_allclose(gram(Y), gram(past), atol=1e-8)
    assert_allclose(level, past[:, 2] / 4 + 0.5, atol=1e-9)
    assert mesh.extended > 0


def test_prisms_are_vertical_and_end_on_both_surfaces():
    hull, P, _ = GENTLE
    mesh = thesis_control(P, hull)
    low, bottom, top, high = mesh.control.folded.V.reshape(4, -1, 3)
    for a, b in ((low, bottom), (bottom, top), (top, high)):
        edge = b - a
        axis = edge / np.linalg.norm(edge, axis=1, keepdims=True)
        assert_allclose(axis, np.broadcast_to(UP, axis.shape), atol=1e-9)
    distance = cKDTree(mesh.top.V).query(top)[0]
    # The top's vertices come first and unmoved; the sheets are level in unfolded space.
    assert_allclose(distance[: len(mesh.top.V)], 0, atol=1e-9)
    heights = mesh.control.unfolded.V[:, 2].reshape(4, -1)
    assert_allclose(heights[1], -mesh.thickness / 2, atol=1e-12)
    assert_allclose(heights[2], mesh.thickness / 2, atol=1e-12)
    _, at_bottom, at_top, _ = mesh.control.stratigraphic.reshape(4, -1)
    assert_allclose(at_bottom, 0, atol=1e-12)
    assert_allclose(at_top, 1, atol=1e-12)
    assert len(mesh.top_flat.uv) == len(mesh.top.V)
    assert len(mesh.bottom_flat.uv) == len(mesh.bottom.V)


def test_neighbouring_prisms_share_their_diagonals():
    hull, P, _ = GENTLE
    T = thesis_control(P, hull).control.folded.T
    faces = np.sort(np.concatenate([T[:, [1, 2, 3]], T[:, [0, 2, 3]], T[:, [0, 1, 3]], T[:, :3]]))
    unique, count = np.unique(np.sort(faces, axis=1), axis=0, return_counts=True)
    assert count.max() == 2
    # A mesh that is one ball: its border has the Euler number of a sphere.  Prisms cut along
    # crossing diagonals leave some 1,000 unmatched faces inside.
    border = unique[count == 1]
    edges = np.unique(np.sort(border[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    assert len(np.unique(border)) - len(edges) + len(border) == 2


def test_up_turns_the_answer_over_without_mirroring():
    hull, P, _ = GENTLE
    one, other = (carried(thesis_control(P, hull, s * UP).control, P) for s in (1, -1))
    # The other side's vertices go first into the joint plan, so the same surfaces are cut along
    # other edges: measured 0.003; a mirrored or shifted answer is off by whole layers, 0.2.
    assert_allclose(one[1] + other[1], 1, atol=0.01)
    assert_allclose(one[0][:, 2], -other[0][:, 2], atol=0.05)
    A, B = (Y - Y.mean(axis=0) for Y, _ in (one, other))
    assert np.linalg.det(np.linalg.lstsq(A, B, rcond=None)[0]) == pytest.approx(1, abs=0.01)


def test_inset_moves_zero_and_one_to_the_blocks_faces():
    hull, P, W = body(flat, 24, 15, 4)
    _, level = carried(thesis_control(P, hull, inset=0.5).control, P)
    assert_allclose(level, (W[:, 2] + 2.5) / 5, atol=1e-9)


def test_rigid_motion_changes_nothing():
    rng = np.random.default_rng(5)
    hull, P, _ = GENTLE
    # Jitter against Delaunay's ties, which rounding breaks either way.
    hull = hull.with_vertices(hull.V + 0.02 * rng.standard_normal(hull.V.shape))
    turn, shift = rotation(3), np.array([400.0, -100.0, 50.0])
    Y, level = carried(thesis_control(P, hull).control, P)
    moved = hull.with_vertices(hull.V @ turn.T + shift)
    Q = P @ turn.T + shift
    Z, again = carried(thesis_control(Q, moved, turn @ UP).control, Q)
    # LAPACK may return a principal axis reversed.  The border's grid then starts at another corner
    # and rim blocks move by some thousandths.  Measured over 20 rotations and 11 jitters: 4e-14
    # and 5e-11 where no axis is reversed; else 5.1e-3 to 7.4e-3, and 0.18 to 0.33 square blocks.
    # The bounds are twice these.  A wrong turn moves blocks by blocks.
    assert_allclose(level, again, atol=0.015)
    assert_allclose(gram(Y), gram(Z), atol=0.7)


def test_answers_are_the_same_bit_for_bit():
    hull, P, _ = GENTLE
    a, b = (thesis_control(P, hull).control for _ in range(2))
    assert_array_equal(a.unfolded.V, b.unfolded.V)
    assert_array_equal(a.folded.V, b.folded.V)
    assert_array_equal(a.folded.T, b.folded.T)


def test_the_thesis_springs_can_be_asked_for():
    options = FLATTENERS["spring_dynamic"].options(stop_rule="thesis")
    hull, P, _ = GENTLE
    mesh = thesis_control(
        P,
        hull,
        flatten=lambda side, start: flatten(
            side, "spring_dynamic", start=start, options=options, repair=False
        ),
    )
    assert mesh.top_flat.stop == Stop.THESIS_RULE
    # They stop with the surface hardly flattened: some per cent of strain, where the same
    # springs at rest are left with next to none on this developable surface.
    assert mesh.top_flat.edge_error[-1] > 5 * thesis_control(P, hull).top_flat.edge_error[-1]


def overturned(steepest):
    return body(waves(np.radians(steepest), 120, 2), 120, 20, 4)


@pytest.mark.parametrize("axis", ["principal", "up"])
def test_an_overhang_is_refused(axis):
    hull, P, _ = overturned(115)
    with pytest.raises(SplitError, match="cannot hold an overhang; use --method sheet"):
        thesis_control(P, hull, options=ThesisOptions(axis=axis))


def test_a_surface_behind_itself_is_refused(monkeypatch):
    monkeypatch.setattr(surfaces, "STEEP", 1.0)
    hull, P, _ = overturned(115)
    with pytest.raises(SplitError, match=r"% of the (top|bottom) lies behind another part"):
        thesis_control(P, hull, UP, ThesisOptions(axis="up"))


def test_a_wall_is_refused(monkeypatch):
    monkeypatch.setattr(surfaces, "STEEP", 1.0)
    hull, P = vertical_body(lambda x: 6 * np.tanh(5 * (x - 20)), thick=6.0)
    with pytest.raises(SplitError, match="steep slopes tear"):
        thesis_control(P, hull, UP, ThesisOptions(axis="up"))


def test_a_sheet_standing_on_edge_is_refused():
    hull, P, _ = body(flat, 24, 15, 4)
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    with pytest.raises(SplitError, match="no top and bottom"):
        thesis_control(
            P @ turn.T, hull.with_vertices(hull.V @ turn.T), UP, ThesisOptions(axis="up")
        )


def test_a_cube_has_no_sheet():
    hull, P, _ = body(flat, 8, 8, 8)
    with pytest.raises(NoSheetError):
        thesis_control(P, hull)


def test_a_top_under_its_bottom_is_refused(monkeypatch):
    def swapped(hull, trim):
        top, bottom, steep = surfaces.two_sides(hull, trim)
        return bottom, top, steep

    monkeypatch.setattr(build, "two_sides", swapped)
    hull, P, _ = body(flat, 24, 15, 4)
    with pytest.raises(SplitError, match="does not lie over"):
        thesis_control(P, hull)


def test_trimming_everything_is_refused():
    hull, P, _ = body(flat, 24, 15, 4)
    with pytest.raises(SplitError, match="nothing is left of the top"):
        thesis_control(P, hull, options=ThesisOptions(trim=20))


def test_a_block_off_the_triangulation_is_refused(monkeypatch):
    class Blind(joint.Delaunay):
        def find_simplex(self, xi, bruteforce=False, tol=None):
            return np.full(len(xi), -1)

    monkeypatch.setattr(joint, "Delaunay", Blind)
    hull, P, _ = body(flat, 24, 15, 4)
    with pytest.raises(ControlMeshError, match="1440 blocks lie outside"):
        thesis_control(P, hull)


@pytest.mark.parametrize("points", [np.zeros((5, 2)), np.zeros((0, 3)), [[0, 0, np.nan]]])
def test_bad_points_are_refused(points):
    with pytest.raises(InputError, match="points must be finite and of shape"):
        thesis_control(points, GENTLE[0])


@pytest.mark.parametrize("up", [[0, 0, 0], [0, 1], [0, np.inf, 0]])
def test_bad_up_is_refused(up):
    with pytest.raises(OptionError, match="up must be three finite numbers"):
        thesis_control(GENTLE[1], GENTLE[0], up)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("axis", "sideways", "one of principal, up"),
        ("axis", 3, "one of principal, up"),
        ("trim", -1, "a whole number of 0 or more"),
        ("trim", 0.5, "a whole number of 0 or more"),
    ],
)
def test_bad_options_are_refused(name, value, words):
    with pytest.raises(OptionError) as refused:
        ThesisOptions(**{name: value})
    assert str(refused.value) == f"thesis_options.{name} must be {words}, but is {value!r}"


def test_a_plane_field_is_continued_exactly():
    rng = np.random.default_rng(1)
    xy = grid(np.arange(9.0), np.arange(7.0)).reshape(-1, 2)
    node = np.arange(63).reshape(9, 7)
    F = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:]], axis=-1).reshape(-1, 3)
    slope = rng.standard_normal((2, 3))
    field = joint.PlanField(TriMesh(np.column_stack([xy, 0 * xy[:, 0]]), F), xy @ slope)
    q = rng.uniform(-5, 14, (200, 2))
    values, inside = field.at(q)
    assert_allclose(values, q @ slope, atol=1e-9)
    assert 0 < inside.sum() < 200
    assert not inside[(q < -1e-3).any(axis=1)].any()


def test_fans_that_meet_in_a_point_are_parted():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    parted = surfaces._split_fans(TriMesh(V, [[0, 1, 2], [0, 3, 4]]))
    assert len(parted.V) == 6
    assert_allclose(parted.V[parted.F], V[[[0, 1, 2], [0, 3, 4]]])
    whole = surfaces._split_fans(TriMesh(V, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]))
    assert len(whole.V) == 5


@pytest.mark.parametrize(
    ("case", "truth", "folded"),
    [
        # The targets; the thesis prints 0.0227 and 0.0257.
        ("sim_case_1", 0.026, 0.032),
        # The thesis prints 0.0329 and 0.0595 for its body of that name; its code with alpha
        # mended reaches 0.111 and 0.129 on ours, this one 0.059 and 0.100, doing nothing 0.045.
        ("sim_case_2", 0.111, 0.129),
    ],
)
def test_simulated_cases_reach_the_thesis(case, truth, folded):
    table = pd.read_csv(acceptance(case))
    X = table[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    W = table[["true_x", "true_y", "true_z"]].to_numpy() / 10
    P = (X - X.mean(axis=0)) / 10
    hull = extract_hull(P, None, "alpha")
    mesh = thesis_control(P, hull.mesh, inset=hull.inset)
    Y, _ = carried(mesh.control, P)
    assert epsilon(W, Y).mean() <= truth
    assert epsilon(P, Y).mean() <= folded
    control = mesh.control
    assert (control.inverted_folded, control.inverted_unfolded) == (0, 0)
    assert tet_volumes(control.unfolded.V, control.unfolded.T).sum() > 0


def test_public_names():
    assert set(thesis.__all__) == {"ThesisMesh", "ThesisOptions", "thesis_control"}
