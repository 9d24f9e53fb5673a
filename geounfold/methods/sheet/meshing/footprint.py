"""The triangulated footprint of the blocks in the mid surface's parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi

from geounfold.errors import ControlMeshError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods.sheet.mid_surface.surface import MidSurface, normals, second_form


@dataclass(frozen=True, eq=False)
class Ring:
    """Cells around a footprint, cut into triangles.

    Attributes
    ----------
    U : (r, 2) float
        Parameters of the ring's own nodes.
    F : (k, 3) int
        Triangles over the footprint's nodes, then the ring's.
    """

    U: Floats
    F: Ints


@dataclass(frozen=True, eq=False)
class Footprint:
    """Square cells of the parameter plane that hold feet of blocks, each cut into two triangles.

    Attributes
    ----------
    U : (n, 2) float
        Parameters of the nodes.
    F : (m, 3) int
        Triangles, counter-clockwise; no two parts touch only in a corner.
    weight : (n,) float
        Number of blocks around each node, capped at the median; weights of the registration.
    of_cell : (m,) int
        Flat index of every triangle's cell.
    held : (m,) bool
        Whether that cell holds feet.
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
    ring : Ring
        The cells around them.
    """

    U: Floats
    F: Ints
    weight: Floats
    of_cell: Ints
    held: Bools
    cell_of: Ints
    node: Ints
    shape: tuple[int, int]
    axes: Floats
    cell: float
    ring: Ring

    def without(self, nodes: Ints) -> Footprint:
        """Return the footprint with its empty cells at some nodes given to the ring."""
        cells = np.zeros(self.shape, dtype=bool)
        dropped = ~self.held & np.isin(self.F, nodes).any(axis=1)
        cells.ravel()[self.of_cell] = True
        cells.ravel()[self.of_cell[dropped]] = False
        kept = _widened(cells, 0).ravel()[self.of_cell]
        ring = Ring(self.ring.U, np.concatenate([self.F[~kept], self.ring.F]))
        return replace(
            self, F=self.F[kept], of_cell=self.of_cell[kept], held=self.held[kept], ring=ring
        )

    def at_nodes(self, cells: Floats, reach: int) -> Floats:
        """Return a cell field as a smooth upper bound at the nodes, (n,).

        A maximum filter of radius ``reach`` cells, then a mean filter no wider, so the bound holds.
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


def principal_direction(sheet: MidSurface, U: Floats) -> float:
    """Return the mean direction of principal curvature over U (n, 2), radians."""
    jet = sheet.jet(U)
    L, M, N = second_form(jet, normals(jet))
    size = np.hypot(L - N, 2 * M)
    return 0.5 * float(np.arctan2((2 * M * size).sum(), ((L - N) * size).sum()))


def _triangles(cells: Bools) -> Ints:
    """Return two triangles per set cell over the node grid, diagonals alternating.

    The first triangle of every cell comes first, in the order of the cells, then the second.
    """
    i, j = np.nonzero(cells)
    width = cells.shape[1] + 1
    a, b = i * width + j, (i + 1) * width + j
    d, c = a + 1, b + 1
    even = ((i + j) % 2 == 0)[:, None]
    first = np.where(even, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(even, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.concatenate([first, second])


_CORNERED = (np.array([[1, 0], [0, 1]], dtype=bool), np.array([[0, 1], [1, 0]], dtype=bool))
_SQUARE = np.ones((3, 3), dtype=bool)


def _widened(cells: Bools, rings: int) -> Bools:
    """Return cells with rings of others around them; corners that alone connect cells are filled.

    Cells that touch only in a corner would make a mesh whose border is no manifold.
    """
    out = np.asarray(ndi.binary_dilation(cells, _SQUARE, iterations=rings)) if rings else cells
    while True:
        fill = np.zeros_like(out)
        for pattern in _CORNERED:
            at = ndi.binary_hit_or_miss(out, pattern, ~pattern, origin1=-1, origin2=-1)
            for i, j in np.argwhere(~pattern):
                fill |= np.roll(at, (i, j), axis=(0, 1))
        if not fill.any():
            return out
        out = out | fill


def footprint(U: Floats, angle: float, cell: float, dilation: int, rings: int = 0) -> Footprint:
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
    rings : int
        Rings of cells around these, returned as ``ring``.

    Raises
    ------
    ControlMeshError
        The cells are not connected.
    """
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    V = U @ turn
    margin = dilation + rings + 1
    low = V.min(axis=0) - (1.63 + margin) * cell  # keeps feet off the cells' edges
    shape = np.ceil((V.max(axis=0) - low) / cell).astype(int) + 2 + margin
    at = np.floor((V - low) / cell).astype(np.int64)
    count = np.bincount(at[:, 0] * shape[1] + at[:, 1], minlength=shape.prod()).reshape(shape)
    held = count > 0
    cells = _widened(held, dilation)
    parts = int(np.max(ndi.label(cells)[0]))
    if parts > 1:
        raise ControlMeshError(
            f"the blocks lie on the fitted mid surface in {parts} parts that do not touch: bodies "
            "of their own, or one too ragged or narrow for its thickness; unfold them one by one, "
            "or try another --hull"
        )
    node, F = np.unique(_triangles(cells), return_inverse=True)
    capped = np.pad(np.minimum(count, np.median(count[held])).astype(float), 1)
    around = capped[:-1, :-1] + capped[1:, :-1] + capped[:-1, 1:] + capped[1:, 1:]

    def places(nodes: Ints) -> Floats:
        i, j = np.divmod(nodes, shape[1] + 1)
        out: Floats = (low + cell * np.stack([i, j], axis=1)) @ turn.T
        return out

    extra = _triangles(_widened(cells, rings) & ~cells)
    fresh = np.setdiff1d(extra, node)
    number = np.zeros((shape + 1).prod(), dtype=np.int64)
    number[node], number[fresh] = np.arange(len(node)), len(node) + np.arange(len(fresh))
    return Footprint(
        U=places(node),
        F=F.reshape(-1, 3),
        weight=around.ravel()[node],
        of_cell=np.tile(np.flatnonzero(cells), 2),
        held=np.tile(held[cells], 2),
        cell_of=at,
        node=node,
        shape=(int(shape[0]), int(shape[1])),
        axes=turn.T,
        cell=cell,
        ring=Ring(places(fresh), number[extra]),
    )
