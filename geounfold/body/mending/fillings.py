"""Fill what is waste inside a body: cavities, lenses with a mouth, pits."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from geounfold.body.mending.euler import FACE
from geounfold.body.mending.pieces import Pieces
from geounfold.geometry.mesh import Bools

OPEN_RIM = 0.35
"""Share of a filling's rim that may be open (see `Pieces.open_rim`)."""

LARGEST_SHARE = 0.05
"""Share of the body that one filling may have; a larger one is no detail."""

LEAST = 4
"""Number of cells from which a filling has a rim; smaller ones need five faces in six closed."""

WIDTHS = (1, 2)
"""Half widths, in cells, of the mouths that are closed, the narrow ones first."""


def fill_cavities(body: Bools) -> Bools:
    """Return a body (i, j, k) without the cavities that hold at most `LARGEST_SHARE` of it."""
    solid = np.asarray(ndimage.binary_fill_holes(body, FACE))
    inside = solid & ~body
    if not inside.any():
        return body
    pieces = Pieces.of(body, inside)
    return pieces.with_chosen(pieces.sizes <= LARGEST_SHARE * body.sum())


def fill_lenses(body: Bools) -> Bools:
    """Return a body (i, j, k) with its waste lenses and pits filled; itself if it has none.

    What a closing by `WIDTHS` adds is judged piece by piece.
    """
    for width in WIDTHS:
        closed = ndimage.binary_closing(body, FACE, width)
        pieces = Pieces.of(body, np.asarray(closed & ~body))
        if not pieces.count:
            continue
        solid, rest = (faces.sum(axis=1) for faces in pieces.faces)
        wanted = np.where(pieces.sizes < LEAST, solid >= 5 * rest, pieces.open_rim < OPEN_RIM)
        wanted &= pieces.sizes <= LARGEST_SHARE * body.sum()
        if wanted[1:].any():
            body = pieces.with_chosen(wanted)
    return body
