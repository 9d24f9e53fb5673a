"""Fit one body: hull, split, map by the chosen method; all in working units."""

from __future__ import annotations

from geounfold.cloud import scattered
from geounfold.coarse import merged, merges
from geounfold.errors import (
    BackendError,
    ControlMeshError,
    FlatteningError,
    HullError,
    NoSheetError,
    SplitError,
)
from geounfold.frame import Frame
from geounfold.hull import extract_hull
from geounfold.mesh import Floats, TriMesh
from geounfold.methods import METHODS, Body, BodyFit, SurfacePair
from geounfold.methods.contract import OTHER_SIDE, Stage, mean_top_normal, turned_over
from geounfold.options import UnfoldOptions
from geounfold.reference import split_reference
from geounfold.split import SurfaceSplit, split

__all__ = ["BodyFit", "Stage", "SurfacePair", "fit", "top_looks_down"]


def fit(
    points: Floats,
    blocks: Floats,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit of one body.

    Parameters
    ----------
    points : (n, 3) float
        What the body is fitted to, working units: its blocks moved onto their lattice, sub-blocks
        and gaps filled.
    blocks : (b, 3) float
        Its blocks as they were given, which the map has to hold.
    frame : Frame
        Working frame.
    options : UnfoldOptions
        See there.
    reference : (TriMesh, TriMesh) or None
        Top and bottom given by the user, working units.
    stage : callable
        See Stage.

    Raises
    ------
    HullError, NoSheetError, SplitError, FlatteningError
        As the stages do.
    """
    with stage("hull"):
        tried = _merges(points, frame, options, reference)
    for merge in tried:
        try:
            return _fit_at(merge, points, blocks, frame, options, reference, stage)
        except _TOO_COARSE:
            continue
    return _fit_at(1, points, blocks, frame, options, reference, stage)


_TOO_COARSE = (BackendError, ControlMeshError, FlatteningError, HullError, NoSheetError, SplitError)
"""What a body's shape may do to merged blocks and not to the blocks themselves."""


def _merges(
    points: Floats, frame: Frame, options: UnfoldOptions, reference: object
) -> tuple[int, ...]:
    """Return how many blocks to merge along a cell's side, the most first (see merges).

    Scattered points are left as they are: nothing tells how full such cells are.
    """
    chosen = options.sheet_options.coarse
    if reference is not None or options.method != "sheet" or len(points) <= chosen.blocks:
        return ()
    if frame.steps is None and scattered(points):
        return ()
    return merges(points, frame.steps, chosen)


def _fit_at(
    merge: int,
    points: Floats,
    blocks: Floats,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit to cells of ``merge`` blocks a side, or, at 1, to the blocks (see fit)."""
    method, hull, coarse = METHODS[options.method], None, None
    if reference is None:
        with stage("hull"):
            name = method.hull if options.hull == "auto" else options.hull
            coarse = merged(points, frame.steps, merge) if merge > 1 else None
            cells, share = (points, None) if coarse is None else (coarse.points, coarse.share)
            hull = extract_hull(cells, frame.sides, name, options.hull_options, share)
        with stage("split"):
            parts = split(hull.mesh, options.split)
    else:
        with stage("split"):
            parts = split_reference(*reference)
    up = frame.up_in_work(options.up)
    over = top_looks_down(parts, up)
    body = Body(
        points=points,
        blocks=blocks,
        frame=frame,
        hull=hull,
        split=parts,
        up=up,
        datum=OTHER_SIDE.get(options.datum, options.datum) if over else options.datum,
        flattener=options.flattener,
        reach=options.reach,
        options=getattr(options, method.options),
        sheet_options=options.sheet_options,
        stage=stage,
        coarse=coarse,
    )
    result = method.fit(body)
    return turned_over(result) if over else result


def top_looks_down(parts: SurfaceSplit, up: Floats) -> bool:
    """Return whether the split's top side looks away from up, (3,) in working units.

    Decided once for the whole sheet by the area-weighted normals of its top; a sheet whose
    mean normal is square to up (within 3 degrees) keeps the top the split chose.
    """
    mean = mean_top_normal(parts)
    return bool(mean @ up < -0.05 * float((mean @ mean) ** 0.5))
