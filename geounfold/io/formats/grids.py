"""Block models in files: a grid along three axes, divided into blocks and sub-blocks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.packages.names import side_sets

_SIDES = ("dx", "dy", "dz")
_INDICES = ("i", "j", "k")
_SQUARE = 1e-5  # largest cosine between two axes; unit vectors in single precision are within it
_MOST_BLOCKS = 2**31  # number of blocks above which a file counts as damaged


@dataclass(frozen=True, eq=False)
class Grid:
    """Blocks in rows along three axes u, v, w at right angles.

    Attributes
    ----------
    corner : (3,) float
        Corner of the first block, world coordinates.
    axes : (3, 3) float
        Unit vectors along u, v and w, as rows; right- or left-handed.
    starts : three (n,) float
        Distance of each block's start from the corner, along each axis.
    widths : three (n,) float
        Length of each block along each axis.
    """

    corner: Floats
    axes: Floats
    starts: tuple[Floats, Floats, Floats]
    widths: tuple[Floats, Floats, Floats]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of blocks along each axis."""
        u, v, w = (len(width) for width in self.widths)
        return u, v, w

    def blocks(self, ijk: Ints, low: Floats | float = 0.0, high: Floats | float = 1.0) -> Blocks:
        """Return blocks of given indices, or a part of each.

        Parameters
        ----------
        ijk : (n, 3) int
            Indices along u, v and w, from 0.
        low, high : (n, 3) float
            Lower and upper corner of the part in its block, as shares of the block's sides.

        Raises
        ------
        ValueError
            A block is outside the grid, or a part is outside its block.
        """
        if ijk.size and not (ijk.min() >= 0 and (ijk.max(axis=0) < self.shape).all()):
            raise ValueError("a block lies outside the grid")
        begin, end = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        if not ((begin >= 0) & (begin < end) & (end <= 1)).all():
            raise ValueError("a sub-block reaches out of its block")
        start = np.column_stack([self.starts[a][ijk[:, a]] for a in range(3)])
        width = np.column_stack([self.widths[a][ijk[:, a]] for a in range(3)])
        centres = self.corner + (start + width * (0.5 * (begin + end))) @ self.axes
        return Blocks(centres, width * (end - begin), ijk)


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of a model.

    Attributes
    ----------
    centres : (n, 3) float
        Centroids, world coordinates.
    sides : (n, 3) float
        Lengths along the model's own axes.
    ijk : (n, 3) int
        Indices of each block, from 0; those of the parent block for a sub-block.
    """

    centres: Floats
    sides: Floats
    ijk: Ints


def tensor_grid(corner: ArrayLike, axes: ArrayLike, widths: Sequence[ArrayLike]) -> Grid:
    """Return a grid of blocks with given lengths along each axis, three (n,) float.

    Raises
    ------
    ValueError
        The axes are not at right angles, or a length is negative or not finite.
    """
    u, v, w = (np.asarray(width, dtype=np.float64).reshape(-1) for width in widths)
    starts = [np.concatenate(([0.0], np.cumsum(width)[:-1])) for width in (u, v, w)]
    return _checked(Grid(*_frame(corner, axes), (starts[0], starts[1], starts[2]), (u, v, w)))


def regular_grid(corner: ArrayLike, axes: ArrayLike, count: ArrayLike, side: ArrayLike) -> Grid:
    """Return a grid of equal blocks, given their number along each axis and their three sides.

    Raises
    ------
    ValueError
        The axes are not at right angles, a side is negative or not finite, or there are no blocks
        or more than 2**31.
    """
    numbers = [int(n) for n in np.asarray(count).reshape(3)]
    _check_number(numbers)
    lengths = np.asarray(side, dtype=np.float64).reshape(3)
    u, v, w = (np.full(n, d) for n, d in zip(numbers, lengths, strict=True))
    starts = [np.arange(n) * d for n, d in zip(numbers, lengths, strict=True)]
    return _checked(Grid(*_frame(corner, axes), (starts[0], starts[1], starts[2]), (u, v, w)))


def places(shape: Sequence[int], fastest: Literal["u", "w"]) -> Ints:
    """Return the indices (n, 3) of all blocks, in the order in which `fastest` (u or w) runs first.

    Examples
    --------
    >>> places((2, 1, 2), "u").tolist()
    [[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]]
    >>> places((2, 1, 2), "w").tolist()
    [[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1]]
    """
    _check_number(shape)
    numbers = np.arange(int(np.prod(shape)))
    order: Literal["F", "C"] = "F" if fastest == "u" else "C"
    return np.column_stack(np.unravel_index(numbers, shape, order=order)).astype(np.int64)


def with_sides(
    data: Mapping[str, np.ndarray], sides: Floats, ijk: Ints | None = None
) -> dict[str, np.ndarray]:
    """Return a block model's values, followed by its sides (dx, dy, dz) and indices (i, j, k).

    The file's own values take precedence. Sides are not added if the values hold sides under any
    of their usual names; sides or indices are not added if one column of that name exists.
    """
    names = {name.casefold() for name in data}
    out = dict(data)
    if not side_sets(list(data)) and not names & set(_SIDES):
        out |= dict(zip(_SIDES, np.asarray(sides, dtype=np.float64).T, strict=True))
    if ijk is not None and not names & set(_INDICES):
        out |= dict(zip(_INDICES, np.asarray(ijk, dtype=np.int64).T, strict=True))
    return out


def _frame(corner: ArrayLike, axes: ArrayLike) -> tuple[Floats, Floats]:
    """Return a corner and unit axes; raise ValueError unless these are at right angles."""
    rows = np.asarray(axes, dtype=np.float64).reshape(3, 3)
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    if not (np.isfinite(lengths).all() and (lengths > 0).all()):
        raise ValueError("the block model's axes are no directions")
    unit: Floats = rows / lengths
    skew = unit @ unit.T - np.eye(3)
    if (np.abs(skew) > _SQUARE).any():
        raise ValueError("the block model's axes are not at right angles")
    return np.asarray(corner, dtype=np.float64).reshape(3), unit


def _check_number(shape: Sequence[int]) -> None:
    if min(shape) < 1 or math.prod(int(n) for n in shape) > _MOST_BLOCKS:
        raise ValueError(f"a block model of {' x '.join(str(n) for n in shape)} blocks")


def _checked(grid: Grid) -> Grid:
    for width in grid.widths:
        if not len(width) or not np.isfinite(width).all() or (width < 0).any():
            raise ValueError("the block model has no blocks, or sides that are no lengths")
    return grid
