"""All flatteners: analytic truths, invariances, and a failing input for each raise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.backends import igl as backend
from geounfold.errors import FlatteningError, MeshError, OptionError
from geounfold.flattening import (
    FLATTENERS,
    ArapOptions,
    IsomapOptions,
    MdsOptions,
    SpringDynamicOptions,
    SpringOptions,
    Stop,
    UfoOptions,
    flatten,
    measures,
)
from geounfold.flattening._start import check_disk
from geounfold.geometry.measures import lengths, triangle_areas, unique_edges
from geounfold.geometry.mesh import TriMesh
from tests.flattening.meshes import EXACT, METHODS, annulus, cap, cylinder, edge_errors, grid, slab
from tests.shapes import rotation

# harmonic keeps neither lengths nor angles: test_harmonic.py holds its truths.
SHAPELY = [m for m in METHODS if FLATTENERS[m].keeps != "nothing"]

# Relative difference of lengths after a rigid motion.  Coordinates of 4e6 for a body of 350 leave
# 1e-12 of rounding: measured 1.9e-11 at most over 20 rotations and orders of the vertices, with
# OpenBLAS's Haswell and SkylakeX kernels alike.  The scaffold's frame has sides along the axes, so
# scaf agrees as far as it converges: measured 1.4e-6; the cap's own strain is 1e-2.
SAME = dict.fromkeys(METHODS, 1e-10) | {"scaf": 1e-5}


def cone(n=11, m=8):
    """Ruling-aligned cone frustum: every quadrilateral is plane and keeps its shape."""
    S, F = grid(n, m)
    theta, r = S[:, 0] * 0.15, 3 + S[:, 1]
    return np.c_[r * np.cos(theta), r * np.sin(theta), 0.8 * r], F


@pytest.mark.parametrize("method", SHAPELY)
@pytest.mark.parametrize(
    "surface", [lambda: cylinder()[:2], cone, slab], ids=["cylinder", "cone", "slab"]
)
def test_developable_surfaces_keep_every_length(surface, method):
    mesh = surface()
    flat = flatten(mesh, method)
    # A cone's flat image is not convex: shortest paths bend round its inner arc, and mds, which
    # sees distances alone, errs by 0.014.
    limit = 0.02 if (surface, method) == (cone, "mds") else EXACT[method]
    assert np.abs(edge_errors(mesh, flat.uv)).max() < limit
    assert flat.flips == 0
    assert flat.method == method


@pytest.mark.parametrize("method", SHAPELY)
def test_slab_comes_back_as_itself_up_to_a_rigid_motion(method):
    V, F = slab()
    uv = flatten((V, F), method).uv
    P = V[:, :2] - V[:, :2].mean(axis=0)
    u, _, vt = np.linalg.svd(uv.T @ P)
    # A proper rotation: the map never mirrors.
    assert np.linalg.det(u @ vt) == pytest.approx(1.0)
    assert_allclose(uv @ (u @ vt), P, atol=EXACT[method] * np.ptp(V))


@pytest.mark.parametrize("method", [m for m in METHODS if FLATTENERS[m].intrinsic])
def test_rest_lengths_along_arcs_give_the_arc_development(method):
    V, F, _, arcs = cylinder()
    edges = unique_edges(F)
    rest = lengths(arcs, edges)
    uv = flatten((V, F), method, rest=rest).uv
    # The effect: chords differ from arcs by 1.16e-3 here.
    assert np.abs(lengths(V, edges) / rest - 1).max() > 1e-3
    tol = EXACT[method]
    assert np.sqrt(np.mean((lengths(uv, edges) / rest - 1) ** 2)) < tol


@pytest.mark.parametrize("method", METHODS)
def test_spherical_cap_keeps_its_strain(method):
    mesh = cap()
    flat = flatten(mesh, method)
    strain = measures.edge_strain(*mesh, flat.uv)
    # Measured: springs 0.0129 (at the least energy: next test), ARAP, SLIM and scaffold maps
    # 0.0139, mds 0.0198, LSCM 0.0223, isomap 0.0426 (0.018 on the slab, where all of it is its
    # own), harmonic (a disk out of a square) 0.139; a developable surface leaves less than 1e-4.
    most = {"isomap": 0.05, "harmonic": 0.15}.get(method, 0.025)
    assert 0.0125 < strain < most
    assert flat.one_to_one


@pytest.mark.parametrize("method", METHODS)
def test_rigid_motion_scale_and_vertex_order_change_nothing(method):
    # Oblong: on a square cap the axis along which lscm pins its border is a tie that rounding
    # breaks, and lengths differ by up to 0.7 %.
    V, F = cap(n=9)
    V = V * [1.0, 0.8, 1.0]
    before = lengths(flatten((V, F), method).uv, unique_edges(F))
    order = np.random.default_rng(7).permutation(len(V))
    place = np.argsort(order)
    moved = (250.0 * V @ rotation(7).T + [5e5, 4e6, -300])[order]
    after = flatten((moved, place[F]), method).uv
    assert_allclose(lengths(after[place], unique_edges(F)) / 250, before, rtol=SAME[method])


@pytest.mark.parametrize("method", METHODS)
def test_result_is_centred_upright_frozen_and_repeatable(method):
    mesh = cap(n=9)
    first, second = flatten(mesh, method), flatten(mesh, method)
    assert np.array_equal(first.uv, second.uv)
    assert_allclose(first.uv.mean(axis=0), 0, atol=1e-12)
    assert triangle_areas(first.uv, mesh[1]).sum() > 0
    # The last record is the answer's own.
    assert first.area_error[-1] == pytest.approx(measures.area_error(*mesh, first.uv))
    assert first.edge_error[-1] == pytest.approx(measures.edge_strain(*mesh, first.uv))
    assert len(first.energy) == len(first.area_error) == len(first.edge_error) > 0
    with pytest.raises(ValueError, match="read-only"):
        first.uv[0] = 0


@pytest.mark.parametrize("method", METHODS)
def test_a_mirrored_start_is_not_kept_mirrored(method):
    V, F = slab()
    flat = flatten((V, F), method, start=V[:, :2] * [-1, 1])
    assert triangle_areas(flat.uv, F).sum() > 0


@pytest.mark.parametrize("method", METHODS)
def test_hole_stays_a_hole(method):
    mesh = annulus()
    assert len(check_disk(TriMesh(*mesh))) == 2
    flat = flatten(mesh, method)
    assert flat.one_to_one
    assert len(flat.loops) == 2


def test_max_iter_is_reported():
    assert flatten(cap(), options=SpringOptions(max_iter=1)).stop is Stop.MAX_ITER
    assert flatten(cap(), "arap", options=ArapOptions(max_iter=2)).stop is Stop.MAX_ITER


TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def holed_torus():
    F = grid(8, 8)[1]
    n = 7
    F = (F // 8 % n) * n + F % 8 % n
    t, p = np.divmod(np.arange(n * n), n)
    t, p = t * 2 * np.pi / n, p * 2 * np.pi / n
    V = np.c_[(3 + np.cos(p)) * np.cos(t), (3 + np.cos(p)) * np.sin(t), np.sin(p)]
    return V, F[1:]


BAD = {
    "no faces": (SQUARE, np.empty((0, 3), int), "no faces"),
    "plane vertices": (SQUARE[:, :2], [[0, 1, 2]], r"shape \(n, 3\)"),
    "unused vertex": (SQUARE, [[0, 1, 2]], "belong to no face, the first is 3"),
    "degenerate": (SQUARE * [1, 0, 0], [[0, 1, 2], [0, 2, 3]], "degenerate"),
    "turned": (SQUARE, [[0, 1, 2], [0, 3, 2]], "not an oriented manifold"),
    "two parts": (
        np.concatenate([SQUARE[:3], SQUARE[:3] + 5]),
        [[0, 1, 2], [3, 4, 5]],
        "2 components",
    ),
    "bow tie": (np.concatenate([SQUARE[:3], -SQUARE[1:3]]), [[0, 1, 2], [0, 3, 4]], "manifold"),
    "closed": (TETRAHEDRON, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], "closed"),
    "handle": (*holed_torus(), "1 handle"),
}


@pytest.mark.parametrize("case", BAD)
def test_surfaces_that_cannot_be_flattened_are_refused(case):
    V, F, message = BAD[case]
    with pytest.raises(MeshError, match=message):
        flatten((V, np.asarray(F)))


def test_wrong_arguments_are_refused():
    V, F = slab()
    edges = len(unique_edges(F))
    with pytest.raises(OptionError, match=r"flattener must be one of spring, .*, but is 'origami'"):
        flatten((V, F), "origami")
    with pytest.raises(OptionError, match="must be ArapOptions, the options of arap, or None"):
        flatten((V, F), "arap", options=SpringOptions())
    for start in (V, V[:, :2] * np.nan):
        with pytest.raises(OptionError, match="start must be finite and of shape"):
            flatten((V, F), start=start)
    with pytest.raises(OptionError, match=rf"rest must have shape \({edges},\)"):
        flatten((V, F), rest=np.ones(3))
    for bad in (0.0, np.nan):
        with pytest.raises(OptionError, match="finite and positive"):
            flatten((V, F), rest=np.full(edges, bad))


@pytest.mark.parametrize("method", [m for m in METHODS if not FLATTENERS[m].intrinsic])
def test_extrinsic_methods_refuse_rest_lengths(method):
    V, F = slab()
    with pytest.raises(OptionError, match="cannot take rest lengths"):
        flatten((V, F), method, rest=lengths(V, unique_edges(F)))


ITERATIVE = ["spring", "spring_dynamic", "arap", "slim", "scaf", "ufo"]
ABOVE_0 = "a number above 0"
OR_NONE = "a number above 0 or None"
SOME = "a whole number of 1 or more"


@pytest.mark.parametrize(
    ("kind", "name", "value", "words"),
    [
        *((FLATTENERS[m].options, "tol", 0.0, f"{ABOVE_0}, but is 0.0") for m in ITERATIVE),
        *((FLATTENERS[m].options, "tol", "far", f"{ABOVE_0}, but is 'far'") for m in ITERATIVE),
        *((FLATTENERS[m].options, "max_iter", 0, f"{SOME}, but is 0") for m in ITERATIVE),
        *((FLATTENERS[m].options, "max_iter", 9.5, f"{SOME}, but is 9.5") for m in ITERATIVE),
        (SpringOptions, "tol", np.nan, f"{ABOVE_0}, but is nan"),
        (SpringOptions, "max_iter", True, f"{SOME}, but is True"),
        (SpringDynamicOptions, "time_step", -1.0, f"{OR_NONE}, but is -1.0"),
        (SpringDynamicOptions, "damping", 1, "a number from 0 to below 1 or None, but is 1"),
        (SpringDynamicOptions, "stop_rule", "never", "one of converged, thesis, but is 'never'"),
        (UfoOptions, "time_step", 0, f"{OR_NONE}, but is 0"),
        (MdsOptions, "landmarks", 2, "a whole number of 3 or more, but is 2"),
        (IsomapOptions, "landmarks", [3], "a whole number of 3 or more, but is [3]"),
        (IsomapOptions, "neighbours", 0, f"{SOME}, but is 0"),
    ],
)
def test_options_check_themselves(kind, name, value, words):
    with pytest.raises(OptionError) as refused:
        kind(**{name: value})
    assert str(refused.value) == f"flattener_options.{name} must be {words}"


@pytest.mark.parametrize("name", ["lscm", "arap_solve", "arap_precomputation"])
def test_refusals_of_libigl_are_named(monkeypatch, name):
    def refuse(*_):
        raise RuntimeError("no")

    monkeypatch.setattr(backend.igl, name, refuse)
    with pytest.raises(FlatteningError, match=f"{name} failed"):
        flatten(cap(n=9), name.split("_")[0])


def test_positions_that_are_not_finite_are_an_error(monkeypatch):
    n = 81
    monkeypatch.setattr(backend.igl, "arap_solve", lambda *_: np.full((n, 2), np.nan))
    monkeypatch.setattr(backend.igl, "lscm", lambda *_: (np.full((n, 2), np.nan), None))
    for method in ("arap", "lscm"):
        with pytest.raises(FlatteningError, match="not finite"):
            flatten(cap(n=9), method)


@pytest.mark.parametrize("method", METHODS)
def test_unused_vertices_and_parts_of_issue_66_never_reach_libigl(method):
    # libigl 2.6.3 ends the process on the first of these, and LSCM is singular on the second.
    V, F = cap(n=5)
    for bad in ((np.r_[V, [[9.0, 9, 9]]], F), (np.r_[V, V + 5], np.r_[F, F + len(V)])):
        with pytest.raises(MeshError, match=r"belong to no face|2 components"):
            flatten(bad, method)
