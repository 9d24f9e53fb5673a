"""What was mended in a run, for summary, warning and column: counts and places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import connected
from geounfold.body.mending.mend import CRUDE, FEW, WORDS, Mended
from geounfold.errors import NoSheetError
from geounfold.geometry.mesh import Floats, Ints

MOST_PLACES = 10
"""Number of places that are told of each kind of change, the largest first."""

MOST_LEFT_OUT = 0.06
"""Share of the blocks that mending may leave out of the hull.

Measured: 0.042 and 0.058 in crude shells that are unfolded with 0.2 % of the blocks outside the
layer and with levels 0.03 off; 0.074 in one whose levels are 0.10 off; 0.09 and 0.14 in others,
whose maps put 8 and 29 % of the blocks outside, after a minute.
"""

_REACH = 1.8  # cells: distance within which changes are one place; a corner apart is 1.73


@dataclass(frozen=True)
class MendedPlace:
    """Cells that were changed together.

    Attributes
    ----------
    what : str
        ``filled``, ``cut``, ``dropped`` or ``smoothed``.
    cells : int
        Their number.
    at : (float, float, float)
        The one nearest to their middle, in the data's coordinates.
    """

    what: str
    cells: int
    at: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class MendingRecord:
    """What was mended of a run's bodies.

    Attributes
    ----------
    fate : (n,) int
        Index in `WORDS` for every point given; 0 if it is kept.
    blocks : int
        Number of points in the bodies.
    filled, cut, dropped, smoothed : int
        Number of lattice cells.
    handles_closed, handles_left : int
        Number of handles.
    places : tuple of MendedPlace
        Largest first, at most `MOST_PLACES` of each kind and body.
    """

    fate: Ints
    blocks: int = 0
    filled: int = 0
    cut: int = 0
    dropped: int = 0
    smoothed: int = 0
    handles_closed: int = 0
    handles_left: int = 0
    places: tuple[MendedPlace, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether any cell was filled or left out of the hull."""
        return bool(self.filled or self.cut or self.dropped or self.smoothed)

    @property
    def column(self) -> np.ndarray:
        """What became of every point: empty, cut, dropped or smoothed, (n,) of str."""
        out: np.ndarray = np.array(WORDS, dtype=object)[self.fate]
        return out

    @classmethod
    def of(cls, mended: Mended, rows: Ints, places: tuple[MendedPlace, ...]) -> MendingRecord:
        """Return the record of one body.

        Parameters
        ----------
        mended : Mended
            What was mended of its cells.
        rows : (n,) int
            For every point given, its row among the body's cells; -1 if it is in none.
        places : tuple of MendedPlace
            Where.
        """
        return cls(
            fate=np.where(rows >= 0, mended.fate[np.maximum(rows, 0)], 0),
            blocks=int((rows >= 0).sum()),
            filled=len(mended.filled),
            cut=mended.count("cut"),
            dropped=mended.count("dropped"),
            smoothed=mended.count("smoothed"),
            handles_closed=mended.handles_closed,
            handles_left=mended.handles_left,
            places=places,
        )

    def joined(self, other: MendingRecord) -> MendingRecord:
        """Return the record of the bodies of both; every point is in one body at most."""
        counts = (
            "blocks",
            "filled",
            "cut",
            "dropped",
            "smoothed",
            "handles_closed",
            "handles_left",
        )
        return MendingRecord(
            fate=np.maximum(self.fate, other.fate),
            places=(*self.places, *other.places),
            **{name: getattr(self, name) + getattr(other, name) for name in counts},
        )

    @property
    def crude(self) -> bool:
        """Whether the bodies had more than `CRUDE` handles."""
        return self.handles_left + self.handles_closed > CRUDE

    @property
    def left_out(self) -> int:
        """Number of blocks that the hull leaves out."""
        return self.cut + self.dropped + self.smoothed

    def check(self) -> None:
        """Raise NoSheetError if the body is too crude for a hull.

        It is if more than `FEW` of more than `CRUDE` handles are left, or if more than
        `MOST_LEFT_OUT` of its blocks would be left out.
        """
        many = self.crude and self.handles_left > FEW
        if many or self.left_out > MOST_LEFT_OUT * self.blocks:
            raise NoSheetError(self.too_crude())

    def too_crude(self) -> str:
        """Return the sentence that refuses a crude body."""
        largest = max(self.places, key=lambda place: place.cells)
        return (
            f"crude shell: {self.handles_left} handles left after {self.filled} cells were "
            f"filled and {self.left_out} of {self.blocks} blocks left "
            f"out{self._at(largest.what)}; model the domain with a smoother boundary, or leave out "
            "the blocks of thin bridges and loose bits"
        )

    def summary(self) -> dict[str, Any]:
        """Return counts and places for the summary, ready for JSON."""
        return {
            "filled": self.filled,
            "cut": self.cut,
            "dropped": self.dropped,
            "smoothed": self.smoothed,
            "handles_closed": self.handles_closed,
            "handles_left": self.handles_left,
            "places": [{"what": p.what, "cells": p.cells, "at": list(p.at)} for p in self.places],
        }

    def sentence(self) -> str:
        """Return one sentence that says what was mended, how much and where; empty if nothing."""
        told = []
        if self.filled:
            told.append(
                f"{self.filled} cells inside the body were filled for the hull{self._at('filled')}"
            )
        for word, what in _LEFT_OUT.items():
            count = getattr(self, word)
            if count:
                told.append(f"{count} blocks {what} were left out of the hull{self._at(word)}")
        if self.handles_closed > 0:
            told.append(f"this closed {self.handles_closed} handle(s)")
        return "; ".join(told) if self.changed else ""

    def _at(self, what: str) -> str:
        place = next((p for p in self.places if p.what == what), None)
        return (
            ""
            if place is None
            else ", most around ({})".format(", ".join(f"{x:.6g}" for x in place.at))
        )


_LEFT_OUT = {
    "cut": "of thin bridges",
    "dropped": "away from the body",
    "smoothed": "of a rough skin",
}


def places_of(what: str, cells: Ints, world: Floats) -> tuple[MendedPlace, ...]:
    """Return the places of changed cells, the largest first.

    Parameters
    ----------
    what : str
        The change.
    cells : (n, 3) int
        Lattice cells.
    world : (n, 3) float
        Their centres in the data's coordinates.
    """
    if not len(cells):
        return ()
    pairs = cKDTree(cells).query_pairs(_REACH, output_type="ndarray")
    group = connected(pairs[:, 0], pairs[:, 1], len(cells))
    sizes = np.bincount(group)
    out = []
    for number in np.lexsort((np.arange(len(sizes)), -sizes))[:MOST_PLACES]:
        mine = world[group == number]
        nearest = mine[np.square(mine - mine.mean(axis=0)).sum(axis=1).argmin()]
        x, y, z = nearest.tolist()
        out.append(MendedPlace(what, len(mine), (x, y, z)))
    return tuple(out)
