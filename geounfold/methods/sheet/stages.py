"""The sheet method: a spline mid surface, flattened, with prisms along its normals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.body.merged_blocks import MergedBlocks
from geounfold.errors import ControlMeshError, SplitError
from geounfold.flattening import SpringOptions
from geounfold.flattening import flatten as flatten_surface
from geounfold.geometry.measures import vertex_sum
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.methods.sheet.meshing.build import Flatten, SheetMesh, build_control
from geounfold.methods.sheet.meshing.top_and_bottom import Horizons, fit_horizons, separate_horizons
from geounfold.methods.sheet.mid_surface.fit import (
    FitOptions,
    FittedSheet,
    HullSamples,
    fit_mid_surface,
)
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet, medial_sheet
from geounfold.methods.sheet.mid_surface.parallel_surface import conform
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.sheet.sharpening.by_lattice_sites import enough_sites, sharpen
from geounfold.methods.sheet.sharpening.by_layers import sharpen_layers
from geounfold.methods.sheet.sharpening.lattice_sites import Sites, surface_sites
from geounfold.surfaces.split.result import SurfaceSplit

__all__ = ["SheetResult", "fit_body"]


_LOOSE_SPRINGS = SpringOptions(tol=1e-4)


_TOO_ROUGH = 0.12
"""Roughness of the first sheet, in cells of merged blocks, above which they are too coarse.

Measured: 0.03 to 0.08 where the sheet could be sharpened, 0.28 where it could not.
"""


_CLEARLY = 0.7
"""Share of the sites' mean depth that a closer fit may leave where none separates them.

Measured: 0.05 to 0.5 where the first fit had lost a limb, 0.9 to 1.6 where the closer one did.
"""


@dataclass(frozen=True, eq=False)
class SheetResult:
    """Every stage of the sheet method, in working units.

    ``sharpened``: by lattice ``sites``, by ``layers``, or by nothing (empty).
    """

    medial: MedialSheet
    fitted: FittedSheet
    horizons: Horizons
    mesh: SheetMesh
    sharpened: str


def fit_body(
    split: SurfaceSplit,
    points: Floats,
    blocks: Floats,
    steps: Floats | None,
    variance: Floats,
    inset: float,
    flatten: Flatten,
    options: SheetOptions,
    datum: str = "mid",
    exact: bool = False,
    coarse: MergedBlocks | None = None,
) -> SheetResult:
    """Return the control mesh of a split body by the sheet method, and what led to it.

    Parameters
    ----------
    split : SurfaceSplit
        The hull's (or the reference surfaces') faces as top, bottom, rim; in working units, or
        in those of ``coarse``.
    points : (n, 3) float
        What the sheet is fitted to, working units: blocks on their lattice, gaps filled.
    blocks : (b, 3) float
        Blocks as they were given, which the control mesh has to hold.
    steps : (3,) float or None
        Block sides, where the blocks lie on a lattice at whole multiples of them.
    variance : (3,) float
        Variance of the blur the hull was made with, per axis; zeros for none.  Like ``inset``
        in the split's unit.
    inset : float
        How far inside the body's surface the hull runs.
    flatten : callable
        See Flatten.
    options : SheetOptions
        See there.
    datum : str
        Which surface is flat: mid, top, bottom or proportional.
    exact : bool
        The faces are the horizons themselves (reference surfaces): blocks do not correct them.
    coarse : MergedBlocks, optional
        The points merged into cells, which the hull was made of; its unit is a cell's side.

    Raises
    ------
    SplitError
        No part of the top has a parallel bottom; or merged blocks are too coarse for the body.
    ControlMeshError
        The blocks lie on the mid surface in parts; or of merged blocks: it could not be proved, or
        does not hold every block.
    """
    unit = 1 if coarse is None else coarse.merge
    medial = medial_sheet(split, _parameters, options.medial)
    side = vertex_sum(split.side.astype(float), split.mesh.F, len(split.mesh.V))
    samples = HullSamples(
        split.mesh.V, medial.normals, np.sign(side).astype(np.int64), variance, inset
    )
    cells = points if coarse is None else coarse.points

    def first(fit: FitOptions) -> FittedSheet:
        return fit_mid_surface(medial, samples, cells, fit).scaled(unit)

    fitted, fit = _first(first, options)
    if coarse is not None and fitted.roughness > _TOO_ROUGH * unit:
        raise SplitError(f"cells of {unit} blocks a side are too coarse for the body's bends")
    if exact:
        sharpened, used = "", None
    else:
        sites = None if steps is None else _sites(points, steps, coarse)
        fitted, sharpened, used = _fitted(fitted, fit, first, points, sites, options)
    if coarse is not None and not sharpened:
        raise SplitError(f"a sheet fitted to cells of {unit} blocks a side cannot be sharpened")
    fitted = conform(fitted, medial.scaled(unit), _parameters, options.conform)
    hull = fitted.scaled(1 / unit)
    horizons = fit_horizons(hull, samples, hull.sheet.grid.step, options.horizons).scaled(unit)
    if used is not None and sharpened:
        horizons = separate_horizons(fitted, horizons, used, options.horizons, options.occupancy)
    mesh = build_control(fitted, horizons, points, blocks, flatten, options.control, datum)
    if coarse is not None and not mesh.sound:
        raise ControlMeshError(f"no control mesh with cells of {unit} blocks a side is sound")
    return SheetResult(medial, fitted, horizons, mesh, sharpened)


def _first(
    first: Callable[[FitOptions], FittedSheet], options: SheetOptions
) -> tuple[FittedSheet, FitOptions]:
    """Return the sheet fitted to the hull alone, and how: allowing for a taper where it may be."""
    fitted = first(options.fit)
    half = fitted.sheet.grid.value(fitted.half, fitted.near)
    if float(np.std(half)) > options.tapering * float(np.mean(half)):
        fit = _tapering(options.fit, options)
        tapered = _tried(first, fit)
        if tapered is not None and tapered.accepted > options.taper_gain * fitted.accepted:
            return tapered, fit
    return fitted, options.fit


def _tapering(fit: FitOptions, options: SheetOptions) -> FitOptions:
    return replace(fit, order_half=3, smooth_half=options.taper_half)


def _tried(first: Callable[[FitOptions], FittedSheet], fit: FitOptions) -> FittedSheet | None:
    """Return another fit than the first; None where no sample agrees with it."""
    try:
        return first(fit)
    except SplitError:
        return None


def _parameters(mesh: TriMesh, start: Floats | None) -> Floats:
    """Return near-isometric parameters of a surface, (n, 2): springs, not to the last digit."""
    return flatten_surface(mesh, "spring", start=start, options=_LOOSE_SPRINGS, repair=False).uv


def _sites(points: Floats, steps: Floats, coarse: MergedBlocks | None) -> Sites:
    """Return the lattice sites at the surface of the points' body."""
    if coarse is None:
        return surface_sites(np.rint(points / steps).astype(np.int64), steps)
    near = np.rint(points[coarse.beside] / steps).astype(np.int64)
    return surface_sites(near, steps, coarse.border[coarse.beside])


def _fitted(
    fitted: FittedSheet,
    fit: FitOptions,
    first: Callable[[FitOptions], FittedSheet],
    points: Floats,
    sites: Sites | None,
    options: SheetOptions,
) -> tuple[FittedSheet, str, Sites | None]:
    """Return the fitted sheet, what sharpened it (see SheetResult), and the sites used.

    ``fitted`` is fitted to the hull alone, as ``first`` does it with the options ``fit``.
    Where sites or points contradict it, it is fitted again: more choosily, as a rim may have been
    taken for a horizon, then more closely.  Sites that contradict all of these belong to a rougher
    body; of the closer fit and a rougher one that is taken which they contradict less, or which
    leaves less of the blocks out.
    """
    if sites is None:
        layered = sharpen_layers(fitted, points, options.layers)
        if layered is not None:
            return layered, "layers", None
        return _holding(fitted, first, points, options), "", None
    used = enough_sites(fitted, sites, options.occupancy)
    once = sharpen(fitted, used, options.occupancy)
    if once.sheet is not None:
        return once.sheet, "sites", used
    if fitted.unit <= 1:
        choosy = replace(_tapering(fit, options), agree=options.refused_agree)
        other = _tried(first, choosy)
        if other is not None and other.accepted > options.refused_share:
            again = sharpen(other, used, options.occupancy)
            if again.sheet is not None:
                return again.sheet, "sites", used
    contradicted = np.isfinite(once.depth)  # else no site said anything
    closer = _tried(first, options.closer) if contradicted else None
    if closer is not None:
        others = enough_sites(closer, sites, options.occupancy)
        again = sharpen(closer, others, replace(options.occupancy, sheared=options.sheared))
        if again.sheet is not None:
            return again.sheet, "sites", others
    rougher = first(replace(fit, rough=options.refused_rough))
    if closer is None or again.depth > _CLEARLY * once.depth:
        return rougher, "", used
    if closer.left_out(points) >= rougher.left_out(points):
        return rougher, "", used
    return closer, "", others


def _holding(
    fitted: FittedSheet,
    first: Callable[[FitOptions], FittedSheet],
    points: Floats,
    options: SheetOptions,
) -> FittedSheet:
    """Return the sheet, or one fitted more closely where that leaves out half as much or less."""
    over = fitted.left_out(points)
    if over < options.left_out * fitted.unit:
        return fitted
    closer = _tried(first, options.closer)
    return fitted if closer is None or closer.left_out(points) > over / 2 else closer
