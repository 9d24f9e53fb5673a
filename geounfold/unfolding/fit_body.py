"""Fit one body: hull, split, map by the chosen method; all in working units."""

from __future__ import annotations

from dataclasses import replace

from geounfold.body.fault_surface import FaultWalls
from geounfold.body.merged_blocks import MergedBlocks, merge_blocks, merge_sizes
from geounfold.body.prepare import BodyPoints
from geounfold.body.scattered import scattered
from geounfold.body.working_frame import Frame
from geounfold.errors import (
    BackendError,
    ControlMeshError,
    FlatteningError,
    GeounfoldError,
    HullError,
    NoSheetError,
    SplitError,
    StreamError,
)
from geounfold.geometry.measures import face_normals
from geounfold.geometry.mesh import Bools, Floats, TriMesh
from geounfold.methods import METHODS, BodyFit, PreparedBody, SurfacePair
from geounfold.methods.contract import Stage, mean_top_normal
from geounfold.methods.sheet.members.run import run_members
from geounfold.methods.turned_over import OTHER_SIDE, turned_over
from geounfold.surfaces.given import solid_hull, split_reference
from geounfold.surfaces.hull import extract_hull
from geounfold.surfaces.split import split
from geounfold.surfaces.split.result import SurfaceSplit
from geounfold.unfolding.options import UnfoldOptions

__all__ = ["BodyFit", "Stage", "SurfacePair", "fit", "top_looks_down"]


def fit(
    body: BodyPoints,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit of one body.

    Parameters
    ----------
    body : BodyPoints
        Its points, working units.
    frame : Frame
        Working frame.
    options : UnfoldOptions
        Which method, flattener, hull and split.
    reference : (TriMesh, TriMesh) or None
        Top and bottom given by the user, working units.
    stage : callable
        Times and names a stage: ``with stage("hull"):``.

    Raises
    ------
    NoSheetError
        The body is too crude for a hull, or as the stages do.
    HullError, SplitError, FlatteningError
        As the stages do.
    """
    if body.shell is not None and reference is None and options.hull == "auto":
        try:
            return _fit_in_turn(body, frame, options, reference, stage)
        except _TOO_COARSE as error:
            found = fit(replace(body, shell=None), frame, options, reference, stage)
            told = f"the horizons are those of the blocks, not of the solid's surface: {error}"
            return replace(found, warnings=(*found.warnings, told))
    return _fit_in_turn(replace(body, shell=None), frame, options, reference, stage)


def _fit_in_turn(
    body: BodyPoints,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit of one body, to merged blocks first if there are many (see fit)."""
    if body.mended is not None and reference is None:
        body.mended.check()
    with stage("hull"):
        tried = _merges(body, frame, options, reference)
    failed: GeounfoldError | None = None
    for merge in tried:
        try:
            return _fit_at(merge, body, frame, options, reference, stage)
        except _TOO_COARSE as error:
            failed = error
    if body.hollow is not None:
        raise StreamError(f"no fit to merged blocks holds ({failed or 'it has too few blocks'})")
    try:
        return _fit_at(1, body, frame, options, reference, stage)
    except _TOO_COARSE as error:
        if body.mended is None or not body.mended.crude or reference is not None:
            raise
        raise NoSheetError(f"{body.mended.too_crude()} (the mended body fails: {error})") from error


_TOO_COARSE = (BackendError, ControlMeshError, FlatteningError, HullError, NoSheetError, SplitError)
"""Errors that merged blocks may cause on bodies that the single blocks do not."""


def _merges(
    body: BodyPoints, frame: Frame, options: UnfoldOptions, reference: object
) -> tuple[int, ...]:
    """Return how many blocks to merge along a cell's side, the most first (see merge_sizes).

    Scattered points are not merged: the share of such a cell that is full is not known.
    """
    above, points = options.sheet_options.merge_above, body.fitted
    if body.hollow is not None:
        return body.hollow.merge_sizes(above)
    if reference is not None or options.method != "sheet" or len(points) <= above:
        return ()
    if frame.steps is None and scattered(points):
        return ()
    return merge_sizes(points, frame.steps, above)


def _fit_at(
    merge: int,
    body: BodyPoints,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit to cells of ``merge`` blocks a side, or, at 1, to the blocks (see fit)."""
    points, method, hull, coarse = body.fitted, METHODS[options.method], None, None
    if reference is None:
        with stage("hull"):
            name = method.hull if options.hull == "auto" else options.hull
            coarse = _merged(body, frame, merge) if merge > 1 else None
            cells, share = (points, None) if coarse is None else (coarse.points, coarse.share)
            if body.shell is None:
                hull = extract_hull(cells, frame.sides, name, options.hull_options, share)
            else:
                shell = body.shell.with_vertices(body.shell.V / merge)
                hull = solid_hull(shell, cells, float(len(cells) if share is None else share.sum()))
        with stage("split"):
            walls = None if body.walls is None else _walled(hull.mesh, body.walls.scaled(1 / merge))
            parts = split(hull.mesh, options.split, walls=walls)
    else:
        with stage("split"):
            parts = split_reference(*reference)
    up = frame.up_in_work(options.up)
    over = top_looks_down(parts, up)
    prepared = PreparedBody(
        points=points,
        blocks=body.blocks,
        frame=frame,
        hull=hull,
        split=parts,
        up=up,
        datum=OTHER_SIDE.get(options.datum, options.datum) if over else options.datum,
        flattener=options.flattener,
        flattener_options=options.flattener_options,
        reach=options.reach,
        options=getattr(options, method.options),
        sheet_options=options.sheet_options,
        stage=stage,
        coarse=coarse,
        count=None if body.hollow is None else body.count,
        walls=body.walls if reference is None else None,
    )
    result = method.fit(prepared)
    if options.uncertainty and result.sheet is not None:
        with stage("uncertainty"):
            result = replace(
                result, spread=run_members(prepared, result.sheet, options.uncertainty)
            )
    return turned_over(result) if over else result


def _merged(body: BodyPoints, frame: Frame, merge: int) -> MergedBlocks:
    """Return the blocks of a body merged into cells of ``merge`` blocks a side."""
    if body.hollow is not None:
        return body.hollow.merged(merge)
    return merge_blocks(body.fitted, frame.steps, merge)


def _walled(hull: TriMesh, walls: FaultWalls) -> Bools:
    """Return which faces of a hull are at walls, (m,)."""
    return walls.at_faces(hull.V[hull.F].mean(axis=1), face_normals(hull.V, hull.F))


def top_looks_down(parts: SurfaceSplit, up: Floats) -> bool:
    """Return whether the split's top side looks away from up, (3,) in working units.

    The area-weighted mean normal of the top decides for the whole sheet.  If it is square to up
    (within 3 degrees), the split's own top is kept.
    """
    mean = mean_top_normal(parts)
    return bool(mean @ up < -0.05 * float((mean @ mean) ** 0.5))
