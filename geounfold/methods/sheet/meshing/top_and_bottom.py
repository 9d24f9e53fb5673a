"""Top and bottom as heights over the flat mid surface, for the stratigraphic coordinate.

Both are fitted to the hull.  On a lattice they are then moved until they separate blocks from empty
sites, like the sheet before (`sharpening.by_lattice_sites`).  The sites do not fix the heights
everywhere, for example not on limbs along a lattice plane; there the heights of the hull are kept.
A sheet of a few blocks is no thicker than the blur of the hull: its start is the sharpened half
thickness instead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.geometry.mesh import Floats, Ints
from geounfold.methods.sheet.mid_surface.fit import (
    RIDGE,
    FittedSheet,
    HullSamples,
    unbiased_heights,
)
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils
from geounfold.methods.sheet.mid_surface.spline import SplineGrid, density_weights
from geounfold.methods.sheet.mid_surface.surface import near_any
from geounfold.methods.sheet.sharpening.by_lattice_sites import separating_step
from geounfold.methods.sheet.sharpening.lattice_sites import Sites
from geounfold.methods.sheet.sharpening.site_places import Places
from geounfold.methods.sheet.sharpening.site_rules import DEPTHS, PINCHED, SiteRules

_SMOOTH = 1.5
"""Smoothing length of the heights, in blocks."""

_AGREE = 0.9
"""Cosine between a hull normal and the mid surface's below which a hull vertex is rim."""

_EROSION = 0.5
"""Distance kept from the rim, in blocks, because hulls are rounded there."""

CLOSE, BOLD = 2.5, 40.0
"""Departure from the half thickness, in blocks, above which a hull vertex is not used.

The close limit leaves out flanks, branches and waste, and with them bulges.  Mean error of the
stratigraphic coordinate, close and bold, as measured: thickness x5 within ten blocks 0.43 and 0.02,
a fold with thick hinges 0.165 and 0.054, a layer with waste lenses 0.011 and 0.039.
"""

_STIFFNESS = 1e-4
"""Weight that draws the heights to the half thickness far from hull vertices."""

_SEPARATE = 1.5
"""Smoothing length of the change of the heights by the lattice sites, in blocks."""

_MARGINS = (0.1, 0.1, 0.06, 0.04, 0.03, 0.02)
"""Softness of the separation in each round, in blocks."""

_BLURRED = 2.0
"""Half thickness, in blocks, up to which the heights of the hull are not used.

From one block more on they have full weight.
"""


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

    def scaled(self, factor: float) -> Horizons:
        """Return the horizons in another unit: lengths times a factor."""
        return Horizons(self.grid.scaled(factor), self.top * factor, self.bottom * factor)

    def heights(self, u: Floats) -> tuple[Floats, Floats]:
        """Return the bottom's and the top's height at u (n, 2); at least 0.3 block apart."""
        top, bottom = self.grid.value(self.top, u), self.grid.value(self.bottom, u)
        return bottom, np.maximum(top, bottom + 0.3)

    def crossings(self, U: Floats, slip: Floats, limit: float) -> tuple[Floats, Floats]:
        """Return the heights at which normals at U (n, 2) meet bottom and top, (n,) each.

        ``slip`` (n, 2) is the slip per height there.  Newton's method solves t = height(U - t
        slip).  The heights are continued past the blocks, so t is clipped to the limit.
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
    fitted: FittedSheet, samples: HullSamples, knots: float, misfit: float = CLOSE
) -> Horizons:
    """Return the height fields of top and bottom fitted to the hull."""
    sheet, grid = fitted.sheet, fitted.sheet.grid
    foot = sheet.search().feet(samples.points)
    cos = np.einsum("ij,ij->i", samples.normals, foot.normal)
    side = np.sign(cos)
    height = unbiased_heights(sheet, foot, side, samples)
    flat = foot.U - foot.t[:, None] * grid.value(fitted.slip, foot.U)
    rim = near_any(samples.points, np.abs(cos) < _AGREE, _EROSION)
    nodes, _ = sheet.samples()
    P = grid.basis(nodes)
    sampled = grid.gram(P, np.ones(len(nodes)))
    half = sampled.solver(RIDGE)(P.T @ np.maximum(grid.value(fitted.half, nodes), 0.2))
    bending = (_SMOOTH / knots) ** 4 * grid.energy(2)
    still = bending + _STIFFNESS * sampled
    found = []
    for s in (1.0, -1.0):
        reach = fitted.reach(s, half)
        expected = grid.value(reach, flat)
        use = (foot.miss < 0.1) & (side == s) & ~rim
        use &= np.abs(s * foot.t - expected) < misfit
        B = grid.basis(flat[use])
        w = density_weights(flat[use], knots) if use.any() else np.empty(0)
        K = grid.gram(B, w) + still
        rest = K.solver(ridge=1e-12)(B.T @ (w * (height[use] - s * expected[use])))
        found.append(rest + s * reach)
    return Horizons(grid, found[0], found[1])


def separate_horizons(
    fitted: FittedSheet,
    hull: Horizons,
    sites: Sites,
    rules: SiteRules,
) -> Horizons:
    """Return the height fields of top and bottom that separate blocks from empty sites.

    The energy is that of `sharpen`, for the sites on each horizon's own side, plus the second
    differences of the change.

    Parameters
    ----------
    fitted : FittedSheet
        Sharpened by the sites.
    hull : Horizons
        Heights fitted to the hull; the start, unless the sheet is thin.
    sites : Sites
        Lattice sites at the body's surface.
    rules : SiteRules
        Which sites are used.
    """
    grid = fitted.sheet.grid
    nodes, _ = fitted.sheet.samples()
    held = grid.gram(grid.basis(nodes), np.ones(len(nodes)))
    still = (_SEPARATE * fitted.unit / grid.step) ** 4 * grid.energy(2) + _STIFFNESS * held
    sharp = [fitted.reach(side, fitted.half) for side in (1.0, -1.0)]
    trust = np.clip(fitted.half / fitted.unit - _BLURRED, 0.0, 1.0)
    start = (
        sharp[0] + trust * (hull.top - sharp[0]),
        sharp[1] + trust * (-hull.bottom - sharp[1]),
    )
    reach = start
    rules = replace(rules, thinnest=PINCHED)
    places = Places.of(fitted, sites, rules)
    places.follow(fitted.sheet, reach, fitted.slip, steps=1)
    for margin in _MARGINS:
        use = places.explained(margin, DEPTHS[-1], rules)
        above = places.side[use] > 0
        rise = [
            _rise(places, mine, grid, margin, still, now - first, fitted.unit <= 1)
            for mine, now, first in zip((use[above], use[~above]), reach, start, strict=True)
        ]
        reach = (reach[0] + rise[0], reach[1] + rise[1])
        places.level(grid, reach)
    return Horizons(grid, reach[0], -reach[1])


def _rise(
    places: Places,
    use: Ints,
    grid: SplineGrid,
    margin: float,
    still: Stencils,
    rest: Floats,
    held: bool,
) -> Floats:
    """Return a Newton step of a horizon's reach, outwards, from some of the sites."""
    H, occupied = grid.basis(places.flat[use]), places.sites.occupied[use]
    height = places.beyond[use]
    return separating_step(H, height, occupied, margin, grid.step, still, still @ rest, held)
