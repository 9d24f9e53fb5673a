"""Connected cells that are added to a voxel body or taken away from it, judged piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from geounfold.body.mending.euler import CORNER, euler_changes
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers


@dataclass(frozen=True, eq=False)
class Pieces:
    """Connected sets of cells beside or in a body.

    Attributes
    ----------
    body : (i, j, k) bool
        The body.
    number : (i, j, k) int
        Piece of every cell, from 1; 0 for cells of none. Pieces do not share a corner.
    count : int
        Number of pieces.
    """

    body: Bools
    number: Numbers
    count: int

    @classmethod
    def of(cls, body: Bools, cells: Bools) -> Pieces:
        """Return the pieces of cells (i, j, k), all of them in the body or all outside."""
        number, count = ndimage.label(cells, CORNER)
        return cls(body, np.asarray(number, np.int32), int(count))

    @cached_property
    def cells(self) -> Ints:
        """Flat index of every cell of a piece, (m,)."""
        return np.flatnonzero(self.number)

    @cached_property
    def own(self) -> Ints:
        """Piece of each of ``cells``, (m,)."""
        out: Ints = self.number.ravel()[self.cells].astype(np.int64)
        return out

    @cached_property
    def sizes(self) -> Ints:
        """Number of cells of each piece, (count + 1,); entry 0 is 0."""
        return np.bincount(self.own, minlength=self.count + 1)

    @cached_property
    def handles(self) -> Ints:
        """Number of handles that go if a piece is added, or taken away, (count + 1,).

        It is the rise of Euler's number, if pieces and cavities stay as many.
        """
        other = self.body ^ (self.number > 0)
        return euler_changes(self.body, other, self.number, self.count)

    @cached_property
    def faces(self) -> tuple[Ints, Ints]:
        """Faces of each piece across each axis, to the body and to what is neither, (count + 1, 3).

        Faces between two cells of the piece do not count.
        """
        to_body, to_rest = (np.zeros((self.count + 1, 3), np.int64) for _ in range(2))
        number, body = self.number.ravel(), self.body.ravel()
        _, j, k = self.number.shape
        for axis, stride in enumerate((j * k, k, 1)):
            for step in (stride, -stride):
                beside = self.cells + step
                border = number[beside] == 0
                solid = border & body[beside]
                to_body[:, axis] += np.bincount(self.own[solid], minlength=self.count + 1)
                rest = border & ~body[beside]
                to_rest[:, axis] += np.bincount(self.own[rest], minlength=self.count + 1)
        return to_body, to_rest

    @cached_property
    def open_rim(self) -> Floats:
        """Share of each piece's rim that does not touch the body, (count + 1,).

        The rim is what looks along the two axes other than that of the most faces to the body. A
        lens of waste or a pit touches the body nearly all round; the gap between two limbs or plies
        only at one end. A piece that is open across the third axis too, as a step's corner is,
        counts as open all round.
        """
        solid, rest = self.faces
        row, axis = np.arange(self.count + 1), solid.argmax(axis=1)
        across = rest[row, axis] / np.maximum((solid + rest)[row, axis], 1)
        rim_rest = rest.sum(axis=1) - rest[row, axis]
        rim = rim_rest + solid.sum(axis=1) - solid[row, axis]
        return np.where(across > _ACROSS, 1.0, rim_rest / np.maximum(rim, 1))

    def chosen(self, which: Bools) -> Bools:
        """Return the cells (i, j, k) of some pieces, (count + 1,)."""
        which = which.copy()
        which[0] = False
        out: Bools = which[self.number]
        return out

    def with_chosen(self, which: Bools) -> Bools:
        """Return the body with the chosen pieces added, or taken away, (i, j, k)."""
        out: Bools = self.body ^ self.chosen(which)
        return out


_ACROSS = 0.35
"""Share of the faces across a piece that may be open."""
