"""Which surface the layers run parallel to: the mid surface, the top or the bottom.

If the thickness varies alike on both sides, layers follow the mid surface.  If it varies on one
side only (a bulge or a scour), they follow the other side.  The surface that layers follow was flat
before folding, so it is the one of the three that flattens with the least strain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geounfold.geometry.measures import lengths, unique_edges
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet
from geounfold.methods.sheet.mid_surface.spline import density_weights
from geounfold.methods.sheet.mid_surface.surface import MidSurface, normals, slip_potential

_VARIED = 0.03
"""Relative standard deviation of the half thickness below which the mid surface is kept."""

_STRAINED = 0.002
"""Strain (rms over edges) of the flattened mid surface below which it is kept."""

_CLEARLY_LESS = 0.5
"""Share of the mid surface's strain that the top or the bottom must stay below to be taken."""


def conform(
    fitted: FittedSheet,
    medial: MedialSheet,
    flatten: Callable[[TriMesh, Floats], Floats],
) -> FittedSheet:
    """Return the sheet moved onto the surface that the layers run parallel to.

    Parameters
    ----------
    fitted : FittedSheet
        Fit with the mid surface as its sheet.
    medial : MedialSheet
        Medial points; they define the domain that is flattened.
    flatten : callable
        ``flatten(mesh, start)`` returns a flattening, (n, 2).

    Returns
    -------
    FittedSheet
        ``lean`` is 0 if the mid surface was kept, 1 for the top's shape, -1 for the bottom's.
    """
    half = fitted.sheet.grid.value(fitted.half, fitted.near)
    level = float(np.median(half))
    if level <= 0 or float(np.std(half)) < _VARIED * level:
        return fitted
    limits = (float(half.min()), float(half.max()))

    def strain(lean: float) -> float:
        V = _leaning(fitted, medial.uv, lean, level, limits)
        uv = flatten(TriMesh(V, medial.mesh.F), medial.uv)
        E = unique_edges(medial.mesh.F)
        return float(np.sqrt(np.mean((lengths(uv, E) / lengths(V, E) - 1) ** 2)))

    middle = strain(0.0)
    if middle < _STRAINED:
        return fitted
    best, lean = min((strain(side), side) for side in (1.0, -1.0))
    if best > _CLEARLY_LESS * middle:
        return fitted
    return _moved(fitted, lean, level, limits)


def _leaning(
    fitted: FittedSheet, U: Floats, lean: float, level: float, limits: tuple[float, float]
) -> Floats:
    """Return points of the sheet moved towards a side by their extra half thickness, (n, 3)."""
    jet = fitted.sheet.jet(U)
    half = np.clip(fitted.sheet.grid.value(fitted.half, U), *limits)
    return jet.value + (lean * (half - level))[:, None] * normals(jet)


def _moved(
    fitted: FittedSheet, lean: float, level: float, limits: tuple[float, float]
) -> FittedSheet:
    """Return the fit with its sheet moved and its slip recomputed."""
    sheet, grid = fitted.sheet, fitted.sheet.grid
    U, _ = sheet.samples()
    B = grid.basis(U)
    K = grid.gram(B, np.ones(len(U))) + 1e-6 * grid.energy(2)
    C = K.solver(ridge=1e-9)(B.T @ _leaning(fitted, U, lean, level, limits))
    moved: MidSurface = sheet.with_coefficients(C)
    weights = density_weights(fitted.near, grid.step)
    slip = slip_potential(moved, fitted.near, weights, grid.energy(2))
    return replace(fitted, sheet=moved, slip=slip, lean=lean, level=level)
