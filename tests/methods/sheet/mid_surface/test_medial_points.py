"""Which surfaces are told to close on themselves: tubes, not sheets with holes; handles."""

import numpy as np
import pytest

from geounfold.errors import NoSheetError
from geounfold.geometry.mesh import TriMesh
from geounfold.methods.sheet.mid_surface.medial_points import _check_open


def grid(rows, columns, place, around=False):
    """Return a triangulated grid of cells at ``place(i, j)``, closed along i if ``around``."""
    n = rows if around else rows + 1
    i, j = np.meshgrid(np.arange(n), np.arange(columns + 1), indexing="ij")
    V = place(i.ravel().astype(float), j.ravel().astype(float))
    a, b = (x.ravel() for x in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    steps = ((0, 0), (1, 0), (1, 1), (0, 1))
    corner = [(a + s) % n * (columns + 1) + b + t for s, t in steps]
    F = np.concatenate([np.stack([corner[k] for k in t], axis=1) for t in ((0, 1, 2), (0, 2, 3))])
    return V, F


def tube(i, j):
    angle = 2 * np.pi * i / 40
    return np.stack([6 * np.cos(angle), 6 * np.sin(angle), j], axis=1)


def sheet(i, j):
    return np.stack([i, j, 3 * np.sin(i / 5)], axis=1)


def without_vertex(V, F, vertex):
    """Return the mesh with a hole in place of a vertex."""
    kept = ~(F == vertex).any(axis=1)
    used, F = np.unique(F[kept], return_inverse=True)
    return V[used], F.reshape(-1, 3)


def test_tube_is_refused():
    with pytest.raises(NoSheetError, match="closes on itself around an axis"):
        _check_open(TriMesh(*grid(40, 20, tube, around=True)))


def test_tube_with_a_small_hole_is_refused():
    V, F = grid(40, 20, tube, around=True)
    with pytest.raises(NoSheetError, match="closes on itself around an axis"):
        _check_open(TriMesh(*without_vertex(V, F, 21 * 10 + 10)))


def test_closed_surface_is_refused():
    F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    with pytest.raises(NoSheetError, match="closes on itself on all sides"):
        _check_open(TriMesh(np.eye(4)[:, :3], F))


def test_sheet_with_a_small_hole_is_open_even_if_its_border_is_rough():
    V, F = without_vertex(*grid(40, 30, sheet), 31 * 20 + 15)
    _check_open(TriMesh(V, F))
    # Crumpled along its border, the long loop turns by anything.
    rough = np.random.default_rng(0).normal(scale=1.5, size=V.shape)
    edge = (V[:, 0] < 1) | (V[:, 0] > 39) | (V[:, 1] < 1) | (V[:, 1] > 29)
    _check_open(TriMesh(V + rough * edge[:, None], F))


def test_sheet_with_a_large_hole_is_open():
    V, F = grid(40, 30, sheet)
    inner = (np.abs(V[:, 0] - 20) < 12) & (np.abs(V[:, 1] - 15) < 9)
    used, F = np.unique(F[~inner[F].any(axis=1)], return_inverse=True)
    _check_open(TriMesh(V[used], F.reshape(-1, 3)))


def test_handles_are_counted():
    def torus(i, j):
        a, b = 2 * np.pi * i / 30, 2 * np.pi * j / 20
        r = 8 + 3 * np.cos(b)
        return np.stack([r * np.cos(a), r * np.sin(a), 3 * np.sin(b)], axis=1)

    V, F = grid(30, 20, torus, around=True)
    first = np.arange(len(V)) - np.where(np.arange(len(V)) % 21 == 20, 20, 0)  # j = 20 is j = 0
    V, F = without_vertex(V, first[F], 5 * 21 + 7)
    with pytest.raises(
        NoSheetError, match=r"the top of the layer has 1 handle\(s\): .*smoother boundary"
    ):
        _check_open(TriMesh(V, F))
