"""Prisms: volumes, orientation, shared diagonals."""

from itertools import permutations

import numpy as np
import pytest

from geounfold.geometry.measures import boundary_faces, tet_volumes
from geounfold.geometry.prisms import prism_tets, whole_prisms
from tests.shapes import plane


@pytest.mark.parametrize("labels", list(permutations(range(3))))
def test_every_numbering_of_a_prism_gives_three_upright_sixths(labels):
    corners = np.array([[0.0, 0], [1, 0], [0, 1]])
    V = np.empty((3, 2))
    V[list(labels)] = corners
    P = np.concatenate([np.column_stack([V, np.full(3, z)]) for z in (0.0, 1.0)])
    volumes = tet_volumes(P, prism_tets(np.array([labels]), 3, 2))
    assert volumes == pytest.approx([1 / 6] * 3, abs=1e-15)


def test_neighbours_share_their_diagonals():
    # Two prisms over a square, three layers: were diagonals not shared, faces inside the mesh
    # would belong to one tetrahedron only and the boundary would exceed the block's surface.
    F = np.array([[0, 1, 2], [0, 2, 3]])
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    V = np.concatenate([np.column_stack([square, np.full(4, z)]) for z in (0.0, 1.0, 2.0)])
    T = prism_tets(F, 4, 3)
    assert tet_volumes(V, T).sum() == pytest.approx(2.0)
    faces, owner, _ = boundary_faces(T)
    sides = V[faces]
    area = np.linalg.norm(
        np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1
    ).sum()
    assert area / 2 == pytest.approx(2 * 1 + 4 * 2)
    normal = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    outward = sides.mean(axis=1) - V[T[owner]].mean(axis=1)
    assert (np.einsum("ij,ij->i", normal, outward) > 0).all()


def test_prisms_are_found_again():
    rng = np.random.default_rng(4)
    F = rng.permutation(25)[plane(4, 4)[1]]  # neighbours numbered in every way
    T = prism_tets(F, 25, 4)
    rows, corners = whole_prisms(T)
    # 32 triangles, 3 slabs; every tetrahedron in one prism.
    assert len(rows) == 96
    assert sorted(rows.ravel()) == list(range(288))
    assert (np.diff(corners[:, :3], axis=1) > 0).all()
    assert (corners[:, 3:] - corners[:, :3] == 25).all()
    for row, six in zip(rows, corners, strict=True):
        assert sorted(np.unique(T[row])) == sorted(six)


def test_prisms_that_lost_a_tetrahedron_are_not_found():
    F = plane(3, 3)[1]
    T = prism_tets(F, 16, 2)
    whole, _ = whole_prisms(T)
    for lost in (whole[5, 0], whole[5, 1], whole[5, 2]):
        rows, _ = whole_prisms(np.delete(T, lost, axis=0))
        assert len(rows) == len(whole) - 1
    assert len(whole_prisms(T[:0])[0]) == 0
