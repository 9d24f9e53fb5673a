"""Landmark Isomap of the mid surface, then each block by its distances (as in Unfolding.jl)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from geounfold.errors import FlatteningError, InputError, check_whole
from geounfold.flattening._classical_scaling import scaled
from geounfold.geometry.measures import vertex_normals
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.methods.contract import BodyFit, Placed, PreparedBody, by_rule
from geounfold.methods.sheet.meshing.build import register
from geounfold.methods.sheet.result import SheetResult
from geounfold.methods.sheet.stages import sheet_stages

_TIE = 1e-6  # relative difference of distances up to which neighbours are all taken or all left
_SPARE = 24  # neighbours searched beyond those wanted, for ties
_CHUNK = 4096  # points placed at once
_STEPS = 60  # most steps of Levenberg and Marquardt
_STILL = 1e-10  # blocks: a point that moves less is finished
_TINY = 1e-12  # blocks: below this distance two points define no direction
_OWN = 1e-9  # blocks: a point nearer than this to a block counts as the block
_HASH = np.array([73_856_093, 19_349_663, 83_492_791], dtype=np.int64)

# Values of Unfolding.jl:
_NEAR = 50  # placed points whose distances to a block are kept
_ROUNDS = 4  # rounds in which blocks are placed, each from the blocks of earlier rounds
_LARGEST = 2.5  # blocks: with a larger error of a distance to a neighbour a block is placed again


@dataclass(frozen=True, kw_only=True)
class IsomapMethodOptions:
    """Options of ``isomap``; the defaults are Unfolding.jl's.

    Parameters
    ----------
    neighbours : int
        Neighbours of each point of the mid surface in the graph.
    landmarks : int
        Points of the mid surface from which distances are measured; all points if there are fewer.

    Raises
    ------
    OptionError
        A value out of its range.
    """

    neighbours: int = 16
    landmarks: int = 1500

    def __post_init__(self) -> None:
        check_whole("isomap_options.neighbours", self.neighbours, 3)
        check_whole("isomap_options.landmarks", self.landmarks, 4)


def fit_isomap(body: PreparedBody) -> BodyFit:
    """Return the map of a body by landmark Isomap (Caixeta and Costa 2021).

    Points of the mid surface are joined with their nearest neighbours; the shortest paths along the
    graph replace lengths along the surface, and classical scaling of the paths between the
    landmarks (de Silva and Tenenbaum 2004) lays the surface flat.  A block starts over the nearest
    point of the surface, at its distance from it.  It then moves to the place at which its
    distances to the nearest placed points fit those of the folded body by least squares.

    Differences from Unfolding.jl: the mid surface is the one that ``sheet`` fits, not thinned
    sections; landmarks are the farthest from each other, not random; the least squares are solved
    by Levenberg and Marquardt, not Nelder and Mead; a block's round depends on its place, so that
    neither the order of the rows nor chance changes the result.

    Notes
    -----
    A path along a graph is longer than the line it follows, so the surface comes out too large;
    layers do not slip; the map is known only at the blocks, and has no inverse.

    Raises
    ------
    FlatteningError
        The graph of neighbours is not connected, or its distances do not span a plane.
    """
    options: IsomapMethodOptions = body.options
    sheet = sheet_stages(body, "mid", 0.0)
    mesh = sheet.mesh
    with body.stage("isomap"):
        mid = TriMesh(mesh.layers.P, mesh.layers.F)
        uv, count = landmark_isomap(mid.V, options)
        uv = _onto(uv, mid, mesh.layers.flat)
        placed = _placed(body.points, mid, uv)
        rule = NeighbourRule(np.concatenate([mid.V, body.points]), placed, sheet)
        folded = {name: pair[0] for name, pair in sheet.mesh.surfaces.items()}
        return by_rule(body, sheet, rule, folded, {"reference": len(mid.V), "landmarks": count})


def landmark_isomap(P: Floats, options: IsomapMethodOptions) -> tuple[Floats, int]:
    """Return points of a surface (n, 3) laid flat (n, 2), and the number of landmarks.

    Raises
    ------
    FlatteningError
        The graph of neighbours is not connected, or its distances do not span a plane.
    """
    graph = _graph(P, options.neighbours)
    parts = int(connected_components(graph, directed=False)[0])
    if parts > 1:
        raise FlatteningError(
            f"isomap: the graph of neighbours falls into {parts} parts; raise neighbours above "
            f"{options.neighbours}"
        )
    marks = _farthest(P, min(options.landmarks, len(P)))
    far = np.asarray(dijkstra(graph, directed=False, indices=marks))
    return scaled(far, marks, "isomap"), len(marks)


def _graph(P: Floats, k: int) -> sp.csr_array:
    """Return the lengths of the edges between points and their k nearest, ties included."""
    count = min(k + 1 + _SPARE, len(P))
    distance, near = (np.asarray(a)[:, 1:] for a in cKDTree(P).query(P, k=count))
    keep = distance <= distance[:, min(k, count - 1) - 1, None] * (1 + _TIE)
    row = np.broadcast_to(np.arange(len(P))[:, None], near.shape)[keep]
    lengths = np.maximum(distance[keep], _TINY)
    half = sp.coo_array((lengths, (row, near[keep])), shape=(len(P), len(P))).tocsr()
    return sp.csr_array(half.maximum(half.T))


def _farthest(P: Floats, count: int) -> Ints:
    """Return points each farthest from those before it, the first one from the middle."""
    if count == len(P):
        return np.arange(len(P))
    out = np.empty(count, dtype=np.int64)
    away = np.linalg.norm(P - P.mean(axis=0), axis=1)
    out[0] = _first_largest(away)
    away = np.full(len(P), np.inf)
    for k in range(1, count):
        np.minimum(away, np.linalg.norm(P - P[out[k - 1]], axis=1), out=away)
        out[k] = _first_largest(away)
    return out


def _first_largest(values: Floats) -> int:
    """Return the first index of the largest value, values within a tie being equal."""
    return int(np.argmax(values >= values.max() * (1 - _TIE)))


def _onto(uv: Floats, mid: TriMesh, flat: Floats) -> Floats:
    """Return the scaled positions mirrored back if they are mirrored, and turned onto flat."""
    a, b, c = (uv[mid.F[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    if area.sum() < 0:
        uv = uv * np.array([1.0, -1.0])
    return register(uv, flat, np.ones(len(uv)))


def _placed(P: Floats, mid: TriMesh, uv: Floats) -> Floats:
    """Return the flat places of the mid surface's points and of blocks, (m + n, 3)."""
    known = np.column_stack([uv, np.zeros(len(uv))])
    flat = _first_guess(P, mid, known)
    part = _rounds(P)
    for number in range(_ROUNDS):
        before = np.flatnonzero(part < number)
        good = np.ones(len(before), dtype=bool)
        if len(before) > _NEAR:
            good = _sound(P[before], flat[before])
        again = np.sort(np.concatenate([np.flatnonzero(part == number), before[~good]]))
        held = before[good]
        tree = _Known(np.concatenate([mid.V, P[held]]), np.concatenate([known, flat[held]]))
        flat[again] = tree.place(P[again], flat[again])
    return np.concatenate([known, flat])


def _rounds(P: Floats) -> Ints:
    """Return the round in which each point is placed, (n,): a function of the place only."""
    cell = np.floor(P * 8 + 0.318).astype(np.int64)
    mixed = np.bitwise_xor.reduce(cell * _HASH, axis=1)
    return np.asarray((mixed ^ (mixed >> 13)) % _ROUNDS, dtype=np.int64)


def _first_guess(P: Floats, mid: TriMesh, known: Floats) -> Floats:
    """Return blocks over the nearest point of the surface, at their distance from it."""
    distance, near = cKDTree(mid.V).query(P)
    near = np.asarray(near, dtype=np.int64)
    above = np.einsum("ij,ij->i", P - mid.V[near], vertex_normals(mid.V, mid.F)[near])
    out = known[near].copy()
    out[:, 2] = np.where(above < 0, -distance, distance)
    return out


def _sound(P: Floats, flat: Floats) -> Bools:
    """Return which points keep their distances to their neighbours to within 2.5 blocks."""
    near = np.asarray(cKDTree(P).query(P, k=_NEAR)[1], dtype=np.int64)
    out = np.ones(len(P), dtype=bool)
    for start in range(0, len(P), _CHUNK):
        rows = slice(start, start + _CHUNK)
        before, after = (np.linalg.norm(Q[near[rows]] - Q[rows, None], axis=2) for Q in (P, flat))
        off = np.abs(after - before) > _LARGEST
        out[rows] &= ~off.any(axis=1)
        out[near[rows][off]] = False
    return out


class _Known:
    """Placed points, from which others are placed by their distances.

    Parameters
    ----------
    P, flat : (n, 3) float
        The points in both spaces; the 50 nearest to a point are used, ties included.
    """

    def __init__(self, P: Floats, flat: Floats) -> None:
        self._flat, self._near = flat, min(_NEAR, len(P))
        self._count = min(_NEAR + _SPARE, len(P))
        self._tree = cKDTree(P)

    def nearest(self, Q: Floats) -> tuple[Floats, Floats]:
        """Return distance (k,) and flat place (k, 3) of the nearest placed point."""
        distance, near = self._tree.query(Q)
        return np.asarray(distance), self._flat[near]

    def place(self, Q: Floats, guess: Floats) -> Floats:
        """Return points (k, 3) moved from a guess to the places that best fit their distances."""
        out = np.empty_like(guess)
        for start in range(0, len(Q), _CHUNK):
            rows = slice(start, start + _CHUNK)
            distance, near = (np.asarray(a) for a in self._tree.query(Q[rows], k=self._count))
            last = distance[:, self._near - 1, None]
            weight = (distance <= last * (1 + _TIE)).astype(np.float64)
            out[rows] = _trilaterated(guess[rows], self._flat[near], distance, weight)
        return out


def _trilaterated(x: Floats, at: Floats, distance: Floats, weight: Floats) -> Floats:
    """Return points (k, 3) of the least sum of ``weight (|x - at| - distance)^2``.

    ``at`` is (k, m, 3), distance and weight (k, m).  Levenberg and Marquardt, all points at once.
    """
    x = x.copy()
    live, damping = np.arange(len(x)), np.full(len(x), 1e-3)
    cost = _misfit(x, at, distance, weight)
    for _ in range(_STEPS):
        here, w = x[live], weight[live]
        offset = here[:, None] - at[live]
        length = np.maximum(np.linalg.norm(offset, axis=2), _TINY)
        J = offset / length[..., None]
        gradient = np.einsum("km,kmi->ki", w * (length - distance[live]), J)
        H = np.einsum("km,kmi,kmj->kij", w, J, J)
        H = H + (damping * w.sum(axis=1))[:, None, None] * np.eye(3)
        step = np.linalg.solve(H, -gradient[..., None])[..., 0]
        after = _misfit(here + step, at[live], distance[live], w)
        better = after < cost[live]
        x[live[better]] += step[better]
        cost[live[better]] = after[better]
        damping = np.clip(np.where(better, damping / 5, damping * 5), 1e-9, 1e6)
        moving = np.abs(step).max(axis=1) > _STILL
        live, damping = live[moving], damping[moving]
        if not len(live):
            break
    return x


def _misfit(x: Floats, at: Floats, distance: Floats, weight: Floats) -> Floats:
    out: Floats = (weight * (np.linalg.norm(x[:, None] - at, axis=2) - distance) ** 2).sum(axis=1)
    return out


@dataclass(frozen=True, eq=False)
class NeighbourRule:
    """A map known at placed points; others are placed by their distances to the nearest of them.

    Attributes
    ----------
    known, placed : (n, 3) float
        The points in both spaces.
    sheet : SheetResult
        Source of top and bottom, for the stratigraphic coordinate.
    """

    known: Floats
    placed: Floats
    sheet: SheetResult = field(repr=False)

    way_back = False

    @cached_property
    def _tree(self) -> _Known:
        return _Known(self.known, self.placed)

    def to_flat(self, points: Floats) -> Placed:
        """Place folded points: known ones at their stored place, others by distances."""
        away, guess = self._tree.nearest(points)
        out, rest = guess.copy(), away > _OWN
        out[rest] = self._tree.place(points[rest], guess[rest])
        return Placed(out, self._share(out), np.ones(len(out), dtype=bool))

    def _share(self, flat: Floats) -> Floats:
        """Return the stratigraphic coordinate of flat points, from the nearest vertex."""
        layers, surfaces = self.sheet.mesh.layers, self.sheet.mesh.surfaces
        near = np.asarray(cKDTree(self.placed[: len(layers.P), :2]).query(flat[:, :2])[1])
        low, high = (surfaces[name][1].V[near, 2] for name in ("bottom", "top"))
        return np.asarray((flat[:, 2] - low) / (high - low))

    def to_folded(self, points: Floats) -> Floats:
        """Raise InputError: the map has no inverse."""
        raise InputError("method isomap has no way back: use --method sheet")
