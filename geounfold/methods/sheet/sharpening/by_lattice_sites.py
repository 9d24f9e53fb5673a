"""Sharpen a fitted sheet so that top and bottom separate blocks from empty lattice sites.

A blurred hull averages a staircase.  If a horizon runs nearly along a lattice plane, the average is
off by a fixed part of a block.  The sites are exact: a block's centroid lies inside the body, its
empty neighbour's outside.  So top and bottom become the smoothest pair of surfaces that separate
the two kinds of sites.  They are found by logistic classification with a margin that shrinks from
0.3 block to 0.02.  In a sheet of one or two blocks a block is near both surfaces, and is used for
both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from scipy.special import expit

from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods.sheet.mid_surface.fit import RIDGE, FittedSheet
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils, gram
from geounfold.methods.sheet.mid_surface.spline import density_weights
from geounfold.methods.sheet.mid_surface.surface import MidSurface, slip_potential
from geounfold.methods.sheet.sharpening.displace import displacement_basis, node_normals
from geounfold.methods.sheet.sharpening.lattice_sites import Sites, scatter
from geounfold.methods.sheet.sharpening.site_places import Places
from geounfold.methods.sheet.sharpening.site_rules import DEPTHS, RIM, SiteRules

_HOPELESS = 0.03  # blocks: mean depth on the wrong side from which merged blocks never recovered

_LEAST, _PACE = 1.73, 1.15
"""Least smoothing length of the mid surface, in blocks, and the factor by which it is reduced.

The length is divided by the factor after every round with too many sites on the wrong side.
"""

_TOLERATED = 0.03  # largest share of the sites on the wrong side that is not too many
_ADAPT = 0.06  # blocks: margin up to which these sites are counted
_SMOOTH_HALF = 3.5  # blocks: smoothing length of the half thickness

_ENOUGH = 100
"""Sites per coefficient of the sheet; if blocks were merged and there are more, a part is used."""

_OFF = 0.75
"""Depth of a hole below the horizon of a sheet fitted to merged cells, at least, in cells.

Such a sheet is off by half a cell where it bends. With 1.25 blocks for cells of four, empty sites
beyond the hinges of two million blocks counted as holes: 1.09 million sites were used in place of
0.2 million, and the two attempts to sharpen took 29 s of processor.
"""

_MANY = 500_000
"""Number of sites above which a tenth of them is placed on the sheet, and marks the rim's cells.

Of ten million blocks with 1.8 million sites it takes 0.6 s of processor in place of 7.8; the
unfolded blocks come out 0.17 blocks from the truth in place of 0.20.
"""

_LEAST_SHARE = 0.1  # least share of the sites far from the rim that is used

_THICK = 1.2  # factor on the half thickness of a thin layer; a layer thicker than that is not thin


@dataclass(frozen=True, eq=False)
class _Views:
    """The used sites relative to the sheet.

    A site lies ``height - A z - H half`` above its horizon: z is the surface's displacement along
    its normals and half the half thickness, both as spline coefficients.
    """

    height: Floats
    occupied: Bools
    A: sp.csr_array
    H: sp.csr_array


@dataclass(frozen=True, eq=False)
class Separation:
    """A sheet moved to separate blocks from empty sites.

    Attributes
    ----------
    sheet : FittedSheet or None
        None if no site could be used, or if the steps did not lead towards a separation.
    depth : float
        Mean depth of the used sites on the wrong side, in blocks; infinite if none was used.
    leaves_out : bool
        Whether a block lies so far beyond its horizon that it was not used.
    """

    sheet: FittedSheet | None
    depth: float
    leaves_out: bool = False


@dataclass(frozen=True, eq=False)
class _Energy:
    """Smoothness terms of the separation.

    ``rough``, ``fine``: fourth and third differences of coefficients; ``held``: as in SiteRules.
    """

    rough: Stencils
    fine: Stencils
    held: bool


@dataclass(frozen=True, eq=False)
class _Round:
    """Result of a round: sheet, half thickness, share and mean depth of sites on the wrong side."""

    sheet: MidSurface
    half: Floats
    wrong: float
    depth: float


def sharpen(fitted: FittedSheet, sites: Sites, rules: SiteRules) -> Separation:
    """Return the sheet moved until the lattice sites lie on the correct sides of its horizons.

    Parameters
    ----------
    fitted : FittedSheet
        Fit to the hull.
    sites : Sites
        Lattice sites at the body's surface.
    rules : SiteRules
        Rules by which sites are used, and softness of the separation.
    """
    fitted, rules = _for_thin(fitted, rules.for_cells(fitted.unit))
    sheet, half, grid = fitted.sheet, fitted.half, fitted.sheet.grid
    places = Places.of(fitted, sites, rules)
    energy = _Energy(grid.energy(4), grid.energy(3), rules.held)
    smooth, last = rules.smooth, None
    used = fitted.near
    for k, margin in enumerate(rules.margins):
        depth = DEPTHS[min(k, len(DEPTHS) - 1)]
        places.follow(sheet, (half, half), fitted.slip, steps=1 if k else 0)
        use = places.explained(margin, depth, rules)
        if not len(use):
            return Separation(None, np.inf)
        nodes = node_normals(sheet)
        views = _views(sheet, nodes, places, use)
        last = _step(sheet, half, nodes, views, (margin, smooth), energy)
        sheet, half, used = last.sheet, last.half, places.U[use]
        if not np.isfinite(sheet.C).all():
            return Separation(None, np.inf)
        if k and not rules.held and last.depth > _HOPELESS:
            return Separation(None, last.depth)
        places.watch(margin)
        if margin <= _ADAPT and last.wrong > _TOLERATED:
            smooth = max(smooth / _PACE, min(_LEAST, rules.smooth))
    assert last is not None  # there is at least one margin
    weights = density_weights(used, grid.step)
    slip = slip_potential(sheet, used, weights, grid.energy(2))
    sharper = replace(fitted, sheet=sheet, half=half, slip=slip, smoothing=smooth)
    return Separation(sharper, last.depth, places.leave_out())


def enough_sites(fitted: FittedSheet, sites: Sites, rules: SiteRules) -> Sites:
    """Return the sites to use for a sheet fitted to cells of merged blocks.

    All sites near the rim and in thin parts of the layer are kept, because they are needed to find
    the rim; of the others an evenly spread part.
    """
    most = _ENOUGH * fitted.sheet.grid.size
    if fitted.unit <= 1 or len(sites.points) <= most:
        return sites
    spread = scatter(sites.points)
    if len(sites.points) > _MANY:
        sampled = spread < _LEAST_SHARE
        some = Sites(sites.points[sampled], sites.occupied[sampled])
        kept = sampled | _in_cells_of(
            sites.points, some.points[~_spare(fitted, some, rules)], fitted.unit
        )
    else:
        spare = _spare(fitted, sites, rules)
        share = (most - (~spare).sum()) / max(int(spare.sum()), 1)
        kept = ~spare | (spread < max(share, _LEAST_SHARE))
    return Sites(sites.points[kept], sites.occupied[kept])


def _spare(fitted: FittedSheet, sites: Sites, rules: SiteRules) -> Bools:
    """Return which sites lie far from the rim and in thick parts of the layer."""
    grid, rim = fitted.sheet.grid, 2 * (RIM + fitted.unit)
    foot = fitted.sheet.search(fitted.near, reach=8.0 * fitted.unit).feet(sites.points)
    flat = foot.U - foot.t[:, None] * grid.value(fitted.slip, foot.U)
    half, seen = grid.value(fitted.half, flat), foot.miss < 0.02
    inside = seen & (
        half - np.abs(foot.t) > np.minimum(max(DEPTHS[0], _OFF * fitted.unit), 0.6 * half)
    )
    holes = cKDTree(flat[inside & ~sites.occupied])
    spare = seen & (half > _THICK * rules.thin)
    spare[spare] = holes.query(flat[spare], distance_upper_bound=rim)[0] > rim
    return spare


def _in_cells_of(points: Floats, others: Floats, side: float) -> Bools:
    """Return which points (n, 3) lie in a cubic cell of a side that holds one of some others."""
    cells, places = (np.floor(X / side).astype(np.int64) for X in (points, others))
    low, high = bounds(cells)
    table = np.zeros(high - low + 1, dtype=bool)
    table[tuple((places - low).T)] = True
    return np.asarray(table[tuple((cells - low).T)])


def _for_thin(fitted: FittedSheet, rules: SiteRules) -> tuple[FittedSheet, SiteRules]:
    """Return fit and rules so that the sites of a thin sheet are used everywhere.

    The hull of a thin sheet ends in a wide rim, over which the half thickness was continued.  There
    it is raised to at least half its median.  Parts of a thick sheet that pinch out are not
    changed; they count as rim.
    """
    least = float(np.median(fitted.sheet.grid.value(fitted.half, fitted.near))) / 2
    rules = replace(rules, thinnest=min(rules.thinnest, least))
    if 2 * least > rules.thin:
        return fitted, replace(rules, thin=0.0)
    return replace(fitted, half=np.maximum(fitted.half, 1.01 * least)), rules


def _views(sheet: MidSurface, nodes: Floats, places: Places, use: Ints) -> _Views:
    t, side = places.t[use], places.side[use]
    A = displacement_basis(sheet, nodes, places.U[use], places.normal[use] * side[:, None])
    H = sheet.grid.basis(places.flat[use])
    return _Views(side * t, places.sites.occupied[use], A, H)


def _step(
    sheet: MidSurface,
    half: Floats,
    nodes: Floats,
    views: _Views,
    lengths: tuple[float, float],
    energy: _Energy,
) -> _Round:
    """Take one Newton step in the surface, then one in the half thickness.

    The energy is ``sum margin log(1 + exp(+-m / margin)) / knots^2`` over the sites, m the height
    above the site's horizon (+ for blocks, - for empty sites), plus the fourth differences of the
    moved surface (weight (smooth / knots)^8) and the third differences of the half thickness.
    """
    knots = sheet.grid.step
    margin, smooth = lengths
    rough, held = energy.rough, energy.held
    stiff = (smooth / knots) ** 8
    pull = np.einsum("ij,ij->i", nodes, rough @ sheet.C)
    m = views.height - views.H @ half
    stiffness = stiff * rough.between(nodes)
    z = separating_step(views.A, m, views.occupied, margin, knots, stiffness, stiff * pull, held)
    m = m - views.A @ z
    even = (_SMOOTH_HALF / knots) ** 6 * energy.fine
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

    With ``held`` no coefficient moves by more either, past the rim included.
    """
    slope = (expit(m / margin) - ~occupied) / knots**2
    bend = 0.25 / np.cosh(np.clip(m / (2 * margin), -20, 20)) ** 2
    weight = np.maximum(bend, 1e-4) / (margin * knots**2)
    K = gram(A, weight, stiffness.shape) + stiffness
    x = K.solver(RIDGE)(A.T @ slope - pull)
    longest = float(np.abs(x if held else A @ x).max())
    return x * min(1.0, 10 * margin / longest) if longest > 0 else x
