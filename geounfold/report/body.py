"""The body that a report shows: its blocks with an image, checked once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.quality.neighbour_distances import NEIGHBOURS, neighbours, nmd
from geounfold.report.columns import DISTRIBUTED

_COORDINATES = ("unfolded_x", "unfolded_y", "unfolded_z")  # columns that repeat the blocks' own


@dataclass(frozen=True, eq=False)
class ReportBody:
    """The blocks that have an image, with all that is known of them.

    Attributes
    ----------
    folded, unfolded : (n, 3) float
        Block centroids in both spaces.
    rows : (n,) int
        Data rows of the input, from 1.
    total : int
        Number of blocks, including those without an image.
    columns : dict of (n,)
        All columns of the input and of the result.
    results : dict of (n,) float
        Columns of the result that the still pictures and distributions show.
    neighbours : (n, k) int or None
        Rows of each block's neighbours when folded, in its own fault block if that has enough
        blocks; None if there are too few blocks.
    distances : two of (n,) float, or None
        Neighbour mean distances in both spaces, in the input's unit.
    """

    folded: Floats
    unfolded: Floats
    rows: Ints
    total: int
    columns: Mapping[str, ArrayLike]
    results: Mapping[str, Floats]
    neighbours: Ints | None
    distances: tuple[Floats, Floats] | None


def report_body(folded: Floats, unfolded: Floats, columns: Mapping[str, ArrayLike]) -> ReportBody:
    """Return the body that a report shows.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        Block centroids in both spaces, in the same unit; NaN in the unfolded space for a block
        without an image.
    columns : mapping of str to (n,)
        Columns of the input and of the result.

    Raises
    ------
    InputError
        Arrays do not agree, or values are not finite.
    """
    X, Y = np.asarray(folded, dtype=np.float64), np.asarray(unfolded, dtype=np.float64)
    if X.shape != Y.shape or X.ndim != 2 or X.shape[1] != 3:
        raise InputError(f"folded {X.shape} and unfolded {Y.shape} must both be (n, 3)")
    if not np.isfinite(X).all():
        raise InputError(f"{np.count_nonzero(~np.isfinite(X))} folded coordinates are not finite")
    placed: Bools = np.asarray(np.isfinite(Y).all(axis=1))
    if not placed.any():
        raise InputError("no block has finite unfolded coordinates: there is nothing to draw")
    known = {n: _placed(n, v, placed) for n, v in columns.items() if n not in _COORDINATES}
    results = {n: _finite(n, known[n]) for n in ("stratigraphic", *DISTRIBUTED) if n in known}
    X, Y = X[placed], Y[placed]
    ids = _neighbours(X, known.get("fault_block"))
    distances = None if ids is None else (nmd(X, ids), nmd(Y, ids))
    if distances is not None:
        results.setdefault("nmd_error", np.abs(distances[0] - distances[1]) / distances[0])
        known |= {"nmd_error": results["nmd_error"]}
        known |= dict(zip(("nmd_folded", "nmd_unfolded"), distances, strict=True))
    rows = np.flatnonzero(placed) + 1
    return ReportBody(X, Y, rows, len(placed), known, results, ids, distances)


def _neighbours(X: Floats, fault_block: ArrayLike | None) -> Ints | None:
    """Return the rows of each block's neighbours (n, k); None if there are too few blocks.

    A fault parts neighbours: distances across it change by the slip, which is no distortion.
    """
    if len(X) <= NEIGHBOURS:
        return None
    _, own = np.unique(np.zeros(len(X)) if fault_block is None else np.asarray(fault_block),
                       return_inverse=True)  # fmt: skip
    count = np.bincount(own.ravel())
    if len(count) == 1 or count.min() <= NEIGHBOURS:
        return neighbours(X)
    out = np.empty((len(X), NEIGHBOURS), np.int64)
    for block in range(len(count)):
        rows = np.flatnonzero(own.ravel() == block)
        out[rows] = rows[neighbours(X[rows])]
    return out


def _placed(name: str, values: ArrayLike, placed: Bools) -> ArrayLike:
    """Return a column's values of the blocks that have an image."""
    plain = np.asarray(values)
    if plain.shape != placed.shape:
        raise InputError(f"column {name} has shape {plain.shape}, but there are {len(placed)} rows")
    kept: ArrayLike = plain[placed]
    return kept


def _finite(name: str, values: ArrayLike) -> Floats:
    """Return a column of the result as floats; raise InputError if some are not finite."""
    v = np.asarray(values, dtype=np.float64)
    if not np.isfinite(v).all():
        raise InputError(
            f"column {name}: {np.count_nonzero(~np.isfinite(v))} values are not finite"
        )
    return v
