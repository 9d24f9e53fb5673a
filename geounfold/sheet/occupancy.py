"""Sharpen a fitted sheet by what each lattice site says: the surface is above me, or below me.

A blurred hull averages a staircase; where a horizon runs nearly along a lattice plane the average
errs by a fixed part of a block.  The sites themselves are exact: a block's centroid lies inside
the body, its empty neighbour's outside.  So top and bottom are the smoothest pair of surfaces
that separate the two, found as in logistic classification with a margin that shrinks from 0.3
block to 0.02.  In a sheet of one or two blocks a block is near both surfaces, and speaks for both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from scipy.special import expit

from geounfold.mesh import Bools, Floats, Ints
from geounfold.sheet.displace import (
    displacement_basis,
    follow_feet,
    node_normals,
)
from geounfold.sheet.fit import RIDGE, FittedSheet
from geounfold.sheet.normal import Stencils, gram
from geounfold.sheet.sites import Sites, scatter
from geounfold.sheet.spline import SplineGrid, density_weights
from geounfold.sheet.surface import Sheet, slip_potential

_HOPELESS = 0.03  # blocks: mean depth on the wrong side that cells of merged blocks never mend
_LEAST_SHARE = 0.1  # of the sites far from the rim that is kept
_THICK = 1.2  # times the half thickness of a thin sheet, from which it is surely none


@dataclass(frozen=True, kw_only=True)
class OccupancyOptions:
    """How the sheet is sharpened; lengths in blocks.

    ``margins``: softness of the separation, round by round; ``smooth``, ``least``: smoothing
    length of the mid surface, and what it is lowered to, by ``pace``, while more than
    ``tolerated`` of the sites lie on the wrong side and the margin is at most ``adapt``;
    ``smooth_half``: that of the half thickness; ``rim``: a site this near to an empty site
    inside the layer is the rim's, not a horizon's; ``depths``: how far below the horizon that
    is, round by round; ``thin``, ``cover``: where the half thickness is at most ``thin``, that
    is anywhere below the horizon but farther than ``cover`` along the sheet from any block;
    ``band``: largest distance of a site from its horizon; ``thinnest``, ``taper``: half
    thickness (or half of its median, where that is less) below which, and its slope above
    which, sites are left alone; ``slack``: how far
    sites past those limits are followed all the same, as the sheet moves; ``misfit``: mean
    depth on the wrong side above which the first fit is kept; ``enough``: sites per coefficient
    of the sheet up to which all are used, where blocks were merged; ``held``: whether steps are
    limited past the rim as well, where the sheet is but continued; ``sheared``: share of the
    slip by which the distance from the rim grows, as slip spreads the rim's sites along the
    unfolded layer.
    """

    margins: tuple[float, ...] = (0.3, 0.3, 0.15, 0.1, 0.06, 0.04, 0.03, 0.02, 0.02, 0.02)
    smooth: float = 2.7
    least: float = 1.73
    pace: float = 1.15
    tolerated: float = 0.03
    adapt: float = 0.06
    smooth_half: float = 3.5
    rim: float = 1.0
    depths: tuple[float, ...] = (1.25, 1.0, 0.75)
    band: float = 1.2
    thin: float = 1.25
    cover: float = 0.9
    thinnest: float = 1.0
    taper: float = 0.25
    slack: float = 0.5
    misfit: float = 0.01
    enough: int = 100
    held: bool = True
    sheared: float = 0.0

    def for_cells(self, side: float) -> OccupancyOptions:
        """Return the options for a sheet fitted to cells of merged blocks of some side.

        Such a sheet is farther off at first: the margins begin with wider ones.
        """
        if side <= 1:
            return self
        wider = self.margins[0] * side * 0.5 ** np.arange(np.ceil(np.log2(side)))
        return replace(self, margins=(*wider.tolist(), *self.margins), held=False)


@dataclass(frozen=True, eq=False)
class _Views:
    """The used sites as seen from the sheet.

    A site lies ``height - A z - H half`` above its own horizon, z the surface's normal
    displacement and half the half thickness, both as spline coefficients.
    """

    height: Floats
    occupied: Bools
    A: sp.csr_array
    H: sp.csr_array


@dataclass(frozen=True, eq=False)
class Separation:
    """A sheet moved to separate the sites, or None where no smooth one does.

    ``depth``: mean depth of the used sites on the wrong side, blocks; inf where none was used.
    """

    sheet: FittedSheet | None
    depth: float


@dataclass(frozen=True, eq=False)
class _Round:
    """What one round made: sheet, half thickness, and how many sites are on the wrong side."""

    sheet: Sheet
    half: Floats
    wrong: float
    depth: float


def sharpen(fitted: FittedSheet, sites: Sites, options: OccupancyOptions) -> Separation:
    """Return the sheet sharpened by lattice sites.

    It is none where no smooth pair of surfaces separates the sites: their mean depth on the
    wrong side is above ``misfit``.

    Parameters
    ----------
    fitted : FittedSheet
        Fit to the hull.
    sites : Sites
        Lattice sites at the body's surface.
    options : OccupancyOptions
        See there.
    """
    fitted, options = _for_thin(fitted, options.for_cells(fitted.unit))
    sheet, half, grid = fitted.sheet, fitted.half, fitted.sheet.grid
    places = Places.of(fitted, sites, options)
    rough, fine = grid.energy(4), grid.energy(3)
    smooth, last = options.smooth, None
    used = fitted.near
    for k, margin in enumerate(options.margins):
        depth = options.depths[min(k, len(options.depths) - 1)]
        places.follow(sheet, (half, half), fitted.slip, steps=1 if k else 0)
        use = places.explained(margin, depth, options)
        if not len(use):
            return Separation(None, np.inf)
        nodes = node_normals(sheet)
        views = _views(sheet, nodes, places, use)
        last = _step(
            sheet,
            half,
            nodes,
            views,
            margin,
            smooth,
            options.smooth_half,
            rough,
            fine,
            options.held,
        )
        sheet, half, used = last.sheet, last.half, places.U[use]
        if not np.isfinite(sheet.C).all():
            return Separation(None, np.inf)
        if k and not options.held and last.depth > _HOPELESS:
            return Separation(None, last.depth)
        places.watch(margin, options)
        if margin <= options.adapt and last.wrong > options.tolerated:
            smooth = max(smooth / options.pace, options.least)
    if last is None or last.depth > options.misfit:
        return Separation(None, np.inf if last is None else last.depth)
    weights = density_weights(used, grid.step)
    slip = slip_potential(sheet, used, weights, grid.energy(2))
    sharper = replace(fitted, sheet=sheet, half=half, slip=slip, smoothing=smooth)
    return Separation(sharper, last.depth)


def enough_sites(fitted: FittedSheet, sites: Sites, options: OccupancyOptions) -> Sites:
    """Return as many sites as a sheet fitted to cells of merged blocks can learn from.

    Those near the rim and where the layer is thin all stay, as they tell each other's kind; of the
    others an even part.
    """
    most = options.enough * fitted.sheet.grid.size
    if fitted.unit <= 1 or len(sites.points) <= most:
        return sites
    grid, rim = fitted.sheet.grid, 2 * (options.rim + fitted.unit)
    foot = fitted.sheet.search(fitted.near, reach=8.0 * fitted.unit).feet(sites.points)
    flat = foot.U - foot.t[:, None] * grid.value(fitted.slip, foot.U)
    half, seen = grid.value(fitted.half, flat), foot.miss < 0.02
    inside = seen & (half - np.abs(foot.t) > np.minimum(options.depths[0], 0.6 * half))
    holes = cKDTree(flat[inside & ~sites.occupied])
    spare = seen & (half > _THICK * options.thin)
    spare[spare] = holes.query(flat[spare], distance_upper_bound=rim)[0] > rim
    share = (most - (~spare).sum()) / max(int(spare.sum()), 1)
    kept = ~spare | (scatter(sites.points) < max(share, _LEAST_SHARE))
    return Sites(sites.points[kept], sites.occupied[kept])


def _for_thin(
    fitted: FittedSheet, options: OccupancyOptions
) -> tuple[FittedSheet, OccupancyOptions]:
    """Return fit and options so that sites of a thin sheet are listened to everywhere.

    The hull of a thin sheet ends in a wide rim, over which the half thickness was continued;
    where it came to nothing it is raised to half its median.  A thick sheet's own thin parts,
    where it pinches out, are left to its rim.
    """
    least = float(np.median(fitted.sheet.grid.value(fitted.half, fitted.near))) / 2
    options = replace(options, thinnest=min(options.thinnest, least))
    if 2 * least > options.thin:
        return fitted, replace(options, thin=0.0)
    return replace(fitted, half=np.maximum(fitted.half, 1.01 * least)), options


def clearance(margin: float) -> float:
    """Return how far on its own side of a horizon a site still says something."""
    return max(0.15, 6 * margin)


@dataclass(eq=False)
class Places:
    """Where the sites lie in the sheet's coordinates; those watched are followed as it moves.

    ``farther`` (n,): seen from the farther horizon, not the nearer; ``U`` (n, 2) feet, ``t``
    (n,) offsets, ``normal`` (n, 3), ``flat`` (n, 2) unfolded parameters, ``slope`` (n,) slip per
    height; ``half`` (n,) half thickness, ``taper`` (n,) its slope and ``middle`` (n,) offset
    half-way between the horizons there; ``watched`` (w,) rows.
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
    def of(cls, fitted: FittedSheet, sites: Sites, options: OccupancyOptions) -> Places:
        """Return the sites with a foot on a sheet, the rest to be found by `follow`.

        Blocks near both horizons are there twice.
        """
        sheet = fitted.sheet
        foot = sheet.search(fitted.near, reach=8.0 * fitted.unit).feet(sites.points)
        seen = foot.miss < 0.02
        across = np.abs(foot.t) + sheet.grid.value(fitted.half, foot.U)
        twice = across < clearance(options.margins[0]) + options.slack
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
        """The horizon each is seen from: +1 the top, -1 the bottom, (n,)."""
        return np.where((self.t < self.middle) == self.farther, 1.0, -1.0)

    @property
    def beyond(self) -> Floats:
        """Height over the horizon, (n,): away from the middle of the layer is up."""
        return self.side * (self.t - self.middle) - self.half

    @property
    def right(self) -> Floats:
        """Distance from the horizon on the side where the site belongs, (n,)."""
        beyond = self.beyond
        return np.where(self.sites.occupied, -beyond, beyond)

    def follow(self, sheet: Sheet, reach: tuple[Floats, Floats], slip: Floats, steps: int) -> None:
        """Find the watched sites' places anew; ``reach``: coefficients up to top and bottom."""
        rows, grid = self.watched, sheet.grid
        foot = follow_feet(sheet, self.sites.points[rows], self.U[rows], steps)
        shear = grid.value(slip, foot.U)
        flat = foot.U - foot.t[:, None] * shear
        self.slope[rows] = np.linalg.norm(shear, axis=1)
        self.U[rows], self.t[rows], self.normal[rows] = foot.U, foot.t, foot.normal
        self.flat[rows] = flat
        self.level(sheet.grid, reach)

    def level(self, grid: SplineGrid, reach: tuple[Floats, Floats]) -> None:
        """Find the horizons' heights at the watched sites' places anew."""
        rows, (top, bottom) = self.watched, reach
        half, hu, hv = grid.gradient((top + bottom) / 2, self.flat[rows])
        self.half[rows], self.taper[rows] = half, np.hypot(hu, hv)
        self.middle[rows] = (
            0.0 if top is bottom else grid.value((top - bottom) / 2, self.flat[rows])
        )

    def watch(self, margin: float, options: OccupancyOptions) -> None:
        """Watch only sites that may be used, or mark the rim, with this margin or a smaller one."""
        near = self.right[self.watched] < clearance(margin) + options.slack
        self.watched = self.watched[near]

    def explained(self, margin: float, depth: float, options: OccupancyOptions) -> Ints:
        """Return the sites that a horizon explains, not the rim (indices).

        An empty site well inside the layer lies beyond the rim, and so do those around it; where
        the layer tapers steeply, horizon and rim are one.
        """
        beyond, thickness = self.beyond, self.half
        hole = self.holes(depth, options)
        good = (self.right < clearance(margin)) & (np.abs(beyond) < max(options.band, 4 * margin))
        good &= (thickness > options.thinnest) & (self.taper < options.taper)
        use = np.flatnonzero(good)
        wide = options.rim * np.hypot(1.0, options.sheared * self.slope[use])
        most = float(wide.max(initial=options.rim))
        rim = cKDTree(self.flat[hole]).query(self.flat[use], distance_upper_bound=most)[0]
        out: Ints = use[rim > wide]
        return out

    def holes(self, depth: float, options: OccupancyOptions) -> Bools:
        """Return which empty sites lie well inside the layer, (n,): past its rim."""
        deep = -self.beyond > np.minimum(depth, 0.6 * self.half)
        deep &= ~self.sites.occupied & (self.half > options.thin)
        return deep | self._uncovered(options)

    def _uncovered(self, options: OccupancyOptions) -> Bools:
        """Return which empty sites lie in a thin layer where no block is near, (n,)."""
        beyond, occupied = self.beyond, self.sites.occupied
        out: Bools = ~occupied & (beyond < 0) & (self.half <= options.thin)
        if out.any():
            blocks = self.flat[occupied & (beyond < 0.5)]
            near = cKDTree(blocks).query(self.flat[out], distance_upper_bound=options.cover)[0]
            out[out] = near > options.cover
        return out


def _views(sheet: Sheet, nodes: Floats, places: Places, use: Ints) -> _Views:
    t, side = places.t[use], places.side[use]
    A = displacement_basis(sheet, nodes, places.U[use], places.normal[use] * side[:, None])
    H = sheet.grid.basis(places.flat[use])
    return _Views(side * t, places.sites.occupied[use], A, H)


def _step(
    sheet: Sheet,
    half: Floats,
    nodes: Floats,
    views: _Views,
    margin: float,
    smooth: float,
    smooth_half: float,
    rough: Stencils,
    fine: Stencils,
    held: bool,
) -> _Round:
    """Take one Newton step in the surface, then one in the half thickness.

    The energy is ``sum margin log(1 + exp(+-m / margin)) / knots^2`` over the sites, m their
    height above their horizon (+ for blocks, - for empty sites), plus the fourth differences
    of the moved surface (weight (smooth / knots)^8) and the third of the half thickness.
    """
    knots = sheet.grid.step
    stiff = (smooth / knots) ** 8
    pull = np.einsum("ij,ij->i", nodes, rough @ sheet.C)
    m = views.height - views.H @ half
    stiffness = stiff * rough.between(nodes)
    z = separating_step(views.A, m, views.occupied, margin, knots, stiffness, stiff * pull, held)
    m = m - views.A @ z
    even = (smooth_half / knots) ** 6 * fine
    dh = separating_step(views.H, m, views.occupied, margin, knots, even, even @ half, held)
    m = m - views.H @ dh
    wrong = np.where(views.occupied, m, -m)
    moved = sheet.with_coefficients(sheet.C + nodes * z[:, None])
    depth = float(np.maximum(wrong, 0).mean())
    return _Round(moved, half + dh, float((wrong > 0).mean()), depth)


def separating_step(
    A: sp.csr_array,
    m: Floats,
    occupied: Bools,
    margin: float,
    knots: float,
    stiffness: Stencils,
    pull: Floats,
    held: bool,
) -> Floats:
    """Return a Newton step x for ``m - A x`` that moves no site by more than ten margins.

    ``held``: nor any coefficient, past the rim or not.
    """
    slope = (expit(m / margin) - ~occupied) / knots**2
    bend = 0.25 / np.cosh(np.clip(m / (2 * margin), -20, 20)) ** 2
    weight = np.maximum(bend, 1e-4) / (margin * knots**2)
    K = gram(A, weight, stiffness.shape) + stiffness
    x = K.solver(RIDGE)(A.T @ slope - pull)
    longest = float(np.abs(x if held else A @ x).max())
    return x * min(1.0, 10 * margin / longest) if longest > 0 else x
