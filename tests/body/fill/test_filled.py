"""Blocks in solids: which, how many, and what is told."""

import numpy as np
import pytest

from geounfold.body.fill import fill_between, fill_solid
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import TriMesh
from tests.body.fill.solids import ball, box
from tests.shapes import plane


def test_a_box_holds_the_blocks_of_its_volume():
    made = fill_solid(TriMesh(*box((10, 20, 30), (40, 20, 10))), (5, 4, 2.5))
    assert len(made) == 8 * 5 * 4
    assert made.points.min(axis=0).tolist() == [12.5, 22.0, 31.25]
    assert made.blocks_volume == made.volume == 8000.0
    assert made.table.columns.tolist() == ["x", "y", "z", "dx", "dy", "dz"]


def test_planes_through_centres_take_one_of_two_layers():
    # The box's faces lie in block centres: 4 blocks of 5 along each axis, not 3 or 5.
    assert len(fill_solid(TriMesh(*box((2.5, 2.5, 2.5), (20, 20, 20))), 5)) == 64


def test_a_ball_holds_the_centres_within_its_radius():
    V, F = ball(64)
    made = fill_solid(TriMesh(10 * V, F), 1)
    k = np.stack(np.meshgrid(*[np.arange(-11, 11) + 0.5] * 3, indexing="ij"), -1).reshape(-1, 3)
    radius = np.linalg.norm(k, axis=1)
    held = {tuple(p) for p in made.points}
    # The inscribed triangles lie up to 0.012 below the sphere: 10 (1 - cos(pi / 128)) / cos.
    assert held >= {tuple(p) for p in k[radius < 9.98]}
    assert held <= {tuple(p) for p in k[radius <= 10]}


def test_rows_are_in_order_and_do_not_depend_on_the_triangles():
    V, F = ball(16)
    order = np.random.default_rng(0).permutation(len(F))
    one, other = (fill_solid(TriMesh(10 * V, G), 1) for G in (F, F[order]))
    assert np.array_equal(one.points, other.points)
    assert np.array_equal(one.points, one.points[np.lexsort(one.points.T[::-1])])


@pytest.mark.parametrize("parts", [2, 4, 8])
def test_sub_blocks_are_the_finer_blocks_merged(parts):
    V, F = ball(48)
    split = fill_solid(TriMesh(10 * V, F), 2, parts)
    assert set(np.unique(split.sizes)) == {2.0, 2.0 / parts}
    fine = fill_solid(TriMesh(10 * V, F), 2 / parts)
    assert split.blocks_volume == pytest.approx(fine.blocks_volume)  # the same cells, merged


def test_the_size_follows_from_the_thickness_and_is_told():
    made = fill_solid(TriMesh(*box((0, 0, 0), (400, 400, 40))))
    # 2 V / A = 33.3; an eighth of it, 4.17, rounded down
    assert made.block_size.tolist() == [4.0, 4.0, 4.0]
    assert "--block-size sets another" in made.told[0]


def test_the_skin_of_blocks_is_filled_with_these_blocks():
    made = fill_solid(TriMesh(*box((1, 2, 3), (30, 20, 20), cell=5.0)))
    assert len(made) == 6 * 4 * 4
    assert made.points.min(axis=0).tolist() == [3.5, 4.5, 5.5]


def test_blocks_lie_between_two_surfaces():
    nodes, F = plane(20, 10)
    top, bottom = (TriMesh(np.column_stack([nodes, np.full(len(nodes), z)]), F) for z in (5.0, 1.0))
    made = fill_between(bottom, top, 0.5)
    extent = np.ptp(nodes, axis=0)
    # 4 high; the wall between the borders is vertical, so the count is that of the box.
    assert len(made) == extent[0] * 2 * extent[1] * 2 * 8
    assert made.points.min(axis=0).tolist() == [0.25, 0.25, 1.25]
    assert made.bounds.thickness == pytest.approx(4.0)


def test_blocks_between_follow_a_fold():
    """Two half cylinders about one axis: the blocks between have radii between theirs."""
    turn, along = np.linspace(0, np.pi, 61), np.linspace(0, 40, 21)
    _, F = plane(60, 20)
    surfaces = []
    for radius in (12.0, 8.0):
        a, y = (g.ravel() for g in np.meshgrid(turn, along, indexing="ij"))
        surfaces.append(TriMesh(np.stack([radius * np.cos(a), y, radius * np.sin(a)], 1), F))
    made = fill_between(*surfaces, 0.5)
    radius = np.hypot(made.points[:, 0], made.points[:, 2])
    inner = np.abs(made.points[:, 1] - 20) < 15
    assert 7.95 < radius[inner].min() < radius[inner].max() < 12.0
    # pi / 2 (12^2 - 8^2) 40, less what the chords cut off
    assert made.blocks_volume == pytest.approx(np.pi / 2 * 80 * 40, rel=0.02)


@pytest.mark.parametrize(
    ("size", "parts", "said"),
    [
        ((1, 2), 1, "a length or three"),
        (0, 1, "block_size must be a number"),
        (-5, 1, "block_size must be a number"),
        (0.01, 1, "more than 20,000,000"),
        (5, 3, "sub_blocks must be 1, 2, 4 or 8"),
    ],
)
def test_options_out_of_range_are_refused(size, parts, said):
    with pytest.raises(OptionError, match=said):
        fill_solid(TriMesh(*box((0, 0, 0), (40, 20, 10))), size, parts)


def test_blocks_that_are_too_large_are_refused():
    with pytest.raises(InputError, match="no centre of a block of 100 x 100 x 100"):
        fill_solid(TriMesh(*box((0, 0, 0), (40, 20, 10))), 100)


def test_one_surface_twice_is_refused():
    nodes, F = plane(5, 5)
    mesh = TriMesh(np.column_stack([nodes, np.zeros(len(nodes))]), F)
    with pytest.raises(InputError, match="the same surface"):
        fill_between(mesh, mesh, 1)


def test_a_surface_with_a_hole_is_filled_by_what_it_covers():
    nodes, F = plane(40, 40)
    top, bottom = (TriMesh(np.column_stack([nodes, np.full(len(nodes), z)]), F) for z in (4.0, 0.0))
    inner = (np.abs(nodes[F].mean(axis=1) - 20) < 6).all(axis=1)
    made = fill_between(TriMesh(top.V, F[~inner]), bottom, 1.0)
    away = np.abs(made.points[:, :2] - 20).max(axis=1)
    assert ((away > 9) & (away < 15)).sum() == (30**2 - 18**2) * 4
