"""The result of an unfolding in batches: carries rows, and adds up what is told of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from geounfold.body.parts import Junction
from geounfold.body.streamed import StreamedBody
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.result_columns import UNFOLDED, result_columns
from geounfold.mapping.carried import Carried
from geounfold.mapping.distortion import deformation_gradients, distortion
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods.sheet.sharpening.lattice_sites import scatter
from geounfold.quality.by_cells import CellFigures, CellNumbers
from geounfold.unfolding.summary import RunRecord, summarise, warnings_of

_RETURNED = 250_000
"""Number of rows, about, that are carried to the flat space and back."""

_DISTORTION = ("volume_ratio", "stretch_min", "stretch_max", "shear")
_COLUMNS = ("volume_ratio", "nmd_error", "stretch_min", "stretch_max", "shear")
_TOLD = 2  # places of empty rows that are kept: a message names the first


class ElementColumns:
    """Distortion of the tetrahedra of a map, computed when they are first used.

    Parameters
    ----------
    mapping : UnfoldingMap
        With the coordinates of tetrahedra.
    """

    def __init__(self, mapping: UnfoldingMap) -> None:
        self._whole = mapping.whole
        count = len(self._whole.folded.T)
        self._known: Bools = np.zeros(count, dtype=bool)
        self._values = {name: np.full(count + 1, np.nan) for name in _DISTORTION}

    def of(self, elements: Ints) -> dict[str, Floats]:
        """Return the columns of tetrahedra (n,) by name; NaN for -1."""
        used = np.zeros(len(self._known) + 1, dtype=bool)
        used[elements] = True
        fresh = np.flatnonzero(used[:-1] & ~self._known)
        if len(fresh):
            found = distortion(deformation_gradients(self._whole, fresh))
            for name, values in self._values.items():
                values[fresh] = getattr(found, name)
            self._known[fresh] = True
        return {name: values[elements] for name, values in self._values.items()}


@dataclass
class RowCounts:
    """What is told of the rows, added up as they are carried."""

    rows: int = 0
    outside: int = 0
    empty: int = 0
    lost: int = 0
    returned: float = 0.0
    largest: float = 0.0
    left: list[Floats] | None = None

    def add(self, points: Floats, carried: Carried) -> None:
        """Add carried rows."""
        self.rows += len(points)
        self.outside += int(np.count_nonzero(~carried.inside))
        missed = np.flatnonzero(~carried.placed)
        self.empty += len(missed)
        self.left = [*(self.left or []), *points[missed[:_TOLD]]][:_TOLD]
        self.largest = max(self.largest, float(np.nanmax(carried.distance, initial=0.0)))


@dataclass(frozen=True, eq=False, kw_only=True)
class StreamedRecord(RunRecord):
    """Everything that a run in batches made; the rows' figures grow as they are carried.

    Attributes
    ----------
    body : StreamedBody
        The body.
    cells : CellFigures
        What was measured of its cells.
    rows : RowCounts
        What is told of its rows.
    size : dict of float
        Length, width and thickness of the unfolded body.
    ratio : float
        Mean volume ratio of the cells.
    """

    body: StreamedBody
    cells: CellFigures
    rows: RowCounts
    size: dict[str, float | None]
    ratio: float

    @property
    def volumes(self) -> dict[str, float | None]:
        """Volume of the body's blocks in both spaces."""
        count = self.body.given.count - len(self.body.apart)
        folded = count * self.body.frame.scale**3
        return {"folded": folded, "unfolded": folded * self.ratio}

    @property
    def count(self) -> int:
        """Number of rows."""
        return self.body.rows

    @property
    def duplicates(self) -> int:
        """Number of rows in the cell of another, but for one of each cell."""
        return self.body.duplicates

    @property
    def apart(self) -> Floats:
        """The cells that are not the body's, (k, 3)."""
        return self.body.apart

    @property
    def left_empty(self) -> Floats:
        """The first rows without an image, (k, 3)."""
        return np.array(self.rows.left or np.empty((0, 3)))

    @property
    def torn(self) -> int:
        """Number of cells that came to lie far from a cell that they touch; 0 if left empty."""
        return len(self.cells.torn)

    @property
    def largest_distance(self) -> float:
        """Largest distance of a row from the control mesh."""
        return self.rows.largest

    @property
    def flat_size(self) -> dict[str, float | None]:
        """Length, width and thickness of the unfolded body."""
        return self.size

    @property
    def full_box(self) -> list[int] | None:
        """Sides of the lattice's box in blocks if the blocks fill it; None else."""
        given = self.body.given
        return given.shape.tolist() if given.count == given.filled.size else None

    @property
    def outside(self) -> int:
        """Number of rows that the control mesh does not hold."""
        return self.rows.outside

    @property
    def empty(self) -> int:
        """Number of rows without an image."""
        return self.rows.empty

    @property
    def lost(self) -> int:
        """Number of rows that were not brought back although the map holds their image."""
        return self.rows.lost

    @property
    def round_trip_max(self) -> float | None:
        """Largest distance between a row and its return, over the rows that were brought back."""
        return self.rows.returned


class StreamedUnfolding:
    """An unfolded body that carries the rows of its file, batch by batch.

    Attributes
    ----------
    map : UnfoldingMap
        Carries any points both ways.
    certificate : Certificate
        What is proved of the map.
    junctions : tuple
        Empty: a body of several sheets is not unfolded in batches.
    uncertainty : None
        Not measured.
    """

    junctions: tuple[Junction, ...] = ()
    uncertainty = None

    def __init__(self, record: StreamedRecord, empty: Ints) -> None:
        """Keep a run's record, and the cells (k, 3) whose rows are left empty."""
        self._record = record
        self.map: UnfoldingMap = record.map  # type: ignore[assignment]  # the method has a mesh
        self.certificate = record.measured.certificate
        self._columns = ElementColumns(self.map)
        self._numbers = CellNumbers(record.body.given)
        self._left_empty = self._numbers.of(empty) if len(empty) else np.empty(0, np.int64)

    @property
    def duplicates(self) -> int:
        """Number of rows in the cell of another, but for one of each cell."""
        return self._record.duplicates

    def carried(self, points: Floats) -> dict[str, Any]:
        """Return the results of rows (n, 3) by output column, and count them."""
        found = self.map.carry(points)
        number = self._numbers.of(self._record.body.cells_of(points))
        if len(self._left_empty):
            found = found.without(np.flatnonzero(np.isin(number, self._left_empty)))
        rows = self._record.rows
        rows.add(points, found)
        some = np.flatnonzero(scatter(points) < _RETURNED / max(self._record.count, 1))
        if len(some):
            back = self.map.returned(points[some], found.part(some))
            rows.returned = max(rows.returned, back.largest)
            rows.lost += int(np.count_nonzero(back.lost))
        own = self._columns.of(found.element)
        own["nmd_error"] = self._record.cells.error[number].astype(np.float64)
        own["nmd_error"][~found.placed] = np.nan
        return result_columns(UNFOLDED, found) | {name: own[name] for name in _COLUMNS}

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map (not the points) as .npz; ``geounfold.load`` reads it."""
        self.map.save(path)

    def summary(self) -> dict[str, Any]:
        """Return what ran and how good it is, for JSON; complete once all rows are carried."""
        found = summarise(self._record, self._surfaces())
        return {
            **found,
            "streamed": True,
            "warnings": [*self._record.body.notes, *found["warnings"]],
        }

    def _surfaces(self) -> dict[str, Any]:
        """Return the surfaces of the fit, true to scale."""
        frame = self._record.prepared.frame
        return {name: pair.in_world(frame) for name, pair in self._record.fits[0].surfaces.items()}

    def warnings(self) -> list[str]:
        """Return what a user should know, once all rows are carried."""
        return [*self._record.body.notes, *warnings_of(self._record)]
