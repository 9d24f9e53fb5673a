"""Wireframes that are solids: what is mended, what is refused, and where."""

import numpy as np
import pytest

from geounfold.body.fill import closed_shell
from geounfold.body.fill.edges import border_edges, holes_of
from geounfold.errors import InputError
from geounfold.geometry.mesh import TriMesh
from tests.body.fill.solids import ball, box, joined


def test_the_border_of_an_open_box_is_its_rim():
    V, F = box((0, 0, 0), (4, 3, 2))
    assert len(border_edges(F)) == 0
    holes = holes_of(V, F[2:])
    assert len(holes.edges) == 4
    assert holes.area.tolist() == [12.0]  # the lower face, 4 x 3
    assert holes.length.tolist() == [14.0]


def test_a_closed_surface_stays_as_it_is():
    V, F = ball(16)
    shell = closed_shell(TriMesh(V, F))
    assert shell.told == ()
    assert shell.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)  # the unit ball, inscribed
    assert shell.thickness == pytest.approx(2 / 3, rel=0.02)  # 2 V / A of a ball: 2 r / 3


def test_triangles_that_face_either_way_are_turned_outward():
    V, F = ball(12)
    flip = np.arange(len(F)) % 3 == 0
    mixed = np.where(flip[:, None], F[:, ::-1], F)
    for faces in (mixed, F[:, ::-1]):
        assert closed_shell(TriMesh(V, faces)).volume == pytest.approx(
            closed_shell(TriMesh(V, F)).volume, rel=1e-12
        )


def test_corners_that_should_be_one_are_joined_and_told():
    V, F = ball(12)
    soup = V[F].reshape(-1, 3)
    moved = soup + np.random.default_rng(1).normal(0, 1e-6, soup.shape)
    shell = closed_shell(TriMesh(moved, np.arange(len(moved)).reshape(-1, 3)))
    assert len(border_edges(shell.mesh.F)) == 0
    assert "were joined" in shell.told[0]
    assert shell.volume == pytest.approx(closed_shell(TriMesh(V, F)).volume, rel=1e-4)


def test_a_pin_hole_is_closed_and_its_place_told():
    V, F = ball(24)
    shell = closed_shell(TriMesh(V, F[1:]))
    assert len(border_edges(shell.mesh.F)) == 0
    assert "1 hole" in shell.told[0]
    assert "at (0.06896515399, " in shell.told[0]  # mean of the triangle's edges, by length


def test_a_missing_side_is_refused_with_its_place_and_the_way_out():
    V, F = box((100, 200, 50), (40, 30, 20))
    with pytest.raises(
        InputError, match=r"not closed.* around \(120, 215, 50\).*--top and --bottom"
    ):
        closed_shell(TriMesh(V, F[2:]))


def test_loose_triangles_are_left_out_and_told():
    V, F = joined(ball(20), (np.array([[3.0, 0, 0], [3, 0.1, 0], [3, 0, 0.1]]), [[0, 1, 2]]))
    shell = closed_shell(TriMesh(V, F))
    assert "1 loose triangle" in shell.told[0]
    assert shell.mesh.V[:, 0].max() <= 1.0


def test_parts_that_cross_are_one_solid():
    shell = closed_shell(TriMesh(*joined(box((0, 0, 0), (4, 4, 4)), box((2, 0, 0), (4, 4, 4)))))
    assert shell.volume == pytest.approx(96.0)  # 6 x 4 x 4, what both enclose
    assert "crosses or touches itself" in shell.told[0]


def test_an_inner_part_that_faces_the_outer_one_is_a_void():
    outer, (V, F) = box((0, 0, 0), (6, 6, 6)), box((2, 2, 2), (2, 2, 2))
    void = closed_shell(TriMesh(*joined(outer, (V, F[:, ::-1]))))
    assert void.volume == pytest.approx(216 - 8)
    assert void.told == ()
    full = closed_shell(TriMesh(*joined(outer, (V, F))))
    assert "counts as full" in full.told[0]


def test_the_skin_of_blocks_is_known_by_its_corners():
    V, F = box((0, 0, 0), (30, 20, 20), cell=5.0)
    shell = closed_shell(TriMesh(V, F))
    assert shell.blocks is not None
    assert shell.blocks.steps.tolist() == [5.0, 5.0, 5.0]
    assert shell.around(np.array([[1.0, 1, 1]])) is None  # stairs are no horizon
    assert closed_shell(TriMesh(*ball(16))).blocks is None


def test_the_part_around_a_body_is_found():
    left, right = ball(12), ball(12)
    shell = closed_shell(TriMesh(*joined(left, (right[0] + [5.0, 0, 0], right[1]))))
    around = shell.around(np.array([[5.0, 0, 0], [5.1, 0, 0]]))
    assert around is not None
    assert around.V[:, 0].min() >= 4.0
    assert shell.around(np.array([[2.5, 0, 0]])) is None
