"""Bodies divided into their sheet parts, each of which is fitted as a body of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.parts import Junction, sheet_parts
from geounfold.body.sub_blocks import FEWEST
from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class PartCells:
    """The cells at the surface of every part: the nearest one gives a point its part.

    Attributes
    ----------
    cells : (m, 3) int
        Lattice cells with a neighbour across a face that is empty or of another part.
    part : (m,) int
        The part of each.
    steps : (3,) float
        Sides of a cell, working units.
    """

    cells: Ints
    part: Ints
    steps: Floats

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.cells * self.steps)

    def of(self, points_work: Floats) -> Ints:
        """Return the part of points (n, 3), working units: that of the nearest cell."""
        out: Ints = self.part[self._tree.query(points_work)[1]]
        return out


@dataclass(frozen=True, eq=False)
class Division:
    """The sheet parts of all bodies of a run.

    Attributes
    ----------
    cells : PartCells
        What gives other points their part.
    labels : tuple of (m,) int
        Part of each fitted point, body by body.
    body : (k,) int
        Number of the body, among those to unfold, that each part belongs to.
    thickness : (k,) float
        Mean thickness of each part, in the data's unit.
    junctions : tuple of Junction
        In the data's coordinates and unit, numbered over all bodies.
    """

    cells: PartCells
    labels: tuple[Ints, ...]
    body: Ints
    thickness: Floats
    junctions: tuple[Junction, ...]

    @property
    def count(self) -> int:
        """Number of parts in all bodies."""
        return len(self.body)

    def named(self, part: int) -> str:
        """Return a part with its neighbours' junctions, for messages."""
        met = [j.sentence for j in self.junctions if part in j.parts]
        return f"part {part} of {self.count} sheet parts ({'; '.join(met) or 'no junction'})"


def divide(bodies: Sequence[Floats], frame: Frame) -> Division | None:
    """Return the sheet parts of bodies; None if each is one sheet, or not on a lattice.

    Parameters
    ----------
    bodies : sequence of (m, 3) float
        The points that each body is fitted to, working units.
    frame : Frame
        The working frame.
    """
    if frame.steps is None:
        return None
    thickness, labels, found_in = [], [], []
    body: list[int] = []
    junctions: list[Junction] = []
    for number, points in enumerate(bodies):
        cells = frame.cells(points)
        if cells is None:
            return None
        occupied, row = OccupiedCells.numbered(cells)
        if occupied.gappy() or occupied.usual_neighbours < FEWEST:
            return None  # sheets one block thick have no rays across them
        found = sheet_parts(occupied.cells_of(occupied.keys), frame.steps)
        own = _joined(occupied, found.labels, frame.steps) + len(body)
        found_in.append((occupied, own))
        labels.append(own[row])
        junctions += [_in_data(j, frame, len(body)) for j in found.junctions]
        body += [number] * found.count
        thickness.append(found.thickness * frame.scale)
    if not junctions:
        return None
    shells = [(cells, own, _at_surface(cells, own)) for cells, own in found_in]
    surface = PartCells(
        np.concatenate([cells.cells_of(cells.keys[shell]) for cells, _, shell in shells]),
        np.concatenate([own[shell] for _, own, shell in shells]),
        frame.steps,
    )
    return Division(
        surface, tuple(labels), np.array(body), np.concatenate(thickness), tuple(junctions)
    )


def _joined(occupied: OccupiedCells, label: Ints, steps: Floats) -> Ints:
    """Return labels with the cells of no sheet in the part of the nearest cell that has one."""
    none = label < 0
    if not none.any():
        return label
    place = occupied.cells_of(occupied.keys) * steps
    near = cKDTree(place[~none]).query(place[none])[1]
    out = label.copy()
    out[none] = label[~none][near]
    return out


def _at_surface(occupied: OccupiedCells, label: Ints) -> Bools:
    """Return whether each cell has a neighbour across a face that is empty or of another part."""
    out = np.zeros(len(label), dtype=bool)
    for step in (*occupied.stride.tolist(), *(-occupied.stride).tolist()):
        beside = occupied.rows(occupied.keys + step)
        out |= (beside < 0) | (label[beside] != label)
    return out


def _in_data(junction: Junction, frame: Frame, first: int) -> Junction:
    """Return a junction in the data's coordinates, its parts numbered from ``first``."""
    x, y, z = frame.to_world(np.array([junction.place]))[0].tolist()
    a, b = junction.parts
    thickness = tuple(t * frame.scale for t in junction.thickness)
    return replace(junction, parts=(a + first, b + first), place=(x, y, z), thickness=thickness)
