"""How blocks are drawn: which lie outside, which are drawn at all, and what shape they take."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from geounfold.mesh import Bools, Floats, Ints
from geounfold.plotting import block_sides, level_step

LIMIT = 50_000
"""Blocks that a report holds at most."""

_SEED = 20_261_124
_MAX_CELLS = 30_000_000  # of the grid that inner blocks are found with: 30 MB
_INSIDE_SHARE = 0.2  # of the blocks drawn at least, so that slices of large bodies are not empty
_LOOSE = 0.001  # how much a gradient is held to a rotation, which sheets of one block need
_TORN = 2.5  # neighbours that move apart by this factor are none


def outer_blocks(points: Floats) -> Bools:
    """Return which blocks can be seen from outside: all but those with blocks on every side.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in the space where they may form a lattice.

    Returns
    -------
    (n,) bool
        On lattices the outermost layer.  Elsewhere counted on a grid of the blocks' size, whose
        holes are closed, and two layers deep, so that no gaps show.

    Examples
    --------
    >>> cube = np.stack(np.meshgrid(*[np.arange(3.0)] * 3), -1).reshape(-1, 3)
    >>> np.flatnonzero(~outer_blocks(cube))
    array([13])
    """
    sides = block_sides(points)
    cell = np.floor((points - points.min(axis=0)) / sides + 0.5).astype(np.int64) + 3
    shape = cell.max(axis=0) + 4
    if shape.prod() > _MAX_CELLS:
        return np.ones(len(points), dtype=np.bool_)
    full = np.zeros(shape, dtype=np.bool_)
    full[tuple(cell.T)] = True
    lattice = on_lattice(points)
    if not lattice:
        full = ndimage.binary_closing(full, np.ones((3, 3, 3), dtype=np.bool_))
    inside = ndimage.binary_erosion(full, iterations=1 if lattice else 2)
    outer: Bools = ~inside[tuple(cell.T)]
    return outer


def on_lattice(points: Floats) -> bool:
    """Return whether the coordinates along every axis are levels at equal steps."""
    return len(points) > 1 and all(level_step(column) is not None for column in points.T)


def chosen_blocks(outer: Bools, limit: int = LIMIT) -> Ints:
    """Return the rows that are drawn, in order: all, or a seeded sample that prefers the outside.

    Parameters
    ----------
    outer : (n,) bool
        Which blocks can be seen from outside.
    limit : int, optional
        How many are drawn at most.

    Examples
    --------
    >>> chosen_blocks(np.array([True, False, False, True]), limit=3)[[0, -1]]
    array([0, 3])
    """
    n = len(outer)
    if n <= limit:
        return np.arange(n)
    shuffled = np.random.default_rng(_SEED).permutation(n)
    seen, hidden = shuffled[outer[shuffled]], shuffled[~outer[shuffled]]
    inside = min(len(hidden), max(limit - len(seen), int(_INSIDE_SHARE * limit)))
    return np.sort(np.concatenate([seen[: limit - inside], hidden[:inside]]))


def gradients(here: Floats, there: Floats, neighbours: Ints, chosen: Ints) -> Floats:
    """Return how the surroundings of blocks are turned and stretched, (k, 3, 3).

    The matrix F that fits ``dy = F dx`` best over the neighbours, dx from the block to a neighbour
    in the one space and dy in the other.  Where the neighbours lie in a plane or a line, the rest
    of F is the nearest rotation's (Kabsch 1976).

    Parameters
    ----------
    here, there : (n, 3) float
        All blocks in the one space and in the other.
    neighbours : (n, m) int
        Rows of each block's neighbours.
    chosen : (k,) int
        The blocks whose matrices are wanted.
    """
    ids = neighbours[chosen]
    dx = here[ids] - here[chosen, None]
    dy = there[ids] - there[chosen, None]
    near = np.linalg.norm(dy, axis=2) <= _TORN * np.linalg.norm(dx, axis=2)
    dx, dy = dx * near[..., None], dy * near[..., None]
    cross = np.einsum("kmi,kmj->kij", dy, dx)
    square = np.einsum("kmi,kmj->kij", dx, dx)
    U, _, Vt = np.linalg.svd(cross)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    size = np.trace(square, axis1=1, axis2=2)
    hold = np.where(size > 0, _LOOSE * size, 1.0)[:, None, None]
    fitted: Floats = np.linalg.solve(
        square + hold * np.eye(3), (cross + hold * (U @ Vt)).swapaxes(1, 2)
    ).swapaxes(1, 2)
    return fitted
