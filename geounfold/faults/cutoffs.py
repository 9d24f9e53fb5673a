"""Cut-offs: the lines in which the layers of a fault block end at a fault.

The fault's own surface is carried through the block's map and contoured at equal stratigraphic
heights. It is smooth, so its contours have none of the blocks' staircase.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.fault_surface import FaultSurface
from geounfold.faults.block_map import BlockMap
from geounfold.geometry.mesh import Floats, Ints

LEVELS = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Stratigraphic heights of the cut-offs; nearer to top and bottom the mesh ends."""

MIDDLE = 2  # index of the middle level

_FINE = 0.9  # blocks: longest edge of the carried surface, at 60 % of its edges
_REACHED = 1.6  # blocks from a fault block within which a fault is its wall
_SMOOTH = 3.0  # blocks: radius over which a cut-off is evened out
_FEWEST = 6  # samples of the middle level that a cut-off must have
_SHORTEST = 3.0  # blocks of length, per level, that a cut-off must have


@dataclass(frozen=True, eq=False)
class Cutoff:
    """Samples of the cut-offs of one fault block at one fault.

    Attributes
    ----------
    flat : (n, 3) float
        Places in the block's own flat space, working units.
    folded : (n, 3) float
        The same on the fault.
    tangent : (n, 2) float
        Unit tangent of the cut-off in the block's own flat space.
    length : (n,) float
        Length of cut-off that the sample stands on.
    level : (n,) int
        Index in LEVELS.
    side : float
        Side of the fault on which the block lies: +1 the hanging wall's.
    """

    flat: Floats
    folded: Floats
    tangent: Floats
    length: Floats
    level: Ints
    side: float

    def turned(self) -> Cutoff:
        """Return the cut-offs of the block turned over."""
        return Cutoff(
            self.flat * [1, -1, -1],
            self.folded,
            self.tangent * [1, -1],
            self.length,
            len(LEVELS) - 1 - self.level,
            self.side,
        )

    def rows(self, level: int) -> Ints:
        """Return the samples of a level."""
        return np.flatnonzero(self.level == level)


def refined(surface: FaultSurface, edge: float = _FINE, most: int = 6) -> FaultSurface:
    """Return a surface whose triangles were quartered until their edges are short enough."""
    V, F = surface.V, surface.F
    for _ in range(most):
        length = np.linalg.norm(V[F] - V[np.roll(F, -1, axis=1)], axis=2)
        if np.quantile(length, 0.6) <= edge:
            break
        edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        used, row = np.unique(edges, axis=0, return_inverse=True)
        m = len(V) + row.ravel().reshape(3, -1).T
        V = np.concatenate([V, V[used].mean(axis=1)])
        F = np.concatenate(
            [
                np.stack([F[:, 0], m[:, 0], m[:, 2]], axis=1),
                np.stack([F[:, 1], m[:, 1], m[:, 0]], axis=1),
                np.stack([F[:, 2], m[:, 2], m[:, 1]], axis=1),
                m,
            ]
        )
    return FaultSurface(surface.name, V, F)


def cutoff(block: BlockMap, fine: FaultSurface) -> Cutoff | None:
    """Return the cut-offs of a fault block at a fault; None if it hardly reaches the fault.

    Parameters
    ----------
    block : BlockMap
        The block with its own map.
    fine : FaultSurface
        The fault, refined, working units.
    """
    near = block.tree.query(fine.V, distance_upper_bound=_REACHED)[0] < _REACHED
    if np.count_nonzero(near) < 12:
        return None
    flat, level = np.full((len(fine.V), 3), np.nan), np.full(len(fine.V), np.nan)
    carried = block.carry(fine.V[near])
    flat[near], level[near] = carried.flat, carried.level
    F = fine.F[np.isfinite(level[fine.F]).all(axis=1)]
    found = [_contour(fine.V, flat, level, F, k) for k in range(len(LEVELS))]
    Y, X, T, length, index = (np.concatenate(column) for column in zip(*found, strict=True))
    if not len(length) or length.sum() < _SHORTEST * len(LEVELS):
        return None
    if np.count_nonzero(index == MIDDLE) < _FEWEST:
        return None  # the fault ends inside the layer, or runs along it
    Y, T = smoothed(Y, T, length, index)
    away = cKDTree(fine.V).query(block.points, distance_upper_bound=3.0)[0]
    seen = fine.sides(block.points[away < 3.0])  # most blocks are far, and slow to look up
    side = float(np.sign(np.sign(seen.signed[seen.distance < 2]).sum()))
    return Cutoff(Y, X, T, length, index, side) if side else None


def _contour(
    V: Floats, flat: Floats, level: Floats, F: Ints, number: int
) -> tuple[Floats, Floats, Floats, Floats, Ints]:
    """Return middles, flat and folded, tangents and lengths of the contour of a level."""
    over = level[F] - LEVELS[number]
    above = (over > 0).sum(axis=1)
    f = np.flatnonzero((above == 1) | (above == 2))
    odd = np.where(above[f] == 1, (over[f] > 0).argmax(axis=1), (over[f] <= 0).argmax(axis=1))
    ends = []
    for j in (1, 2):
        a, b = F[f, odd], F[f, (odd + j) % 3]
        t = ((LEVELS[number] - level[a]) / (level[b] - level[a]))[:, None]
        ends.append((flat[a] + t * (flat[b] - flat[a]), V[a] + t * (V[b] - V[a])))
    along = ends[1][0] - ends[0][0]
    length = np.linalg.norm(along[:, :2], axis=1)
    ok = length > 1e-6
    tangent = along[ok, :2] / length[ok, None]
    middle = [(ends[0][k] + ends[1][k])[ok] / 2 for k in (0, 1)]
    return middle[0], middle[1], tangent, length[ok], np.full(int(ok.sum()), number)


def smoothed(
    flat: Floats, tangent: Floats, length: Floats, level: Ints, radius: float = _SMOOTH
) -> tuple[Floats, Floats]:
    """Return samples moved onto the local line through their neighbours, and its direction.

    The wiggles of the map along a wall would otherwise count as marks of the slip along it.
    """
    out, direction = flat.copy(), tangent.copy()
    for k in np.unique(level):
        rows = np.flatnonzero(level == k)
        P = flat[rows, :2]
        pairs = cKDTree(P).query_pairs(radius, output_type="ndarray")
        itself = np.arange(len(rows))
        i = np.concatenate([pairs[:, 0], pairs[:, 1], itself])
        j = np.concatenate([pairs[:, 1], pairs[:, 0], itself])
        apart = P[j] - P[i]
        weight: Floats = length[rows][j] * (1 - (apart**2).sum(axis=1) / radius**2) ** 2
        total: Floats = np.maximum(np.bincount(i, weight, len(rows)), 1e-300)
        mean = np.stack([np.bincount(i, weight * apart[:, c], len(rows)) for c in (0, 1)], axis=1)
        mean = np.divide(mean, total[:, None])
        square = np.empty((len(rows), 2, 2))
        for c in (0, 1):
            for d in (0, 1):
                moment = np.bincount(i, weight * apart[:, c] * apart[:, d], len(rows))
                square[:, c, d] = np.divide(moment, total) - mean[:, c] * mean[:, d]
        axis = np.linalg.eigh(square)[1][:, :, 1]
        moved = P + mean - axis * (mean * axis).sum(axis=1, keepdims=True)
        enough = np.bincount(i, minlength=len(rows)) >= 4
        out[rows[enough], :2], direction[rows[enough]] = moved[enough], axis[enough]
    return out, direction


def strike_of(surface: FaultSurface, points: Floats, up: Floats) -> Floats:
    """Return the mean level direction (3,) of a fault at places (n, 3) on it.

    A level fault has no strike; the places' longest direction takes its place.
    """
    n = surface.normal[surface.sides(points).face]
    level = np.cross(up, n)
    size, axes = np.linalg.eigh(level.T @ level)
    if size[2] < 0.01 * len(points):
        out: Floats = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
        return out
    return np.asarray(axes[:, 2])
