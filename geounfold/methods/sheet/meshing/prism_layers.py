"""Prism layers along the mid surface's normals, and the shrinking that keeps them upright."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.measures import lengths, unique_edges
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.prisms import prism_tets

FRACTIONS = (-1.0, -0.6, 0.0, 0.6, 1.0)
"""Heights of the layers as shares of the offset on their side, from the bottom up."""

FINE_FRACTIONS = (-1.0, -0.8, -0.6, -0.3, 0.0, 0.3, 0.6, 0.8, 1.0)
"""The same for refined prisms."""


@dataclass(frozen=True, eq=False)
class Layers:
    """Nodes of the prisms in both spaces, as functions of the offsets per node and side.

    Attributes
    ----------
    P, normal : (n, 3) float
        Mid surface and its unit normals at the footprint's nodes.
    flat : (n, 2) float
        Flattened mid surface.
    slope_up, slope_down : (n, 2) float
        Change of the unfolded position per unit of height above / below the mid surface.
    F : (m, 3) int
        The footprint's triangles.
    curvature : (2, n) float
        Curvature that makes normals converge above (row 0) and below (row 1).
    up, down : (n,) float
        Offsets: heights of the mesh above and below the mid surface.
    fractions : tuple of float
        Heights of the layers as shares of the offset on their side, from -1 at the bottom to 1.
    """

    P: Floats
    normal: Floats
    flat: Floats
    slope_up: Floats
    slope_down: Floats
    F: Ints
    curvature: Floats
    up: Floats
    down: Floats
    fractions: tuple[float, ...] = FRACTIONS

    @property
    def heights(self) -> list[Floats]:
        """Signed height of every layer at every node, bottom first."""
        return [f * (self.up if f >= 0 else self.down) for f in self.fractions]

    @property
    def folded(self) -> Floats:
        """Folded vertices, layer by layer, (layers n, 3)."""
        return np.concatenate([self.P + q[:, None] * self.normal for q in self.heights])

    @property
    def unfolded(self) -> Floats:
        """Unfolded vertices, layer by layer, (layers n, 3); z is the height."""
        return np.concatenate([np.column_stack([self.flat_at(q), q]) for q in self.heights])

    def flat_at(self, height: Floats) -> Floats:
        """Return the unfolded position in the plane (n, 2) at signed heights over the nodes."""
        slope = np.where(height[:, None] >= 0, self.slope_up, self.slope_down)
        out: Floats = self.flat + np.abs(height)[:, None] * slope
        return out

    def tets(self) -> Ints:
        """Return the tetrahedra, right-handed if upright."""
        return prism_tets(self.F, len(self.P), len(self.fractions))


def bounded_slope(values: Floats, U: Floats, F: Ints, slope: float) -> Floats:
    """Return the largest field (n,) below the values whose slope is at most ``slope``.

    Parameters
    ----------
    values : (n,) float
        Values at the nodes of triangles F (m, 3) with places U (n, 2).
    """
    E = unique_edges(F)
    rise = slope * lengths(U, E)
    out = values.copy()
    while True:
        before = out.copy()
        np.minimum.at(out, E[:, 0], before[E[:, 1]] + rise)
        np.minimum.at(out, E[:, 1], before[E[:, 0]] + rise)
        if np.array_equal(out, before):
            return out


def neighbour_mean(F: Ints, n: int) -> sp.csr_array:
    """Return the (n, n) matrix that averages over each node's neighbours."""
    E = unique_edges(F)
    half = sp.coo_array((np.ones(len(E)), (E[:, 0], E[:, 1])), shape=(n, n)).tocsr()
    A = sp.csr_array(half + half.T)
    return sp.csr_array(sp.diags_array(1 / np.maximum(np.asarray(A.sum(axis=1)).ravel(), 1)) @ A)


def shrink(layers: Layers, nodes: Ints, mean: sp.csr_array, factor: float = 0.9) -> Layers:
    """Return the layers with the offsets at some nodes shrunk on the converging side only.

    Neighbours are shrunk half as much, so that the mesh's top and bottom stay smooth.
    """
    offsets = []
    bend = np.stack([layers.curvature[0] * layers.up, layers.curvature[1] * layers.down])
    for side, c in enumerate((layers.up, layers.down)):
        mine, other = bend[side][nodes], bend[1 - side][nodes]
        turn = (mine > 0.3) | (mine > other + 0.1) | ((mine <= 0.3) & (other <= 0.3))
        f = np.ones(len(c))
        f[nodes[turn]] = factor
        f = np.minimum(f, 1 - mean @ (1 - f))
        offsets.append(np.maximum(c * f, 0.05))
    return replace(layers, up=offsets[0], down=offsets[1])
