"""Top and bottom as heights over the mid surface, for the stratigraphic coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from geounfold.mesh import Floats
from geounfold.sheet.fit import FittedSheet, Samples, unbiased_heights
from geounfold.sheet.spline import SplineGrid, density_weights, spd_solver


@dataclass(frozen=True, kw_only=True)
class HorizonOptions:
    """How top and bottom are fitted; lengths in blocks.

    ``smooth``: smoothing length of the heights; ``agree``: least cosine between a hull normal
    and the mid surface's; ``misfit``: largest departure from the half thickness.
    """

    smooth: float = 1.5
    agree: float = 0.6
    misfit: float = 2.5


@dataclass(frozen=True, eq=False)
class Horizons:
    """Heights of the hanging wall and the footwall over the mid surface's parameters.

    Attributes
    ----------
    grid : SplineGrid
        Basis in U.
    top, bottom : (grid.size,) float
        Coefficients of the signed offsets of top and bottom along the mid surface's normal.
    """

    grid: SplineGrid
    top: Floats
    bottom: Floats

    def heights(self, U: Floats) -> tuple[Floats, Floats]:
        """Return the bottom's and the top's offset at U (n, 2); at least 0.3 block apart."""
        top, bottom = self.grid.value(self.top, U), self.grid.value(self.bottom, U)
        return bottom, np.maximum(top, bottom + 0.3)


def fit_horizons(
    fitted: FittedSheet, samples: Samples, knots: float, options: HorizonOptions
) -> Horizons:
    """Return the height fields of top and bottom fitted to the hull (see Horizons)."""
    sheet, grid = fitted.sheet, fitted.sheet.grid
    foot = sheet.search().feet(samples.points)
    cos = np.einsum("ij,ij->i", samples.normals, foot.normal)
    side = np.sign(cos)
    height = unbiased_heights(sheet, foot, side, samples)
    flat = foot.U - foot.t[:, None] * grid.value(fitted.slip, foot.U)
    expected = np.maximum(grid.value(fitted.half, flat), 0.2)
    bending = grid.energy(2)
    nodes, _ = sheet.samples()
    P = grid.basis(nodes)
    prior = np.maximum(P @ fitted.half, 0.2)
    heights = []
    for s in (1.0, -1.0):
        use = (foot.miss < 0.1) & (s * cos > options.agree)
        use &= np.abs(s * foot.t - expected) < options.misfit
        B = grid.basis(foot.U[use])
        w = density_weights(foot.U[use], knots) if use.any() else np.empty(0)
        K = B.T @ sp.diags_array(w) @ B + (options.smooth / knots) ** 4 * bending + 1e-6 * (P.T @ P)
        rhs = B.T @ (w * height[use]) + 1e-6 * (P.T @ (s * prior))
        heights.append(spd_solver(K + 1e-12 * sp.eye_array(grid.size))(rhs))
    return Horizons(grid, heights[0], heights[1])
