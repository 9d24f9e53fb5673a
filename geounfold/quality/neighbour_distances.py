"""Mean distances to neighbours (NMD) and their change, epsilon."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores, over_slices, slices
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.quality.lattice_neighbours import lattice_nmd

NEIGHBOURS = 26
"""Neighbours per point: those of a block inside a lattice that share a face, edge or corner."""


_CHUNK = 1 << 16  # points whose neighbours are sought at once: 28 MB beside the answer


CACHED = 1 << 11  # points whose distances are summed at once: they stay in the cache


def neighbour_cloud(points: Floats, name: str = "points") -> Floats:
    """Return points as contiguous (n, 3) floats, or raise InputError."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"{name} must have shape (n, 3), but have {P.shape}")
    if not np.isfinite(P).all():
        bad = int(np.flatnonzero(~np.isfinite(P).all(axis=1))[0])
        raise InputError(f"{name}: row {bad} is not finite: {P[bad]}")
    return P


def same_rows(a: Floats, b: Floats, names: str) -> None:
    """Raise InputError unless two arrays have the same shape."""
    if len(a) != len(b):
        raise InputError(f"{names} must pair row by row, but have {len(a)} and {len(b)} rows")


def neighbours(points: Floats, k: int = NEIGHBOURS) -> Ints:
    """Return the k nearest neighbours of each point, itself left out.

    Parameters
    ----------
    points : (n, 3) float
        Points, in any length unit; n > k.
    k : int
        Number of neighbours.

    Returns
    -------
    (n, k) int
        Row numbers, nearest first; of equally near ones, any, but always the same.

    Raises
    ------
    InputError
        Wrong shape, values that are not finite, k < 1 or too few points.

    Examples
    --------
    >>> neighbours(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), k=2).tolist()
    [[1, 2], [0, 2], [1, 0]]
    """
    P = neighbour_cloud(points)
    _check_neighbours(len(P), k)
    tree = cKDTree(P)
    out = np.empty((len(P), k), dtype=np.int64)
    for rows in slices(len(P), _CHUNK):
        out[rows] = _nearest(tree, rows, k)
    return out


def _check_neighbours(count: int, k: int) -> None:
    """Raise InputError where points cannot have k neighbours."""
    if k < 1:
        raise InputError(f"the number of neighbours must be at least 1, but is {k}")
    if count <= k:
        raise InputError(f"{k} neighbours need more than {k} points, but there are {count}")


def _nearest(tree: cKDTree, rows: slice | Ints, k: int) -> Ints:
    """Return the k nearest neighbours of some of a tree's points, (m, k)."""
    found = np.asarray(tree.query(tree.data[rows], k=k + 1, workers=cores())[1], dtype=np.int64)
    numbers = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
    return _without_self(found, numbers)


def _without_self(found: Ints, rows: Ints) -> Ints:
    """Drop each row's own number; among coincident points it need not come first."""
    itself = found == rows[:, None]
    if itself[:, 0].all():
        first: Ints = found[:, 1:]
        return first
    # Where more points coincide than were asked for, the row itself may be missing: drop any.
    itself[~itself.any(axis=1), 0] = True
    others: Ints = found[~itself].reshape(len(found), -1)
    return others


def nmd(points: Floats, neighbours: Ints) -> Floats:
    """Return the neighbour mean distance of each point (thesis, equation 2.2).

    Parameters
    ----------
    points : (n, 3) float
        Points, in any length unit.
    neighbours : (n, k) int
        Row numbers of each point's neighbours.

    Returns
    -------
    (n,) float
        Mean distance to the neighbours, in the points' unit.

    Raises
    ------
    InputError
        Wrong shapes, values that are not finite or row numbers out of range.

    Examples
    --------
    >>> nmd(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), np.array([[1, 2], [0, 2], [1, 0]]))
    array([2. , 1.5, 2.5])
    """
    P, N = neighbour_cloud(points), np.asarray(neighbours)
    if N.ndim != 2 or len(N) != len(P) or N.shape[1] == 0:
        raise InputError(f"neighbours must have shape ({len(P)}, k), but have {N.shape}")
    if not 0 <= N.min() <= N.max() < len(P):
        raise InputError(f"neighbours name rows {N.min()}..{N.max()}, but there are {len(P)}")
    return _mean_distance(np.ascontiguousarray(P.T), np.arange(len(P)), N)


def _mean_distance(axes: Floats, rows: Ints, ids: Ints) -> Floats:
    """Return the mean distance from points in some rows (m,) to their neighbours (m, k).

    ``axes`` (3, n) are the points' columns.
    """
    out = np.empty(len(rows))

    def work(part: slice) -> None:
        square: Floats = np.zeros(ids[part].shape)
        for axis in axes:
            square += (axis[ids[part]] - axis[rows[part], None]) ** 2
        out[part] = np.sqrt(square, out=square).mean(axis=1)

    over_slices(work, len(rows), CACHED)
    return out


def epsilon(
    A: Floats, B: Floats, k: int = NEIGHBOURS, mode: Literal["reference", "own"] = "reference"
) -> Floats:
    """Return the relative change of the neighbour mean distance (thesis, equation 2.4).

    ``|NMD(A_i) - NMD(B_i)| / NMD(A_i)``: its rows are the distribution of equation 2.3, their sum
    is equation 2.5.  It tells neither stretching from shrinking nor a fold from none.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference and other cloud, row by row the same points, *in the same unit*.
    k : int
        Number of neighbours.
    mode : "reference" or "own"
        Whether B keeps the neighbours found in A, or each cloud has its own.

    Returns
    -------
    (n,) float
        Dimensionless, not negative.

    Raises
    ------
    InputError
        Unequal shapes, an unknown mode, too few points, or coincident points in A.

    Examples
    --------
    >>> A = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> epsilon(A, 2 * A, k=2)
    array([1., 1., 1.])
    """
    A, B = neighbour_cloud(A, "A"), neighbour_cloud(B, "B")
    same_rows(A, B, "A and B")
    if mode not in ("reference", "own"):
        raise InputError(f"mode must be 'reference' or 'own', but is {mode!r}")
    if mode == "own":
        return _change(nmd(A, neighbours(A, k)), nmd(B, neighbours(B, k)), k)
    _check_neighbours(len(A), k)
    return _change(*_kept_neighbours(A, B, np.arange(len(A)), k), k)


def _change(before: Floats, after: Floats, k: int) -> Floats:
    """Return the relative change of mean distances, (n,)."""
    if not before.all():
        raise InputError(f"point {int(np.argmin(before))} of A coincides with its {k} neighbours")
    return np.abs(before - after) / before


def _kept_neighbours(A: Floats, B: Floats, rows: Ints, k: int) -> tuple[Floats, Floats]:
    """Return the mean distance of some points (m,) to their neighbours in A, in A and in B.

    The neighbours of a part of them at a time: memory does not grow with their number.
    """
    before, after = np.empty(len(rows)), np.empty(len(rows))
    if len(rows):
        tree = cKDTree(A)
        a, b = np.ascontiguousarray(A.T), np.ascontiguousarray(B.T)
        for part in slices(len(rows), _CHUNK):
            ids = _nearest(tree, rows[part], k)
            before[part] = _mean_distance(a, rows[part], ids)
            after[part] = _mean_distance(b, rows[part], ids)
    return before, after


def lattice_epsilon(A: Floats, B: Floats, cells: Ints, sides: Floats, k: int) -> Floats:
    """Return `epsilon` of blocks on a lattice, (n,): exact, many times faster than by a tree.

    Of equally near neighbours the mean counts; a tree takes any.  So the answer depends neither
    on the order of the rows nor on how the body lies in space.

    Parameters
    ----------
    A, B : (n, 3) float
        As for `epsilon`.
    cells : (n, 3) int
        Lattice cell of each block of A.
    sides : (3,) float
        Sides of a cell, in any unit.
    k : int
        Number of neighbours.

    Raises
    ------
    InputError
        As `epsilon` does.
    """
    A, B = neighbour_cloud(A, "A"), neighbour_cloud(B, "B")
    same_rows(A, B, "A and B")
    _check_neighbours(len(A), k)
    found = lattice_nmd(cells, sides, (A, B), k)
    if found is None:
        return epsilon(A, B, k)
    before, after = found
    lonely = np.flatnonzero(np.isnan(before))
    before[lonely], after[lonely] = _kept_neighbours(A, B, lonely, k)
    return _change(before, after, k)
