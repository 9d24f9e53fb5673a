"""Vertical columns of the flat space: where the body is, and from where to where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.quality.trust.carried_hull import CarriedHull

_MARGIN = 2
"""Empty columns around the body, so that its outline lies inside the array."""

_RIM = 2.0
"""Columns from the outline within which heights are always the rim's, not the layer's."""


@dataclass(frozen=True, eq=False)
class FlatColumns:
    """Square columns of the flat space that the hull crosses.

    Attributes
    ----------
    side : float
        Side of a column, working units.
    low : (2,) float
        Corner of the first column.
    highest, lowest : (r, c) float
        Height of the body's uppermost and lowermost face; -inf and inf if there is none.
    depth : (r, c) float
        Distance from the outline inside the body, working units; 0 outside.
    clear : (r, c) float
        The same from the outline and from the columns of fault walls, in which the layers end on
        a slant; equal to ``depth`` if there are none.
    """

    side: float
    low: Floats
    highest: Floats
    lowest: Floats
    depth: Floats
    clear: Floats

    def of(self, places: Floats) -> tuple[Ints, Ints]:
        """Return the row and column number of flat places (k, 2 or 3)."""
        cell = np.floor((places[:, :2] - self.low) / self.side).astype(np.int64) + _MARGIN
        cell = np.clip(cell, 0, np.array(self.depth.shape) - 1)
        return cell[:, 0], cell[:, 1]

    def within(self, distance: float) -> Bools:
        """Return the columns that the body fills so far inside its outline, (r, c)."""
        out: Bools = np.isfinite(self.highest) & (self.clear > max(distance, _RIM * self.side))
        return out


def flat_columns(hull: CarriedHull, side: float, walls: Bools | None = None) -> FlatColumns:
    """Return the columns that the hull's faces cross; holes of one column are closed.

    Parameters
    ----------
    hull : CarriedHull
        The body's hull in the flat space.
    side : float
        Side of a column, working units: a little more than a block, so that none is missed.
    walls : (m,) bool, optional
        Which of the hull's faces are at fault walls.
    """
    centre = hull.flat_centre
    low = centre[:, :2].min(axis=0)
    cell = np.floor((centre[:, :2] - low) / side).astype(np.int64) + _MARGIN
    shape = tuple(cell.max(axis=0) + _MARGIN + 1)
    highest, lowest = np.full(shape, -np.inf), np.full(shape, np.inf)
    at = (cell[:, 0], cell[:, 1])
    np.maximum.at(highest, at, centre[:, 2])
    np.minimum.at(lowest, at, centre[:, 2])
    there = np.isfinite(highest)
    there = ndimage.binary_fill_holes(there | ndimage.binary_closing(there))
    depth = clear = ndimage.distance_transform_edt(there) * side
    if walls is not None:
        walled = np.zeros(shape, bool)
        walled[at[0][walls], at[1][walls]] = True
        clear = ndimage.distance_transform_edt(there & ~ndimage.binary_closing(walled)) * side
    return FlatColumns(side, low, highest, lowest, depth, clear)
