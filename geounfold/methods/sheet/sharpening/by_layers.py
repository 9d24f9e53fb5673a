"""Sharpen a fitted sheet by the layers of points that were gridded before folding.

Such points lie on a lattice only in the sheet's coordinates: in m layers at heights (2 i + 1 - m) /
m of the half thickness.  So every point is a measurement of the mid surface.  A density hull alone
is biased, because folding spreads points on one side and packs them on the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.mesh import Bools, Floats
from geounfold.methods.sheet.mid_surface.fit import RIDGE, FittedSheet
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils
from geounfold.methods.sheet.mid_surface.spline import SplineGrid, density_weights
from geounfold.methods.sheet.mid_surface.surface import slip_potential
from geounfold.methods.sheet.sharpening.displace import (
    displacement_basis,
    follow_feet,
    node_normals,
)
from geounfold.methods.sheet.sharpening.lattice_sites import scatter

CLEAR = 0.5
"""Mean cosine of the phase of the heights from which points count as layered; 1 is exact."""

MOST = 12_000
"""Largest number of points used."""

_ROUNDS = 4  # number of fits; feet are searched again before each
_SMOOTH = (1.0, 1.6, 2.4, 3.2)  # smoothing lengths in blocks; cross-validation chooses one
_SMOOTH_HALF = 2.0  # blocks: least smoothing length of the half thickness


def layer_heights(t: Floats, half: Floats, clear: float = CLEAR) -> Floats | None:
    """Return the height of each point's layer as a share of the half thickness, (n,).

    None if the points do not lie in layers: the mean of ``-cos(pi m (t / half + 1))``, which is 1
    for points in the middle of m layers, is below ``clear`` for every m.

    Examples
    --------
    >>> t = np.array([-2.0, 0.0, 2.0, 0.0])
    >>> layer_heights(t, np.full(4, 3.0), 0.5).round(3).tolist()
    [-0.667, 0.0, 0.667, 0.0]
    """
    q = t / half
    counts = np.arange(1, int(2.5 * float(np.median(half))) + 2)
    phase = [-float(np.cos(np.pi * m * (q + 1)).mean()) for m in counts]
    if max(phase) < clear:
        return None
    m = counts[int(np.argmax(phase))]
    layer = np.clip(np.round((q + 1) * m / 2 - 0.5), 0, m - 1)
    out: Floats = (2 * layer + 1 - m) / m
    return out


@dataclass(frozen=True, eq=False)
class _Problem:
    """Least squares of heights r for a displacement z and a change of half thickness d.

    The model is ``r = A z + H d``; H includes the heights of the layers as shares.  Both unknowns
    have an energy.
    """

    r: Floats
    A: sp.csr_array
    H: sp.csr_array
    bending: Stencils
    pull: Floats
    half_energy: Stencils
    half_pull: Floats
    grid: SplineGrid
    layers: int

    def solve(self, smooth: float, smooth_half: float, use: Bools) -> tuple[Floats, Floats]:
        """Return z, then d, fitted to some of the points."""
        weight = len(use) / int(use.sum()) / self.layers
        stiff = (smooth / self.grid.step) ** 8
        even = (max(smooth, smooth_half) / self.grid.step) ** 6
        A, H, r = self.A[use], self.H[use], self.r[use]
        every = np.full(A.shape[0], weight)
        K = self.grid.gram(A, every) + stiff * self.bending
        z = K.solver(RIDGE)(weight * (A.T @ r) - stiff * self.pull)
        r = r - A @ z
        K = self.grid.gram(H, every) + even * self.half_energy
        d = K.solver(RIDGE)(weight * (H.T @ r) - even * self.half_pull)
        return z, d

    def left(self, z: Floats, d: Floats, use: Bools) -> float:
        """Return the mean squared residual of z and d at some of the points."""
        rest = self.r[use] - self.A[use] @ z - self.H[use] @ d
        return float(np.mean(rest**2))


def sharpen_layers(fitted: FittedSheet, points: Floats, most: int = MOST) -> FittedSheet | None:
    """Return the sheet fitted through all layers of the points; None if there are no layers.

    Parameters
    ----------
    fitted : FittedSheet
        Fit to the hull.
    points : (n, 3) float
        Blocks, working units.
    most : int
        Largest number of points used; an evenly spread part if there are more.
    """
    sheet, half, grid = fitted.sheet, fitted.half, fitted.sheet.grid
    if len(points) > most:
        points = points[scatter(points[:, ::-1]) < most / len(points)]
    part = scatter(points) < 0.5
    every = np.ones(len(points), dtype=bool)
    U = sheet.search(fitted.near, reach=8.0 * fitted.unit).feet(points).U
    rough, fine = grid.energy(4), grid.energy(3)
    smooth = _SMOOTH[len(_SMOOTH) // 2]
    for turn in range(_ROUNDS):
        foot = follow_feet(sheet, points, U, steps=1)
        U = foot.U
        flat = U - foot.t[:, None] * grid.value(fitted.slip, U)
        thickness = np.maximum(grid.value(half, flat), 0.2)
        level = layer_heights(foot.t, thickness, CLEAR)
        if level is None:
            return None
        nodes = node_normals(sheet)
        H = grid.basis(flat)
        H.data *= np.repeat(level, 16)
        problem = _Problem(
            foot.t - H @ half,
            displacement_basis(sheet, nodes, U, foot.normal),
            H,
            rough.between(nodes),
            np.einsum("ij,ij->i", nodes, rough @ sheet.C),
            fine,
            fine @ half,
            grid,
            len(np.unique(level)),
        )
        if turn == 1:
            left = [problem.left(*problem.solve(s, _SMOOTH_HALF, part), ~part) for s in _SMOOTH]
            smooth = _SMOOTH[int(np.argmin(left))]
        z, d = problem.solve(smooth, _SMOOTH_HALF, every)
        sheet, half = sheet.with_coefficients(sheet.C + nodes * z[:, None]), half + d
        roughness = float(np.sqrt(problem.left(z, d, every)))
    slip = slip_potential(sheet, U, density_weights(U, grid.step), grid.energy(2))
    return replace(fitted, sheet=sheet, half=half, slip=slip, smoothing=smooth, roughness=roughness)
