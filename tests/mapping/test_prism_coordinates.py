"""Generalised barycentric coordinates: what they are, and the map made of them."""

import io
import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import geounfold as gu
from geounfold.body.working_frame import Frame
from geounfold.cli import main
from geounfold.errors import ControlMeshError, OptionError
from geounfold.geometry.mesh import TetMesh
from geounfold.geometry.prisms import prism_tets
from geounfold.mapping import map_file
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.mesh_map import UnfoldingMap, load
from geounfold.mapping.prism_coordinates import (
    PrismInterpolant,
    interpolant,
    mean_value,
    mean_value_gradients,
    wachspress,
    wachspress_gradients,
)
from geounfold.mapping.prism_coordinates._prism import EDGES, TRIANGLES, convex

STRAIGHT = np.array(
    [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
)  # fmt: skip
TETS = np.array([[0, 1, 2, 5], [1, 0, 4, 5], [0, 3, 4, 5]])
KINDS = {"wachspress": wachspress, "mvc": mean_value}
GRADIENTS = {"wachspress": wachspress_gradients, "mvc": mean_value_gradients}
SEEDS = st.integers(0, 10_000)


def bent_prisms(seed, count=200):
    """Return prisms with corners off by 0.08: about 12 % of them are strictly convex."""
    return STRAIGHT + np.random.default_rng(seed).normal(size=(count, 6, 3)) * 0.08


def points_in(prisms, seed=1):
    """Return a point of each prism (n, 6, 3), somewhere in one of its tetrahedra."""
    rng = np.random.default_rng(seed)
    tets = TETS[rng.integers(0, 3, len(prisms))]
    share = rng.dirichlet(np.full(4, 2.0), len(prisms))
    return np.einsum("ni,nij->nj", share, np.take_along_axis(prisms, tets[:, :, None], axis=1))


def prisms_for(kind, seed):
    prisms = bent_prisms(seed)
    return prisms[convex(prisms)] if kind == "wachspress" else prisms


# ---------------------------------------------------------------------------------- coordinates


def test_the_border_is_that_of_the_three_tetrahedra():
    assert len(EDGES) == 12  # 8 triangles, 6 corners: Euler's 12
    faces = [frozenset(np.delete(tet, k)) for tet in TETS for k in range(4)]
    assert sorted(map(sorted, (f for f in faces if faces.count(f) == 1))) == sorted(
        map(sorted, TRIANGLES)
    )
    i, j, k = (STRAIGHT[list(c)] for c in zip(*TRIANGLES, strict=True))
    outward = np.cross(j - i, k - i)
    assert (np.einsum("ij,ij->i", outward, (i + j + k) / 3 - STRAIGHT.mean(axis=0)) > 0).all()


@settings(max_examples=20, derandomize=True, database=None, deadline=None)
@given(kind=st.sampled_from(sorted(KINDS)), seed=SEEDS)
def test_they_sum_to_one_and_reproduce_places(kind, seed):
    prisms = prisms_for(kind, seed)
    P = points_in(prisms)
    values, slopes = GRADIENTS[kind](P, prisms)
    assert np.array_equal(values, KINDS[kind](P, prisms))
    # Rounding, of weights that grow to 1e3 times their sum's inverse near the border.
    assert np.abs(values.sum(axis=1) - 1).max() < 1e-13
    assert np.abs(np.einsum("ni,nij->nj", values, prisms) - P).max() < 1e-12
    assert np.abs(slopes.sum(axis=1)).max() < 1e-8
    assert np.abs(np.einsum("nia,nib->nab", prisms, slopes) - np.eye(3)).max() < 1e-8


@settings(max_examples=20, derandomize=True, database=None, deadline=None)
@given(kind=st.sampled_from(sorted(KINDS)), seed=SEEDS)
def test_they_are_positive_inside_convex_prisms(kind, seed):
    prisms = prisms_for("wachspress", seed)
    assert len(prisms)
    assert (KINDS[kind](points_in(prisms), prisms) > 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_they_are_one_at_their_corner_and_linear_on_the_border(kind):
    prisms = prisms_for(kind, 3)
    middle = prisms.mean(axis=1)
    for share in (np.array([1.0, 0, 0]), np.array([0, 0.5, 0.5]), np.array([0.2, 0.3, 0.5])):
        for face in TRIANGLES:
            place = np.einsum("i,nij->nj", share, prisms[:, face])
            wanted = np.zeros((len(prisms), 6))
            wanted[:, face] = share
            # 1e-11 inside: the steepest of these convex prisms bulges by 1e-4 of its size only,
            # where Wachspress coordinates change by 1e4 per length.
            values = KINDS[kind](place + 1e-11 * (middle - place), prisms)
            assert np.abs(values - wanted).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_gradients_agree_with_differences(kind):
    prisms = prisms_for(kind, 5)
    P = points_in(prisms)
    _, slopes = GRADIENTS[kind](P, prisms)
    h = 1e-6
    for axis, step in enumerate(h * np.eye(3)):
        ahead, behind = (KINDS[kind](P + s, prisms) for s in (step, -step))
        error = np.abs((ahead - behind) / (2 * h) - slopes[:, :, axis]).max(axis=1)
        # Differences err by h^2 times the third derivative, which grows like 1 / distance^3
        # towards the border: measured medians of 5e-11, largest 4e-7.
        assert np.median(error) < 1e-9
        assert error.max() < 1e-4


def test_wachspress_in_a_straight_prism_are_products():
    # The product of a triangle's and a segment's: what isoparametric wedges use.
    P = points_in(np.repeat(STRAIGHT[None], 50, axis=0))
    x, y, z = P.T
    flat = np.stack([1 - x - y, x, y], axis=1)
    product = np.concatenate([flat * (1 - z)[:, None], flat * z[:, None]], axis=1)
    values = wachspress(P, np.repeat(STRAIGHT[None], 50, axis=0))
    assert np.abs(values - product).max() < 1e-13


def test_mean_values_are_means_over_directions():
    # The definition: the border's linear function over the distance, averaged over directions
    # from the point; in area, |p - x|^-3 n.(p - x) dA is the solid angle.
    prism = bent_prisms(8, 1)[0]
    x = prism.mean(axis=0)
    level = 200
    i, j = (a.ravel() for a in np.indices((level, level)))
    up = i + j < level
    down = i + j < level - 1
    cells = np.concatenate(
        [
            np.stack([i[up] + 1 / 3, j[up] + 1 / 3], axis=1),
            np.stack([i[down] + 2 / 3, j[down] + 2 / 3], axis=1),
        ]
    )
    share = np.column_stack([level - cells.sum(axis=1), cells]) / level  # midpoints, equal areas
    total = np.zeros(6)
    for face in TRIANGLES:
        a, b, c = prism[list(face)]
        away = share @ prism[list(face)] - x
        far = np.linalg.norm(away, axis=1)
        angle = away @ np.cross(b - a, c - a) / (2 * level**2 * far**3)
        np.add.at(total, list(face), (share * (angle / far)[:, None]).sum(axis=0))
    values = mean_value(x[None], prism[None])
    # The midpoint rule errs by the cell's side squared, 2.5e-5, times a share of it.
    assert np.abs(values[0] - total / total.sum()).max() < 1e-5


def test_mean_values_are_smooth_where_a_faces_plane_passes():
    # A twisted prism is not convex: planes of its border pass through it.  There the plain formula
    # is 0 / 0, and near it rounding over the distance.
    turn = 0.4
    prism = STRAIGHT.copy()
    spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    prism[3:, :2] = (prism[3:, :2] - 1 / 3) @ spin + 1 / 3
    found = 0
    for face in TRIANGLES:
        a, b, c = prism[list(face)]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        P = points_in(np.repeat(prism[None], 200, axis=0), 2)
        P -= ((P - a) @ normal)[:, None] * normal
        P = P[inside(prism, P, 0.05)]
        found += len(P)
        many = np.repeat(prism[None], len(P), axis=0)
        here, ahead, behind = (mean_value(P + h * normal, many) for h in (0.0, 1e-4, -1e-4))
        # Half of h^2 times the second derivative: 1e-8 times 10; without care it is off by 1.
        assert np.abs(here - (ahead + behind) / 2).max(initial=0) < 1e-6
        for h in (1e-14, 1e-11, 1e-8):  # 1e-14: h times a slope of 10, and rounding
            near = mean_value(P + h * normal, many)
            assert np.abs(here - near).max(initial=0) < 20 * h + 1e-13
    assert found > 50


def inside(prism, points, margin):
    """Return which points are at least so far (barycentric) inside one of the tetrahedra."""
    out = np.zeros(len(points), bool)
    for tet in TETS:
        edges = prism[tet[1:]] - prism[tet[0]]
        share = np.linalg.solve(edges.T, (points - prism[tet[0]]).T)
        out |= (share.min(axis=0) > margin) & (share.sum(axis=0) < 1 - margin)
    return out


def test_a_quadrilateral_bulges_out_of_one_prism_only():
    prism = STRAIGHT.copy()
    prism[4] += [0.1, -0.1, 0]  # b' away from the prism: a-b', b-c' stay plane or bulge
    prism[5] += [0.1, 0.1, 0]
    prism[0] += [-0.1, -0.05, 0]
    assert convex(prism[None])[0]
    dented = prism.copy()
    dented[0] += [0.3, 0.3, 0]
    assert not convex(np.stack([dented, STRAIGHT])).any()  # plane ones do not count as bulging


# ------------------------------------------------------------------------------------- the map


def bent_map(kind, bend=0.15, seed=9):
    """Return a map of 6 x 6 x 2 cells, folded into waves and shaken, with its coordinates."""
    n = 7
    i, j = (a.ravel() for a in np.indices((n, n)))
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    T = prism_tets(F, n * n, 3)
    layers = [np.column_stack([i, j, np.full(n * n, z)]) for z in (-1.0, 0.0, 1.0)]
    flat = np.concatenate(layers).astype(float)
    shaken = np.random.default_rng(seed).normal(size=flat.shape) * bend / 3
    folded = flat + shaken
    folded[:, 2] += np.sin(flat[:, 0] / 2)
    control = ControlMesh(TetMesh(folded, T), TetMesh(flat, T), (flat[:, 2] + 1) / 2)
    frame = Frame(np.array([431.0, 74.0, 9.0]), np.eye(3), 2.5, None)
    return UnfoldingMap(frame, control, coordinates=kind)


def flat_points(mapping, count=600, seed=3):
    rng = np.random.default_rng(seed)
    return (rng.random((count, 3)) * [6, 6, 2] - [0, 0, 1]) * mapping.frame.scale


@pytest.mark.parametrize("kind", KINDS)
def test_there_and_back_by_prisms(kind):
    mapping = bent_map(kind)
    flat = flat_points(mapping)
    back = mapping.carry(flat, inverse=True)
    assert back.unsolved == 0
    carried = mapping.carry(back.points)
    # The inverse is asked for 1e-12 of the size, 15 m; coordinates of 400 m round by 6e-14.
    assert np.abs(carried.points - flat).max() < 1.6e-11
    assert np.abs(carried.stratigraphic - (flat[:, 2] / 2.5 + 1) / 2).max() < 1e-11
    assert np.abs(back.stratigraphic - carried.stratigraphic).max() < 1e-11
    # Not the tetrahedra's map: up to a few per cent of a cell from it.
    away = np.linalg.norm(back.points - bent_map("tet").to_folded(flat), axis=1).max()
    assert 0.01 < away < 0.25


@pytest.mark.parametrize("kind", KINDS)
def test_an_affine_map_is_reproduced(kind):
    mapping = bent_map(kind)
    A = np.array([[1.0, 0.2, 0.3], [0.0, 0.9, 0.1], [0.1, 0.0, 1.2]])
    control = mapping.control
    straight = ControlMesh(
        control.folded, control.folded.with_vertices(control.folded.V @ A), control.stratigraphic
    )
    affine = UnfoldingMap(mapping.frame, straight, coordinates=kind)
    folded = mapping.to_folded(flat_points(mapping))
    found = affine.carry(folded)
    work = mapping.frame.to_work(folded)
    assert np.abs(found.points - work @ A * 2.5).max() < 1e-12
    J = affine.gradients(folded, found.element)
    assert np.abs(J - A.T).max() < 1e-6  # the steepest weights lie 1e-9 from a border


@pytest.mark.parametrize("kind", KINDS)
def test_neighbours_agree_on_their_faces(kind):
    mapping = bent_map(kind)
    tets, prisms = bent_map("tet"), mapping.prisms
    faces = prisms.corners[:, TRIANGLES].reshape(-1, 3)
    key = np.sort(faces, axis=1)
    _, inverse, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    assert set(count) == {1, 2}
    V = mapping.control.folded.V
    share = np.random.default_rng(1).dirichlet(np.ones(3), len(count))[inverse]
    # The same place on a face from both of its prisms: ordered corners, and the same shares.
    place = np.einsum("ni,nij->nj", share, V[key])
    middle = V[prisms.corners].mean(axis=1).repeat(8, axis=0)
    world = mapping.frame.to_world
    on_it = mapping.to_flat(world(place))
    # On the face itself the map is the tetrahedra's, to the last bit but for the face's side.
    assert np.abs(on_it - tets.to_flat(world(place))).max() < 1e-13
    for step in (1e-6, 1e-9):
        near = mapping.to_flat(world(place + step * (middle - place)))
        # No jump: off by a slope (measured: 3e3 for the flattest Wachspress fold) times the step.
        assert np.abs(near - on_it).max() < 1e4 * step * 2.5


@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_carried_each_on_its_own(kind):
    mapping = bent_map(kind)
    flat = flat_points(mapping, 9000)  # more than a chunk
    folded = mapping.to_folded(flat)
    order = np.random.default_rng(0).permutation(len(flat))
    assert np.array_equal(mapping.to_folded(flat[order]), folded[order])
    assert np.array_equal(mapping.to_flat(folded[order]), mapping.to_flat(folded)[order])


@pytest.mark.parametrize("kind", KINDS)
def test_the_gradient_is_the_maps(kind):
    mapping = bent_map(kind)
    folded = mapping.to_folded(flat_points(mapping))
    found = mapping.carry(folded)
    J = mapping.gradients(folded, found.element)
    h = 1e-5
    steps = [
        (mapping.to_flat(folded + s) - mapping.to_flat(folded - s)) / (2 * h) for s in h * np.eye(3)
    ]
    error = np.abs(np.stack(steps, axis=2) - J).max(axis=(1, 2))
    assert np.median(error) < 1e-7  # h^2, and 1e-13 of rounding over h
    assert np.mean(error < 1e-3) > 0.99  # others have a face within h


def test_prisms_that_are_not_convex_have_mean_values():
    counts = bent_map("wachspress").prisms.counts()
    assert counts["prisms"] == 6 * 6 * 2 * 2
    assert counts["wachspress"] + counts["mvc"] == counts["prisms"]
    assert 0 < counts["wachspress"] < counts["mvc"]
    assert counts["single_tetrahedra"] == 0


def test_inverted_and_lone_tetrahedra_are_no_prisms():
    control = bent_map("mvc").control
    V = np.array(control.folded.V)
    V[60, 2] += 5.0  # a node of the middle layer, past the top
    bad = ControlMesh(control.folded.with_vertices(V), control.unfolded, control.stratigraphic)
    whole = PrismInterpolant.of(control, "mvc").counts()
    found = PrismInterpolant.of(bad, "mvc").counts()
    lost = whole["prisms"] - found["prisms"]
    assert 0 < lost <= 12  # six triangles around a node, above and below
    assert found["single_tetrahedra"] == 3 * lost
    T = control.folded.T[1:]
    cut = ControlMesh(TetMesh(V, T), TetMesh(control.unfolded.V, T), control.stratigraphic)
    assert PrismInterpolant.of(cut, "mvc").counts()["single_tetrahedra"] >= 2


def test_what_has_no_inverse_is_left_empty_and_counted(monkeypatch):
    mapping = bent_map("mvc")
    flat = flat_points(mapping)
    monkeypatch.setattr(interpolant, "_STEPS", 0)
    back = mapping.carry(flat, inverse=True)
    assert back.unsolved == len(flat)
    assert np.isnan(back.points).all()
    assert np.isnan(back.stratigraphic).all()
    assert set(back.location) == {"outside"}


def test_a_step_that_leaves_the_prism_is_halved(monkeypatch):
    # A first guess far off, at the prism's middle in place of the tetrahedron's answer.
    mapping = bent_map("mvc")
    flat = flat_points(mapping)
    wanted = mapping.to_folded(flat)
    true = PrismInterpolant.back

    def far_off(self, points, element, start):
        middle = self.control.folded.V[self.corners[self.prism[element]]].mean(axis=1)
        return true(self, points, element, middle)

    monkeypatch.setattr(PrismInterpolant, "back", far_off)
    assert np.abs(mapping.to_folded(flat) - wanted).max() < 1e-10


# ------------------------------------------------------------------------------------- its file


@pytest.mark.parametrize("kind", ["tet", *KINDS])
def test_a_saved_map_keeps_its_coordinates(kind, tmp_path):
    mapping = bent_map(kind)
    mapping.save(tmp_path / "m.npz")
    again = load(tmp_path / "m.npz")
    assert again.coordinates == kind
    folded = mapping.to_folded(flat_points(mapping))
    assert np.array_equal(again.to_flat(folded), mapping.to_flat(folded))


def test_files_of_version_2_are_maps_by_tetrahedra(tmp_path):
    stream = io.BytesIO()
    bent_map("tet").save(stream)
    with np.load(io.BytesIO(stream.getvalue())) as file:
        arrays = dict(file)
    del arrays["checksum"], arrays["coordinates"]
    arrays["version"] = np.array(2)
    np.savez(tmp_path / "old.npz", **arrays, checksum=np.array(map_file._checksum(arrays)))
    old = load(tmp_path / "old.npz")
    assert old.coordinates == "tet"
    flat = flat_points(old)
    assert np.array_equal(old.to_folded(flat), bent_map("tet").to_folded(flat))


def test_unknown_coordinates_are_refused():
    with pytest.raises(
        OptionError, match="coordinates must be one of tet, wachspress, mvc, but is 'bilinear'"
    ):
        bent_map("bilinear")
    with pytest.raises(
        OptionError, match="coordinates must be one of tet, wachspress, mvc, but is 'bilinear'"
    ):
        gu.UnfoldOptions(coordinates="bilinear")


# ------------------------------------------------------------------------------ the whole pipeline


@pytest.fixture(scope="module")
def small():
    return gu.simulate("sim_case_1", blocks=3000)


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_unfolds_as_well_by_prisms(kind, small):
    u = gu.unfold(small.folded, coordinates=kind)
    plain = gu.unfold(small.folded)
    error, usual = (gu.epsilon(small.truth, v.points).mean() for v in (u, plain))
    # Measured: within 2 % of each other; doing nothing scores 0.017.
    assert error < 1.1 * usual
    size = float(np.ptp(plain.control.unfolded.V, axis=0).max())
    assert u.round_trip_max < 1e-11 * size
    summary = u.summary()
    assert summary["injective"] is False
    assert summary["certificate"]["injective"] is True  # of the tetrahedra
    facts = summary["coordinates"]
    assert facts["name"] == kind
    assert facts["proved"] is False
    assert facts["prisms"] == facts["wachspress"] + facts["mvc"]
    assert facts["blocks_in_prisms"] == len(small.folded)
    assert facts["blocks_inside_out"] == facts["blocks_not_brought_back"] == 0
    assert any(f"{kind} coordinates" in w for w in summary["warnings"])
    assert "not proved" in repr(u)
    assert plain.summary()["coordinates"] == {"name": "tet", "proved": True}
    # Points around the body go by the shell's prisms, and come back too: a block above it.
    above = small.folded + np.array([0.0, 0.0, 15.0])
    there = u.map.carry(above)
    assert (there.location == "extrapolated").any()
    back = u.to_folded(there.points[there.placed])
    assert np.abs(back - above[there.placed]).max() < 1e-11 * size
    # The distortion is the prisms' own: no more one value for all blocks of a tetrahedron.
    assert len(np.unique(u.columns["shear"])) > len(np.unique(plain.columns["shear"]))


def test_blocks_that_do_not_come_back_are_an_error_unless_allowed(small, monkeypatch):
    monkeypatch.setattr(interpolant, "_STEPS", 0)
    with pytest.raises(ControlMeshError, match=r"mvc coordinates turn 0 .* bring \d+ not back"):
        gu.unfold(small.folded, coordinates="mvc")
    u = gu.unfold(small.folded, coordinates="mvc", allow_uncertified=True)
    lost = u.summary()["coordinates"]["blocks_not_brought_back"]
    assert lost > 0
    assert any(f"{lost} points were not brought back" in w for w in u.summary()["warnings"])
    assert np.isfinite(u.round_trip_max)


def test_the_command_line_carries_by_the_coordinates_saved(small, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    small.frame(4).to_csv("b.csv", index=False)
    words = ["--coordinates", "mvc", "--summary", "s.json", "--map", "m.npz"]
    assert main(["unfold", "b.csv", "-o", "f.csv", *words]) == 0
    assert "mvc coordinates, which no theorem covers" in capsys.readouterr().err
    summary = json.loads((tmp_path / "s.json").read_text())
    assert summary["options"]["coordinates"] == "mvc"
    assert 'coordinates = "mvc"' in summary["config"]
    assert main(["map", "m.npz", "b.csv", "-o", "again.csv"]) == 0
    first, second = pd.read_csv("f.csv"), pd.read_csv("again.csv")
    place = ["unfolded_x", "unfolded_y", "unfolded_z"]
    assert np.array_equal(first[place], second[place])
    assert main(["map", "m.npz", "f.csv", "--inverse", "-o", "back.csv"]) == 0
    back = pd.read_csv("back.csv")
    off = back[["folded_x", "folded_y", "folded_z"]].to_numpy() - small.frame(4).to_numpy()[:, :3]
    assert np.abs(off).max() < 1e-8
    monkeypatch.setattr(interpolant, "_STEPS", 0)
    assert main(["map", "m.npz", "f.csv", "--inverse", "-o", "none.csv"]) == 0
    assert "inverse of its mvc coordinates was not found" in capsys.readouterr().err


def test_the_command_line_refuses_other_coordinates(small, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    small.frame(4).to_csv("b.csv", index=False)
    assert main(["unfold", "b.csv", "-o", "f.csv", "--coordinates", "bilinear"]) == 2
    assert "--coordinates must be one of tet, wachspress, mvc" in capsys.readouterr().err
    assert not (tmp_path / "f.csv").exists()
