"""Shapes that several test files use: boxes, planes, slabs of prisms, rolls, turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.prisms import prism_tets

CUBE = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
"""Corners of a cube of side 1."""

SIX = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])
"""The cube's six tetrahedra about the diagonal from corner 0 to corner 7 (Kuhn)."""


def grid_cells(*counts: int) -> Ints:
    """Return the whole cells (n, 3) of a box of so many cells a side, from (0, 0, 0) on."""
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)


def box(*counts: int) -> Floats:
    """Return the centroids (n, 3) of a box of unit blocks, about the origin."""
    return grid_cells(*counts) - (np.array(counts) - 1) / 2


def plane(nx: int, ny: int) -> tuple[Floats, Ints]:
    """Return nodes (n, 2) of nx by ny square cells from (0, 0) on, and two triangles of each.

    The triangles are counter-clockwise, and all diagonals run alike.
    """
    nodes = np.indices((nx + 1, ny + 1)).reshape(2, -1).T.astype(float)
    k = np.arange(len(nodes)).reshape(nx + 1, ny + 1)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return nodes, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def slab(
    nx: int, ny: int, nz: int, steps: Sequence[float] = (1.0, 1.0, 1.0)
) -> tuple[Floats, Ints]:
    """Return a box of nx by ny by nz cells of two prisms each: nodes (n, 3), tetrahedra (m, 4)."""
    nodes, F = plane(nx, ny)
    layers = [np.column_stack([nodes, np.full(len(nodes), float(z))]) for z in range(nz + 1)]
    return np.concatenate(layers) * steps, prism_tets(F, len(nodes), nz + 1)


def rolled(points: Floats, radius: float) -> Floats:
    """Return points of a slab rolled up about y: x runs along the arc, z outward from a radius."""
    angle, r = points[:, 0] / radius, radius + points[:, 2]
    return np.column_stack([r * np.sin(angle), points[:, 1], r * np.cos(angle)])


def rotation(seed: int) -> Floats:
    """Return a proper rotation (3, 3) drawn at random."""
    q = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    out: Floats = q * np.sign(np.linalg.det(q))
    return out


def turned(points: Floats, seed: int = 0) -> Floats:
    """Return points after a rigid motion drawn at random, in UTM coordinates."""
    return points @ rotation(seed).T + [412_300.0, 6_815_750.0, 1_480.0]
