"""Drawing of blocks: which lie outside, which are drawn, and their shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from geounfold.body.lattice import measure_lattice, point_spacing
from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.block_sizes import size_columns
from geounfold.report.columns import read_columns
from geounfold.report.plots.rendering import block_sides

LIMIT = 50_000
"""Largest number of blocks in a report."""

_SEED = 20_261_124
_MAX_CELLS = 30_000_000  # largest grid in which inner blocks are found: 30 MB
_INSIDE_SHARE = 0.2  # least share of inner blocks drawn, so that slices are not empty
_LOOSE = 0.001  # weight that draws a gradient to a rotation, needed for sheets of one block
_SPARSE = 1.3  # ratio of typical spacing to lattice step above which blocks are larger than steps
_FINEST = 8  # largest number of sub-blocks along a side
_LEVEL = 1e-3  # largest slope of axes that are drawn as level
_TORN = 2.5  # points that move apart by this factor are no longer neighbours


@dataclass(frozen=True, eq=False)
class Shape:
    """Boxes drawn for the blocks, in the folded space.

    Attributes
    ----------
    axes : (3, 3) float
        Unit directions of the boxes' edges, as rows.
    sides : (3,) float
        Lengths along the axes if all blocks are alike; else those of the smallest block.
    sizes : (n, 3) float or None
        Lengths of every block if they differ.
    """

    axes: Floats
    sides: Floats
    sizes: Floats | None = None


def block_shape(points: Floats, columns: Mapping[str, ArrayLike]) -> Shape | None:
    """Return the boxes of blocks in the folded space; None for points on no lattice.

    Parameters
    ----------
    points : (n, 3) float
        Centroids.
    columns : mapping of str to (n,)
        If they include one set of sides (``XINC``, ``dim_x`` ...: `size_columns`), all above 0,
        these are the sides of the blocks along the lattice's axes.

    Examples
    --------
    >>> cube = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), -1).reshape(-1, 3)
    >>> block_shape(5 * cube, {}).sides
    array([5., 5., 5.])
    """
    found = measure_lattice(points)
    axes = np.eye(3) if found is None else found.axes
    sizes = _sizes(columns, len(points))
    if sizes is not None:
        return Shape(axes, sizes.min(axis=0), sizes if np.ptp(sizes, axis=0).any() else None)
    if found is not None and point_spacing(points) < _SPARSE * found.steps.max():
        return Shape(axes, found.steps)
    return None


def level_sides(shape: Shape | None) -> Floats | None:
    """Return every block's sides along the world's axes, (n, 3); None if blocks are rotated."""
    if shape is None or not np.allclose(shape.axes, np.eye(3), rtol=0, atol=_LEVEL):
        return None
    return shape.sizes


def _sizes(columns: Mapping[str, ArrayLike], count: int) -> Floats | None:
    """Return the sides of blocks from a table's columns, (n, 3); None if there are none."""
    try:
        names = size_columns([str(name) for name in columns])
    except InputError:  # several sets of sides: it is not known which are the blocks'
        return None
    if names is None:
        return None
    read, _ = read_columns({name: columns[name] for name in names}, count, "")
    if len(read) < 3 or any(column.categories for column in read):
        return None
    sizes = np.column_stack([column.values for column in read]).astype(np.float64)
    return sizes if bool((sizes > 0).all()) else None


def outer_blocks(points: Floats, shape: Shape | None) -> Bools:
    """Return which blocks are visible from outside: all except those with blocks on every side.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in the folded space.
    shape : Shape or None
        Boxes of the blocks (`block_shape`).

    Returns
    -------
    (n,) bool
        On lattices the outermost layer.  Elsewhere the two outermost layers on a grid of the
        blocks' size with closed holes, so that no gaps appear.

    Examples
    --------
    >>> cube = np.stack(np.meshgrid(*[np.arange(3.0)] * 3), -1).reshape(-1, 3)
    >>> np.flatnonzero(~outer_blocks(cube, Shape(np.eye(3), np.ones(3))))
    array([13])
    """
    cells, owner = _cells(points, shape)
    extent = cells.max(axis=0) + 4
    if extent.prod() > _MAX_CELLS:
        return np.ones(len(points), dtype=np.bool_)
    full = np.zeros(extent, dtype=np.bool_)
    full[tuple(cells.T)] = True
    if shape is None:
        full = ndimage.binary_closing(full, np.ones((3, 3, 3), dtype=np.bool_))
    inside = ndimage.binary_erosion(full, iterations=2 if shape is None else 1)
    outer: Bools = np.zeros(len(points), dtype=np.bool_)
    outer[owner[~inside[tuple(cells.T)]]] = True
    return outer


def _cells(points: Floats, shape: Shape | None) -> tuple[Ints, Ints]:
    """Return the cells filled by blocks, (m, 3), indices from 3, and the block that fills each."""
    axes, sides = (np.eye(3), block_sides(points)) if shape is None else (shape.axes, shape.sides)
    sizes = sides if shape is None or shape.sizes is None else shape.sizes
    corner = points @ axes.T - sizes / 2
    first = np.rint((corner - corner.min(axis=0)) / sides).astype(np.int64) + 3
    counts = np.maximum(np.rint(np.broadcast_to(sizes / sides, first.shape)), 1).astype(np.int64)
    counts = np.minimum(counts, _FINEST)
    cells, owner = [], []
    kinds, kind = np.unique(counts, axis=0, return_inverse=True)
    for number, many in enumerate(kinds):
        rows = np.flatnonzero(kind.ravel() == number)
        inner = np.stack(np.meshgrid(*map(np.arange, many), indexing="ij"), -1).reshape(-1, 3)
        cells.append((first[rows, None] + inner).reshape(-1, 3))
        owner.append(np.repeat(rows, len(inner)))
    return np.concatenate(cells), np.concatenate(owner)


def chosen_blocks(outer: Bools, limit: int = LIMIT) -> Ints:
    """Return the rows that are drawn, in order: all, or a seeded sample that prefers the outside.

    Parameters
    ----------
    outer : (n,) bool
        Which blocks are visible from outside.
    limit : int, optional
        Largest number of blocks drawn.

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
    """Return the deformation gradients around blocks, (k, 3, 3).

    The matrix F best fits ``dy = F dx`` over the neighbours, dx from the block to a neighbour in
    the first space and dy in the second.  If the neighbours lie in a plane or on a line, the rest
    of F is that of the nearest rotation (Kabsch 1976).

    Parameters
    ----------
    here, there : (n, 3) float
        All blocks in the first and in the second space.
    neighbours : (n, m) int
        Rows of each block's neighbours.
    chosen : (k,) int
        Rows of the blocks whose matrices are returned.
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
