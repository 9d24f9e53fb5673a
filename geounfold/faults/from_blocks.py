"""Fault surfaces fitted between fault blocks of which only the blocks are known.

Two fault blocks end against one smooth surface, one on each side. Blocks that slipped far need not
touch. So the surface is sought by what ends at it: exposed faces of both blocks that look at each
other across it, with no block of either beyond it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.block_cells import OccupiedCells
from geounfold.body.fault_surface import FaultSurface
from geounfold.body.working_frame import Frame
from geounfold.faults.block_map import BlockMap
from geounfold.geometry.mesh import Bools, Floats, Ints

_SEED = 0  # of the drawn trials: the same blocks give the same surfaces
_TRIALS, _REFINED = 300, 8  # planes tried between two blocks, and the best of them that are fitted
_FEWEST = 15  # faces of each block at a surface between them
_LOOKS = 0.75  # cosine with the surface's normal from which a face may end at it
_STEPS = ((1.5, 1), (1.5, 1), (1.2, 1), (1.2, 2), (1.0, 2), (1.0, 3), (0.9, 3), (0.9, 3))
"""Blocks from the surface within which faces are fitted, and the degree, round by round."""

_HORIZONS = (0.8, 0.93)
"""Cosines with the layers' normal above which a face is top or bottom: the strict one first."""

_MESH = 0.8  # blocks: edge of the surface's mesh
_REACH = 4.0  # blocks past the faces that made it to which the surface goes


@dataclass(frozen=True, eq=False)
class Exposed:
    """Exposed faces of the blocks of a fault block.

    Attributes
    ----------
    centres, normals : (n, 3) float
        Working units; normals are means over the neighbourhood, outward.
    """

    centres: Floats
    normals: Floats

    def part(self, rows: Bools | Ints) -> Exposed:
        """Return some of the faces."""
        return Exposed(self.centres[rows], self.normals[rows])


def exposed_faces(points: Floats, frame: Frame) -> Exposed:
    """Return the exposed faces of blocks (n, 3) on the lattice, working units.

    Scattered points have none; the outermost points of their hull take their place.
    """
    cells = frame.cells(points)
    if cells is None or frame.steps is None:
        return _outermost(points)
    occupied, row = OccupiedCells.numbered(cells)
    centres, normals = [], []
    for axis in range(3):
        for sign in (-1, 1):
            beside = occupied.rows(occupied.keys[row] + sign * int(occupied.stride[axis]))
            free = beside < 0
            step = np.zeros(3)
            step[axis] = sign
            centres.append(points[free] + step * frame.steps[axis] / 2)
            normals.append(np.repeat(step[None], int(free.sum()), axis=0))
    C, N = np.concatenate(centres), np.concatenate(normals)
    return Exposed(C, _evened(C, N, 2.2))


def _outermost(points: Floats) -> Exposed:
    """Return points with few others on one side, and the direction to that side."""
    tree = cKDTree(points)
    near = tree.query(points, k=min(24, len(points)))[1]
    away = points - points[near].mean(axis=1)
    size = np.linalg.norm(away, axis=1)
    rows = size > 0.35
    return Exposed(points[rows], _evened(points[rows], away[rows] / size[rows, None], 3.0))


def _evened(C: Floats, N: Floats, radius: float, rounds: int = 2) -> Floats:
    """Return unit normals averaged over neighbours within a radius, some rounds."""
    pairs = cKDTree(C).query_pairs(radius, output_type="ndarray")
    i = np.concatenate([pairs[:, 0], pairs[:, 1], np.arange(len(C))])
    j = np.concatenate([pairs[:, 1], pairs[:, 0], np.arange(len(C))])
    for _ in range(rounds):
        N = np.stack([np.bincount(i, N[j, k], len(C)) for k in range(3)], axis=1)
        N = N / np.maximum(np.bincount(i, minlength=len(C)), 1)[:, None]
    out: Floats = N / np.maximum(np.linalg.norm(N, axis=1, keepdims=True), 1e-9)
    return out


class Height:
    """A surface as a polynomial height over a plane.

    Parameters
    ----------
    origin, normal : (3,) float
        Of the plane.
    """

    def __init__(self, origin: Floats, normal: Floats) -> None:
        self.origin, self.normal = origin, normal
        other = np.eye(3)[np.abs(normal).argmin()]
        self.u = np.cross(normal, other) / np.linalg.norm(np.cross(normal, other))
        self.v = np.cross(normal, self.u)
        self._degree, self._coefficients, self._scale = 0, np.zeros(1), 1.0

    def local(self, points: Floats) -> tuple[Floats, Floats]:
        """Return places in the plane, (n, 2), and distances off it, (n,)."""
        r = points - self.origin
        return np.stack([r @ self.u, r @ self.v], axis=1), r @ self.normal

    def at(self, places: Floats) -> Floats:
        """Return the height over places in the plane (n, 2)."""
        q = np.clip(places / self._scale, -1.6, 1.6)
        out: Floats = _monomials(q, self._degree) @ self._coefficients
        return out

    def off(self, points: Floats) -> Floats:
        """Return the distance of points (n, 3) off the surface, along the plane's normal."""
        places, off = self.local(points)
        out: Floats = off - self.at(places)
        return out

    def fit(self, points: Floats, weight: Floats, degree: int) -> None:
        """Fit the height to points (n, 3) by weighted least squares with a weak ridge."""
        places, off = self.local(points)
        self._scale = float(np.abs(places).max())
        B = _monomials(places / self._scale, degree)
        ridge = 3e-4 * weight.sum() * np.diag((np.arange(B.shape[1]) > 0).astype(float))
        self._degree = degree
        self._coefficients = np.linalg.solve(
            (B * weight[:, None]).T @ B + ridge, B.T @ (weight * off)
        )


def _monomials(q: Floats, degree: int) -> Floats:
    a, b = q.T
    return np.stack([a**i * b**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)


@dataclass(frozen=True, eq=False)
class _Found:
    """A surface between two fault blocks: their faces on it, and the share it parts."""

    surface: Height
    first: Bools
    second: Bools
    parted: float

    @property
    def value(self) -> int:
        """Number of faces on it, of the block that has fewer."""
        return int(min(self.first.sum(), self.second.sum()))


def _between(
    A: Exposed, B: Exposed, blocks: tuple[Floats, Floats], rng: np.random.Generator
) -> _Found | None:
    """Return the surface between two fault blocks by their faces, or None."""
    if min(len(A.centres), len(B.centres)) < 2 * _FEWEST:
        return None
    some = tuple(P[:: max(1, len(P) // 1500)] for P in blocks)
    best: _Found | None = None
    value = 0.0
    for origin, normal in _planes(A, B, some, rng):
        found = _fitted(A, B, some, origin, normal)
        if found is not None and found.value * max(found.parted - 0.8, 0) > value:
            best, value = found, found.value * (found.parted - 0.8)
    return best


def _planes(
    A: Exposed, B: Exposed, some: tuple[Floats, ...], rng: np.random.Generator
) -> list[tuple[Floats, Floats]]:
    """Return the planes through faces of A with the most faces of both on them, parting both."""
    tree = cKDTree(A.centres)
    away = cKDTree(B.centres).query(A.centres)[0]
    near = np.flatnonzero(away < np.median(away) + 3)
    tried: list[tuple[float, int, Floats, Floats]] = []
    for k in rng.choice(near, min(_TRIALS, len(near)), replace=False):
        own = np.array(tree.query_ball_point(A.centres[k], 5.0))
        own = own[A.normals[own] @ A.normals[k] > 0.85]
        if len(own) < 6:
            continue
        origin = A.centres[own].mean(axis=0)
        normal = np.linalg.eigh(np.cov((A.centres[own] - origin).T))[1][:, 0]
        normal = normal * np.sign(normal @ A.normals[k])
        if normal @ A.normals[k] < _LOOKS:
            continue
        a = (np.abs((A.centres - origin) @ normal) < 1.5) & (A.normals @ normal > 0.8)
        b = (np.abs((B.centres - origin) @ normal) < 1.5) & (B.normals @ normal < -0.8)
        apart = min(
            float(((some[0] - origin) @ normal < 1).mean()),
            float(((some[1] - origin) @ normal > -1).mean()),
        )
        score = min(int(a.sum()), int(b.sum())) * max(apart - 0.6, 0) ** 2
        if score > 0 and min(a.sum(), b.sum()) >= _FEWEST:
            tried.append((score, len(tried), origin, normal))
    tried.sort(key=lambda t: (-t[0], t[1]))
    return [(origin, normal) for *_, origin, normal in tried[:_REFINED]]


def _fitted(
    A: Exposed, B: Exposed, some: tuple[Floats, ...], origin: Floats, normal: Floats
) -> _Found | None:
    """Return the surface fitted to the faces of both at a plane, round by round; or None."""
    S = Height(origin, normal)
    a = (np.abs(S.off(A.centres)) < 1.5) & (A.normals @ normal > 0.8)
    b = (np.abs(S.off(B.centres)) < 1.5) & (B.normals @ normal < -0.8)
    for within, degree in _STEPS:
        P = np.concatenate([A.centres[a], B.centres[b]])
        weight = np.repeat([100 / a.sum(), 100 / b.sum()], [a.sum(), b.sum()])
        S.fit(P, weight, min(degree, 2) if len(P) < 60 else degree)
        a = (np.abs(S.off(A.centres)) < within) & (A.normals @ normal > _LOOKS)
        b = (np.abs(S.off(B.centres)) < within) & (B.normals @ normal < -_LOOKS)
        if min(a.sum(), b.sum()) < _FEWEST:
            return None
    parted = min(float((S.off(some[0]) < 0.8).mean()), float((S.off(some[1]) > -0.8).mean()))
    return _Found(S, a, b, parted)


def layer_normals(block: BlockMap, points: Floats) -> Floats:
    """Return the unit normal of the layers at points (n, 3) of a fault block; NaN if unknown."""
    slope = block.carry(points, gradients=True).gradient[:, 2]
    ok = np.flatnonzero(np.isfinite(slope).all(axis=1))
    if len(ok) < 20:
        return np.full(points.shape, np.nan)
    slope = slope[ok] / np.maximum(np.linalg.norm(slope[ok], axis=1, keepdims=True), 1e-12)
    near = cKDTree(points[ok]).query(points, k=20)[1]
    mean = slope[near].mean(axis=1)
    out: Floats = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    return out


def surfaces_between(
    points: Floats, block: Ints, frame: Frame, normals: Floats | None = None
) -> tuple[tuple[FaultSurface, ...], tuple[tuple[int, int], ...]]:
    """Return the fault surfaces between fault blocks, and which two blocks each parts.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    block : (n,) int
        Fault block of each.
    frame : Frame
        The working frame.
    normals : (n, 3) float, optional
        Normal of the layers at each block; NaN where it is not known.
    """
    rng = np.random.default_rng(_SEED)
    up = frame.up_in_work()
    count = int(block.max()) + 1
    rows = [np.flatnonzero(block == k) for k in range(count)]
    faces = [exposed_faces(points[own], frame) for own in rows]
    flat = []
    for own, face in zip(rows, faces, strict=True):
        if normals is None:
            flat.append(np.full(len(face.centres), np.nan))
            continue
        layer = normals[own][cKDTree(points[own]).query(face.centres)[1]]
        flat.append(np.abs(np.einsum("ij,ij->i", layer, face.normals)))
    tree = cKDTree(points)
    found: list[tuple[int, int, int, _Found, Ints, Ints]] = []
    for i in range(count):
        for j in range(i + 1, count):
            if not _may_meet(points[rows[i]], points[rows[j]]):
                continue
            for limit in _HORIZONS:
                a, b = (np.flatnonzero(~(flat[k] > limit)) for k in (i, j))
                A, B = faces[i].part(a), faces[j].part(b)
                got = _between(A, B, (points[rows[i]], points[rows[j]]), rng)
                if got is not None:
                    break
            else:
                continue
            A, B = A.part(got.first), B.part(got.second)
            if got.parted > 0.9 and max(_beyond(tree, block, F, (i, j)) for F in (A, B)) < 0.5:
                found.append((got.value, i, j, got, a[got.first], b[got.second]))
    return _kept(found, faces, up)


def _may_meet(A: Floats, B: Floats) -> bool:
    """Return whether the boxes of two fault blocks come near each other."""
    margin = 0.25 * np.maximum(np.ptp(A, axis=0), np.ptp(B, axis=0)) + 5
    return bool(((A.min(0) - margin < B.max(0)) & (B.min(0) - margin < A.max(0))).all())


def _beyond(tree: cKDTree, block: Ints, faces: Exposed, pair: tuple[int, int]) -> float:
    """Return the share of faces beyond which a third fault block lies."""
    away, at = tree.query(faces.centres + faces.normals)
    return float(((away < 0.9) & ~np.isin(block[at], pair)).mean())


def _kept(
    found: Sequence[tuple[int, int, int, _Found, Ints, Ints]],
    faces: Sequence[Exposed],
    up: Floats,
) -> tuple[tuple[FaultSurface, ...], tuple[tuple[int, int], ...]]:
    """Return the surfaces whose faces no better surface has: a face ends at one fault."""
    claimed = [np.zeros(len(face.centres), dtype=bool) for face in faces]
    surfaces, pairs = [], []
    for _, i, j, got, a, b in sorted(found, key=lambda f: (-f[0], f[1], f[2])):
        if min(claimed[i][a].mean(), claimed[j][b].mean()) > 0.4:
            continue
        claimed[i][a] = claimed[j][b] = True
        P = np.concatenate([faces[i].centres[a], faces[j].centres[b]])
        surfaces.append(_mesh(got.surface, P, f"{i}|{j}", up))
        pairs.append((i, j))
    return tuple(surfaces), tuple(pairs)


def _mesh(S: Height, P: Floats, name: str, up: Floats) -> FaultSurface:
    """Return a surface as triangles, where it lies near the faces P (n, 3) that made it."""
    places, _ = S.local(P)
    low, high = places.min(axis=0) - 3, places.max(axis=0) + 3
    count = np.maximum(np.ceil((high - low) / _MESH).astype(int) + 1, 2)
    a, b = (np.linspace(x, y, n) for x, y, n in zip(low, high, count, strict=True))
    grid = np.stack([c.ravel() for c in np.meshgrid(a, b, indexing="ij")], axis=1)
    V = S.origin + np.outer(grid[:, 0], S.u) + np.outer(grid[:, 1], S.v)
    V = V + np.outer(S.at(grid), S.normal)
    k = np.arange(len(grid)).reshape(count)
    p, q, r, s = (c.ravel() for c in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
    near = np.asarray(cKDTree(P).query(V)[0] < _REACH)
    F = F[near[F].all(axis=1)]
    used, F = np.unique(F, return_inverse=True)
    return FaultSurface.facing(name, V[used], F.reshape(-1, 3), up)
