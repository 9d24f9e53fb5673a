"""Datums, registration, lifted nodes, offsets that shrink, horizons met along normals."""

import numpy as np
import pytest

from geounfold.errors import InputError, OptionError
from geounfold.geometry.measures import tet_volumes, triangle_areas
from geounfold.geometry.mesh import TriMesh
from geounfold.mapping.control_mesh import Datum
from geounfold.methods.sheet.meshing.build import register
from geounfold.methods.sheet.meshing.footprint import footprint
from geounfold.methods.sheet.meshing.prism_layers import Layers, neighbour_mean, shrink
from geounfold.methods.sheet.meshing.top_and_bottom import Horizons
from geounfold.methods.sheet.mid_surface.spline import SplineGrid
from geounfold.surfaces.given import split_reference


def test_datums_level_their_surface():
    rng = np.random.default_rng(2)
    bottom, top = rng.uniform(-4, -2, 20), rng.uniform(1, 5, 20)
    assert np.array_equal(Datum("mid", -3, 3).z(top, bottom, top), top)
    assert np.allclose(Datum("top", -3, 3).z(top, bottom, top), 3)
    assert np.allclose(Datum("bottom", -3, 3).z(bottom, bottom, top), -3)
    both = Datum("proportional", -3, 3)
    assert np.allclose(both.z(top, bottom, top), 3)
    assert np.allclose(both.z(bottom, bottom, top), -3)
    # A shear keeps every thickness.
    sheared = Datum("top", -3, 3)
    assert np.allclose(sheared.z(top, bottom, top) - sheared.z(bottom, bottom, top), top - bottom)


def test_an_unknown_datum_is_refused():
    with pytest.raises(OptionError, match="mid, top, bottom, proportional"):
        Datum("sea", -1, 1)


def test_registration_finds_the_motion_and_never_mirrors():
    rng = np.random.default_rng(2)
    A = rng.normal(size=(40, 2))
    turn = np.array([[np.cos(1.1), -np.sin(1.1)], [np.sin(1.1), np.cos(1.1)]])
    B = A @ turn.T + [5.0, -3.0]
    weight = rng.uniform(0.1, 1, 40)
    assert np.allclose(register(A, B, weight), B)
    mirrored = A * [1, -1]
    moved, face = register(mirrored, A, weight), np.array([[0, 1, 2]])
    assert triangle_areas(moved, face) == pytest.approx(triangle_areas(mirrored, face))


def test_footprint_holds_every_foot_inside_its_border():
    rng = np.random.default_rng(2)
    U = rng.uniform(-20, 20, (800, 2))
    prints = footprint(U, 0.4, 1.5, 1)
    # Counter-clockwise halves of square cells.
    assert triangle_areas(prints.U, prints.F) == pytest.approx(np.full(len(prints.F), 1.5**2 / 2))
    centres = prints.U[prints.F].mean(axis=1)
    nearest = np.sqrt(((U[:, None] - centres[None]) ** 2).sum(axis=2)).min(axis=1)
    assert nearest.max() < 1.5
    assert prints.axes @ prints.axes.T == pytest.approx(np.eye(2))


def bent_layers(radius, reach):
    """Prisms over a cylinder of a radius, bent so that normals meet above."""
    rng = np.random.default_rng(2)
    U = footprint(rng.uniform(-6, 6, (900, 2)), 0.0, 1.0, 0)
    angle = U.U[:, 0] / radius
    P = np.column_stack([radius * np.sin(angle), U.U[:, 1], radius * (1 - np.cos(angle))])
    normal = np.column_stack([-np.sin(angle), np.zeros(len(P)), np.cos(angle)])
    slope = np.column_stack([-angle, np.zeros(len(P))])
    n = len(P)
    curvature = np.stack([np.full(n, 1 / radius), np.full(n, -1 / radius)])
    offset = np.full(n, reach)
    return Layers(P, normal, U.U, slope, -slope, U.F, curvature, offset, offset)


def bad_nodes(layers, T):
    """Nodes of tetrahedra that are not upright in both spaces."""
    volumes = np.stack([tet_volumes(V, T) for V in (layers.folded, layers.unfolded)])
    return np.unique(T[(volumes <= 0).any(axis=0)] % len(layers.P))


def test_offsets_within_the_focal_distance_are_upright_and_shrink_past_it():
    sound = bent_layers(radius=8.0, reach=5.0)
    assert len(bad_nodes(sound, sound.tets())) == 0
    crossed = bent_layers(radius=8.0, reach=9.0)
    bad = bad_nodes(crossed, crossed.tets())
    assert len(bad) > 0
    smaller = shrink(crossed, bad, neighbour_mean(crossed.F, len(crossed.P)))
    assert smaller.up[bad] == pytest.approx(0.9 * crossed.up[bad])
    # The diverging side keeps its reach.
    assert np.array_equal(smaller.down, crossed.down)


def test_normals_meet_a_tilted_horizon_where_algebra_says():
    rng = np.random.default_rng(2)
    grid = SplineGrid.over(np.full(2, -20.0), np.full(2, 20.0), 3.5)
    horizons = Horizons(grid, 3 + 0.1 * grid.nodes[:, 0], np.full(grid.size, -2.0))
    U = rng.uniform(-10, 10, (60, 2))
    slip = np.column_stack([rng.uniform(-0.8, 0.8, 60), np.zeros(60)])
    bottom, top = horizons.crossings(U, slip, limit=50.0)
    # t = 3 + 0.1 (x - t s)  =>  t = (3 + 0.1 x) / (1 + 0.1 s)
    assert np.allclose(top, (3 + 0.1 * U[:, 0]) / (1 + 0.1 * slip[:, 0]), atol=1e-12)
    assert np.allclose(bottom, -2)
    assert np.abs(horizons.crossings(U, slip, limit=1.0)[0]).max() <= 1.0


def test_horizons_never_cross():
    grid = SplineGrid.over(np.full(2, -9.0), np.full(2, 9.0), 3.5)
    pinched = Horizons(grid, np.full(grid.size, -1.0), np.full(grid.size, 1.0))
    bottom, top = pinched.heights(np.zeros((1, 2)))
    assert top[0] - bottom[0] == pytest.approx(0.3)


def plane(z, side=20):
    i, j = (a.ravel().astype(float) for a in np.indices((side, side)))
    k = np.arange(side * side).reshape(side, side)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return TriMesh(np.column_stack([i, j, np.full(len(i), z)]), F)


def test_reference_surfaces_are_turned_away_from_each_other():
    top, bottom = plane(3.0), plane(-2.0)
    for upper, lower in ((top, bottom), (TriMesh(top.V, top.F[:, ::-1]), bottom)):
        parts = split_reference(upper, lower)
        inner = ~parts.rim
        assert parts.thickness[inner] == pytest.approx(5.0)
        assert parts.median_thickness == pytest.approx(5.0)
        assert (parts.side[parts.opposite[inner]] == -parts.side[inner]).all()


def test_reference_surfaces_that_do_not_meet_are_refused():
    far = TriMesh(np.add(plane(0.0).V, [100.0, 0, 0]), plane(0.0).F)
    with pytest.raises(InputError, match="do not face each other"):
        split_reference(plane(3.0), far)
