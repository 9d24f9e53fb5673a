"""Sharpen a fitted sheet by what each lattice site says: the surface is above me, or below me.

A blurred hull averages a staircase; where a horizon runs nearly along a lattice plane the average
errs by a fixed part of a block.  The sites themselves are exact: a block's centroid lies inside
the body, its empty neighbour's outside.  So top and bottom are the smoothest pair of surfaces
that separate the two, found as in logistic classification with a margin that shrinks from 0.3
block to 0.02.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.special import expit

from geounfold.mesh import Bools, Floats, Ints
from geounfold.sheet.displace import (
    displacement_basis,
    follow_feet,
    node_normals,
)
from geounfold.sheet.fit import RIDGE, FittedSheet
from geounfold.sheet.normal import Stencils, gram
from geounfold.sheet.sites import Sites
from geounfold.sheet.spline import SplineGrid, density_weights
from geounfold.sheet.surface import Foot, Sheet, near_any, slip_potential


@dataclass(frozen=True, kw_only=True)
class OccupancyOptions:
    """How the sheet is sharpened; lengths in blocks.

    ``margins``: softness of the separation, round by round; ``smooth``, ``least``: smoothing
    length of the mid surface, and what it is lowered to, by ``pace``, while more than
    ``tolerated`` of the sites lie on the wrong side and the margin is at most ``adapt``;
    ``smooth_half``: that of the half thickness; ``rim``: a site this near to an empty site
    inside the layer is the rim's, not a horizon's; ``depths``: how far below the horizon that
    is, round by round; ``band``: largest distance of a site from its horizon; ``thinnest``,
    ``taper``: half thickness below which, and its slope above which, sites are left alone;
    ``misfit``: mean depth on the wrong side above which the first fit is kept.
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
    thinnest: float = 1.0
    taper: float = 0.25
    misfit: float = 0.01


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
class _Round:
    """What one round made: sheet, half thickness, and how many sites are on the wrong side."""

    sheet: Sheet
    half: Floats
    wrong: float
    depth: float


def sharpen(fitted: FittedSheet, sites: Sites, options: OccupancyOptions) -> FittedSheet | None:
    """Return the sheet sharpened by lattice sites.

    None where no smooth pair of surfaces separates the sites: their mean depth on the wrong
    side is above ``misfit``.

    Parameters
    ----------
    fitted : FittedSheet
        Fit to the hull.
    sites : Sites
        Lattice sites at the body's surface.
    options : OccupancyOptions
        See there.
    """
    sheet, half, grid = fitted.sheet, fitted.half, fitted.sheet.grid
    foot = sheet.search(fitted.near, reach=8.0).feet(sites.points)
    seen = foot.miss < 0.02
    sites = Sites(sites.points[seen], sites.occupied[seen])
    U = foot.U[seen]
    rough, fine = grid.energy(4), grid.energy(3)
    smooth, last = options.smooth, None
    used = fitted.near
    for k, margin in enumerate(options.margins):
        foot = follow_feet(sheet, sites.points, U, steps=1 if k else 0)
        U = foot.U
        flat = U - foot.t[:, None] * grid.value(fitted.slip, U)
        depth = options.depths[min(k, len(options.depths) - 1)]
        use = _explained(grid, half, sites, foot, flat, margin, depth, options)
        if not len(use):
            return None
        nodes = node_normals(sheet)
        views = _views(sheet, nodes, sites, foot, flat, use)
        last = _step(sheet, half, nodes, views, margin, smooth, options.smooth_half, rough, fine)
        sheet, half, used = last.sheet, last.half, U[use]
        if margin <= options.adapt and last.wrong > options.tolerated:
            smooth = max(smooth / options.pace, options.least)
    if last is None or last.depth > options.misfit:
        return None
    weights = density_weights(used, grid.step)
    slip = slip_potential(sheet, used, weights, grid.energy(2))
    return replace(fitted, sheet=sheet, half=half, slip=slip, smoothing=smooth)


def _explained(
    grid: SplineGrid,
    half: Floats,
    sites: Sites,
    foot: Foot,
    flat: Floats,
    margin: float,
    depth: float,
    options: OccupancyOptions,
) -> Ints:
    """Return the sites that a horizon explains, not the rim (indices).

    An empty site well inside the layer lies beyond the rim, and so do those around it; where
    the layer tapers steeply, horizon and rim are one.
    """
    thickness, hu, hv = grid.gradient(half, flat)
    away = np.abs(foot.t)  # distance from the mid surface, on whichever side
    beyond = away - thickness
    hole = ~sites.occupied & (-beyond > np.minimum(depth, 0.6 * thickness))
    clear = np.where(sites.occupied, -beyond, beyond) < max(0.15, 6 * margin)
    good = clear & (np.abs(beyond) < options.band) & (thickness > options.thinnest)
    good &= np.hypot(hu, hv) < options.taper
    good &= ~near_any(flat, hole, options.rim)
    return np.flatnonzero(good)


def _views(
    sheet: Sheet, nodes: Floats, sites: Sites, foot: Foot, flat: Floats, use: Ints
) -> _Views:
    side = np.sign(foot.t[use])
    A = displacement_basis(sheet, nodes, foot.U[use], foot.normal[use] * side[:, None])
    return _Views(side * foot.t[use], sites.occupied[use], A, sheet.grid.basis(flat[use]))


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
    z = _newton(views.A, m, views.occupied, margin, knots, stiffness, stiff * pull)
    m = m - views.A @ z
    even = (smooth_half / knots) ** 6 * fine
    dh = _newton(views.H, m, views.occupied, margin, knots, even, even @ half)
    m = m - views.H @ dh
    wrong = np.where(views.occupied, m, -m)
    moved = sheet.with_coefficients(sheet.C + nodes * z[:, None])
    depth = float(np.maximum(wrong, 0).mean())
    return _Round(moved, half + dh, float((wrong > 0).mean()), depth)


def _newton(
    A: sp.csr_array,
    m: Floats,
    occupied: Bools,
    margin: float,
    knots: float,
    stiffness: Stencils,
    pull: Floats,
) -> Floats:
    """Return a Newton step x for ``m - A x``, no coefficient longer than ten margins."""
    slope = (expit(m / margin) - ~occupied) / knots**2
    bend = 0.25 / np.cosh(np.clip(m / (2 * margin), -20, 20)) ** 2
    weight = np.maximum(bend, 1e-4) / (margin * knots**2)
    K = gram(A, weight, stiffness.shape) + stiffness
    x = K.solver(RIDGE)(A.T @ slope - pull)
    longest = float(np.abs(x).max())
    return x * min(1.0, 10 * margin / longest) if longest > 0 else x
