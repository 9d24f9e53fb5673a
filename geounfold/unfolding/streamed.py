"""Unfold a body whose rows are read in batches: one pass to fit it, one to carry its rows.

The fit takes the body's surface and its blocks merged into cells, as it does for large bodies in
memory (`fit_body`). Memory depends on the body's box and its surface, not on the number of rows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geounfold.backends.blas import one_thread
from geounfold.body.prepare import BodyPoints
from geounfold.body.streamed import Batches, StreamedBody, prepare_streamed
from geounfold.errors import StreamError
from geounfold.geometry.mesh import Floats
from geounfold.mapping.body_cells import BodyCells
from geounfold.mapping.carried import few
from geounfold.mapping.certificate import certify
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods import BodyFit
from geounfold.quality.blocks import BlockQuality, Quality, of_mesh
from geounfold.quality.by_cells import CellFigures, measure_cells
from geounfold.quality.statistics import Statistics
from geounfold.quality.trust import judge_counted
from geounfold.unfolding.checks import (
    check_certified,
    check_method,
    check_reached,
    check_torn,
    check_trust,
)
from geounfold.unfolding.clock import Clock, Progress
from geounfold.unfolding.fit_body import fit
from geounfold.unfolding.level_horizons import flat_extents
from geounfold.unfolding.measured import Measured, in_data, in_world
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.streamed_result import (
    ElementColumns,
    RowCounts,
    StreamedRecord,
    StreamedUnfolding,
)


def check_streamed(options: UnfoldOptions) -> None:
    """Raise StreamError if options need all rows at once."""
    plain = UnfoldOptions()
    for name in ("method", "coordinates", "body", "uncertainty"):
        value = getattr(options, name)
        if value != getattr(plain, name):
            raise StreamError(f"the option {name} {value} needs all rows at once")


@one_thread()
def unfold_streamed(
    batches: Batches,
    sample: Floats,
    options: UnfoldOptions | None = None,
    *,
    progress: Progress | None = None,
) -> StreamedUnfolding:
    """Take the folds out of a body given by batches of its block centroids.

    Parameters
    ----------
    batches : callable
        Returns the coordinates of all rows, finite, (n, 3) in each batch; called more than once.
    sample : (k, 3) float
        Some of them: runs of rows from several places of the file.
    options : UnfoldOptions, optional
        Defaults if not given.
    progress : callable, optional
        As `geounfold.unfold` takes it.

    Returns
    -------
    StreamedUnfolding
        Carries rows; its figures are complete when all rows were carried.

    Raises
    ------
    StreamError
        The body or an option needs all rows at once, or no fit to merged blocks holds.
    InputError, ControlMeshError
        As `geounfold.unfold` raises them.
    """
    options = options or UnfoldOptions()
    check_method(options)
    check_streamed(options)
    clock = Clock(progress)
    with clock.stage("frame"):
        body = prepare_streamed(batches, sample, parts=options.parts == "auto")
    prepared = body.prepared
    found = fit(body.body, prepared.frame, options, None, clock.stage)
    mapping = _map_of(found, body, options)
    body = replace(body, body=BodyPoints(prepared.work, prepared.work), fitted=body.given)  # spare
    with clock.stage("certificate"):
        none = np.empty(0, np.int64)
        certificate = in_data(certify(mapping.control, mapping.shell, none), prepared.frame)
    check_certified(certificate, options)
    with clock.stage("quality"):
        figures = measure_cells(body.given, body.frame, mapping, options.neighbours)
    certificate = replace(certificate, blocks=figures.held[certificate.elements])
    emptied = _check_cells(body, figures, options)
    with clock.stage("map"):
        surface = mapping.carry(prepared.points)
    with clock.stage("trust"):
        strays = 0.0 if found.hull is None else found.hull.strays
        signs = [] if found.signs is None else [replace(found.signs, strays=strays)]
        names = [""] * len(signs)
        trust = judge_counted(signs, names, prepared.frame, figures.beyond, figures.beyond_share)
    check_trust(trust, options)
    quality, ratio = _quality(mapping, figures)
    record = StreamedRecord(
        options, prepared, [found], mapping,
        Measured(surface, None, certificate, quality, none, trust),
        clock.seconds,
        body=body,
        cells=replace(figures, torn=figures.torn[:0]) if emptied else figures,
        rows=RowCounts(),
        ratio=ratio,
        size=flat_extents(
            [found], surface.points[surface.placed][:, :2], figures.plan, prepared.frame
        ),
    )  # fmt: skip
    clock.over()
    return StreamedUnfolding(record, figures.torn if emptied else figures.torn[:0])


def _map_of(found: BodyFit, body: StreamedBody, options: UnfoldOptions) -> UnfoldingMap:
    """Return the map of a fit."""
    frame = body.prepared.frame
    if found.control is None or frame.steps is None:
        raise TypeError("the method has no control mesh")
    cells = BodyCells.of_table(body.fitted.filled, body.fitted.low, frame.steps)
    reach = options.reach * body.frame.scale / frame.scale
    return UnfoldingMap(frame, found.control, found.shell, reach, body=cells)


def _check_cells(body: StreamedBody, figures: CellFigures, options: UnfoldOptions) -> bool:
    """Check that blocks have an image and are not torn; return whether torn ones are left empty."""
    frame, count = body.frame, body.given.count
    missed = figures.empty[body.own.holds(figures.empty)]
    check_reached(frame.middles(missed), count, options)
    if 0 < len(figures.torn) <= few(count):
        return True
    check_torn(frame.middles(figures.torn), count, options)
    return False


def _quality(mapping: UnfoldingMap, figures: CellFigures) -> tuple[Quality, float]:
    """Return how good the answer is, over the cells, and their mean volume ratio."""
    used = np.flatnonzero(figures.held)
    values, count = ElementColumns(mapping).of(used), figures.held[used]
    over_blocks = (
        figures.nmd,
        Statistics.weighted(values["shear"], count),
        Statistics.weighted(np.abs(values["volume_ratio"] - 1), count),
    )
    none = np.empty(0)
    quality = of_mesh(
        in_world(mapping.control, mapping.frame),
        BlockQuality(none, none, none, none, none),
        over_blocks,
        figures.measured,
    )
    return quality, float(np.average(values["volume_ratio"], weights=count))
