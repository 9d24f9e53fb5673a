"""Candidates for top and bottom: a list of pairs of opposite sides, judged by one measure.

A body has several pairs of opposite sides: top and bottom, flanks, ends.  The candidates are
its largest pairs by area, `CANDIDATES`; if no face has an opposite one that looks straight back,
the only candidate is the whole hull.  The measure of a candidate is its extent, the area of its
smaller side over the squared thickness, divided by `BENT_ADVANTAGE` if both sides are plane.  The
candidate of the largest measure is taken, of those whose sides are `CLOSEST` apart or more; the
larger pair if two are equal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.surfaces.split.faces import Faces, ridges
from geounfold.surfaces.split.result import Candidate
from geounfold.surfaces.split.signed_graph import lowest_vector

RIDGE_COSINE = 0.9
"""Cosine of smoothed normals below which a ridge parts two sides of a body.

Of 106 hulls, half the angle moves sides by 1 % of the area or more on 8, twice on 15 (up to 41 %).
"""

LOOKS_BACK = 0.85
"""Smoothed -N.N' above which two faces of a pair of sides are opposite.

Of 106 hulls, half the angle moves sides by 1 % of the area or more on 16, twice on 66.
"""

CANDIDATES = ("largest pair", "second pair", "third pair")
"""Names of the candidates, by area: top and bottom, flanks and ends in any order."""

CLOSEST = 0.5
"""Distance of two sides, in blocks, below which they are a crumple of the hull, not a body's.

Measured: one 0.04 blocks thick, 0.15 % of a branch's hull, had the largest extent; sheets of one
block have sides 2 blocks apart.
"""

SPECK = 30
"""Number of faces up to which what a ridge surrounds is a roughness, not another side.

Measured: half changes the flanks by up to 22 % of the area, twice by 9 %; the sides stay.
"""

PLANE = 0.03
"""Distance of a side from its plane, rms in thicknesses, up to which it is plane.

Measured: flanks of strips 0.015 to 0.023, sides of a gently bent layer with a hole 0.03 to 0.05.
"""

LEVEL = 0.98
"""Length of the mean of a plane side's smoothed normals, at least.

Measured: flanks of strips from 0.987 on, sides of a gently bent layer with a hole 0.978.
"""

BENT_ADVANTAGE = 8.0
"""Divisor of a plane pair's extent: a fold no wider than it is thick is plane seen from its flanks.

Measured: at half, two strips narrower than thick are split by their flanks; twice has no effect.
"""

SAME_LAYER = 0.5
"""Cosine of smoothed normals, of more than half of a pair's faces, at which it continues the sheet.

It is taken between a face and the nearest one of the sheet on the same side, without its sign: the
limbs past the crease of an isoclinal fold look at each other.  Measured: bulges, boudins, steps and
far sides of faults 0.78 to 1, such limbs -0.7, flanks and ends -0.26 to 0.2.
"""


def signs(x: Floats) -> Ints:
    """Return 1 for numbers from 0 up, -1 for negative ones."""
    return np.where(x >= 0, 1, -1)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two opposite sides of a body, and what they were judged by.

    ``rows`` (k,) its faces and ``side`` (k,) +1 or -1 for each; ``thickness`` their median
    distance, working units; ``rank`` (m,) is the pair of each face, -1 for none.
    """

    candidate: Candidate
    rows: Ints
    side: Ints
    thickness: float
    rank: Ints


def sheet_pair(
    faces: Faces, L: sp.csc_array, walls: Bools | None = None
) -> tuple[Pair, tuple[Candidate, ...]]:
    """Return the pair of opposite sides that is taken, and all candidates in order.

    Faces at ``walls`` (m,), known faults, belong to no pair.
    """
    rank = _families(faces, walls)
    count = int(rank.max()) + 1
    pairs = [_pair(name, rank, k, faces, L) for k, name in enumerate(CANDIDATES[:count])]
    pairs = pairs or [_whole(faces, L)]
    taken = max(pairs, key=lambda pair: (pair.thickness >= CLOSEST, pair.candidate.measure))
    return taken, tuple(replace(p.candidate, taken=p is taken) for p in pairs)


def _families(faces: Faces, walls: Bools | None = None) -> Ints:
    """Return the pair of sides to which each face belongs, (m,): 0 the largest, -1 for none.

    Faces beside a ridge, and those without an opposite one, belong to none; others are joined
    with their neighbours and with the face opposite.
    """
    N, near = faces.smoothed, faces.adjacency
    back = np.where(faces.hit >= 0, -np.einsum("ij,ij->i", N, N[faces.hit]), 0.0)
    good = (back > LOOKS_BACK) & ~ridges(faces, N, RIDGE_COSINE).any(axis=1)
    if walls is not None:
        good &= ~walls
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


def _pair(name: str, rank: Ints, k: int, faces: Faces, L: sp.csc_array) -> Pair:
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
    return Pair(_candidate(name, rows, side, thickness, faces), rows, side, thickness, rank)


def _whole(faces: Faces, L: sp.csc_array) -> Pair:
    """Return the two sides of the whole hull, by its lowest eigenvector."""
    side, rows = signs(lowest_vector(L)), np.arange(len(faces.area))
    candidate = _candidate("whole hull", rows, side, faces.median, faces)
    return Pair(candidate, rows, side, faces.median, np.zeros(len(rows), dtype=np.int64))


def _candidate(name: str, rows: Ints, side: Ints, thickness: float, faces: Faces) -> Candidate:
    """Return the figures of two sides, and the measure by which they are judged."""
    sides = [rows[side == s] for s in (1, -1)]
    extent = min(float(faces.area[mine].sum()) for mine in sides) / thickness**2
    plane = all(_is_plane(faces, mine, thickness) for mine in sides)
    return Candidate(name, extent, plane, extent / (BENT_ADVANTAGE if plane else 1.0))


def _is_plane(faces: Faces, rows: Ints, thickness: float) -> bool:
    """Return whether faces lie in a plane but for the staircase of blocks."""
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


def continued_sides(L: sp.csc_array, pair: Pair) -> Floats:
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


def flanks(faces: Faces, pair: Pair, side: Ints) -> Bools:
    """Return the faces that are no part of the sheet, (m,): flanks, ends, and what ridges part.

    A sheet of uneven thickness has several pairs of opposite sides: steep slopes part them, along
    which no two faces look straight at each other.  Those that are parallel to the nearest faces
    of the same side belong to one sheet.

    Parameters
    ----------
    faces : Faces
        The hull's faces.
    pair : Pair
        The pair that is taken.
    side : (m,) int
        Its sides, continued over all faces.
    """
    rank, own = pair.rank, np.zeros(len(side), dtype=bool)
    own[pair.rows] = True
    while True:
        parallel = _parallel(faces, own, side)
        far = (rank >= 0) & ~own
        at = np.unique(rank[far], return_inverse=True)[1]
        area = faces.area[far]
        agrees = np.bincount(at, area * (parallel[far] > SAME_LAYER)) > 0.5 * np.bincount(at, area)
        if not agrees.any():
            break
        own[far] = agrees[at]
    out: Bools = ((rank >= 0) & ~own) | _parted(faces, np.flatnonzero(own))
    return out


def _parallel(faces: Faces, own: Bools, side: Ints) -> Floats:
    """Return how parallel each face is to the nearest own one on its side, (m,): |cosine|, or 0."""
    cosine = np.zeros(len(side))
    for s in (1, -1):
        sheet = np.flatnonzero(own & (side == s))
        mine = (side == s) & ~own
        if len(sheet) and mine.any():
            near = sheet[cKDTree(faces.centre[sheet]).query(faces.centre[mine])[1]]
            cosine[mine] = np.einsum("ij,ij->i", faces.smoothed[mine], faces.smoothed[near])
    return np.abs(cosine)
