"""Places of lattice sites on the mid surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.mid_surface.spline import SplineGrid
from geounfold.methods.sheet.mid_surface.surface import MidSurface
from geounfold.methods.sheet.sharpening.displace import follow_feet
from geounfold.methods.sheet.sharpening.lattice_sites import Sites
from geounfold.methods.sheet.sharpening.site_rules import (
    BAND,
    COVER,
    SLACK,
    SiteRules,
)


def clearance(margin: float) -> float:
    """Return the distance, in blocks, from a horizon to the farthest correct site still used.

    A site farther away on its correct side no longer affects the fit.
    """
    return max(0.15, 6 * margin)


@dataclass(eq=False)
class Places:
    """Places of sites in the sheet's coordinates; watched sites are updated as the sheet moves.

    ``farther`` (n,): True if heights are measured from the farther horizon, not the nearer; ``U``
    (n, 2): feet; ``t`` (n,): offsets; ``normal`` (n, 3): normals; ``flat`` (n, 2): unfolded
    parameters; ``slope`` (n,): slip per height; ``half`` (n,): half thickness; ``taper`` (n,): its
    slope; ``middle`` (n,): offset half-way between the horizons; ``watched`` (w,): rows.
    """

    sites: Sites
    farther: Bools
    U: Floats
    t: Floats
    normal: Floats
    flat: Floats
    half: Floats
    taper: Floats
    middle: Floats
    watched: Ints
    slope: Floats

    @classmethod
    def of(cls, fitted: FittedSheet, sites: Sites, rules: SiteRules) -> Places:
        """Return the sites with a foot on a sheet; `follow` computes the other values.

        Blocks near both horizons appear twice.
        """
        sheet = fitted.sheet
        foot = sheet.search(fitted.near, reach=8.0 * fitted.unit).feet(sites.points)
        seen = foot.miss < 0.02
        across = np.abs(foot.t) + sheet.grid.value(fitted.half, foot.U)
        twice = across < clearance(rules.margins[0]) + SLACK
        rows = np.concatenate([np.flatnonzero(seen), np.flatnonzero(seen & twice & sites.occupied)])
        n = len(rows)
        farther = np.arange(n) >= int(seen.sum())
        t, half, taper, middle = (np.empty(n) for _ in range(4))
        normal, flat, U = np.empty((n, 3)), np.empty((n, 2)), foot.U[rows]
        chosen = Sites(sites.points[rows], sites.occupied[rows])
        watched, slope = np.arange(n), np.zeros(n)
        return cls(chosen, farther, U, t, normal, flat, half, taper, middle, watched, slope)

    @property
    def side(self) -> Floats:
        """The horizon of each site: +1 the top, -1 the bottom, (n,)."""
        return np.where((self.t < self.middle) == self.farther, 1.0, -1.0)

    @property
    def beyond(self) -> Floats:
        """Height beyond the horizon, (n,), positive away from the middle of the layer."""
        return self.side * (self.t - self.middle) - self.half

    @property
    def right(self) -> Floats:
        """Distance from the horizon, (n,), positive on the site's correct side."""
        beyond = self.beyond
        return np.where(self.sites.occupied, -beyond, beyond)

    def follow(
        self, sheet: MidSurface, reach: tuple[Floats, Floats], slip: Floats, steps: int
    ) -> None:
        """Update the watched sites; ``reach``: coefficients of the heights up to top and bottom."""
        rows, grid = self.watched, sheet.grid
        foot = follow_feet(sheet, self.sites.points[rows], self.U[rows], steps)
        shear = grid.value(slip, foot.U)
        flat = foot.U - foot.t[:, None] * shear
        self.slope[rows] = np.linalg.norm(shear, axis=1)
        self.U[rows], self.t[rows], self.normal[rows] = foot.U, foot.t, foot.normal
        self.flat[rows] = flat
        self.level(sheet.grid, reach)

    def level(self, grid: SplineGrid, reach: tuple[Floats, Floats]) -> None:
        """Update the horizons' heights at the watched sites."""
        rows, (top, bottom) = self.watched, reach
        half, hu, hv = grid.gradient((top + bottom) / 2, self.flat[rows])
        self.half[rows], self.taper[rows] = half, np.hypot(hu, hv)
        self.middle[rows] = (
            0.0 if top is bottom else grid.value((top - bottom) / 2, self.flat[rows])
        )

    def watch(self, margin: float) -> None:
        """Watch only sites that may be used, or mark the rim, at this or a smaller margin."""
        near = self.right[self.watched] < clearance(margin) + SLACK
        self.watched = self.watched[near]

    def explained(self, margin: float, depth: float, rules: SiteRules) -> Ints:
        """Return the sites (indices) that belong to a horizon, not to the rim.

        An empty site deep inside the layer lies beyond the rim, and so do the sites around it.  If
        the layer tapers steeply, horizon and rim can hardly be told apart.
        """
        beyond = self.beyond
        hole = self.holes(depth, rules)
        good = (self.right < clearance(margin)) & (np.abs(beyond) < max(BAND, 4 * margin))
        good &= (self.half > rules.thinnest) & (self.taper < rules.taper)
        use = np.flatnonzero(good)
        wide = rules.rim * np.hypot(1.0, rules.sheared * self.slope[use])
        most = float(wide.max(initial=rules.rim))
        rim = cKDTree(self.flat[hole]).query(self.flat[use], distance_upper_bound=most)[0]
        out: Ints = use[rim > wide]
        return out

    def leave_out(self) -> bool:
        """Return whether a block lies so far beyond its horizon that it is not used."""
        return bool((self.sites.occupied & (self.beyond > BAND)).any())

    def holes(self, depth: float, rules: SiteRules) -> Bools:
        """Return which empty sites lie deep inside the layer, so past its rim, (n,)."""
        deep = -self.beyond > np.minimum(depth, 0.6 * self.half)
        deep &= ~self.sites.occupied & (self.half > rules.thin)
        return deep | self._uncovered(rules)

    def _uncovered(self, rules: SiteRules) -> Bools:
        """Return which empty sites lie in a thin layer with no block near, (n,)."""
        beyond, occupied = self.beyond, self.sites.occupied
        out: Bools = ~occupied & (beyond < 0) & (self.half <= rules.thin)
        if out.any():
            blocks = self.flat[occupied & (beyond < 0.5)]
            near = cKDTree(blocks).query(self.flat[out], distance_upper_bound=COVER)[0]
            out[out] = near > COVER
        return out
