"""Point location: libigl's answer for every point, whatever points come with it."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.backends import threads
from geounfold.backends.igl import TetIndex, barycentric_in_tets
from geounfold.geometry.point_location import ON_FACE, TetWalk
from geounfold.mapping import mesh_map
from geounfold.mapping.mesh_space import TOUCHING
from tests.shapes import CUBE, SIX


@pytest.fixture(scope="module", params=["recumbent", "tight_hinge", "hole"])
def unfolding(request):
    """Overturned limbs, a hinge as tight as the sheet, a hole: walks leave through the border."""
    return gu.unfold(gu.simulate(request.param, width=240.0).folded)


def spaces(unfolding):
    control = unfolding.map.control
    return control.folded, control.unfolded


def on_ties(mesh):
    """Vertices, middles of edges and of faces: where several tetrahedra are right."""
    a, b, c, _ = (mesh.V[mesh.T[:, k]] for k in range(4))
    return np.concatenate([mesh.V, (a + b) / 2, (a + b + c) / 3])


def around(mesh, count=20_000):
    """Points in and around a mesh, half of them outside and more."""
    rng = np.random.default_rng(5)
    return mesh.V[rng.integers(len(mesh.V), size=count)] + rng.normal(size=(count, 3))


def lowest(points, mesh, elements):
    return barycentric_in_tets(points, mesh.V, mesh.T[elements]).min(axis=1)


def test_every_point_lies_where_libigl_says(unfolding):
    for mesh in spaces(unfolding):
        points = np.concatenate([around(mesh), on_ties(mesh), mesh.V[mesh.T].mean(axis=1)])
        found, weights = TetWalk(mesh.V, mesh.T).locate(*np.ascontiguousarray(points.T))
        expected = TetIndex(mesh.V, mesh.T).locate(points)
        placed = found >= 0
        # What the walk leaves to libigl: outside all, a few on the border, few at inner sides.
        assert (expected[~placed] >= 0).mean() < 0.05
        other = placed & (found != expected)
        # On a face the sides' barycentric coordinates are 0 but for rounding: either is right.
        # libigl takes determinants, hence 1e-9 for thin tetrahedra in place of ON_FACE.
        assert (lowest(points[other], mesh, found[other]) > -1e-9).all()
        assert (
            np.abs(lowest(points[other & (expected >= 0)], mesh, expected[other & (expected >= 0)]))
            < 1e-9
        ).all()
        assert placed.mean() > 0.3  # else this would say nothing
        exact = barycentric_in_tets(points[placed], mesh.V, mesh.T[found[placed]])
        assert np.abs(weights[:, placed].T - exact[:, 1:]).max() < 1e-8


def test_every_block_is_carried_as_by_the_reference(unfolding):
    mesh = unfolding.map.control.folded
    blocks = unfolding.frame.to_work(unfolding.folded)
    expected = TetIndex(mesh.V, mesh.T).locate(blocks)
    got = unfolding.carried.element
    inside = expected >= 0
    other = np.flatnonzero(inside & (got != expected))
    assert np.abs(lowest(blocks[other], mesh, got[other])).max(initial=0) < 1e-9
    assert np.array_equal(unfolding.carried.inside[inside], inside[inside])


def test_neither_order_nor_batches_nor_threads_change_a_bit(unfolding, monkeypatch):
    points = np.concatenate([unfolding.folded, unfolding.folded[::-7] + 2.3])
    whole = unfolding.map.carry(points)
    order = np.random.default_rng(1).permutation(len(points))
    monkeypatch.setattr(mesh_map, "_SLICE", 777)
    for count in (1, 3):
        monkeypatch.setattr(threads, "cores", lambda count=count: count)
        turned = unfolding.map.carry(points[order])
        for name in ("points", "stratigraphic", "inside", "placed", "element", "distance"):
            expected = getattr(whole, name)[order]
            np.testing.assert_array_equal(getattr(turned, name), expected, strict=True)
    parts = [unfolding.map.carry(points[k : k + 501]).points for k in range(0, len(points), 501)]
    np.testing.assert_array_equal(np.concatenate(parts), whole.points)


def test_a_walk_through_a_cube_by_hand():
    # In Kuhn's cube the tetrahedra are the orders of x, y, z: the first has x > y > z.
    points = np.array([[0.9, 0.5, 0.1], [0.1, 0.5, 0.9], [0.5, 0.5, 0.5], [1.1, 0.5, 0.1]])
    found, weights = TetWalk(CUBE, SIX).locate(*points.T)
    assert found[0] == 0
    assert found[1] == 3
    assert found[2] >= 0  # on the diagonal that all six share
    assert found[3] == -1
    # Of (0.9, 0.5, 0.1): x - y, y - z and z belong to corners 100, 110 and 111.
    np.testing.assert_allclose(weights[:, 0], [0.4, 0.4, 0.1], atol=1e-15)


def test_flat_and_inverted_tetrahedra_hold_what_they_hold():
    V = np.concatenate([CUBE, [[2.0, 0, 0], [3.0, 0, 0], [2.0, 1, 0], [2.5, 0.5, 0]]])
    T = np.concatenate([SIX[:, [1, 0, 2, 3]], [[8, 9, 10, 11]]])
    found, _ = TetWalk(V, T).locate(*np.array([[0.9, 0.5, 0.1], [2.2, 0.2, 0.0]]).T)
    assert found.tolist() == [0, -1]


def test_the_grid_covers_places_beyond_it():
    far = np.array([[1e9, -1e9, 0.5], [-50.0, 0.5, 0.5]])
    assert TetWalk(CUBE, SIX).locate(*far.T)[0].tolist() == [-1, -1]
    assert ON_FACE < TOUCHING  # else a point taken on a face might count as outside
