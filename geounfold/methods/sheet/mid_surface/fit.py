"""Fit the mid surface and the half thickness, growing from the core to the rim."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.progress import told
from geounfold.errors import SplitError
from geounfold.geometry.measures import unit
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils, coupled_solver
from geounfold.methods.sheet.mid_surface.spline import SplineGrid, density_weights
from geounfold.methods.sheet.mid_surface.surface import (
    Foot,
    MidSurface,
    blur_shift,
    near_any,
    slip_potential,
)

OWN = 0.75
"""Distance past the half thickness, in blocks, up to which a foot is on the point's own limb."""

RIDGE = 1e-9
"""Weight on the diagonal, for coefficients that no sample reaches."""

KNOTS = 3.5
"""Spacing of the spline's knots, in blocks."""

SMOOTH = 2.2
"""Length, in blocks, below which the mid surface is smoothed on smooth hulls."""

_CELL = 1.5  # blocks: spacing of the sampling in which feet are searched
_REACH = 4.0  # blocks: distance past the accepted hull vertices within which feet are searched
_QUIET, _LOUD = 0.03, 0.08  # blocks: residual of smooth hulls at most, of staircases at least
_WEAK = 1e-4  # weight of medial points off the core
_FIRST = 1.5  # blocks: largest departure from the half thickness accepted in round one


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """How one attempt fits the mid surface; lengths in blocks.

    Attributes
    ----------
    smooth : float
        Length below which the mid surface is smoothed on smooth hulls.
    rough : float
        Factor on that length on staircases.
    smooth_half : float
        Length below which the half thickness is smoothed.
    order_half : int
        Order of the differences of the half thickness that are kept small: 2, or 3 if it may
        taper all the way.
    unseen : float
        Weight of curvature beside its slope; it keeps the surface plane far from hull vertices.
    rounds : int
        Rounds of growth.
    agree : float
        Least cosine between the normal of an accepted hull vertex and the predicted normal.
    later : float
        Largest departure from the half thickness accepted after round one.
    erosion : float
        Distance kept from rejected hull vertices.
    ahead : float
        Distance from the feet accepted in the round before; hull vertices with feet farther away
        wait for later rounds.
    """

    smooth: float = SMOOTH
    rough: float = 1.5
    smooth_half: float = 3.0
    order_half: int = 2
    unseen: float = 3e-4
    rounds: int = 4
    agree: float = 0.93
    later: float = 1.0
    erosion: float = 1.5
    ahead: float = np.inf


@dataclass(frozen=True, eq=False)
class HullSamples:
    """Points of the hull with outward normals, and the bias of the hull.

    Attributes
    ----------
    points, normals : (n, 3) float
        Hull vertices, working units, and their unit outward normals.
    side : (n,) int
        Side by the split: +1 top, -1 bottom, 0 undecided.
    variance : (3,) float
        Variance of the blur per axis.
    inset : float
        Depth of the hull below the body's surface.
    """

    points: Floats
    normals: Floats
    side: Ints
    variance: Floats
    inset: float

    def part(self, keep: Bools) -> HullSamples:
        """Return the samples of some vertices (n,)."""
        return replace(
            self, points=self.points[keep], normals=self.normals[keep], side=self.side[keep]
        )


@dataclass(frozen=True, eq=False)
class FittedSheet:
    """The fitted mid surface with its half thickness.

    Attributes
    ----------
    sheet : MidSurface
        Mid surface; offsets are positive on the top's side.
    half : (size,) float
        Spline coefficients of the half thickness, in *unfolded* parameters.
    slip : (size, 2) float
        Spline coefficients of the slip potential: unfolded u = U - t slip(U).
    near : (k, 2) float
        Parameters of the accepted samples.
    roughness : float
        Weighted rms residual of the accepted samples, in blocks.
    smoothing : float
        Smoothing length used, in blocks.
    accepted : float
        Share of the samples accepted.
    lean, level : float
        Side (1 top, -1 bottom, 0 none) and median half thickness, if the sheet was moved onto the
        surface that layers run parallel to (`parallel_surface.conform`).
    unit : float
        Side of the blocks or merged cells that it was fitted to, in the unit of lengths.
    """

    sheet: MidSurface
    half: Floats
    slip: Floats
    near: Floats
    roughness: float
    smoothing: float
    accepted: float
    lean: float = 0.0
    level: float = 0.0
    unit: float = 1.0

    def scaled(self, factor: float) -> FittedSheet:
        """Return the sheet in another unit: lengths times a factor."""
        return replace(
            self,
            sheet=self.sheet.scaled(factor),
            half=self.half * factor,
            near=self.near * factor,
            roughness=self.roughness * factor,
            smoothing=self.smoothing * factor,
            level=self.level * factor,
            unit=self.unit * factor,
        )

    def own_feet(self, Q: Floats, reaches: tuple[float, ...]) -> Foot:
        """Return the feet of points Q (n, 3) of the body on the limb that they belong to.

        The sheet is continued past its rim, and if limbs are close the continuation may run into
        another limb, so that the nearest foot is wrong.  So parts of the sheet within ``reaches``
        (increasing) of the samples are searched in turn, until a foot lies within the half
        thickness.  If none does, the foot on the last part, or on the whole sheet, is returned.
        """
        foot = self.sheet.search(self.near, reaches[0]).feet(Q)
        for reach in (*reaches[1:], None):
            half = self.sheet.grid.value(self.half, foot.U)
            thick = np.where(foot.t >= 0, self.reach(1.0, half), self.reach(-1.0, half))
            over = np.abs(foot.t) > thick + OWN
            lost = foot.miss > 0.05
            rows = np.flatnonzero(lost | over if reach is not None else lost)
            if not len(rows):
                break
            search = self.sheet.search() if reach is None else self.sheet.search(self.near, reach)
            again = search.feet(Q[rows], newton=2 if reach is not None else 3)
            better = lost[rows] | ((again.miss <= 0.05) & (np.abs(again.t) < np.abs(foot.t[rows])))
            for mine, theirs in zip(foot, again, strict=True):
                mine[rows[better]] = theirs[better]
        return foot

    def left_out(self, points: Floats) -> float:
        """Return the mean distance by which points (n, 3) of the body lie beyond the horizons.

        The distance is cut at three blocks, which is also the value of a point without a foot.
        Measured: about 0.001 blocks if the sheet holds the body, 0.1 and more if it lost a limb.
        """
        foot = self.own_feet(points, tuple(r * self.unit for r in (2.0, 5.0, 10.0)))
        grid, most = self.sheet.grid, 3.0 * self.unit
        flat = foot.U - foot.t[:, None] * grid.value(self.slip, foot.U)
        over = np.clip(np.abs(foot.t) - grid.value(self.half, flat), 0.0, most)
        return float(np.where(foot.miss > 0.1 * self.unit, most, over).mean())

    def reach(self, side: float, half: Floats) -> Floats:
        """Return the distance from the sheet to its top (side 1) or bottom (-1), (n,)."""
        return half - side * self.lean * (half - self.level)


@dataclass(frozen=True, eq=False)
class _System:
    """Energies and weights of the grid, shared by every solve of the fit."""

    grid: SplineGrid
    bending: Stencils
    third: Stencils
    even_half: Stencils
    unseen: float

    def stiffness(self, length: float) -> Stencils:
        """Return the smoothing matrix of the surface.

        It penalises third differences, so curvature is carried past the samples; a weak second term
        makes the surface plane where there are none.
        """
        return (length / self.grid.step) ** 6 * self.third + self.unseen * self.bending


def _start(
    medial: MedialSheet, points: Floats, settings: FitSettings
) -> tuple[_System, MidSurface, Floats]:
    """Return the spline system, the first sheet and the first half thickness."""
    margin = float(np.max(cKDTree(medial.mesh.V).query(points)[0])) + 3
    low, high = medial.uv.min(axis=0) - margin, medial.uv.max(axis=0) + margin
    grid = SplineGrid.over(low, high, KNOTS)
    bending = grid.energy(2)
    even_half = (settings.smooth_half / KNOTS) ** (2 * settings.order_half) * (
        grid.energy(settings.order_half)
    )
    if settings.order_half > 2:  # else constant slopes cost nothing and continue past the samples
        even_half = even_half + settings.unseen * bending
    system = _System(grid, bending, grid.energy(3), even_half, settings.unseen)
    w = density_weights(medial.uv, KNOTS) * np.where(medial.trusted, 1.0, _WEAK)
    B = grid.basis(medial.uv)
    BtWB = grid.gram(B, w)
    C = (BtWB + system.stiffness(settings.smooth)).solver(RIDGE)(B.T @ (w[:, None] * medial.mesh.V))
    half = (BtWB + even_half).solver(RIDGE)(B.T @ (w * medial.half))
    return system, MidSurface(grid, C, low, high, _CELL), half


@dataclass(frozen=True, eq=False)
class _Accepted:
    """Samples accepted in one round of growth."""

    foot: Foot
    height: Floats  # offset with the hull's bias undone
    side: Floats
    flat: Floats  # unfolded parameters
    keep: Bools


def unbiased_heights(sheet: MidSurface, foot: Foot, side: Floats, samples: HullSamples) -> Floats:
    """Return the samples' offsets with the hull's blur and inset undone, (n,)."""
    shift = np.zeros(len(foot.t))
    if samples.variance.any():
        shift = np.clip(blur_shift(sheet.jet(foot.U), foot.t, samples.variance), -0.5, 0.5)
    return foot.t - shift + side * samples.inset


def _accept(
    sheet: MidSurface,
    half: Floats,
    slip: Floats | None,
    foot: Foot,
    samples: HullSamples,
    misfit: float,
    near: Floats,
    settings: FitSettings,
) -> _Accepted:
    """Return which samples agree with the sheet of the round before, by normal and by thickness.

    Samples farther than ``settings.ahead`` from the parameters ``near`` (k, 2) are neither accepted
    nor rejected.  The distance kept from rejected samples is reduced if it would drop more than
    half of the accepted ones.
    """
    side = np.sign(np.einsum("ij,ij->i", samples.normals, foot.normal))
    height = unbiased_heights(sheet, foot, side, samples)
    flat = foot.U if slip is None else foot.U - foot.t[:, None] * sheet.grid.value(slip, foot.U)
    expected, hu, hv = sheet.grid.gradient(half, flat)
    _, Pu, Pv = sheet.grid.gradient(sheet.C, foot.U)
    predicted = unit(side[:, None] * foot.normal - hu[:, None] * Pu - hv[:, None] * Pv)
    cos = np.einsum("ij,ij->i", samples.normals, predicted)
    good = (cos > settings.agree) & (side != 0) & (np.abs(side * height - expected) < misfit)
    good &= side * samples.side >= 0  # otherwise the sheet has run into another limb
    true_foot = foot.miss < 0.1
    if np.isfinite(settings.ahead):
        true_foot &= cKDTree(near).query(foot.U)[0] < settings.ahead
    good &= true_foot
    wrong = ~good & true_foot
    for erosion in (settings.erosion, settings.erosion / 2, 0.0):
        keep = good & ~near_any(samples.points, wrong, erosion)
        if 2 * keep.sum() > good.sum():
            break
    return _Accepted(foot, height, side, flat, keep)


def _side_weights(accepted: _Accepted, cell: float) -> Floats:
    """Return weights that count every knot cell once per side."""
    U, side = accepted.foot.U[accepted.keep], accepted.side[accepted.keep]
    w = np.empty(len(U))
    for s in (1.0, -1.0):
        mine = side == s
        if mine.any():
            w[mine] = density_weights(U[mine], cell)
    return w


def _refit(
    system: _System, sheet: MidSurface, accepted: _Accepted, smoothing: float, settings: FitSettings
) -> tuple[MidSurface, Floats, Floats, float, float]:
    """Return sheet, half thickness, weights, roughness and smoothing of one round.

    Offset and half thickness are solved together, t = delta(U) + side half(u).  The mid points are
    then moved by the residual, and the surface is fitted to them again.
    """
    keep = accepted.keep
    U, t, s = accepted.foot.U[keep], accepted.height[keep], accepted.side[keep]
    w = _side_weights(accepted, KNOTS)
    B, H = system.grid.basis(U), system.grid.basis(accepted.flat[keep])
    BtWB = system.grid.gram(B, w)
    surface = BtWB + system.stiffness(smoothing)
    thickness = system.grid.gram(H, w) + system.even_half
    cross = B.T @ H.multiply((w * s)[:, None]).tocsr()
    solve = coupled_solver(surface, thickness, cross, RIDGE)
    z = solve(np.concatenate([B.T @ (w * t), H.T @ (w * s * t)]))
    half = z[system.grid.size :]
    mid = t - s * (H @ half)
    residual = mid - B @ z[: system.grid.size]
    roughness = float(np.sqrt((w * residual**2).sum() / w.sum()))
    stretch = np.interp(roughness, [_QUIET, _LOUD], [1.0, settings.rough])
    smoothing = settings.smooth * float(stretch)
    points = sheet.at(U) + mid[:, None] * accepted.foot.normal[keep]
    C = (BtWB + system.stiffness(smoothing)).solver(RIDGE)(B.T @ (w[:, None] * points))
    return sheet.with_coefficients(C), half, w, roughness, smoothing


def fit_mid_surface(
    medial: MedialSheet, samples: HullSamples, points: Floats, settings: FitSettings
) -> FittedSheet:
    """Return the mid surface and half thickness fitted to a hull.

    Parameters
    ----------
    medial : MedialSheet
        First guess.
    samples : HullSamples
        The hull's vertices.
    points : (n, 3) float
        The blocks, which set how far the sheet must reach.
    settings : FitSettings
        Settings of the fit.

    Raises
    ------
    SplitError
        No sample agrees with the sheet.
    """
    system, sheet, half = _start(medial, points, settings)
    slip: Floats | None = None
    near, smoothing = medial.uv, settings.smooth
    for turn in range(settings.rounds):
        told(0.6 * turn / settings.rounds)
        foot = sheet.search(near, _REACH).feet(samples.points)
        misfit = _FIRST if turn == 0 else settings.later
        accepted = _accept(sheet, half, slip, foot, samples, misfit, near, settings)
        if not accepted.keep.any():
            raise SplitError(
                "no part of the hull agrees with a smooth sheet; try another --hull, or smaller "
                "blocks where the body is narrow"
            )
        sheet, half, w, roughness, smoothing = _refit(system, sheet, accepted, smoothing, settings)
        near = accepted.foot.U[accepted.keep]
        slip = slip_potential(sheet, near, w, system.bending)
    assert slip is not None  # there is at least one round
    share = float(accepted.keep.mean())
    return FittedSheet(sheet, half, slip, near, roughness, smoothing, share)
