"""Transfer of values between the blocks of both spaces, weighted by volume.

Every target block is cut into equal parts. The centre of each part is carried to the source's
space and takes the value of the source block that contains it. A target block gets the mean over
its parts. If the map keeps volumes, the transfer keeps the sum of volume times value, except for
parts outside every source block, which are counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geounfold.backends.threads import slices
from geounfold.body.block_model import BlockModel
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats

SPLIT = 4
"""Parts of a block along each axis: 64 in all, a usual discretisation in block kriging."""

_POINTS = 1 << 18  # most parts carried at a time


@dataclass(frozen=True, eq=False)
class Transfer:
    """Values on target blocks.

    Attributes
    ----------
    means : (n, k) float
        Mean over the parts of each block that have a value; NaN where no part has one.
    share : (n, k) float
        Share of each block's parts that have a value, 0 to 1.
    volumes : (n,) float
        Volumes of the target's blocks.
    total : (k,) float
        Sum of volume times value over the source's blocks.
    """

    means: Floats
    share: Floats
    volumes: Floats
    total: Floats

    @property
    def assigned(self) -> Bools:
        """Whether each block has a value, (n, k)."""
        return np.asarray(self.share > 0)

    @property
    def carried(self) -> Floats:
        """Sum of volume times share times value over the target's blocks, (k,), as `total`."""
        known = np.where(self.assigned, self.means, 0.0)
        out: Floats = (self.volumes[:, None] * self.share * known).sum(axis=0)
        return out


def transfer(
    source: BlockModel,
    values: Floats,
    target: BlockModel,
    carry: Callable[[Floats], Floats],
    *,
    split: int = SPLIT,
) -> Transfer:
    """Return a source's values on a target's blocks.

    Parameters
    ----------
    source : BlockModel
        Blocks that have values: a grid estimated in the unfolded space, or folded blocks.
    values : (m, k) float
        Values of the source's blocks; NaN if a block has none.
    target : BlockModel
        The n blocks of the other space.
    carry : callable
        Carries points (p, 3) from the target's space to the source's; NaN if a point has no
        image. ``unfolding.to_flat`` for folded targets, ``to_folded`` for unfolded ones.
    split : int
        Number of parts along each axis of a target block.

    Raises
    ------
    InputError
        The values do not have one row per source block, or a value is infinite.
    OptionError
        The split is below 1.

    Examples
    --------
    >>> from geounfold import BlockModel
    >>> fine = BlockModel(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]]), np.ones((2, 3)))
    >>> coarse = BlockModel(np.array([[1.0, 0.5, 0.5]]), np.array([[2.0, 1.0, 1.0]]))
    >>> transfer(fine, np.array([[1.0], [3.0]]), coarse, lambda points: points).means.tolist()
    [[2.0]]
    """
    given = np.asarray(values, dtype=np.float64)
    if given.ndim != 2 or len(given) != len(source):
        raise InputError(
            f"values must have shape ({len(source)}, k), one row per source block, but have "
            f"{given.shape}"
        )
    if np.isinf(given).any():
        raise InputError("values must be finite, or NaN if a block has none")
    if split < 1:
        raise OptionError(f"split must be 1 or more parts along each axis, not {split}")
    parts = split**3
    out = np.full((len(target), given.shape[1]), np.nan)
    share = np.zeros_like(out)
    for rows in slices(len(target), max(_POINTS // parts, 1)):
        there = carry(target.sub_points(split, rows).reshape(-1, 3))
        home = np.full(len(there), -1, dtype=np.int64)
        placed = np.isfinite(there).all(axis=1)
        home[placed] = source.locate(there[placed])
        found = given[np.maximum(home, 0)]
        found[home < 0] = np.nan
        found = found.reshape(-1, parts, given.shape[1])
        known = ~np.isnan(found)
        count = known.sum(axis=1)
        summed = np.where(known, found, 0.0).sum(axis=1)
        out[rows] = np.divide(summed, count, out=np.full(count.shape, np.nan), where=count > 0)
        share[rows] = count / parts
    total = np.nansum(source.volumes[:, None] * given, axis=0)
    return Transfer(out, share, target.volumes, total)
