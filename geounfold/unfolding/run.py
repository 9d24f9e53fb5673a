"""Unfold a body: the stages in order."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from typing import Any

import numpy as np
import pandas as pd

from geounfold.backends.blas import one_thread
from geounfold.body.fill import FilledSolid
from geounfold.body.fill.shell_of_bodies import horizons_of_blocks, with_shells
from geounfold.body.parts.division import Division
from geounfold.body.prepare import BodyPoints, PreparedPoints, prepare
from geounfold.body.working_frame import Frame
from geounfold.errors import GeounfoldError, InputError
from geounfold.faults.given import FaultsGiven, Surfaces, block_column
from geounfold.faults.limit_rims import limit_rims
from geounfold.faults.limits import FoundLimit, Limits, limited
from geounfold.faults.rejoin import Faulting
from geounfold.geometry.mesh import Bools, Floats, TriMesh, as_trimesh
from geounfold.io.result_columns import frame_points
from geounfold.io.selection import read_where
from geounfold.io.selection.mixed import mixed_frame
from geounfold.io.tables.points import chosen_rows
from geounfold.mapping.body_cells import BodyCells
from geounfold.mapping.carried import checked_points
from geounfold.mapping.certificate import certify
from geounfold.mapping.control_mesh import side_by_side, vertex_parts
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.mapping.parts_space import MapParts
from geounfold.methods import METHODS, BodyFit, PointwiseMap
from geounfold.unfolding.checks import check_faulted, check_limited, check_method, check_single
from geounfold.unfolding.clock import Clock, Progress
from geounfold.unfolding.fit_blocks import fit_blocks, fit_untold
from geounfold.unfolding.fit_body import fit
from geounfold.unfolding.measured import measure
from geounfold.unfolding.options import UnfoldOptions, check_names
from geounfold.unfolding.result import Unfolding
from geounfold.unfolding.summary import RunRecord, warnings_of
from geounfold.unfolding.uncertain import uncertainty_of

_log = logging.getLogger("geounfold")


def _hinting(run: Callable[..., Unfolding]) -> Callable[..., Unfolding]:
    """Name the columns of rock that vary behind an error, if the user chose no rows."""

    @wraps(run)
    def hinted(points: Any, *args: Any, **more: Any) -> Unfolding:
        try:
            return run(points, *args, **more)
        except GeounfoldError as error:
            frame = isinstance(points, pd.DataFrame) and more.get("where") is None
            hint = mixed_frame(points) if frame else ""
            if not hint:
                raise
            raise type(error)(f"{error}; {hint}") from error

    return hinted


@one_thread()
@_hinting
def unfold(  # the inputs on faults belong together, and to the points as top and bottom do
    points: Floats | pd.DataFrame | FilledSolid,
    options: UnfoldOptions | None = None,
    *,
    top: TriMesh | tuple[Any, Any] | None = None,
    bottom: TriMesh | tuple[Any, Any] | None = None,
    faults: Surfaces | None = None,
    fault_blocks: Any | None = None,
    slip_direction: Mapping[str, Any] | None = None,
    outline: str = "ore",
    limits: Any | None = None,
    progress: Progress | None = None,
    where: str | None = None,
    **changes: Any,
) -> Unfolding:
    """Take the folds out of a body given by its block centroids.

    Parameters
    ----------
    points : (n, 3) array, DataFrame or FilledSolid
        Centroids in any length unit and any coordinates; of a DataFrame the coordinate
        columns are found by name (centroid_x/y/z, x/y/z, XC/YC/ZC, easting/...).  Of a
        solid that `fill` made, its own surfaces become the horizons.
    options : UnfoldOptions, optional
        Defaults if not given.
    top, bottom : TriMesh or (V, F), optional
        Hanging wall and footwall in the points' coordinates, in place of an extracted hull;
        both or neither.
    faults : mapping or sequence, optional
        Fault surfaces as TriMesh, (V, F) or file, by name or in a sequence. The body is cut along
        them into fault blocks; each is unfolded, and all are joined in one flat space.
    fault_blocks : (n,) array or str, optional
        Fault block of every point, numbers or texts; or the column of the DataFrame with them.
    slip_direction : mapping, optional
        (TREND, PLUNGE) of the slip in degrees, by the fault's name.
    outline : str
        ``ore`` if the rims are the ore's own, whose ends at a fault mark its slip; ``model`` if
        the block model was cut off there.
    limits : sequence, optional
        Where the block model was cut off, so that the rim there is no pinch-out: surfaces (file,
        TriMesh or (V, F)), boxes of six numbers x0, x1, y0, y1, z0, z1 (None where the model goes
        on), or polygons (k, 2) in plan.  What lies there is withheld from the fit of the layers.
    progress : callable, optional
        Called with every stage's name as it begins.  If it takes two arguments, it also gets the
        share of the run that is done, 0 to 1, and is called inside long stages too.
    where : str, optional
        Chooses rows of a DataFrame, such as ``"ROCK=ORE and AU>0.2"``; see the command line's
        ``--where``. The body is those rows alone; ``Unfolding.table`` has all rows, the others
        empty.
    **changes
        Fields of UnfoldOptions given by name.

    Returns
    -------
    Unfolding

    Raises
    ------
    InputError
        Points that are no body (too few, flat, several bodies, no sheet), or options outside
        their valid values.
    HullError, SplitError, FlatteningError, ControlMeshError
        A stage failed; the message names the place and what to try.

    Examples
    --------
    >>> import geounfold as gu
    >>> body = gu.simulate("sim_case_1")
    >>> u = gu.unfold(body.folded)
    >>> u.points.shape == body.folded.shape
    True
    """
    check_names(changes, UnfoldOptions)
    chosen = replace(options or UnfoldOptions(), **changes)
    check_method(chosen)
    solid: FilledSolid | None = None
    if isinstance(points, FilledSolid):
        solid, points = points, points.table
        if solid.pair is not None and top is None and bottom is None:
            top, bottom = solid.pair.top, solid.pair.bottom
    given, rows = points if isinstance(points, pd.DataFrame) else None, None
    if where is not None:
        if given is None:
            raise InputError("where chooses rows by columns: give a DataFrame")
        rows = chosen_rows(read_where(where), given, "the table")
        points = given.loc[rows]
    clock = Clock(progress)
    with clock.stage("frame"):
        place = _coordinates(points)
        blocks = block_column(fault_blocks, given, rows)
        found = FaultsGiven.of(faults, blocks, slip_direction, outline, len(place))
        ends = Limits.of(limits, place)
    if ends is not None:
        check_limited(chosen, given=top is not None or bottom is not None)
    if found is not None:
        check_faulted(chosen, given=top is not None or bottom is not None)
        return _finished(_faulted(place, Faulting(found), ends, chosen, clock), given, rows, clock)
    with clock.stage("frame"):
        divide = chosen.parts == "auto" and top is None and METHODS[chosen.method].control
        prepared, bodies = prepare(place, chosen.body, parts=divide)
        check_single(prepared.groups, chosen)
        bodies, at = _limited(bodies, prepared.frame, ends)
        walls = [body.walls for body in bodies]
    reference, told = _reference(top, bottom, prepared.frame), ""
    if solid is not None and reference is None:
        bodies = with_shells(bodies, prepared, solid.shell)
        told = horizons_of_blocks(bodies, prepared, solid.shell)
    fits = []
    for part, body in enumerate(bodies):
        clock.body(part, len(bodies))
        with _named(prepared.division, part):
            fits.append(fit(body, prepared.frame, chosen, reference, clock.stage))
    if told:
        fits[0] = replace(fits[0], warnings=(*fits[0].warnings, told))
    del bodies  # as large as the points, and not needed any more
    with clock.stage("map"):
        mapping = _one_map(fits, prepared, chosen)
    off = uncertainty_of(fits, prepared.frame, chosen)
    measured = measure(mapping, prepared, fits, chosen, clock.stage, uncertainty=off)
    rims = limit_rims(at, walls, fits, prepared.frame.scale)
    record = RunRecord(chosen, prepared, fits, mapping, measured, clock.seconds, None, off, rims)
    return _finished(record, given, rows, clock)


def _finished(
    record: RunRecord, given: pd.DataFrame | None, rows: Bools | None, clock: Clock
) -> Unfolding:
    """Return the result of a run, with its warnings logged."""
    for warning in warnings_of(record):
        _log.warning("%s", warning)
    clock.over()
    return Unfolding(record, given, rows)


def _limited(
    bodies: list[BodyPoints], frame: Frame, limits: Limits | None
) -> tuple[list[BodyPoints], tuple[FoundLimit, ...]]:
    """Return the bodies with the limits that end them, and the limits."""
    if limits is None:
        return bodies, ()
    found = limits.in_work(frame, np.concatenate([body.fitted for body in bodies]))
    return limited(bodies, found), found


def _faulted(
    points: Floats,
    faulting: Faulting,
    limits: Limits | None,
    options: UnfoldOptions,
    clock: Clock,
) -> RunRecord:
    """Return the run of a body cut into fault blocks, which are unfolded and joined."""
    with clock.stage("faults"):
        prepared, bodies = prepare(points, cut=faulting.cut)
    if faulting.lacks_surfaces:
        untold = fit_untold(bodies, prepared.frame, options, clock.stage)
        with clock.stage("faults"):
            faulting.find_surfaces(bodies, untold)
    with clock.stage("faults"):
        bodies, at = _limited(faulting.walled(bodies), prepared.frame, limits)
    fits = fit_blocks(bodies, prepared.frame, options, clock.stage)
    with clock.stage("joining"):
        fits, found = faulting.join(fits, bodies, options.reach)
    with clock.stage("map"):
        meshes = [(f.control, f.shell) for f in fits if f.control is not None]
        control, shell = side_by_side(meshes, apart=False)
        parts = MapParts(vertex_parts(meshes), found.cells)
        mapping = UnfoldingMap(
            *(prepared.frame, control, shell, options.reach),
            coordinates=options.coordinates,
            parts=parts,
            body=_body_cells(prepared),
        )
    off = uncertainty_of(fits, prepared.frame, options, found)
    measured = measure(mapping, prepared, fits, options, clock.stage, found, off)
    rims = limit_rims(at, [body.walls for body in bodies], fits, prepared.frame.scale)
    return RunRecord(options, prepared, fits, mapping, measured, clock.seconds, found, off, rims)


@contextmanager
def _named(division: Division | None, part: int) -> Iterator[None]:
    """Give an error that ends the fit of a sheet part the part's name and its junctions."""
    try:
        yield
    except GeounfoldError as error:
        if division is None:
            raise
        raise type(error)(
            f"{division.named(part)}: {error}; --parts one fits one sheet to the whole body"
        ) from error


def _coordinates(points: Floats | pd.DataFrame) -> Floats:
    """Return finite (n, 3) coordinates; of a DataFrame, those of its coordinate columns."""
    if isinstance(points, pd.DataFrame):
        points = frame_points(points)
    return checked_points(points)


def _reference(
    top: TriMesh | tuple[Any, Any] | None, bottom: TriMesh | tuple[Any, Any] | None, frame: Frame
) -> tuple[TriMesh, TriMesh] | None:
    if top is None and bottom is None:
        return None
    if top is None or bottom is None:
        raise InputError("top and bottom reference surfaces belong together: give both or neither")
    upper, lower = (as_trimesh(mesh) for mesh in (top, bottom))
    return (
        upper.with_vertices(frame.to_work(upper.V)),
        lower.with_vertices(frame.to_work(lower.V)),
    )


def _one_map(
    fits: list[BodyFit], prepared: PreparedPoints, options: UnfoldOptions
) -> UnfoldingMap | PointwiseMap:
    """Return the map of all bodies, without shells if these overlap.

    Shells of sheet parts may overlap, because each point is carried by its own part's.
    """
    frame, division = prepared.frame, prepared.division
    rules = [(f.rule, f.points) for f in fits if f.rule is not None and f.points is not None]
    if rules:
        return PointwiseMap(options.method, frame, *rules[0], options.reach)
    reach = METHODS[options.method].reach
    meshes = [(f.control, f.shell) for f in fits if f.control is not None]
    control, shell = side_by_side(meshes)
    parts = None if division is None else MapParts(vertex_parts(meshes), division.cells)
    if len(fits) > 1 and shell is not None and parts is None:
        none = np.empty(0, np.int64)
        if not certify(control, shell, none).injective:
            control, shell = side_by_side([(control, None) for control, _ in meshes])
    reach = options.reach if reach is None else reach
    return UnfoldingMap(
        frame, control, shell, reach,
        coordinates=options.coordinates, parts=parts, body=_body_cells(prepared),
    )  # fmt: skip


def _body_cells(prepared: PreparedPoints) -> BodyCells | None:
    """Return the cells that the blocks of the bodies to unfold occupy; None without a lattice."""
    steps = prepared.frame.steps
    if prepared.cells is None or steps is None:
        return None
    return BodyCells.of(prepared.cells, steps)
