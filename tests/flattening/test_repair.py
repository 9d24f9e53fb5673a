"""Exact tests of flat maps, and the ladder from one that folds or overlaps to one that does not."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.backends import igl as igl_backend
from geounfold.backends import slim_scaf
from geounfold.backends.checks import finite_array
from geounfold.backends.predicates import orientations
from geounfold.errors import FlatteningError
from geounfold.flattening import FLATTENERS, _repair, flatten, tutte
from geounfold.flattening._border import border_of, is_one_to_one, turned_over
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import make_problem
from geounfold.flattening._start import check_disk
from geounfold.flattening._unflip import _Energy, untangle
from geounfold.flattening.measures import edge_strain
from geounfold.geometry.measures import lengths, unique_edges
from geounfold.geometry.mesh import TriMesh
from tests.shapes import plane


def ramp(turns=1.2):
    """A ring-shaped ramp of more than one turn: laid flat with its lengths it overlaps itself."""
    S, F = plane(36, 6)
    angle, r = S[:, 0] / 36 * turns * 2 * np.pi, 4 - S[:, 1] / 3
    # Up by 0.05 a radian: 0.02 % longer along the ramp.
    return np.c_[r * np.cos(angle), r * np.sin(angle), 0.05 * angle], F


def cap(n=9):
    S, F = plane(n - 1, n - 1)
    P = (S / (n - 1) - 0.5) * 0.9
    return np.c_[P, np.sqrt(1 - (P * P).sum(axis=1))], F


def annulus():
    S, F = plane(8, 8)
    middle = (np.abs(S[F].mean(axis=1) - 4) < 1.2).all(axis=1)
    mesh = TriMesh(np.c_[S, 0.2 * np.sin(S[:, 0])], F).submesh(~middle)[0]
    return mesh.V, mesh.F


def problem_of(mesh):
    surface = TriMesh(*mesh)
    return make_problem(surface, check_disk(surface), None)


# --- predicates ------------------------------------------------------------------------------


def exact_orientation(a, b, c):
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(x)) for x in p] for p in (a, b, c))
    det = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (det > 0) - (det < 0)


def test_orientations_are_those_of_rational_arithmetic():
    rng = np.random.default_rng(4)
    # Points within 256 units in the last place of a line: the rounded determinant alone is wrong
    # for 17 % of them.
    a = 0.5 + rng.integers(0, 256, (500, 2)) * 2.0**-53
    b, c = np.full((500, 2), 12.0), np.full((500, 2), 24.0)
    a = np.concatenate([a, rng.normal(size=(50, 2)), 1e-200 * rng.normal(size=(50, 2))])
    b = np.concatenate([b, rng.normal(size=(50, 2)), np.zeros((50, 2))])
    c = np.concatenate([c, rng.normal(size=(50, 2)), np.full((50, 2), 1e-200)])
    rounded = np.sign((a - c)[:, 0] * (b - c)[:, 1] - (a - c)[:, 1] * (b - c)[:, 0])
    truth = [exact_orientation(*p) for p in zip(a[:550], b[:550], c[:550], strict=True)]
    assert orientations(a[:550], b[:550], c[:550]).tolist() == truth
    assert (rounded[:550] != truth).sum() > 50


def segments_meet(p, q, r, s):
    """Whether closed segments meet, in rational arithmetic."""
    o = exact_orientation
    signs = o(p, q, r), o(p, q, s), o(r, s, p), o(r, s, q)
    if signs == (0, 0, 0, 0):
        box = [
            (min(a, b), max(a, b), min(c, d), max(c, d))
            for a, b, c, d in zip(p, q, r, s, strict=True)
        ]
        return all(lo1 <= hi2 and lo2 <= hi1 for lo1, hi1, lo2, hi2 in box)
    return signs[0] * signs[1] <= 0 and signs[2] * signs[3] <= 0


@pytest.mark.parametrize("seed", range(12))
def test_crossings_are_those_of_a_test_of_every_pair(seed):
    rng = np.random.default_rng(seed)
    # Small whole coordinates: points meet, edges lie along one another, vertices touch edges.
    count = [int(rng.integers(3, 40)), int(rng.integers(3, 12))]
    uv = rng.integers(0, 14 if seed % 2 else 40, (sum(count), 2)).astype(float)
    loops = (np.arange(count[0]), count[0] + np.arange(count[1]))
    edges = [(int(a), int(b)) for p in loops for a, b in zip(p, np.roll(p, -1), strict=True)]
    truth = set()
    for x, e in enumerate(edges):
        for f in edges[x + 1 :]:
            common = set(e) & set(f)
            if not common:
                meets = segments_meet(uv[e[0]], uv[e[1]], uv[f[0]], uv[f[1]])
            else:
                (v,) = common
                p, q = uv[sum(e) - v] - uv[v], uv[sum(f) - v] - uv[v]
                meets = p[0] * q[1] == p[1] * q[0] and p @ q > 0
            if meets:
                truth.add((e, f))
    found = {tuple(tuple(e) for e in pair) for pair in border_of(uv, loops).crossings.tolist()}
    assert found == truth


def test_a_border_that_passes_by_one_unit_in_the_last_place_does_not_cross():
    # A notch whose tip (vertex 4) stops short of, on, or beyond the lower side.
    uv = np.array([[0.0, 0], [4, 0], [4, 2], [3, 2], [2, 1], [1, 2], [0, 2]])
    for height, pairs in ((5e-324, 0), (0.0, 2), (-5e-324, 2)):
        uv[4, 1] = height
        assert len(border_of(uv, (np.arange(7),)).crossings) == pairs


def test_an_edge_that_folds_back_on_its_neighbour_counts():
    uv = np.array([[0.0, 0], [3, 0], [1, 0], [1, 2]])
    assert (
        border_of(uv, (np.arange(4),)).crossings.tolist()
        == [
            [[0, 1], [1, 2]],
            [[0, 1], [2, 3]],
            [[0, 1], [3, 0]],
        ][:2]
    )


def test_a_hole_turned_inside_out_counts():
    mesh = annulus()
    flat = flatten(mesh)
    assert flat.overlaps == 0
    outer, hole = flat.loops
    assert border_of(flat.uv, (outer, hole[::-1])).overlaps == 1
    assert border_of(flat.uv, (outer[::-1], hole)).overlaps == 1


def test_turned_triangles_are_found_below_rounding():
    F = np.array([[0, 1, 2]])
    uv = np.array([[0.5, 0.5 + 2.0**-53], [12.0, 12.0], [24.0, 24.0]])
    assert turned_over(uv, F).tolist() == ([] if exact_orientation(*uv) > 0 else [0])
    assert turned_over(uv[[1, 0, 2]], F).tolist() != turned_over(uv, F).tolist()


# --- the ladder ------------------------------------------------------------------------------

ISOMETRIC = sorted(name for name, f in FLATTENERS.items() if f.keeps == "lengths")


def test_the_ramp_overlaps_itself_where_lengths_are_kept():
    flat = flatten(ramp(), repair=False)
    assert flat.flips == 0
    assert flat.overlaps > 0
    assert not flat.one_to_one
    assert flat.edge_error[-1] < 1e-3  # it is nearly developable


@pytest.mark.parametrize("method", ISOMETRIC)
def test_the_ladder_keeps_the_ramp_apart(method):
    V, F = ramp()
    raw, flat = flatten((V, F), method, repair=False), flatten((V, F), method)
    assert flat.one_to_one
    assert is_one_to_one(flat.uv, F, check_disk(TriMesh(V, F)))
    assert flat.method == method
    assert ("border edges overlap" in flat.note) == (raw.overlaps > 0)
    # Tutte's embedding, from which the ladder starts, has 0.62; a ring of one turn needs 0.1.
    assert edge_strain(V, F, flat.uv) < 0.25


def start_where_slim_overlaps_soon(monkeypatch):
    """Let the ladder begin at the ramp laid out over 0.98 of a turn, and go far."""
    V, _ = ramp()
    r, angle = np.hypot(V[:, 0], V[:, 1]), V[:, 2] / 0.05 * 0.98 / 1.2
    near = np.c_[r * np.cos(angle), r * np.sin(angle)]
    monkeypatch.setattr(_repair, "tutte", lambda problem: near)
    monkeypatch.setattr(_repair, "_ENOUGH", IterationOptions(tol=1e-6, max_iter=40))
    monkeypatch.setattr(_repair, "_ENOUGH_ENERGY", 1e-9)


def test_where_slim_comes_to_overlap_its_last_sound_step_is_taken(monkeypatch):
    start_where_slim_overlaps_soon(monkeypatch)
    flat = flatten(ramp())
    assert flat.one_to_one
    assert "SLIM's last step before its border overlapped" in flat.note


def test_conformal_maps_that_overlap_are_an_error_that_says_where():
    with pytest.raises(FlatteningError, match=r"lscm: \d+ pairs of border edges overlap.*near"):
        flatten(ramp(), "lscm")
    assert flatten(ramp(), "lscm", repair=False).overlaps > 0


def test_a_few_turned_triangles_are_untangled_and_the_rest_stays(monkeypatch):
    V, F = cap(17)
    sound = V[:, :2].copy()
    folded = sound.copy()
    folded[144] += 0.12  # the middle vertex, two cells away
    monkeypatch.setattr(igl_backend.ArapSteps, "__call__", lambda self, uv: folded)
    raw, flat = flatten((V, F), "arap", repair=False), flatten((V, F), "arap")
    assert raw.flips > 0
    assert flat.one_to_one
    assert "untangled" in flat.note
    far = np.linalg.norm(sound - folded[144], axis=1) > 0.4
    # Held vertices keep their places but for the new mean.
    shift = flat.uv[far] - raw.uv[far]
    assert far.sum() > 50
    assert_allclose(shift, shift[[0]].repeat(len(shift), axis=0), atol=1e-14)


def test_untangling_energy_has_its_gradient():
    problem = problem_of(cap(5))
    energy = _Energy(problem.mesh.F, problem.corners, problem.areas)
    rng, step = np.random.default_rng(2), 1e-6
    uv = problem.mesh.V[:, :2] + 0.15 * rng.normal(size=(25, 2))
    assert energy.least_determinant(uv) < 0
    for floor in (0.1, 1.0):
        slope = energy(uv, floor)[1].ravel()
        for k in rng.choice(50, 8, replace=False):
            d = np.zeros(50)
            d[k] = step
            d = d.reshape(-1, 2)
            found = (energy(uv + d, floor)[0] - energy(uv - d, floor)[0]) / (2 * step)
            assert slope[k] == pytest.approx(found, rel=1e-5, abs=1e-5)


def test_untangling_gives_up_where_too_much_is_turned():
    mesh = cap(9)
    assert untangle(problem_of(mesh), mesh[0][:, :2] * [-1, 1]) is None


def test_given_rest_lengths_are_not_replaced_by_the_meshs_own():
    V, F = ramp()
    with pytest.raises(FlatteningError, match=r"spring: .*overlap.*near"):
        flatten((V, F), rest=lengths(V, unique_edges(F)))


def test_scaffold_maps_that_fail_are_an_error(monkeypatch):
    nan = np.full((len(ramp()[0]), 2), np.nan)
    steps = slim_scaf.ScaffoldSteps
    monkeypatch.setattr(steps, "__call__", lambda self: finite_array(nan, nan.shape, "scaf"))
    with pytest.raises(FlatteningError, match=r"scaf: .*not finite"):
        flatten(ramp(), "scaf")


def test_slim_that_fails_is_an_error_for_slim_and_a_rung_less_for_others(monkeypatch):
    n = len(ramp()[0])
    monkeypatch.setattr(slim_scaf.igl, "slim_solve", lambda *_: np.full((n, 2), np.nan))
    with pytest.raises(FlatteningError, match=r"slim: .*not finite"):
        flatten(ramp(), "slim")
    assert flatten(ramp(), "arap").one_to_one


@pytest.mark.parametrize("name", ["slim_precompute", "slim_solve"])
def test_refusals_of_libigl_are_named(monkeypatch, name):
    def refuse(*_):
        raise RuntimeError("no")

    monkeypatch.setattr(slim_scaf.igl, name, refuse)
    with pytest.raises(FlatteningError, match=f"slim: .*{name} failed"):
        flatten(cap(), "slim")


def test_flipping_steps_are_not_kept(monkeypatch):
    V, F = cap()
    true, calls = slim_scaf.SlimSteps.__call__, []

    def flips_later(self):
        calls.append(0)
        return true(self) * [1 if len(calls) < 3 else -1, 1]

    monkeypatch.setattr(slim_scaf.SlimSteps, "__call__", flips_later)
    flat = flatten((V, F), "slim")
    assert str(flat.stop) == "stalled"
    assert "stopped before step 3" in flat.note
    assert flat.iterations == 2
    assert flat.flips == 0


def test_starts_that_fold_or_overlap_give_way_to_tuttes():
    V, F = cap()
    folded = V[:, :2].copy()
    folded[40] += 0.5
    for method in ("slim", "scaf"):
        flat = flatten((V, F), method, start=folded)
        assert "Tutte's embedding instead" in flat.note
        assert flat.one_to_one


def test_tutte_is_one_to_one_with_a_hole():
    mesh = annulus()
    assert is_one_to_one(tutte(mesh), mesh[1], check_disk(TriMesh(*mesh)))
