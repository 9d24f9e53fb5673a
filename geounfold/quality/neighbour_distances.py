"""Neighbour mean distance (NMD) of points, and its change between two spaces, epsilon."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.threads import cores, over_slices, slices
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.quality.lattice_neighbours import lattice_nmd

NEIGHBOURS = 26
"""Neighbours of a point: on a lattice, the blocks that share a face, an edge or a corner."""

CACHED = 1 << 11
"""Points whose distances are summed at once: they fit into the processor's cache."""

_CHUNK = 1 << 16  # points whose neighbours are searched at once: 28 MB beside the answer


def finite_points(points: Floats, name: str = "points") -> Floats:
    """Return points as contiguous (n, 3) floats; raise InputError if they are not such points."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"{name} must have shape (n, 3), but have {P.shape}")
    if not np.isfinite(P).all():
        bad = int(np.flatnonzero(~np.isfinite(P).all(axis=1))[0])
        raise InputError(f"{name}: row {bad} is not finite: {P[bad]}")
    return P


def check_same_rows(a: Floats, b: Floats, names: str) -> None:
    """Raise InputError unless two arrays have the same number of rows."""
    if len(a) != len(b):
        raise InputError(f"{names} must pair row by row, but have {len(a)} and {len(b)} rows")


def neighbours(points: Floats, k: int = NEIGHBOURS) -> Ints:
    """Return the k nearest neighbours of each point, without the point itself.

    Parameters
    ----------
    points : (n, 3) float
        Points, in any length unit; n > k.
    k : int
        Number of neighbours.

    Returns
    -------
    (n, k) int
        Row numbers, nearest first.  Equally near points come in an arbitrary order, which is the
        same in every call.

    Raises
    ------
    InputError
        A wrong shape, values that are not finite, k < 1, or too few points.

    Examples
    --------
    >>> neighbours(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), k=2).tolist()
    [[1, 2], [0, 2], [1, 0]]
    """
    P = finite_points(points)
    _check_neighbours(len(P), k)
    tree = cKDTree(P)
    out = np.empty((len(P), k), dtype=np.int64)
    for rows in slices(len(P), _CHUNK):
        out[rows] = _nearest(tree, rows, k)
    return out


def _check_neighbours(count: int, k: int) -> None:
    """Raise InputError if there are too few points for k neighbours, or k is below 1."""
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
    """Return neighbours without the row itself, which is not always first among coincident ones."""
    itself = found == rows[:, None]
    if itself[:, 0].all():
        first: Ints = found[:, 1:]
        return first
    # If more points coincide than are searched, the row itself may be missing: drop the first.
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
        Wrong shapes, values that are not finite, or row numbers out of range.

    Examples
    --------
    >>> nmd(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), np.array([[1, 2], [0, 2], [1, 0]]))
    array([2. , 1.5, 2.5])
    """
    P, N = finite_points(points), np.asarray(neighbours)
    if N.ndim != 2 or len(N) != len(P) or N.shape[1] == 0:
        raise InputError(f"neighbours must have shape ({len(P)}, k), but have {N.shape}")
    if not 0 <= N.min() <= N.max() < len(P):
        raise InputError(
            f"neighbours must be rows 0 to {len(P) - 1}, but are {N.min()} to {N.max()}"
        )
    return _mean_distance(np.ascontiguousarray(P.T), np.arange(len(P)), N)


def _mean_distance(axes: Floats, rows: Ints, ids: Ints) -> Floats:
    """Return the mean distance from the points of some rows (m,) to their neighbours (m, k).

    ``axes`` (3, n) holds the points' coordinates, one row per axis.
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

    ``|NMD(A_i) - NMD(B_i)| / NMD(A_i)``: the rows are the distribution of equation 2.3, their sum
    is equation 2.5.  Epsilon does not distinguish stretching from shrinking, and a folded body
    may have a small one.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference points and the same points elsewhere, row by row, *in the same unit*.
    k : int
        Number of neighbours.
    mode : {"reference", "own"}
        ``reference``: the neighbours found in A are used in B too.  ``own``: neighbours are found
        in A and in B.

    Returns
    -------
    (n,) float
        Dimensionless, not negative.

    Raises
    ------
    InputError
        Shapes differ, the mode is unknown, there are too few points, or a point of A coincides
        with all its neighbours.

    Examples
    --------
    >>> A = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> epsilon(A, 2 * A, k=2)
    array([1., 1., 1.])
    """
    A, B = finite_points(A, "A"), finite_points(B, "B")
    check_same_rows(A, B, "A and B")
    if mode not in ("reference", "own"):
        raise InputError(f"mode must be 'reference' or 'own', but is {mode!r}")
    if mode == "own":
        return _change(nmd(A, neighbours(A, k)), nmd(B, neighbours(B, k)), k)
    _check_neighbours(len(A), k)
    return _change(*_kept_neighbours(A, B, np.arange(len(A)), k), k)


def _change(before: Floats, after: Floats, k: int) -> Floats:
    """Return the relative change of mean distances (n,); raise InputError if one is 0 before."""
    if not before.all():
        raise InputError(f"point {int(np.argmin(before))} of A coincides with its {k} neighbours")
    return np.abs(before - after) / before


def _kept_neighbours(A: Floats, B: Floats, rows: Ints, k: int) -> tuple[Floats, Floats]:
    """Return the mean distances in A and in B of some points (m,) to their neighbours in A.

    Neighbours are held for a chunk of points at a time, so memory does not grow with m.
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
    """Return `epsilon` of blocks on a lattice, (n,): exact, and much faster than by a search tree.

    If more blocks are equally near than there is room for among k neighbours, the mean over them
    counts, whereas a tree picks some of them.  The answer therefore depends neither on the order
    of the rows nor on the body's position and orientation.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference blocks and the same blocks elsewhere, row by row, in the same unit.
    cells : (n, 3) int
        Lattice cell of each block of A.
    sides : (3,) float
        Sides of a cell, in any unit.
    k : int
        Number of neighbours.

    Raises
    ------
    InputError
        Shapes differ, there are too few points, or a point of A coincides with all its neighbours.
    """
    A, B = finite_points(A, "A"), finite_points(B, "B")
    check_same_rows(A, B, "A and B")
    _check_neighbours(len(A), k)
    found = lattice_nmd(cells, sides, (A, B), k)
    if found is None:
        return epsilon(A, B, k)
    before, after = found
    lonely = np.flatnonzero(np.isnan(before))
    before[lonely], after[lonely] = _kept_neighbours(A, B, lonely, k)
    return _change(before, after, k)
