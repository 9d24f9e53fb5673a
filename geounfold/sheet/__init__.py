"""The sheet method: a spline mid surface, flattened, with prisms along its normals."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from geounfold.flattening import SpringOptions
from geounfold.flattening import flatten as flatten_surface
from geounfold.geometry import vertex_sum
from geounfold.mesh import Floats, TriMesh
from geounfold.sheet.build import ControlOptions, Flatten, SheetMesh, build_control
from geounfold.sheet.conform import ConformOptions, conform
from geounfold.sheet.fit import FitOptions, FittedSheet, Samples, fit_sheet
from geounfold.sheet.horizons import (
    HorizonOptions,
    Horizons,
    fit_horizons,
    separate_horizons,
)
from geounfold.sheet.layered import LayerOptions, sharpen_layers
from geounfold.sheet.medial import MedialOptions, MedialSheet, medial_sheet
from geounfold.sheet.occupancy import OccupancyOptions, sharpen
from geounfold.sheet.sites import Sites, surface_sites
from geounfold.split import SurfaceSplit

__all__ = [
    "ConformOptions",
    "ControlOptions",
    "FitOptions",
    "FittedSheet",
    "Flatten",
    "HorizonOptions",
    "Horizons",
    "LayerOptions",
    "MedialOptions",
    "MedialSheet",
    "OccupancyOptions",
    "Samples",
    "SheetMesh",
    "SheetOptions",
    "SheetResult",
    "fit_body",
]


_COARSE = SpringOptions(tol=1e-4)


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """Options of every stage of the sheet method; lengths in blocks.

    ``refused_rough``: the fit's ``rough`` where lattice sites do not agree with a smooth sheet.
    """

    medial: MedialOptions = field(default_factory=MedialOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    occupancy: OccupancyOptions = field(default_factory=OccupancyOptions)
    horizons: HorizonOptions = field(default_factory=HorizonOptions)
    layers: LayerOptions = field(default_factory=LayerOptions)
    conform: ConformOptions = field(default_factory=ConformOptions)
    control: ControlOptions = field(default_factory=ControlOptions)
    refused_rough: float = 1.25


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
) -> SheetResult:
    """Return the control mesh of a split body by the sheet method, and what led to it.

    Parameters
    ----------
    split : SurfaceSplit
        The hull's (or the reference surfaces') faces as top, bottom, rim; working units.
    points : (n, 3) float
        What the sheet is fitted to, working units: blocks on their lattice, gaps filled.
    blocks : (b, 3) float
        Blocks as they were given, which the control mesh has to hold.
    steps : (3,) float or None
        Block sides, where the blocks lie on a lattice at whole multiples of them.
    variance : (3,) float
        Variance of the blur the hull was made with, per axis; zeros for none.
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

    Raises
    ------
    SplitError
        No part of the top has a parallel bottom.
    """
    medial = medial_sheet(split, _parameters, options.medial)
    side = vertex_sum(split.side.astype(float), split.mesh.F, len(split.mesh.V))
    samples = Samples(split.mesh.V, medial.normals, np.sign(side).astype(np.int64), variance, inset)
    sites = None
    if exact:
        fitted, sharpened = fit_sheet(medial, samples, points, options.fit), ""
    else:
        if steps is not None:
            sites = surface_sites(np.rint(points / steps).astype(np.int64), steps)
        fitted, sharpened = _fitted(medial, samples, points, sites, options)
    fitted = conform(fitted, medial, _parameters, options.conform)
    horizons = fit_horizons(fitted, samples, options.fit.knots, options.horizons)
    if sites is not None and sharpened:
        horizons = separate_horizons(fitted, horizons, sites, options.horizons, options.occupancy)
    mesh = build_control(fitted, horizons, points, blocks, flatten, options.control, datum)
    return SheetResult(medial, fitted, horizons, mesh, sharpened)


def _parameters(mesh: TriMesh, start: Floats | None) -> Floats:
    """Return near-isometric parameters of a surface, (n, 2): springs, not to the last digit."""
    return flatten_surface(mesh, "spring", start=start, options=_COARSE, repair=False).uv


def _fitted(
    medial: MedialSheet,
    samples: Samples,
    points: Floats,
    sites: Sites | None,
    options: SheetOptions,
) -> tuple[FittedSheet, str]:
    """Return the fitted sheet, and what sharpened it (see SheetResult).

    Sites that no smooth sheet explains belong to a rougher body: it is fitted again, less
    smoothly.
    """
    fitted = fit_sheet(medial, samples, points, options.fit)
    if sites is None:
        layered = sharpen_layers(fitted, points, options.layers)
        return (fitted, "") if layered is None else (layered, "layers")
    sharper = sharpen(fitted, sites, options.occupancy)
    if sharper is not None:
        return sharper, "sites"
    rougher = replace(options.fit, rough=options.refused_rough)
    return fit_sheet(medial, samples, points, rougher), ""
