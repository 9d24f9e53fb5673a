"""Pictures: they show what their titles name, and errors name what is missing."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from geounfold.backends.system import libraries
from geounfold.errors import InputError, MissingDependencyError, OptionError
from geounfold.geometry.mesh import TetMesh, TriMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.report.plots import style
from geounfold.report.plots.bodies import (
    _tet_faces,
    draw_bodies,
    draw_body,
    draw_control,
    draw_split,
    draw_surface,
)
from geounfold.report.plots.figures import draw_curves, draw_distribution, png
from geounfold.report.plots.rendering import _seen, block_sides, check_rendering, render_body
from geounfold.report.plots.style import ViewOptions
from tests.shapes import CUBE, SIX, grid_cells

try:
    check_rendering()
    CANNOT = ""
except MissingDependencyError as error:
    CANNOT = str(error)
needs_rendering = pytest.mark.skipif(bool(CANNOT), reason=CANNOT or "nothing is missing")

SMALL = ViewOptions(size=(160, 120))
SLAB = grid_cells(8, 6, 4) * [10, 10, 5] + [5e5, 7e6, 300]  # as far out as real surveys lie

CONTROL = ControlMesh(TetMesh(CUBE, SIX), TetMesh(2 * CUBE, SIX), CUBE[:, 2])


def is_png(data):
    return data.startswith(b"\x89PNG") and len(data) > 1000


# --- blocks


def test_sides_of_blocks_on_a_lattice_and_off_it():
    np.testing.assert_allclose(block_sides(SLAB), [10, 10, 5])
    turned = grid_cells(8, 6, 4) @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1.0]])
    turned += 0.05 * np.random.default_rng(0).random(turned.shape)
    # Unit spacing; six neighbours of a border block lie up to sqrt 2 away: measured 1.20.
    assert ((block_sides(turned) > 0.95) & (block_sides(turned) < 1.4)).all()
    assert block_sides(SLAB[:1]).tolist() == [1, 1, 1]


def test_blocks_behind_others_are_left_out_and_no_others():
    cube = grid_cells(9, 9, 9) * 1.0
    seen = _seen(cube, np.ones(3), np.array([1.0, 1.0, 1.0]))
    assert not seen[(cube < 7).all(axis=1)].any()
    assert seen[(cube >= 7).any(axis=1)].all()
    assert seen[(cube == 8).any(axis=1)].all()


@needs_rendering
def test_colours_are_those_of_the_map_and_up_is_up():
    image = render_body(SLAB, SLAB[:, 2], (300.0, 315.0), options=SMALL)
    assert image.shape == (120, 160, 3)
    assert image.dtype == np.uint8
    # Viridis ends in (253, 231, 37), seen on the top face at full brightness.
    yellow = np.argwhere((np.abs(image.astype(int) - [253, 231, 37]) < 6).all(axis=2))
    body = np.argwhere((image < 250).any(axis=2))
    assert len(yellow) > 0.2 * len(body)
    assert yellow[:, 0].mean() < body[:, 0].mean()  # rows run downwards


@needs_rendering
def test_the_same_body_gives_the_same_picture():
    first, second = (render_body(SLAB, SLAB[:, 0], (5e5, 5.01e5), options=SMALL) for _ in "ab")
    np.testing.assert_array_equal(first, second)


@needs_rendering
def test_a_body_too_large_is_thinned():
    few = ViewOptions(size=(160, 120), max_blocks=10)
    whole = render_body(SLAB, SLAB[:, 2], (300, 315), options=SMALL)
    thin = render_body(SLAB, SLAB[:, 2], (300, 315), options=few)
    assert (thin < 250).any()
    assert (thin < 250).sum() < 0.7 * (whole < 250).sum()


# --- figures


@needs_rendering
def test_bodies_are_drawn_side_by_side():
    assert is_png(png(draw_bodies(SLAB, SLAB * [1, 1, 0.5], SLAB[:, 2], "height", options=SMALL)))
    pair = (SLAB[:, 0], SLAB[:, 1] * 0 + 2.0)
    assert is_png(png(draw_bodies(SLAB, SLAB, pair, "x", options=SMALL)))
    assert is_png(png(draw_body(SLAB, SLAB[:, 2], "height", options=SMALL)))


@needs_rendering
def test_surfaces_are_coloured_by_vertex_or_by_face():
    folded = TriMesh(CUBE, [[0, 1, 2], [1, 3, 2]])
    flat = TriMesh(CUBE * [1, 1, 0.5], folded.F)
    assert is_png(png(draw_surface(folded, flat, CUBE[:, 2], "height", options=SMALL)))
    assert is_png(png(draw_surface(folded, flat, np.arange(2.0), "face", options=SMALL)))


@needs_rendering
def test_split_and_control_mesh_are_drawn():
    F = _tet_faces(SIX)
    assert len(F) == 12
    side, rim = np.where(CUBE[F].mean(axis=1)[:, 2] > 0.6, 1, -1), np.arange(12) % 2 == 0
    assert is_png(png(draw_split(TriMesh(CUBE, F), side, rim, options=SMALL)))
    assert is_png(png(draw_control(CONTROL, options=SMALL)))


def test_the_border_of_a_control_mesh_faces_outwards():
    F = _tet_faces(SIX)
    normal = np.cross(CUBE[F[:, 1]] - CUBE[F[:, 0]], CUBE[F[:, 2]] - CUBE[F[:, 0]])
    assert (np.einsum("ij,ij->i", normal, CUBE[F].mean(axis=1) - 0.5) > 0).all()


def test_distributions_and_curves_need_no_rendering():
    pytest.importorskip("matplotlib")
    values = np.random.default_rng(0).random(500) ** 2
    assert is_png(png(draw_distribution(values, "epsilon")))
    assert is_png(png(draw_distribution(np.zeros(5), "epsilon")))  # all alike
    curves = {"top": 1 / np.arange(1.0, 9), "bottom": 1 / np.arange(1.0, 5)}
    assert is_png(png(draw_curves(curves, "step", "energy", logarithmic=True)))


# --- what is refused


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: render_body(SLAB[:, :2], SLAB[:, 0], (0, 1)), r"points must have shape \(n, 3\)"),
        (lambda: render_body(SLAB, SLAB[1:, 0], (0, 1)), "192 points need as many values"),
        (lambda: render_body(SLAB, np.full(192, np.nan), (0, 1)), "192 values are not finite"),
        (lambda: render_body(SLAB, SLAB[:, 0], (1, 1)), "limits must rise"),
        (
            lambda: draw_surface(*[TriMesh(CUBE, [[0, 1, 2]])] * 2, np.ones(3), "x"),
            "8 vertices or 1 faces need as many values",
        ),
        (lambda: draw_split(TriMesh(CUBE, [[0, 1, 2]]), np.ones(2), np.ones(1)), "1 faces"),
        (lambda: draw_distribution(np.array([np.inf]), "x"), "x: needs finite values"),
    ],
)
def test_bad_input_is_refused_with_its_reason(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"elevation": 91}, "elevation must be -90 to 90"),
        ({"size": (8, 100)}, "size must be 16 to 8192"),
        ({"max_blocks": 0}, "max_blocks must be at least 1"),
    ],
)
def test_options_check_themselves(options, message):
    with pytest.raises(OptionError, match=message):
        ViewOptions(**options)


def test_a_missing_python_library_is_named_with_its_cure(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MissingDependencyError, match=r"need pyvista: .*geounfold\[view\]"):
        style.require("pyvista")


@pytest.mark.parametrize(
    ("loads", "message"),
    [(lambda _: False, "libEGL.so.1 missing.*libegl1"), (lambda _: True, "ended with -11")],
)
def test_a_trial_that_dies_is_told_apart_from_a_missing_library(monkeypatch, loads, message):
    """VTK ends with a segmentation fault if OpenGL is missing; geounfold must not."""
    pytest.importorskip("pyvista")
    died = SimpleNamespace(returncode=-11)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: died)
    monkeypatch.setattr(libraries, "_loads", loads)
    with pytest.raises(MissingDependencyError, match=message):
        check_rendering.__wrapped__()


def test_blocks_are_drawn_in_their_own_sides() -> None:
    # One block of 40 m beside one of 10 m, seen from above: areas are 16 to 1.
    points = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]])
    sides = np.array([[40.0, 40.0, 40.0], [10.0, 10.0, 10.0]])
    above = ViewOptions(azimuth=0.0, elevation=90.0, size=(800, 400))
    image = render_body(points, np.array([0.0, 1.0]), (0.0, 1.0), sides=sides, options=above)
    ends = ([68, 1, 84], [253, 231, 37])  # of viridis
    large, small = (np.count_nonzero(np.abs(image - np.array(e)).max(axis=2) < 30) for e in ends)
    # Of the small one's 30 x 30 pixels, one along each edge is mixed with the ground: 13 %.
    assert abs(large / small / 16 - 1) < 0.15
    with pytest.raises(InputError, match="sides must be positive"):
        render_body(points, np.array([0.0, 1.0]), (0.0, 1.0), sides=-sides, options=above)
