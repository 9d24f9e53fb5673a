"""Top and bottom as heights over the flat mid surface, for the stratigraphic coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.mesh import Floats
from geounfold.sheet.fit import RIDGE, FittedSheet, Samples, unbiased_heights
from geounfold.sheet.spline import SplineGrid, density_weights
from geounfold.sheet.surface import near_any


@dataclass(frozen=True, kw_only=True)
class HorizonOptions:
    """How top and bottom are fitted; lengths in blocks.

    ``smooth``: smoothing length of the heights; ``agree``: least cosine between a hull normal
    and the mid surface's, below which a sample is rim; ``erosion``: distance kept from the
    rim, where hulls are rounded; ``misfit``: largest departure from the half thickness;
    ``stiffness``: pull towards the half thickness where there are no samples.
    """

    smooth: float = 1.5
    agree: float = 0.9
    erosion: float = 0.5
    misfit: float = 2.5
    stiffness: float = 1e-4


@dataclass(frozen=True, eq=False)
class Horizons:
    """Heights of the hanging wall and the footwall over the flat mid surface.

    Attributes
    ----------
    grid : SplineGrid
        Basis in the unfolded parameters u = U - t slip(U).
    top, bottom : (grid.size,) float
        Coefficients of the signed heights of top and bottom.
    """

    grid: SplineGrid
    top: Floats
    bottom: Floats

    def heights(self, u: Floats) -> tuple[Floats, Floats]:
        """Return the bottom's and the top's height at u (n, 2); at least 0.3 block apart."""
        top, bottom = self.grid.value(self.top, u), self.grid.value(self.bottom, u)
        return bottom, np.maximum(top, bottom + 0.3)

    def crossings(self, U: Floats, slip: Floats, limit: float) -> tuple[Floats, Floats]:
        """Return where normals of the mid surface at U (n, 2) meet bottom and top, (n,) each.

        ``slip`` (n, 2): slip per height there; solves t = height(U - t slip) by Newton's
        method.  Past the blocks, where heights are continued, t stays within the limit.
        """
        found = []
        for C in (self.bottom, self.top):
            t = np.clip(self.grid.value(C, U), -limit, limit)
            for _ in range(8):
                height, hu, hv = self.grid.gradient(C, U - t[:, None] * slip)
                rate = 1 + hu * slip[:, 0] + hv * slip[:, 1]
                t = np.clip(t - (t - height) / np.maximum(rate, 0.3), -limit, limit)
            found.append(t)
        return found[0], np.maximum(found[1], found[0] + 0.3)


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
    rim = near_any(samples.points, np.abs(cos) < options.agree, options.erosion)
    nodes, _ = sheet.samples()
    P = grid.basis(nodes)
    sampled = grid.gram(P, np.ones(len(nodes)))
    half = sampled.solver(RIDGE)(P.T @ np.maximum(grid.value(fitted.half, nodes), 0.2))
    bending = (options.smooth / knots) ** 4 * grid.energy(2)
    still = bending + options.stiffness * sampled
    found = []
    for s in (1.0, -1.0):
        reach = fitted.reach(s, half)
        expected = grid.value(reach, flat)
        use = (foot.miss < 0.1) & (side == s) & ~rim
        use &= np.abs(s * foot.t - expected) < options.misfit
        B = grid.basis(flat[use])
        w = density_weights(flat[use], knots) if use.any() else np.empty(0)
        K = grid.gram(B, w) + still
        rest = K.solver(ridge=1e-12)(B.T @ (w * (height[use] - s * expected[use])))
        found.append(rest + s * reach)
    return Horizons(grid, found[0], found[1])
