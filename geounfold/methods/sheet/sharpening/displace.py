"""Displacement of a spline surface along its normals: bases, and updated feet of points."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from geounfold.backends.threads import over_slices
from geounfold.geometry.mesh import Floats
from geounfold.methods.sheet.mid_surface.surface import (
    SLICE,
    Foot,
    MidSurface,
    newton_step,
    normals,
)


def node_normals(sheet: MidSurface) -> Floats:
    """Return the sheet's unit normals at its coefficients, clipped to the spline's range."""
    grid = sheet.grid
    ij = np.stack(np.unravel_index(np.arange(grid.size), grid.shape), axis=1)
    ij = np.clip(ij, 1, np.array(grid.shape) - 2)
    return normals(sheet.jet(grid.origin + grid.step * ij))


def displacement_basis(sheet: MidSurface, nodes: Floats, U: Floats, normal: Floats) -> sp.csr_array:
    """Return the matrix (n, size) from displacements of the coefficients to heights at U.

    Coefficients move along their own normals ``nodes`` (size, 3).  The height is measured along
    ``normal`` (n, 3), the surface's normal at U (n, 2).
    """
    A = sheet.grid.basis(U)
    columns = A.indices.reshape(-1, 16)
    along = np.zeros(columns.shape)
    for axis in range(3):
        along += nodes[:, axis].take(columns) * normal[:, axis, None]
    A.data *= along.ravel()
    return A


def follow_feet(sheet: MidSurface, Q: Floats, U: Floats, steps: int) -> Foot:
    """Return the feet of points Q (n, 3) near parameters U (n, 2), by Newton steps only.

    Feet stay within the sheet's rectangle; a point without a foot there keeps a large miss.
    """
    foot = Foot.empty(len(Q))

    def work(rows: slice) -> None:
        at = U[rows]
        for _ in range(steps):
            at = np.clip(at + newton_step(sheet, Q[rows], sheet.jet(at)), sheet.low, sheet.high)
        sheet.set_feet(foot, rows, Q[rows], at)

    over_slices(work, len(Q), SLICE)
    return foot
