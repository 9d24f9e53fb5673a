"""The stages of the sheet method, in order: medial points, mid surface, horizons, control mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from geounfold.backends.progress import told, within
from geounfold.errors import ControlMeshError, HullError, SplitError
from geounfold.flattening import SpringOptions
from geounfold.flattening import flatten as flatten_surface
from geounfold.geometry.measures import face_normals, vertex_sum
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.methods.contract import PreparedBody
from geounfold.methods.sheet.attempts import Case, Trial, try_in_turn
from geounfold.methods.sheet.finishes import finish_in_turn
from geounfold.methods.sheet.meshing.build import MeshPlan, SheetMesh, build_control
from geounfold.methods.sheet.meshing.top_and_bottom import (
    Horizons,
    fit_horizons,
    separate_horizons,
)
from geounfold.methods.sheet.mid_surface.fit import FittedSheet, HullSamples
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet, medial_sheet
from geounfold.methods.sheet.mid_surface.parallel_surface import conform
from geounfold.methods.sheet.result import SheetResult
from geounfold.methods.sheet.sharpening.lattice_sites import Sites, surface_sites
from geounfold.methods.sheet.sharpening.site_rules import SiteRules
from geounfold.surfaces.given import SOLID
from geounfold.surfaces.hull import extract_hull

_LOOSE_SPRINGS = SpringOptions(tol=1e-4)

_TOO_ROUGH = 0.12
"""Roughness of the smooth fit, in cells of merged blocks, above which the cells are too coarse.

Measured: 0.03 to 0.08 if the sheet could be sharpened, 0.28 if it could not.
"""


def sheet_stages(body: PreparedBody, datum: str, shell: float) -> SheetResult:
    """Return the stages of the sheet method; other methods take their surfaces from here.

    Parameters
    ----------
    body : PreparedBody
        Points, hull, split and options of one body.
    datum : str
        Which surface is flat: mid, top, bottom or proportional.
    shell : float
        Distance past the control mesh that its shell reaches, in blocks.

    Raises
    ------
    SplitError
        No part of the top has a parallel bottom; or merged blocks are too coarse for the body.
    ControlMeshError
        The body meets its mid surface in separate parts; or blocks were merged and the control mesh
        could not be proved or does not hold every block.
    """
    with body.stage("sheet"):
        unit = 1 if body.coarse is None else body.coarse.merge
        with within(0.0, 0.08):
            medial = medial_sheet(body.split, parameters, body.sheet_options.core)
        case = case_of(body, medial, unit, partial(_sites, body))
        with within(0.08, 0.5):
            trials = _fitted(case)
        outline = _outline(body, case)
        plan = MeshPlan(body.flatten, datum, body.sheet_options.mesh_cell, shell, body.count)

        def build(trial: Trial, misfit: float) -> tuple[FittedSheet, Horizons, SheetMesh]:
            fitted = conform(trial.fitted, medial.scaled(unit), parameters)
            told(0.1)
            horizons = _horizons(fitted, case.samples, trial, misfit)
            with within(0.2, 0.95):
                mesh = build_control(fitted, horizons, outline, body.blocks, plan)
            return fitted, horizons, mesh

        hull = _judged_by(body, unit)
        walls = None
        if body.walls is not None:
            walls = body.walls.at_faces(hull.V[hull.F].mean(axis=1), face_normals(hull.V, hull.F))
        sides = body.frame.sides
        side = unit * (1.0 if sides is None else float(max(sides)))
        with within(0.5, 1.0):
            best, finishes = finish_in_turn(trials, build, (hull, walls), body.frame, side)
        if unit > 1 and not best.mesh.sound:
            raise ControlMeshError(f"no control mesh with cells of {unit} blocks a side is sound")
        return SheetResult(medial, trials, best, finishes)


def _judged_by(body: PreparedBody, unit: int) -> TriMesh:
    """Return the closed surface by which finished meshes are judged, working units.

    Between two given surfaces that is a hull of the blocks, because these have no rim. A solid's
    own surface has edges longer than a column of the judge, which misses faces: 4 % of the outline
    of a body of 54,400 blocks, 0.1 % with its triangles cut in four.
    """
    surface = body.split.scaled(unit).mesh
    if body.hull is None:
        try:
            return extract_hull(body.points, body.frame.sides).mesh
        except HullError:
            return surface
    return surface.quartered() if body.hull.method == SOLID else surface


def case_of(
    body: PreparedBody, medial: MedialSheet, unit: int, find_sites: Callable[[], Sites | None]
) -> Case:
    """Return the data that the mid surface is fitted to and judged by.

    Sites are looked for when they are first used: cells too coarse for a body need none.
    """
    split, hull, coarse = body.split, body.hull, body.coarse
    side = vertex_sum(split.side.astype(float), split.mesh.F, len(split.mesh.V))
    variance = np.zeros(3) if hull is None else hull.blur_variance(body.frame.sides)
    inset = 0.0 if hull is None else hull.inset
    samples = HullSamples(
        split.mesh.V, medial.normals, np.sign(side).astype(np.int64), variance, inset
    )
    if body.walls is not None:
        samples = samples.part(
            ~body.walls.scaled(1 / unit).at_vertices(samples.points, samples.normals)
        )
    return Case(
        medial=medial,
        samples=samples,
        cells=body.points if coarse is None else coarse.points,
        points=body.points,
        find_sites=find_sites,
        unit=unit,
        judged=hull is not None,
        smoothing=body.sheet_options.smoothing,
    )


def _sites(body: PreparedBody) -> Sites | None:
    """Return the lattice sites at the surface of the body; None without lattice or hull."""
    steps, coarse = body.frame.steps, body.coarse
    if steps is None or body.hull is None:
        return None
    if coarse is None:
        sites = surface_sites(np.rint(body.points / steps).astype(np.int64), steps)
    else:
        near = np.rint(body.points[coarse.beside] / steps).astype(np.int64)
        sites = surface_sites(near, steps, coarse.border[coarse.beside])
    if body.walls is None:
        return sites
    keep = sites.occupied | ~body.walls.past(sites.points)
    return Sites(sites.points[keep], sites.occupied[keep])


def _outline(body: PreparedBody, case: Case) -> Floats:
    """Return the blocks that the control mesh is laid out by, (k, 3): all, if none are merged.

    Of merged blocks they are those at the surface, and the cells' middles: every place of the mid
    surface over which blocks lie has some of them, and the highest and lowest ones.
    """
    if body.coarse is None:
        return body.points
    sites, coarse = case.sites, body.coarse
    shell = body.points[coarse.border] if sites is None else sites.points[sites.occupied]
    return np.concatenate([shell, coarse.merge * coarse.points])


def _fitted(case: Case) -> tuple[Trial, ...]:
    """Return the trials that are finished, the one taken last; of merged blocks that one alone.

    Raises
    ------
    SplitError
        Merged blocks are too coarse for the bends of the body, or too coarse to be sharpened.
    """
    if case.unit > 1 and case.smooth.roughness > _TOO_ROUGH * case.unit:
        raise SplitError(f"cells of {case.unit} blocks a side are too coarse for the body's bends")
    taken, trials = try_in_turn(case)
    if case.unit > 1 and not taken.sharpened:
        raise SplitError(
            f"a sheet fitted to cells of {case.unit} blocks a side cannot be sharpened"
        )
    return trials if case.unit == 1 else (taken,)


def _horizons(fitted: FittedSheet, samples: HullSamples, taken: Trial, misfit: float) -> Horizons:
    """Return top and bottom, fitted to the hull and moved by the lattice sites if they agree."""
    hull = fitted.scaled(1 / fitted.unit)
    horizons = fit_horizons(hull, samples, hull.sheet.grid.step, misfit).scaled(fitted.unit)
    if taken.sharpened == "sites" and taken.sites is not None:
        return separate_horizons(fitted, horizons, taken.sites, SiteRules())
    return horizons


def parameters(mesh: TriMesh, start: Floats | None) -> Floats:
    """Return near-isometric parameters of a surface, (n, 2), from springs stopped early."""
    return flatten_surface(mesh, "spring", start=start, options=_LOOSE_SPRINGS, repair=False).uv
