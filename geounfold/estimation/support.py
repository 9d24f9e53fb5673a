"""Blocks that are estimated as the means of points inside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.errors import OptionError, check_numbers
from geounfold.estimation.variogram import Triple
from geounfold.geometry.mesh import Floats


@dataclass(frozen=True, eq=False)
class BlockSupport:
    """Blocks that are estimated as means of points inside them, carried to the unfolded space.

    Attributes
    ----------
    sizes : (float, float, float)
        Sides along the folded x, y and z.
    numbers : (int, int, int)
        Points along each side.
    axes : (m, 3, 3) float
        Images of the folded axes at each block (`support.local_axes`).
    plain : int
        Number of blocks that keep the folded axes along one axis at least.
    """

    sizes: Triple
    numbers: tuple[int, int, int]
    axes: Floats
    plain: int

    @classmethod
    def of(cls, carrier: Any, centres: Floats, sizes: Any, numbers: Any) -> BlockSupport:
        """Return the support of blocks with their centroids, (m, 3), in the folded space.

        Raises
        ------
        OptionError
            A side is not above 0, or a number of points is not a whole number of 1 or more.
        """
        check_numbers("block_size", sizes, 3)
        a, b, c = (float(side) for side in sizes)
        if min(a, b, c) <= 0:
            raise OptionError(f"block_size must have sides above 0, not {a:g}, {b:g}, {c:g}")
        count = tuple(numbers)
        if len(count) != 3 or not all(isinstance(n, int) and 1 <= n <= 20 for n in count):
            raise OptionError(f"discretise must be three whole numbers from 1 to 20, not {numbers}")
        axes, plain = local_axes(carrier, centres, np.array([a, b, c]))
        return cls((a, b, c), (count[0], count[1], count[2]), axes, plain)


def discretised(sizes: Floats, numbers: tuple[int, int, int]) -> Floats:
    """Return the points of a block of sides (3,), from its centre: (q, 3), each in its own cell.

    >>> discretised(np.array([8.0, 4.0, 2.0]), (2, 1, 1)).tolist()
    [[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    """
    along = [(np.arange(n) + 0.5) / n - 0.5 for n in numbers]
    grid = np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, 3)
    out: Floats = grid * sizes
    return out


def local_axes(carrier: Any, centres: Floats, sizes: Floats) -> tuple[Floats, int]:
    """Return what unit steps along the folded axes become in the unfolded space.

    Parameters
    ----------
    carrier : UnfoldingMap or PointwiseMap
        The map.
    centres : (m, 3) float
        Folded centroids.
    sizes : (3,) float
        Sides of the blocks. Each step is the difference of two opposite faces' middles, over the
        side; of a face and the centre where the other face lies outside the map.

    Returns
    -------
    steps : (m, 3, 3) float
        Row k is the image of axis k.
    plain : int
        Number of blocks of which both faces along an axis lie outside the map; these keep the
        folded axis.
    """
    carry = carrier.carry
    middle = carry(centres).points
    steps = np.empty((len(centres), 3, 3))
    plain = np.zeros(len(centres), dtype=bool)
    for axis in range(3):
        half = np.zeros(3)
        half[axis] = 0.5 * sizes[axis]
        ahead, behind = carry(centres + half).points, carry(centres - half).points
        there = [np.isfinite(p).all(axis=1)[:, None] for p in (ahead, behind)]
        span = 0.5 * sizes[axis] * (there[0].astype(float) + there[1])
        difference = np.where(there[0], ahead, middle) - np.where(there[1], behind, middle)
        lost = ~(there[0] | there[1])[:, 0] | ~np.isfinite(middle).all(axis=1)
        steps[:, axis] = np.where(
            lost[:, None], np.eye(3)[axis], difference / np.where(span, span, 1)
        )
        plain |= lost & np.isfinite(middle).all(axis=1)
    return steps, int(plain.sum())
