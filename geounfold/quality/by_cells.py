"""Figures of an unfolding from the cells that its blocks occupy, slab by slab.

Every occupied cell is carried once. A slab and the layers within reach of its blocks' neighbours
are held at a time, so that the order of the rows does not matter. What each block keeps is the
change of distance to its neighbours, four bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from geounfold.body.occupancy import Occupancy
from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers
from geounfold.mapping.carried import Carried
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.quality.lattice_neighbours import LatticeWindow, margin_of
from geounfold.quality.statistics import RunningStatistics, Statistics
from geounfold.quality.torn_blocks import SUSPECT, torn_blocks
from geounfold.quality.trust import out_of_layer

_SLAB = 1 << 20  # blocks of a slab, about
_KEPT = 100_000  # places of blocks out of the layer that are kept for their median
_WORD = 64  # cells of a word of bits


class CellNumbers:
    """The number of each occupied cell among all, in lexicographic order: 2 bits a cell of the box.

    Parameters
    ----------
    cells : Occupancy
        The occupied cells.
    """

    def __init__(self, cells: Occupancy) -> None:
        self._low, self._shape = cells.low, cells.shape
        bits = np.packbits(cells.filled.reshape(-1), bitorder="little")
        bits = np.pad(bits, (0, -len(bits) % 8))
        self._words = bits.view("<u8")
        count = np.bitwise_count(self._words).astype(np.int64)
        self._before = np.cumsum(count) - count

    def of(self, cells: Ints) -> Ints:
        """Return the numbers of occupied cells (n, 3), (n,)."""
        i, j, k = (cells - self._low).T
        word, bit = np.divmod((i * self._shape[1] + j) * self._shape[2] + k, _WORD)
        below = (np.uint64(1) << bit.astype(np.uint64)) - np.uint64(1)
        inside = np.bitwise_count(self._words[word] & below)
        out: Ints = self._before[word] + inside
        return out


@dataclass(frozen=True, eq=False)
class CellFigures:
    """What was measured of all occupied cells.

    Attributes
    ----------
    error : (n,) float32
        epsilon of each cell, in the order of `CellNumbers`; NaN if it has no image or too few
        neighbours.
    nmd : Statistics
        epsilon over the cells.
    measured : int
        Number of cells that it is taken over.
    held : (m,) int
        Number of cells that each tetrahedron carries.
    torn : (k, 3) int
        Cells that came to lie far from a cell that they touch.
    empty : (e, 3) int
        Cells without an image.
    beyond : (b, 3) float
        Cells out of the layer, in the data's coordinates; an even part if there are many.
    beyond_share : float
        Share of the cells that lie out of the layer.
    plan : (2, 2) float
        Sum of the squared distances from the mean in plan, flat, the data's unit.
    """

    error: Numbers
    nmd: Statistics
    measured: int
    held: Ints
    torn: Ints
    empty: Ints
    beyond: Floats
    beyond_share: float
    plan: Floats


@dataclass(eq=False)
class _Sums:
    """What is added up over the slabs."""

    nmd: RunningStatistics
    held: Ints
    error: list[Numbers]
    torn: list[Ints]
    empty: list[Ints]
    beyond: list[Floats]
    out: int = 0
    first: Floats | None = None
    count: int = 0
    plan_sum: Floats | None = None
    plan_square: Floats | None = None

    def add_plan(self, plan: Floats) -> None:
        """Add flat places (n, 2)."""
        if not len(plan):
            return
        if self.first is None:
            self.first = plan[0]
            self.plan_sum, self.plan_square = np.zeros(2), np.zeros((2, 2))
        own = plan - self.first
        self.count += len(own)
        self.plan_sum = self.plan_sum + own.sum(axis=0)
        self.plan_square = self.plan_square + own.T @ own


def measure_cells(given: Occupancy, frame: Frame, mapping: UnfoldingMap, k: int) -> CellFigures:
    """Return the figures of all occupied cells, carried by a map.

    Parameters
    ----------
    given : Occupancy
        The cells.
    frame : Frame
        Along whose axes they are counted.
    mapping : UnfoldingMap
        With the coordinates of tetrahedra.
    k : int
        Number of neighbours.
    """
    steps = frame.steps
    if steps is None:
        raise ValueError("the frame has no lattice")
    sums = _Sums(
        RunningStatistics(), np.zeros(len(mapping.whole.folded.T), np.int64), [], [], [], []
    )
    margin = margin_of(steps)
    shape = given.shape + 2 * margin
    for window, rows in _windows(given, frame, mapping, int(margin[0])):
        cells, carried = window
        placed = np.flatnonzero(carried.placed)
        inner = placed[(placed >= rows.start) & (placed < rows.stop)]
        part = np.searchsorted(placed, [rows.start, rows.stop])
        x, y, z = (cells[placed] - given.low + margin).T
        keys = LatticeWindow((x * shape[1] + y) * shape[2] + z, shape)
        flat = carried.points[placed] / frame.scale
        change = np.full(rows.stop - rows.start, np.nan)
        if len(inner):
            before, after = keys.mean_distances(steps, flat, k, slice(*part.tolist()))
            change[inner - rows.start] = np.abs(before - after) / before
        suspects = part[0] + np.flatnonzero(change[inner - rows.start] > SUSPECT)
        torn = torn_blocks(cells[placed] * steps, flat, steps, suspects)
        _add(sums, carried.part(rows), cells[rows], change, frame)
        sums.torn.append(cells[placed][torn])
    return _made(sums, given)


def _windows(
    given: Occupancy, frame: Frame, mapping: UnfoldingMap, reach: int
) -> Iterator[tuple[tuple[Ints, Carried], slice]]:
    """Yield the cells and images of a slab with ``reach`` layers around it, and the slab's rows."""
    layers = np.count_nonzero(given.filled, axis=(1, 2))
    thick = max(1, int(_SLAB / max(1.0, layers.mean())))
    cells = np.zeros((0, 3), np.int64)
    images: list[Carried] = []
    done = 0
    for start in range(0, len(layers), thick):
        stop = min(start + thick, len(layers))
        ahead = min(stop + reach, len(layers))
        fresh = np.argwhere(given.filled[done:ahead]) + (given.low + np.array([done, 0, 0]))
        if len(fresh):
            images.append(mapping.carry(frame.middles(fresh)))
            cells = np.concatenate([cells, fresh])
        done = max(done, ahead)
        carried = _joined(images)
        keep = np.searchsorted(cells[:, 0], given.low[0] + max(start - reach, 0))
        cells, images = cells[keep:], [carried.part(slice(int(keep), None))]
        a, b = np.searchsorted(cells[:, 0], given.low[0] + np.array([start, stop]))
        if b > a:
            yield (cells, images[0]), slice(int(a), int(b))


def _joined(parts: list[Carried]) -> Carried:
    """Return carried points one after the other."""
    if len(parts) == 1:
        return parts[0]
    return Carried(
        np.concatenate([p.points for p in parts]),
        np.concatenate([p.stratigraphic for p in parts]),
        np.concatenate([p.inside for p in parts]),
        np.concatenate([p.placed for p in parts]),
        np.concatenate([p.element for p in parts]),
        np.concatenate([p.distance for p in parts]),
    )


def _add(sums: _Sums, carried: Carried, cells: Ints, change: Floats, frame: Frame) -> None:
    """Add the figures of a slab."""
    sums.error.append(change.astype(np.float32))
    sums.nmd.add(change)
    sums.held += np.bincount(carried.element[carried.placed], minlength=len(sums.held))
    sums.add_plan(carried.points[carried.placed][:, :2])
    sums.empty.append(cells[~carried.placed])
    out: Bools = out_of_layer(carried.stratigraphic)
    sums.out += int(np.count_nonzero(out))
    some = cells[out][:: max(1, int(np.count_nonzero(out)) // _KEPT)]
    sums.beyond.append(frame.middles(some))


def _made(sums: _Sums, given: Occupancy) -> CellFigures:
    mean = np.zeros(2) if sums.plan_sum is None else sums.plan_sum / max(sums.count, 1)
    square = np.zeros((2, 2)) if sums.plan_square is None else sums.plan_square
    return CellFigures(
        error=np.concatenate(sums.error),
        nmd=sums.nmd.made(),
        measured=sums.nmd.count,
        held=sums.held,
        torn=np.concatenate(sums.torn),
        empty=np.concatenate(sums.empty),
        beyond=np.concatenate(sums.beyond),
        beyond_share=sums.out / given.count,
        plan=square - sums.count * np.outer(mean, mean),
    )
