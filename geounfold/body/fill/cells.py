"""The cells of a lattice whose centres lie inside: large cells away from the surface at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geounfold.geometry.mesh import Bools, Floats, Ints

Inside = Callable[[Floats], Bools]
"""Whether points (k, 3) lie inside, (k,)."""

Distance = Callable[[Floats], Floats]
"""A distance of points (k, 3) within which all points lie on the same side, (k,)."""

_NUDGE = 1e-6 * np.array([1.0, 0.71, 0.43])
"""Move of a centre before it is tested, in cells.

Of two cells that touch in a plane face of the solid one then counts as inside, not both or neither.
"""

_FIRST = 4096  # cells of the coarsest grid
_CHUNK = 1 << 18  # cells tested at a time


@dataclass(frozen=True, eq=False)
class Cells:
    """A lattice of cells.

    Attributes
    ----------
    step : (3,) float
        Sides of a cell; cell k has its centre at ``origin + ((k + 0.5) * step) @ axes``.
    origin : (3,) float
        A corner of cells.
    axes : (3, 3) float
        Directions of the sides as rows, a rotation of the world's axes.
    """

    step: Floats
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    axes: Floats = field(default_factory=lambda: np.eye(3))

    def parted(self, parts: int) -> Cells:
        """Return the lattice of cells with sides cut into ``parts``."""
        return Cells(self.step / parts, self.origin, self.axes)

    def places(self, at: NDArray[np.floating[Any]]) -> Floats:
        """Return the world coordinates of places given in cells, (k, 3)."""
        if (self.axes == np.eye(3)).all():  # exact: no sum of rounded products
            return np.asarray(self.origin + at * self.step)
        return np.asarray(self.origin + (at * self.step) @ self.axes)

    def centres(self, index: Ints) -> Floats:
        """Return the centres of cells (k, 3)."""
        return self.places(index + 0.5)

    def around(self, V: Floats) -> tuple[Ints, Ints]:
        """Return the first and last cell of a box around points, (3,) each, one cell wider."""
        own = (V - self.origin) @ self.axes.T / self.step
        low, high = np.floor(own.min(axis=0)) - 1, np.floor(own.max(axis=0)) + 1
        return low.astype(np.int64), high.astype(np.int64)

    def test(self, index: Ints, inside: Inside, size: int = 1) -> Bools:
        """Return whether the centres of cells, or of cubes of ``size`` cells, lie inside, (k,)."""
        out = np.zeros(len(index), dtype=bool)
        for start in range(0, len(index), _CHUNK):
            rows = slice(start, start + _CHUNK)
            out[rows] = inside(self.places(index[rows] + size / 2 + _NUDGE * size))
        return out

    def cut(self, index: Ints, size: int, far: Distance) -> Bools:
        """Return which cubes of ``size`` cells the surface may cut, (k,); no single cell counts."""
        out = np.zeros(len(index), dtype=bool)
        half = size * float(np.linalg.norm(self.step)) / 2
        for start in range(0, len(index) if size > 1 else 0, _CHUNK):
            rows = slice(start, start + _CHUNK)
            out[rows] = far(self.places(index[rows] + size / 2)) <= half
        return out


def cells_inside(cells: Cells, around: Floats, inside: Inside, far: Distance) -> Ints:
    """Return the cells whose centres lie inside, (k, 3), in lexicographic order.

    Parameters
    ----------
    cells : Cells
        The lattice.
    around : (n, 3) float
        Points whose box holds the solid.
    inside, far : callable
        See Inside and Distance.
    """
    first, last = cells.around(around)
    extent = last - first + 1
    size = 1
    while np.prod(-(-extent // size).astype(float)) > _FIRST and size < extent.max():
        size *= 2
    corners = np.array(list(np.ndindex(*(-(-extent // size)).tolist())), dtype=np.int64)
    index = first + size * corners
    found = []
    while True:
        cut = cells.cut(index, size, far)
        whole = index[~cut]
        found.append(_children(whole[cells.test(whole, inside, size)], size))
        if not cut.any():
            break
        size //= 2
        index = _children(index[cut], 2, size)
    out = np.concatenate(found)
    return np.asarray(out[np.lexsort(out.T[::-1])], dtype=np.int64)


def _children(index: Ints, parts: int, step: int = 1) -> Ints:
    """Return the cells of cubes of ``parts`` steps a side that begin at cells (k, 3)."""
    offsets = step * np.array(list(product(range(parts), repeat=3)), dtype=np.int64)
    out: Ints = (index[:, None] + offsets).reshape(-1, 3)
    return out
