"""A body whose blocks come in batches: lattice, frame and surface, with no row held.

Each cell of the body's box takes one byte (`occupancy`). All that the fit of a large body needs
comes from them. Bodies that need their rows (blocks of several sides, points off a lattice, several
bodies or sheets) are refused with a `StreamError`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.backends.threads import over_slices
from geounfold.body.check import MIN_POINTS, check_units
from geounfold.body.lattice import TOLERANCE, Lattice, measure_lattice
from geounfold.body.mending import MendingRecord
from geounfold.body.mending.mend import WORDS, Mended, mend_lost
from geounfold.body.mending.record import MendedPlace, places_of
from geounfold.body.mending.voxels import MARGIN, VoxelBody
from geounfold.body.occupancy import HollowBody, Occupancy, OccupancyBuilder
from geounfold.body.parts import sheet_parts
from geounfold.body.prepare import BodyPoints, PreparedPoints
from geounfold.body.separate import SPECK_SHARE
from geounfold.body.working_frame import Frame, frame_of_sums
from geounfold.errors import StreamError
from geounfold.geometry.measures import bounds
from geounfold.geometry.mesh import Bools, Floats, Ints

Batches = Callable[[], Iterable[Floats]]
"""Returns all coordinates, (n, 3) in each batch, from the first row on; called several times."""

MENDED_BOX = 100_000_000
"""Number of cells of a box up to which a streamed body is mended; a cell takes up to five bytes."""

MOST_FITTED = 16_000_000
"""Number of blocks above which cells of 2, 3 or more a side take their place in the fit."""

HELD = 1_000_000
"""Number of blocks up to which all are held for the fit, which may then take them one by one."""

_LAYERED = 3.0  # blocks: thickness from which a body is mended and its sheet parts are sought
_PARTS = 5.0  # merged cells: layers in which sheet parts are sought, as `parts` has for many cells
_SEEDS, _BALL = 6, 1000  # places around which blocks are collected, and blocks of each
_SLICE = 1 << 14  # points at once


@dataclass(frozen=True, eq=False)
class StreamedBody:
    """A body whose rows are not held.

    Attributes
    ----------
    prepared : PreparedPoints
        Its points are the surface's blocks alone.
    body : BodyPoints
        What is fitted.
    given : Occupancy
        Cells of all blocks, along the axes of the frame.
    own : Occupancy
        Cells of the body that is fitted: without specks.
    fitted : Occupancy
        Cells that the fit takes: mended, and coarser if there are many; along the axes of the
        frame of ``prepared``.
    frame : Frame
        Whose cells the first two are; that of ``prepared`` is coarser if the body is fitted so.
    rows : int
        Number of rows.
    apart : (k, 3) float
        Blocks of specks, which are not the body's, in the data's coordinates.
    notes : tuple of str
        What was not looked at, a sentence each.
    """

    prepared: PreparedPoints
    body: BodyPoints
    given: Occupancy
    own: Occupancy
    fitted: Occupancy
    frame: Frame
    rows: int
    apart: Floats
    notes: tuple[str, ...] = ()

    @property
    def duplicates(self) -> int:
        """Number of rows in the cell of another row, without the first of each cell."""
        return self.rows - self.given.count

    def cells_of(self, points: Floats) -> Ints:
        """Return the lattice cells of points (n, 3) in the data's coordinates."""
        return self.frame.nearest_cells(self.frame.to_work(points))


def prepare_streamed(batches: Batches, sample: Floats, *, parts: bool) -> StreamedBody:
    """Return the body that batches of rows make.

    Parameters
    ----------
    batches : callable
        Gives the rows' coordinates; read once, or three times if the rows are in no spatial order.
    sample : (k, 3) float
        Some of them, runs of rows from several places of the file.
    parts : bool
        Whether bodies of several sheets are refused.

    Raises
    ------
    StreamError
        The body needs its rows: blocks off a lattice or of several sides, several bodies or sheets,
        or a box of too many cells.
    InputError
        The axes are in different units.
    """
    lattice = measure_lattice(sample)
    found = None if lattice is None else _collected(batches(), lattice)
    if found is None or found[0].lonely():
        lattice = measure_lattice(_balls(batches, sample))
        found = None if lattice is None else _collected(batches(), lattice)
    if lattice is None or found is None:
        raise StreamError("its blocks do not all lie on one lattice of equal blocks")
    raw, rows, ends = found
    if raw.lonely():
        raise StreamError("its blocks have several sides")
    check_units(np.array(ends), lattice)
    if raw.count < MIN_POINTS:
        raise StreamError(f"its {raw.count} blocks are too few")
    scale = float(np.cbrt(lattice.steps.prod()))
    frame = frame_of_sums(raw.sums(lattice.steps / scale), lattice)
    given = raw.turned(lattice, frame)
    del raw, found
    whole = _one_body(given)
    return _bodied(given, whole, (frame, lattice), rows, parts=parts)


def _collected(
    batches: Iterable[Floats], lattice: Lattice
) -> tuple[Occupancy, int, tuple[Floats, Floats]] | None:
    """Return the cells of all rows, their number and bounds; None if a row is off the lattice."""
    builder, rows, ends = OccupancyBuilder(), 0, []
    for points in batches:
        if not len(points):
            continue
        cells, on = _on_lattice(points, lattice)
        if not on:
            return None
        builder.add(cells)
        rows += len(points)
        ends.append(bounds(points))
    low, high = zip(*ends, strict=True)
    return builder.made(), rows, (np.min(low, axis=0), np.max(high, axis=0))


def _on_lattice(points: Floats, lattice: Lattice) -> tuple[Ints, bool]:
    """Return the cells of points (n, 3), and whether all lie on the lattice."""
    cells = np.empty((len(points), 3), np.int64)

    def work(rows: slice) -> bool:
        place = (points[rows] - lattice.origin) @ lattice.axes.T / lattice.steps
        cells[rows] = whole = np.rint(place)
        place -= whole
        return bool(-TOLERANCE < place.min() <= place.max() < TOLERANCE)

    return cells, all(over_slices(work, len(points), _SLICE))


def _balls(batches: Batches, sample: Floats) -> Floats:
    """Return the points nearest to some places of the sample, whatever the order of the rows."""
    places = [sample[0]]
    apart = np.square(sample - sample[0]).sum(axis=1)
    for _ in range(_SEEDS - 1):
        places.append(sample[int(apart.argmax())])
        apart = np.minimum(apart, np.square(sample - places[-1]).sum(axis=1))
    nearest = [np.empty((0, 3)) for _ in places]
    for points in batches():
        for k, place in enumerate(places):
            both = np.concatenate([nearest[k], points])
            far = np.square(both - place).sum(axis=1)
            if len(both) > _BALL:
                both = both[np.argpartition(far, _BALL)[:_BALL]]
            nearest[k] = both
    return np.concatenate(nearest)


def _one_body(given: Occupancy) -> Occupancy:
    """Return the cells of the one body among all cells: without specks."""
    labels, size, first = given.parts()
    whole = np.flatnonzero(size[1:] >= SPECK_SHARE * given.count) + 1
    if len(whole) > 1:
        raise StreamError(f"its blocks form {len(whole)} separate bodies")
    if len(size) == 2:
        return given
    return given.within(labels == int(size.argmax()), first, 2)


def _bodied(
    given: Occupancy,
    whole: Occupancy,
    frames: tuple[Frame, Lattice],
    rows: int,
    *,
    parts: bool,
) -> StreamedBody:
    """Return the body of the cells of a frame, mended and checked."""
    frame, lattice = frames
    if frame.steps is None:
        raise ValueError("the frame has no lattice")
    steps, notes = frame.steps, []
    side = int(np.ceil((whole.count / MOST_FITTED) ** (1 / 3)))
    own, frame_of_fit = whole.coarsened(side), _coarser(frame, side)
    _, thickness = own.area_and_thickness(steps)
    record = MendingRecord(np.zeros(0, np.int64), blocks=own.count)
    if thickness >= _LAYERED and np.prod(own.shape + 2 * MARGIN) > MENDED_BOX:
        notes.append(
            f"bridges, handles and cavities were not looked for: the body's box has more than "
            f"{MENDED_BOX:,} cells"
        )
    elif thickness >= _LAYERED:
        own, record = _mended(own, frame_of_fit)
        record.check()
    if parts and thickness >= _LAYERED:
        _check_one_sheet(own, thickness, steps)
    outer = whole.skin()
    surface = frame.middles(outer.cells[outer.surface])
    work = frame_of_fit.to_work(surface)
    if own.count <= HELD:
        cells = np.argwhere(own.filled) + own.low
        body = BodyPoints(cells * steps + 0.0, frame_of_fit.to_work(_blocks(whole, frame)), record)
    else:
        skin = outer if own is whole else own.skin()
        hollow = HollowBody(own, skin, steps)
        body = BodyPoints(skin.cells * steps + 0.0, work, record, hollow=hollow)
    prepared = PreparedPoints(
        surface, work, frame_of_fit, lattice, (np.arange(len(surface)),), record
    )
    apart = np.empty((0, 3))
    if whole is not given:
        apart = frame.middles(np.argwhere(given.filled & ~whole.filled) + given.low)
    return StreamedBody(prepared, body, given, whole, own, frame, rows, apart, tuple(notes))


def _blocks(cells: Occupancy, frame: Frame) -> Floats:
    """Return the middles of occupied cells in the data's coordinates."""
    return frame.middles(np.argwhere(cells.filled) + cells.low)


def _coarser(frame: Frame, side: int) -> Frame:
    """Return the frame in which ``side`` blocks are one along every axis."""
    if frame.steps is None or side == 1:
        return frame
    corner = frame.to_world((side - 1) / 2 * frame.steps[None])[0]
    return replace(frame, origin=corner, scale=side * frame.scale)


def _mended(whole: Occupancy, frame: Frame) -> tuple[Occupancy, MendingRecord]:
    """Return a body mended on its lattice, and what was mended."""
    box = VoxelBody(np.pad(whole.filled, MARGIN), whole.low - MARGIN)
    mended, full = mend_lost(box)
    record = replace(
        MendingRecord.of(mended, np.zeros(0, np.int64), _places(mended, box, full, frame)),
        blocks=whole.count,
    )
    if not mended.changed:
        return whole, record
    return Occupancy(full, box.low), record


def _places(mended: Mended, box: VoxelBody, full: Bools, frame: Frame) -> tuple[MendedPlace, ...]:
    """Return the places of all changes, in the data's coordinates."""
    lost = box.cells(box.full & ~full)
    changed = {"filled": mended.filled}
    changed |= {word: lost[mended.fate == code] for code, word in enumerate(WORDS) if code}
    return tuple(
        place
        for what, moved in changed.items()
        for place in places_of(what, moved, frame.middles(moved))
    )


def _check_one_sheet(own: Occupancy, thickness: float, steps: Floats) -> None:
    """Raise StreamError if the cells of a body are several sheets that meet."""
    merge = max(1, int(thickness / float(steps.max()) / _PARTS))
    counts, first = own.counts(merge)
    cells = np.argwhere(2 * counts.astype(np.int64) >= merge**3) + first
    found = sheet_parts(cells, steps)
    if found.junctions:
        raise StreamError(f"it has several sheets ({found.junctions[0].sentence})")
