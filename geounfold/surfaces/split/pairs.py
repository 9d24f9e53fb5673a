"""Pairs of opposite sides among which a split chooses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.sparse.csgraph import connected_components

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.surfaces.split.faces import Faces, ridges
from geounfold.surfaces.split.signed_graph import lowest_vector

RIDGE_COSINE = 0.9  # smoothed normals' cosine below which a ridge parts two sides of a body


LOOKS_BACK = 0.85  # faces of a pair of sides are opposite when smoothed -N.N' exceeds this


PAIRS = 3  # largest pairs of opposite sides that are compared: top, flanks, ends


SPECK = 30  # faces: what a ridge surrounds is a roughness, not another side


PLANE = 0.03  # thicknesses off its plane, rms, up to which a side is plane ...


LEVEL = 0.98  # ... where its smoothed normals' mean is longer than this


BENT_ADVANTAGE = 8.0  # a bent pair of sides is preferred to a plane one of up to this the extent


def signs(x: Floats) -> Ints:
    """Return 1 for numbers from 0 up, -1 for negative ones."""
    return np.where(x >= 0, 1, -1)


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two opposite sides of a body.

    ``rows`` (k,) its faces and ``side`` (k,) +1 or -1 for each; ``thickness`` their median
    distance; ``extent`` the smaller side's area over the squared thickness; ``flat``: both
    sides are plane; ``others`` (m,) marks the faces of other pairs.
    """

    rows: Ints
    side: Ints
    thickness: float
    extent: float
    flat: bool
    others: Bools


def sheet_pair(faces: Faces, L: sp.csc_array) -> _Pair | None:
    """Return the pair of opposite sides of the largest extent; None where there is none.

    A fold no wider than it is thick is a bent layer and, seen from its flanks, a plane one:
    plane sides are taken only where their extent is BENT_ADVANTAGE times that of bent ones.
    """
    rank = _families(faces)
    pairs = [_pair(rank, k, faces, L) for k in range(min(rank.max() + 1, PAIRS))]
    if not pairs:
        return None
    return max(pairs, key=lambda pair: pair.extent / (BENT_ADVANTAGE if pair.flat else 1.0))


def _families(faces: Faces) -> Ints:
    """Return the pair of sides to which each face belongs, (m,): 0 the largest, -1 for none.

    Faces beside a ridge, and those without an opposite one, belong to none; others are joined
    with their neighbours and with the face opposite.
    """
    N, near = faces.smoothed, faces.adjacency
    back = np.where(faces.hit >= 0, -np.einsum("ij,ij->i", N, N[faces.hit]), 0.0)
    good = (back > LOOKS_BACK) & ~ridges(faces, N, RIDGE_COSINE).any(axis=1)
    own = np.arange(len(N))
    row = np.concatenate([np.repeat(own, 3), own[good]])
    column = np.concatenate([near.ravel(), faces.hit[good]])
    both = good[row] & good[column]
    links = sp.coo_array((np.ones(both.sum()), (row[both], column[both])), (len(N), len(N)))
    found = connected_components(links, directed=False)[1]
    size = np.bincount(found[good], faces.area[good], minlength=found.max() + 1)
    rank = np.empty(len(size), dtype=np.int64)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    return np.where(good, rank[found], -1)


def _pair(rank: Ints, k: int, faces: Faces, L: sp.csc_array) -> _Pair:
    """Return the two sides that family k has, by its own lowest eigenvector."""
    rows = np.flatnonzero(rank == k)
    part = L.tocsr()[rows][:, rows].tocoo()
    off = part.row != part.col
    row, column, value = part.row[off], part.col[off], part.data[off]
    degree = np.bincount(row, np.abs(value), len(rows))
    own = np.arange(len(rows))
    at = np.concatenate([own, row]), np.concatenate([own, column])
    alone = sp.coo_array((np.concatenate([degree, value]), at), (len(rows), len(rows)))
    side = signs(lowest_vector(alone.tocsc())) if len(rows) > 2 else np.ones(len(rows), int)
    thickness = float(np.median(faces.distance[rows]))
    sides = [rows[side == s] for s in (1, -1)]
    areas = [float(faces.area[mine].sum()) for mine in sides]
    flat = all(_is_plane(faces, mine, thickness) for mine in sides)
    others = ((rank >= 0) & (rank != k)) | _parted(faces, rows)
    return _Pair(rows, side, thickness, min(areas) / thickness**2, flat, others)


def _is_plane(faces: Faces, rows: Ints, thickness: float) -> bool:
    """Return whether faces lie in a plane, as far as the staircase of blocks lets them.

    The flanks of strips were 0.015 to 0.023 thicknesses off theirs, with mean normals from 0.987
    on, the sides of a gently bent layer with a hole 0.03 to 0.05 and 0.978.
    """
    area = faces.area[rows]
    if not len(rows):
        return True
    mean = float(np.linalg.norm(area @ faces.smoothed[rows]) / area.sum())
    apart = faces.centre[rows] - area @ faces.centre[rows] / area.sum()
    least = np.linalg.eigvalsh((apart * area[:, None]).T @ apart / area.sum())[0]
    return mean > LEVEL and float(np.sqrt(max(least, 0.0))) <= PLANE * thickness


def _parted(faces: Faces, rows: Ints) -> Bools:
    """Return the faces that ridges part from all of some rows, specks excepted, (m,)."""
    n = len(faces.area)
    open_ = ~ridges(faces, faces.smoothed, RIDGE_COSINE).ravel()
    row, column = np.repeat(np.arange(n), 3)[open_], faces.adjacency.ravel()[open_]
    links = sp.coo_array((np.ones(len(row)), (row, column)), (n, n))
    _, part = connected_components(links, directed=True, connection="weak")
    far = np.bincount(part) > SPECK
    far[part[rows]] = False
    out: Bools = far[part]
    return out


def continued_sides(L: sp.csc_array, pair: _Pair) -> Floats:
    """Return a pair's sides continued over the other faces, (m,): ``L x = 0`` there."""
    x = np.zeros(L.shape[0])
    x[pair.rows] = pair.side
    free = np.ones(len(x), dtype=bool)
    free[pair.rows] = False
    if free.any():
        pull = -(L @ x)[free]
        rest = L.tocsr()[free][:, free] + 1e-9 * sp.eye_array(int(free.sum()))
        options = {"SymmetricMode": True}
        x[free] = spl.splu(sp.csc_array(rest), permc_spec="MMD_AT_PLUS_A", options=options).solve(
            pull
        )
    return x
