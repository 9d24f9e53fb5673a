"""Blocks as boxes of given sizes: the block that holds a point, and regular grids of blocks."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.measures import sorted_distinct
from geounfold.geometry.mesh import Floats, Ints

ROUNDING = 1e-6
"""Share of a block's side by which a point may lie outside, because coordinates are rounded."""

MOST_CELLS = 50_000_000
"""Number of blocks above which a regular grid is refused."""

_SHARING = 4096  # blocks in one grid cell above which they are no block model


@dataclass(frozen=True, eq=False)
class BlockModel:
    """Boxes of any sizes whose edges are parallel to three common axes.

    Attributes
    ----------
    centroids : (n, 3) float
        World coordinates.
    sizes : (n, 3) float
        Sides along the model's own axes, in the same unit.
    axes : (3, 3) float
        The model's own axes as rows, a rotation of the world's.
    """

    centroids: Floats
    sizes: Floats
    axes: Floats = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        if self.centroids.ndim != 2 or self.centroids.shape[1] != 3:
            raise InputError(f"centroids must have shape (n, 3), but have {self.centroids.shape}")
        if self.sizes.shape != self.centroids.shape:
            raise InputError(
                f"sizes must have shape {self.centroids.shape}, but have {self.sizes.shape}"
            )
        if not np.isfinite(self.centroids).all():
            raise InputError("centroids must be finite")
        bad = np.flatnonzero(~(np.isfinite(self.sizes) & (self.sizes > 0)).all(axis=1))
        if len(bad):
            raise InputError(
                f"sizes must be positive lengths, but those of data row {bad[0] + 1} are "
                f"{', '.join(f'{s:g}' for s in self.sizes[bad[0]])} ({len(bad)} such rows)"
            )

    def __len__(self) -> int:
        return len(self.centroids)

    @property
    def volumes(self) -> Floats:
        """Volume of every block, (n,)."""
        out: Floats = np.prod(self.sizes, axis=1)
        return out

    @cached_property
    def _reference(self) -> Floats:
        """The middle of the blocks, (3,); coordinates relative to it are small."""
        out: Floats = (self.centroids.min(axis=0) + self.centroids.max(axis=0)) / 2
        return out

    def to_own(self, points: Floats) -> Floats:
        """Return points (m, 3) along the model's own axes, relative to the middle of the blocks."""
        out: Floats = (points - self._reference) @ self.axes.T
        return out

    def sub_points(self, split: int, rows: slice) -> Floats:
        """Return the centres of the ``split**3`` equal parts of some blocks.

        Parameters
        ----------
        split : int
            Parts along each axis.
        rows : slice
            Rows of the blocks, r of them.

        Returns
        -------
        (r, split**3, 3) float
        """
        steps = (np.arange(split) + 0.5) / split - 0.5
        offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
        own = offsets[None] * self.sizes[rows, None, :]
        out: Floats = self.centroids[rows, None, :] + own @ self.axes
        return out

    def locate(self, points: Floats) -> Ints:
        """Return the row of the block that holds each point; -1 for a point in no block.

        Parameters
        ----------
        points : (m, 3) float
            World coordinates.

        Returns
        -------
        (m,) int
            If several blocks hold a point, as on a common face, the one lowest along the model's x
            axis (then y, z), for every order of the rows.
        """
        own = self.to_own(np.asarray(points, dtype=np.float64))
        out = np.full(len(own), len(self), dtype=np.int64)
        for group in self._size_groups:
            out = np.minimum(out, group.locate(own))
        found = out < len(self)
        out[found] = self._order[out[found]]
        out[~found] = -1
        return out

    @cached_property
    def _order(self) -> Ints:
        """The rows from the lowest block along the axes to the highest, (n,)."""
        out: Ints = np.lexsort(self.to_own(self.centroids).T[::-1])
        return out

    @cached_property
    def _size_groups(self) -> list[_SizeGroup]:
        """The blocks by size; sizes in one group differ at most by a factor of two."""
        sizes = self.sizes[self._order]
        centres = self.to_own(self.centroids[self._order])
        level = np.floor(np.log2((sizes.max(axis=0) / sizes).max(axis=1)) + 1e-9).astype(np.int64)
        return [
            _SizeGroup(np.flatnonzero(level == k), centres, sizes)
            for k in sorted_distinct(level).tolist()
        ]


class _SizeGroup:
    """Blocks of similar size, sorted into a grid whose cells are as large as the largest of them.

    Parameters
    ----------
    rows : (k,) int
        Rows of the blocks, ascending.
    centres, sizes : (n, 3) float
        Of all blocks, along the model's own axes.
    """

    def __init__(self, rows: Ints, centres: Floats, sizes: Floats) -> None:
        self._centres, self._half = centres, sizes * (0.5 + ROUNDING)
        self._cell = sizes[rows].max(axis=0)
        low, high = (centres[rows] - self._half[rows]), (centres[rows] + self._half[rows])
        self._origin = low.min(axis=0)
        first, last = self._index(low), self._index(high)
        self._shape = last.max(axis=0) + 1
        cells, owners = [], []
        for step in np.ndindex(*(last - first + 1).max(axis=0)):
            here = first + np.array(step)
            there = (here <= last).all(axis=1)
            cells.append(self._key(here[there]))
            owners.append(rows[there])
        cell, owner = np.concatenate(cells), np.concatenate(owners)
        order = np.lexsort((owner, cell))
        self._owner = owner[order]
        self._cells, self._first, self._count = np.unique(
            cell[order], return_index=True, return_counts=True
        )
        if self._count.max() > _SHARING:
            raise InputError(
                f"{self._count.max()} blocks lie in one place, so they are not blocks of a model"
            )

    def _index(self, own: Floats) -> Ints:
        out: Ints = np.floor((own - self._origin) / self._cell).astype(np.int64)
        return out

    def _key(self, index: Ints) -> Ints:
        out: Ints = (index[:, 0] * self._shape[1] + index[:, 1]) * self._shape[2] + index[:, 2]
        return out

    def locate(self, own: Floats) -> Ints:
        """Return the first block of the group that holds each point; len(centres) for none."""
        out = np.full(len(own), len(self._centres), dtype=np.int64)
        index = self._index(own)
        inside = np.flatnonzero(((index >= 0) & (index < self._shape)).all(axis=1))
        key = self._key(index[inside])
        at = np.minimum(np.searchsorted(self._cells, key), len(self._cells) - 1)
        found = self._cells[at] == key
        rows, at = inside[found], at[found]
        rank = 0
        while len(rows):
            there = rank < self._count[at]
            rows, at = rows[there], at[there]
            block = self._owner[self._first[at] + rank]
            held = (np.abs(own[rows] - self._centres[block]) <= self._half[block]).all(axis=1)
            out[rows[held]] = block[held]
            rows, at = rows[~held], at[~held]
            rank += 1
        return out


def regular_grid(points: Floats, sizes: Floats) -> BlockModel:
    """Return a regular grid of equal blocks that covers points, along the world's axes.

    Its faces lie at whole multiples of the sides, so that grids of one size fit each other.

    Parameters
    ----------
    points : (n, 3) float
        Points to cover, such as the unfolded blocks; rows with NaN (no image) are skipped.
    sizes : (3,) float
        Sides of a block.

    Raises
    ------
    InputError
        Sides are not positive, no point is finite, or the grid has more than MOST_CELLS blocks.

    Examples
    --------
    >>> grid = regular_grid(np.array([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5]]), np.ones(3))
    >>> grid.centroids.tolist()
    [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.5, 0.5]]
    """
    sides = np.asarray(sizes, dtype=np.float64)
    if sides.shape != (3,) or not (np.isfinite(sides) & (sides > 0)).all():
        raise InputError("a grid's blocks need three positive sides")
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        raise InputError(
            "no point has finite coordinates, so there is nothing to cover with a grid"
        )
    first = np.floor(finite.min(axis=0) / sides).astype(np.int64)
    count = np.maximum(np.ceil(finite.max(axis=0) / sides).astype(np.int64) - first, 1)
    if np.prod(count.astype(np.float64)) > MOST_CELLS:
        raise InputError(
            f"a grid of {' x '.join(map(str, count))} blocks has more than {MOST_CELLS:,} of "
            "them; take larger blocks"
        )
    ticks = [(first[i] + np.arange(count[i]) + 0.5) * sides[i] for i in range(3)]
    z, y, x = np.meshgrid(ticks[2], ticks[1], ticks[0], indexing="ij")  # x fastest, as in GSLIB
    centroids = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return BlockModel(centroids, np.broadcast_to(sides, centroids.shape).copy())
