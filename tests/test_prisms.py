"""Prisms: volumes, orientation, shared diagonals."""

from itertools import permutations

import numpy as np
import pytest

from geounfold.geometry import boundary_faces, tet_volumes
from geounfold.prisms import prism_tets


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
