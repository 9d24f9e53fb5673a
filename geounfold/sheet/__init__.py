"""The sheet method: a spline mid surface, flattened, with prisms along its normals."""

from __future__ import annotations

from dataclasses import dataclass, field

from geounfold.mesh import Floats, TriMesh
from geounfold.sheet.build import ControlOptions, Flatten, SheetMesh, build_control
from geounfold.sheet.fit import FitOptions, FittedSheet, Samples, fit_sheet
from geounfold.sheet.horizons import HorizonOptions, Horizons, fit_horizons
from geounfold.sheet.medial import MedialOptions, MedialSheet, medial_sheet
from geounfold.split import SurfaceSplit

__all__ = [
    "ControlOptions",
    "FitOptions",
    "FittedSheet",
    "Flatten",
    "HorizonOptions",
    "Horizons",
    "MedialOptions",
    "MedialSheet",
    "Samples",
    "SheetMesh",
    "SheetOptions",
    "SheetResult",
    "fit_body",
]


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """Options of every stage of the sheet method; lengths in blocks."""

    medial: MedialOptions = field(default_factory=MedialOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    horizons: HorizonOptions = field(default_factory=HorizonOptions)
    control: ControlOptions = field(default_factory=ControlOptions)


@dataclass(frozen=True, eq=False)
class SheetResult:
    """Every stage of the sheet method, in working units."""

    medial: MedialSheet
    fitted: FittedSheet
    horizons: Horizons
    mesh: SheetMesh


def fit_body(
    split: SurfaceSplit,
    points: Floats,
    variance: Floats,
    inset: float,
    flatten: Flatten,
    options: SheetOptions,
    datum: str = "mid",
) -> SheetResult:
    """Return the control mesh of a split body by the sheet method, and what led to it.

    Parameters
    ----------
    split : SurfaceSplit
        The hull's (or the reference surfaces') faces as top, bottom, rim; working units.
    points : (n, 3) float
        Blocks, working units.
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

    Raises
    ------
    SplitError
        No part of the top has a parallel bottom.
    """

    def parameters(mesh: TriMesh, start: Floats | None) -> Floats:
        return flatten(mesh, start, None).uv

    medial = medial_sheet(split, parameters, options.medial)
    samples = Samples(split.mesh.V, medial.normals, variance, inset)
    fitted = fit_sheet(medial, samples, points, options.fit)
    horizons = fit_horizons(fitted, samples, options.fit.knots, options.horizons)
    mesh = build_control(fitted, horizons, points, flatten, options.control, datum)
    return SheetResult(medial, fitted, horizons, mesh)
