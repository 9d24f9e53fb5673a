"""The points prepared for the methods: lattice, working frame, separate bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.body.check import check_points, check_units
from geounfold.body.coarsest_cells import coarsest_cells
from geounfold.body.fault_surface import FaultWalls
from geounfold.body.lattice import Lattice, distinct, in_order, measure_lattice, refined
from geounfold.body.mending import MendingRecord, mend
from geounfold.body.mending.mend import WORDS, Mended
from geounfold.body.mending.record import MendedPlace, places_of
from geounfold.body.noisy_lattice import disturbed_lattice
from geounfold.body.occupancy import HollowBody
from geounfold.body.parts.division import Division, divide
from geounfold.body.rounded import unrounded
from geounfold.body.scattered import QUIET, unevenness
from geounfold.body.separate import select_body, separate_bodies
from geounfold.body.sub_blocks import FilledCells, filled_cells
from geounfold.body.working_frame import Frame, working_frame
from geounfold.geometry.mesh import Floats, Ints, TriMesh


@dataclass(frozen=True, eq=False)
class PreparedPoints:
    """The points of a run, with their lattice, working frame and bodies.

    Attributes
    ----------
    points : (n, 3) float
        In the data's coordinates, as given; rounded ones are put back on their lattice.
    work : (n, 3) float
        In working units, in which one block has volume 1.
    frame : Frame
        The working frame, which converts between both.
    lattice : Lattice or None
        The lattice of the blocks; None for scattered points and noisy grids.
    groups : tuple of (k,) int
        Rows of each body to unfold, or of each sheet part of them.
    mended : MendingRecord
        What was mended of these bodies.
    division : Division or None
        The sheet parts; None if every body is one sheet.
    cells : (m, 3) int or None
        Cells of the lattice that the blocks of the bodies to unfold occupy, before mending; None
        without a lattice.
    moved : float
        How far at most rounded coordinates were moved, in their unit.
    joined : int
        How many blocks were joined to one cell along every axis.
    """

    points: Floats
    work: Floats
    frame: Frame
    lattice: Lattice | None
    groups: tuple[Ints, ...]
    mended: MendingRecord
    division: Division | None = None
    cells: Ints | None = None
    moved: float = 0.0
    joined: int = 1

    @property
    def bodies(self) -> int:
        """Number of bodies to unfold."""
        return len(self.groups) if self.division is None else int(self.division.body[-1]) + 1

    @property
    def chosen(self) -> int:
        """Number of points in the bodies to unfold."""
        return sum(len(group) for group in self.groups)


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """The points of one body, working units, in lexicographic order.

    Attributes
    ----------
    fitted : (m, 3) float
        The blocks that are fitted: moved onto their lattice, sub-blocks and gaps filled, mended.
    blocks : (b, 3) float
        The blocks as given, which the map must contain.
    mended : MendingRecord or None
        What was mended of this body; None without a lattice.
    walls : FaultWalls or None
        The faults and limits at which the body was cut off; None if no cut is known.
    shell : TriMesh or None
        The surface of the solid that the blocks fill; None if there is none, or it is no hull.
    hollow : HollowBody or None
        All blocks as occupied cells, if only those at the surface are held: ``fitted`` are then
        those within two of it, and ``blocks`` those at it.
    """

    fitted: Floats
    blocks: Floats
    mended: MendingRecord | None = None
    walls: FaultWalls | None = None
    shell: TriMesh | None = None
    hollow: HollowBody | None = None

    @property
    def count(self) -> int:
        """Number of blocks of the body."""
        return len(self.blocks) if self.hollow is None else self.hollow.cells.count


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a run's points, before they are divided into bodies.

    Attributes
    ----------
    work : (m, 3) float
        Cells, working units: the points, and sub-blocks filled.
    home : (n,) int
        Cell of each point.
    frame : Frame
        The working frame.
    """

    work: Floats
    home: Ints
    frame: Frame


def prepare(
    points: Floats,
    body: int | str | None = None,
    *,
    parts: bool = False,
    cut: Callable[[Cells], Ints] | None = None,
) -> tuple[PreparedPoints, list[BodyPoints]]:
    """Return the prepared points of the run, and those of each body.

    Parameters
    ----------
    points : (n, 3) float
        Finite centroids in the data's coordinates, any order and orientation.
    body : int, "all" or None
        The choice among separate bodies, as `select_body` takes it.
    parts : bool
        Whether bodies of several sheets are divided into these.
    cut : callable, optional
        Returns the body of each cell, from 0 without gaps, -1 for cells to leave out: fault blocks
        in place of the separate bodies. All are chosen.

    Raises
    ------
    InputError
        The points are no body, or several bodies of which none is chosen.
    OptionError
        There is no body of that number.
    """
    check_units(points, None)
    told, points = points, unrounded(points)
    lattice = measure_lattice(points)
    check_units(points, lattice)
    cells = _filled(points, lattice)
    if cut is None:  # faults cut between single blocks
        cells = coarsest_cells(points, lattice, cells)
    filled, lattice = (points, lattice) if cells is None else (cells.points, cells.lattice)
    frame = _frame(points, filled, lattice)
    work = np.ascontiguousarray(frame.snap(frame.to_work(filled)))
    home = np.arange(len(points)) if cells is None else cells.home
    labels = separate_bodies(work, frame) if cut is None else cut(Cells(work, home, frame))
    own = labels if cells is None else labels[home]
    if cut is None:
        groups = select_body(points, own, body)
    else:
        groups = tuple(np.flatnonzero(own == k) for k in range(int(own.max()) + 1))
    given = frame.to_work(points)
    record = MendingRecord(np.zeros(len(points), np.int64))
    bodies = []
    for group in groups:
        rows = np.flatnonzero(labels == own[group[0]])
        fitted, found = _mended(work[rows], rows, home, frame)
        record = record if found is None else record.joined(found)
        bodies.append(BodyPoints(_sorted(fitted), _sorted(given[group]), found))
    chosen = np.isin(labels, [own[group[0]] for group in groups])
    taken = None if frame.steps is None else frame.nearest_cells(work[chosen])
    moved = 0.0 if told is points else float(np.abs(points - told).max())
    joined = 1 if cells is None else cells.joined
    prepared = PreparedPoints(
        points, given, frame, lattice, groups, record, cells=taken, moved=moved, joined=joined
    )
    return _divided(prepared, bodies) if parts else (prepared, bodies)


def _filled(points: Floats, lattice: Lattice | None) -> FilledCells | None:
    """Return the cells that blocks fill, few sub-blocks off the others' lattice included."""
    if lattice is not None and lattice.share < 1:
        found = filled_cells(points, refined(points, lattice))
        if found is not None and found.sub_blocked:
            return found
    return filled_cells(points, lattice)


def _mended(
    fitted: Floats, rows: Ints, home: Ints, frame: Frame
) -> tuple[Floats, MendingRecord | None]:
    """Return the cells of a body mended, and what was mended; on no lattice they stay as they are.

    Parameters
    ----------
    fitted : (m, 3) float
        The body's cells, working units.
    rows : (m,) int
        Their rows among the cells of all bodies, rising.
    home : (n,) int
        For every point given, its row among the cells of all bodies.
    frame : Frame
        The working frame.
    """
    if frame.steps is None:
        return fitted, None
    cells = frame.nearest_cells(fitted)
    mended = mend(cells)
    filled = mended.filled * frame.steps + 0.0
    at = np.minimum(np.searchsorted(rows, home), len(rows) - 1)
    own = np.where(rows[at] == home, at, -1)
    found = MendingRecord.of(mended, own, _places(mended, cells, frame, frame.steps))
    if not mended.changed:
        return fitted, found
    return np.concatenate([fitted[mended.fate == 0], filled]), found


def _places(mended: Mended, cells: Ints, frame: Frame, steps: Floats) -> tuple[MendedPlace, ...]:
    """Return the places of all changes to a body, in the data's coordinates."""
    changed = {"filled": mended.filled}
    changed |= {word: cells[mended.fate == code] for code, word in enumerate(WORDS) if code}
    return tuple(
        place
        for what, moved in changed.items()
        for place in places_of(what, moved, frame.to_world(moved * steps))
    )


def _divided(
    prepared: PreparedPoints, bodies: list[BodyPoints]
) -> tuple[PreparedPoints, list[BodyPoints]]:
    """Return the points with sheet parts in place of the bodies that have several.

    Raises
    ------
    NoSheetError
        A body is too crude for a hull, so that its parts mean nothing.
    """
    for body in bodies:
        if body.mended is not None:
            body.mended.check()
    division = divide([body.fitted for body in bodies], prepared.frame)
    if division is None:
        return prepared, bodies
    chosen = np.sort(np.concatenate(prepared.groups))
    part = division.cells.of(prepared.work[chosen])
    rows = tuple(chosen[part == k] for k in range(division.count))
    parts = [
        replace(
            bodies[number],
            fitted=bodies[number].fitted[division.labels[number] == k],
            blocks=_sorted(prepared.work[rows[k]]),
        )
        for k, number in enumerate(division.body.tolist())
    ]
    return replace(prepared, groups=rows, division=division), parts


def _frame(points: Floats, filled: Floats, lattice: Lattice | None) -> Frame:
    """Return the working frame, after checking that the points can be a body.

    Points on no lattice that are even enough to be a grid with noise get the frame of that grid.
    """
    if lattice is None:
        unique = distinct(points)
        noisy = disturbed_lattice(unique) if unevenness(unique) > QUIET else None
        if noisy is not None:
            check_points(points @ noisy.axes.T / noisy.steps)
            return working_frame(points, noisy, exact=False)
    check_points(filled, lattice)
    return working_frame(filled, lattice)


def _sorted(points: Floats) -> Floats:
    """Return points in lexicographic order.

    Floating-point sums over them then do not depend on the order of the input rows.
    """
    return points if in_order(points) else points[np.lexsort(points.T[::-1])]
