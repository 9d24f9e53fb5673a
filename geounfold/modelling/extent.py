"""How far a body reaches along its layer: beyond its intercepts, short of barren holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import Delaunay, QhullError, cKDTree

from geounfold.geometry.mesh import Bools, Floats, Ints

_WIDEST = 4.0  # spacings: a limb that inclined holes leave open is three of them wide
_MOST_NODES = 4_000_000


@dataclass(frozen=True, eq=False)
class Grid:
    """A regular grid of places along the layer.

    Attributes
    ----------
    origin : (2,) float
        Place of the first node.
    step : float
        Distance between nodes.
    shape : (int, int)
        Number of nodes along the two axes.
    """

    origin: Floats
    step: float
    shape: tuple[int, int]

    @property
    def places(self) -> Floats:
        """Places of all nodes, (n, 2), the second axis fastest."""
        i, j = np.divmod(np.arange(self.shape[0] * self.shape[1]), self.shape[1])
        return np.asarray(self.origin + self.step * np.column_stack([i, j]))

    def nearest(self, places: Floats) -> tuple[Ints, Bools]:
        """Return the nearest node of places (n, 2), and whether the grid reaches them."""
        ij = np.rint((places - self.origin) / self.step).astype(np.int64)
        there = ((ij >= 0) & (ij < self.shape)).all(axis=1)
        ij = np.clip(ij, 0, np.array(self.shape) - 1)
        return np.asarray(ij[:, 0] * self.shape[1] + ij[:, 1]), np.asarray(there)

    def between(self, values: Floats, places: Floats) -> Floats:
        """Return values (n,) at places (n, 2) on the grid, bilinear between nodes."""
        x = (places - self.origin) / self.step
        low = np.clip(np.floor(x).astype(np.int64), 0, np.maximum(np.array(self.shape) - 2, 0))
        f, g = np.clip(x - low, 0.0, 1.0).T
        table = values.reshape(self.shape)
        i, j = low.T
        k, m = np.minimum(i + 1, self.shape[0] - 1), np.minimum(j + 1, self.shape[1] - 1)
        lower = table[i, j] * (1 - g) + table[i, m] * g
        upper = table[k, j] * (1 - g) + table[k, m] * g
        return np.asarray(lower * (1 - f) + upper * f)


def grid_over(places: Floats, margin: float, step: float) -> Grid:
    """Return a grid over places (n, 2) and a margin; a step that is too fine is enlarged."""
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    step = max(step, float(np.sqrt(np.prod(high - low) / _MOST_NODES)))
    a, b = (np.ceil((high - low) / step).astype(np.int64) + 1).tolist()
    return Grid(low, step, (a, b))


def spacing_of(places: Floats) -> float:
    """Return the holes' spacing: the median edge of the triangles between intercepts (m, 2).

    On a square grid that is its side; on lines of holes it is nearer to the distance of the lines.
    """
    try:
        corners = Delaunay(places).simplices
    except QhullError:
        near = np.asarray(cKDTree(places).query(places, k=2)[0])
        return float(np.median(near[:, 1]))
    edges = np.unique(np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    return float(np.median(length))


def covered(grid: Grid, ore: Floats, barren: Floats, spacing: float, extent: float) -> Bools:
    """Return which nodes the body covers, (n,).

    The triangles between intercepts, and what lies within the extent of these, are covered. A
    triangle with an edge above four spacings is none: nothing is known of so wide a gap. A node
    nearer to a barren hole than to an intercept is not covered.

    Parameters
    ----------
    grid : Grid
        Must reach beyond the intercepts by more than the extent.
    ore, barren : (m, 2) float
        Places where holes cross the layer, with and without an intercept.
    spacing, extent : float
        The holes' spacing, and how far the body reaches beyond them.
    """
    places = grid.places
    away = np.asarray(cKDTree(ore).query(places)[0])
    between = away <= 0.5 * grid.step * np.sqrt(2)
    try:
        triangles = Delaunay(ore)
    except QhullError:  # all on one line
        pass
    else:
        corners = ore[triangles.simplices]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        number = triangles.find_simplex(places)
        between |= (number >= 0) & (edges <= _WIDEST * spacing)[number]
    beyond = np.asarray(distance_transform_edt(~between.reshape(grid.shape))).ravel()
    out: Bools = np.asarray(beyond * grid.step <= extent)
    if len(barren):
        out &= away <= np.asarray(cKDTree(barren).query(places)[0])
    return out
