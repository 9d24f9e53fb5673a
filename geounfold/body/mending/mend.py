"""Mend a body on its lattice, so that its hull is the surface of a ball.

Waste inside the body is filled, thin bridges are cut and small holes are filled, the smallest
first, until Euler's number counts no handle. A crude body, with many handles as an indicator model
has them, is then smoothed as a whole. Every change is judged by itself: a body without cavities,
pits or handles stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.mending.euler import CORNER, handle_count
from geounfold.body.mending.fillings import fill_cavities, fill_lenses
from geounfold.body.mending.handles import close_handles
from geounfold.body.mending.smoothing import smoothed, stray_share
from geounfold.body.mending.voxels import VoxelBody
from geounfold.body.sub_blocks import FEWEST
from geounfold.geometry.mesh import Bools, Ints

CRUDE = 20
"""Number of handles above which a body is crude and is smoothed as a whole.

Measured: 0 or 1 in 40 sound bodies, 8 in a layer with waste lenses, 9 in a split seam, 160 to 720
in shells of interpolated indicators.
"""

FEW = 5
"""Number of handles left above which a crude body is refused."""

STRAYS = 0.01
"""Share of stray cells above which a body with handles is smoothed as a whole.

The hull is refused if it leaves a larger share of the blocks outside. Measured: up to 0.0032 in
sound bodies, 0.021 in a crude one.
"""

MOST_SMOOTHED = 0.05
"""Share of a body that smoothing may take if the body has few handles.

Such a body is thin or rough rather than crude: of two sound ones with a neck or a tight hinge,
smoothing would take 5 and 28 %.
"""

WORDS = ("", "cut", "dropped", "smoothed")
"""What became of a block, by its code: kept, part of a bridge, away from the body, at its skin."""


@dataclass(frozen=True, eq=False)
class Mended:
    """What was mended of a body.

    Attributes
    ----------
    filled : (m, 3) int
        Lattice cells that were filled.
    fate : (n,) int
        Index in `WORDS` for every cell given: 0 if it is kept.
    handles_closed, handles_left : int
        Number of handles that were closed, and that are left.
    """

    filled: Ints
    fate: Ints
    handles_closed: int
    handles_left: int

    @property
    def changed(self) -> bool:
        """Whether any cell was filled or left out."""
        return bool(len(self.filled)) or bool(self.fate.any())

    def count(self, word: str) -> int:
        """Return how many of the cells given have a word of `WORDS`."""
        return int((self.fate == WORDS.index(word)).sum())


@dataclass(frozen=True, eq=False)
class MendedBox:
    """A mended body in its box.

    Attributes
    ----------
    body, cut : (i, j, k) bool
        The mended body, and the cells cut as bridges.
    handles_closed, handles_left : int
        As in `Mended`.
    """

    body: Bools
    cut: Bools
    handles_closed: int
    handles_left: int


def mend(cells: Ints) -> Mended:
    """Return what is to be mended of a body.

    Parameters
    ----------
    cells : (n, 3) int
        Lattice cells of the body; repeated ones do no harm.

    Returns
    -------
    Mended
        Nothing is changed in sheets one block thick, whose blocks touch along edges, and if the box
        around the body has too many cells (`voxels.LARGEST`).
    """
    box = VoxelBody.of(cells)
    if box is None or OccupiedCells.of(cells).usual_neighbours < FEWEST:
        return Mended(np.zeros((0, 3), np.int64), np.zeros(len(cells), np.int64), 0, 0)
    found = mend_box(box.full)
    return Mended(
        filled=box.cells(found.body & ~box.full),
        fate=_fates(cells, box, found.body, found.cut),
        handles_closed=found.handles_closed,
        handles_left=found.handles_left,
    )


def mend_lost(box: VoxelBody) -> tuple[Mended, Bools]:
    """Return what is to be mended of a body in a box, and the mended body (i, j, k).

    ``Mended.fate`` is that of the cells that the mended body lacks alone.
    """
    found = mend_box(box.full)
    lost = box.cells(box.full & ~found.body)
    return Mended(
        filled=box.cells(found.body & ~box.full),
        fate=_fates(lost, box, found.body, found.cut) if len(lost) else np.zeros(0, np.int64),
        handles_closed=found.handles_closed,
        handles_left=found.handles_left,
    ), found.body


def mend_box(full: Bools) -> MendedBox:
    """Return the cells of a box (i, j, k) mended."""
    solid = fill_cavities(full)
    before = handle_count(solid)
    whole = fill_lenses(solid)
    handles = before if whole is solid else handle_count(whole)
    body, cut, left = _without_handles(whole, handles)
    return MendedBox(body, cut, before - left, left)


def _without_handles(whole: Bools, handles: int) -> tuple[Bools, Bools, int]:
    """Return the body with its handles closed, the cells cut as bridges, and the handles left."""
    found = close_handles(whole, handles)
    cut = whole & ~found.body
    crude = handles > CRUDE
    if crude or (handles and stray_share(found.body) > STRAYS):
        even = smoothed(found.body)
        lost = 1 - (even & whole).sum() / whole.sum()
        if even.any() and (crude or lost <= MOST_SMOOTHED):
            even = fill_cavities(even)
            found = close_handles(even, handle_count(even))
            cut |= even & ~found.body
    return found.body, cut, found.left


def _fates(cells: Ints, box: VoxelBody, body: Bools, cut: Bools) -> Ints:
    """Return the index in `WORDS` of every cell (n, 3); ``cut`` are the cells of bridges."""
    fate = np.zeros(len(cells), np.int64)
    lost = ~box.at(cells, body)
    if lost.any():
        out = cells[lost]
        near = box.at(out, np.asarray(ndimage.binary_dilation(body, CORNER)))
        word = np.where(near, WORDS.index("smoothed"), WORDS.index("dropped"))
        fate[lost] = np.where(box.at(out, cut), WORDS.index("cut"), word)
    return fate
