"""The triangulated footprint of the blocks in the mid surface's parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi

from geounfold.mesh import Bools, Floats, Ints
from geounfold.sheet.surface import Sheet, normals, second_form


@dataclass(frozen=True, eq=False)
class Footprint:
    """Square cells of the parameter plane that hold feet of blocks, cut into triangles.

    Attributes
    ----------
    U : (n, 2) float
        Parameters of the nodes.
    F : (m, 3) int
        Triangles, counter-clockwise.
    weight : (n,) float
        Number of blocks around each node, capped at the median: weights of registrations.
    cell_of : (b, 2) int
        Cell of every block's foot.
    node : (n,) int
        Flat index of every node in the (shape + 1) node grid.
    shape : (int, int)
        Number of cells along each axis.
    axes : (2, 2) float
        Unit directions of the cells' sides, as rows.
    cell : float
        Side of the cells.
    """

    U: Floats
    F: Ints
    weight: Floats
    cell_of: Ints
    node: Ints
    shape: tuple[int, int]
    axes: Floats
    cell: float

    def at_nodes(self, cells: Floats, reach: int) -> Floats:
        """Return a cell field as a smooth upper bound at the nodes, (n,).

        A maximum filter of radius ``reach`` cells, then a mean filter it dominates.
        """
        top = ndi.maximum_filter(cells, 2 * reach + 1)
        padded = np.pad(top, ((0, 1), (0, 1)), mode="edge")
        grid = ndi.maximum_filter(padded, (2, 2))
        return np.asarray(ndi.uniform_filter(grid, 2 * reach - 1).ravel()[self.node])

    def cell_max(self, values: Floats, use: Bools) -> Floats:
        """Return the largest value (at least 0) per block in each cell, shape ``shape``."""
        out = np.zeros(self.shape)
        np.maximum.at(out, (self.cell_of[use, 0], self.cell_of[use, 1]), values[use])
        return out


def principal_direction(sheet: Sheet, U: Floats) -> float:
    """Return the mean direction of principal curvature over U (n, 2), radians."""
    jet = sheet.jet(U)
    L, M, N = second_form(jet, normals(jet))
    size = np.hypot(L - N, 2 * M)
    return 0.5 * float(np.arctan2((2 * M * size).sum(), ((L - N) * size).sum()))


def _triangles(cells: Bools) -> Ints:
    """Return two triangles per set cell over the node grid, diagonals alternating."""
    i, j = np.nonzero(cells)
    width = cells.shape[1] + 1
    a, b = i * width + j, (i + 1) * width + j
    d, c = a + 1, b + 1
    even = ((i + j) % 2 == 0)[:, None]
    first = np.where(even, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(even, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.concatenate([first, second])


def footprint(U: Floats, angle: float, cell: float, dilation: int) -> Footprint:
    """Return the footprint of feet U (b, 2) on a square grid turned by an angle.

    Parameters
    ----------
    U : (b, 2) float
        Feet of the blocks.
    angle : float
        Direction of the grid's first axis, radians.
    cell : float
        Side of the cells.
    dilation : int
        Rings of cells added around those that hold feet.
    """
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    V = U @ turn
    low = V.min(axis=0) - (2.63 + dilation) * cell  # no foot on a cell's very edge
    shape = np.ceil((V.max(axis=0) - low) / cell).astype(int) + 3 + dilation
    at = np.floor((V - low) / cell).astype(np.int64)
    count = np.bincount(at[:, 0] * shape[1] + at[:, 1], minlength=shape.prod()).reshape(shape)
    held = count > 0
    cells = ndi.binary_dilation(held, iterations=dilation, structure=np.ones((3, 3), dtype=bool))
    node, F = np.unique(_triangles(np.asarray(cells)), return_inverse=True)
    i, j = np.divmod(node, shape[1] + 1)
    nodes = (low + cell * np.stack([i, j], axis=1)) @ turn.T
    capped = np.pad(np.minimum(count, np.median(count[held])).astype(float), 1)
    around = capped[:-1, :-1] + capped[1:, :-1] + capped[:-1, 1:] + capped[1:, 1:]
    weight = around.ravel()[node]
    extent = (int(shape[0]), int(shape[1]))
    return Footprint(nodes, F.reshape(-1, 3), weight, at, node, extent, turn.T, cell)
