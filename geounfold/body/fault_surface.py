"""Fault surfaces: on which side of them points lie, and which part of a body is a fault wall."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from geounfold.backends.igl import SurfaceIndex, face_components, oriented_alike
from geounfold.geometry.mesh import Bools, Floats, Ints

_ON_EDGE = 1e-3  # of an edge's length: nearer to the border than that is on it


@dataclass(frozen=True, eq=False)
class Sides:
    """Points seen from a fault surface.

    Attributes
    ----------
    signed : (n,) float
        Distance off the plane of the nearest triangle; positive on the hanging wall's side.
    distance : (n,) float
        Distance from the surface.
    past : (n,) bool
        Whether the nearest place is on the surface's border, so that the point may lie past it.
    face : (n,) int
        Nearest triangle.
    """

    signed: Floats
    distance: Floats
    past: Bools
    face: Ints

    @property
    def beyond(self) -> Floats:
        """How far past the border each point lies, (n,)."""
        out: Floats = np.sqrt(np.maximum(self.distance**2 - self.signed**2, 0.0))
        return out


@dataclass(frozen=True, eq=False)
class FaultSurface:
    """A triangulated fault surface; its normals point into the hanging wall.

    Attributes
    ----------
    name : str
        Name of the fault.
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles, counter-clockwise seen from the hanging wall.
    """

    name: str
    V: Floats
    F: Ints

    @classmethod
    def facing(cls, name: str, V: Floats, F: Ints, up: Floats) -> FaultSurface:
        """Return a surface whose triangles look the same way, on average up.

        Parameters
        ----------
        name, V, F
            As the attributes; triangles may be wound either way.
        up : (3,) float
            Direction towards which the hanging wall lies. If the surface contains it, the side is
            arbitrary.
        """
        V = np.ascontiguousarray(V, dtype=np.float64)
        F = oriented_alike(np.ascontiguousarray(F, dtype=np.int64))
        normal = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
        axis = np.linalg.eigh(normal.T @ normal)[1][:, 2]
        part = face_components(F)
        total = np.stack([np.bincount(part, normal[:, k]) for k in range(3)], axis=1)
        turned = np.where(total @ axis < 0, -1.0, 1.0)
        mean = turned @ total
        if mean @ up < 0:
            turned = -turned
        F = np.where((turned[part] < 0)[:, None], F[:, ::-1], F)
        return cls(name, V, np.ascontiguousarray(F))

    def moved(self, V: Floats) -> FaultSurface:
        """Return the same triangles over other vertices (n, 3)."""
        return FaultSurface(self.name, np.ascontiguousarray(V, dtype=np.float64), self.F)

    @cached_property
    def normal(self) -> Floats:
        """Unit normals of the triangles, (m, 3)."""
        V, F = self.V, self.F
        n = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
        out: Floats = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
        return out

    @cached_property
    def _index(self) -> SurfaceIndex:
        return SurfaceIndex(self.V, self.F)

    @cached_property
    def _open(self) -> Bools:
        """Whether edges 01, 12 and 20 of each triangle are the border's, (m, 3)."""
        F = self.F
        edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        _, row, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
        out: Bools = (count[row.ravel()] == 1).reshape(3, -1).T
        return out

    def sides(self, points: Floats) -> Sides:
        """Return points (n, 3) seen from the surface."""
        if not len(points):
            none = np.zeros(0)
            return Sides(none, none, np.zeros(0, bool), np.zeros(0, np.int64))
        distance, face, foot = self._index.closest(points)
        signed = np.einsum("ij,ij->i", points - foot, self.normal[face])
        return Sides(signed, distance, self._on_border(face, foot), face)

    def _on_border(self, face: Ints, foot: Floats) -> Bools:
        corners = self.V[self.F[face]]
        out = np.zeros(len(face), dtype=bool)
        for k in range(3):
            edge = corners[:, (k + 1) % 3] - corners[:, k]
            length = np.maximum(np.linalg.norm(edge, axis=1), 1e-300)
            away = np.linalg.norm(np.cross(foot - corners[:, k], edge), axis=1) / length
            out |= self._open[face, k] & (away < _ON_EDGE * length)
        return out


_LOOKS = 0.7
"""Cosine (45 degrees) from which a face of the hull looks at a wall."""

_FACE = 0.9
_VERTEX = 1.2
_TOUCHES = 0.35
"""Distances in blocks from a wall: of a face of the hull that looks at it, of a vertex that looks
at it, and of a vertex whatever it looks at. Measured on 18 designed bodies."""

LIMIT_TOUCHES = 1.0
"""The last of these at a limit, where the hull is rounded.

Measured: a body with oblique rims that are known comes out at 0.16 blocks in place of 0.76. At
faults it moves the rms by 0.014 blocks at most on 12 bodies, but a body of few blocks is joined
wrongly.
"""

_SITES = (8.0, 0.3)
"""Blocks from a wall up to which empty sites are withheld, and blocks on the block's own side."""

_MOST = 0.8
"""Share of the hull that walls may withhold; a block with more is fitted as if it had none."""


@dataclass(frozen=True, eq=False)
class FaultWalls:
    """The fault surfaces that bound one fault block, or the limits that cut a model off.

    A slanted wall looks like a pinch-out in the blocks' coordinates. So what lies at a wall is
    withheld from the fit of the layers: faces of the hull there are rim, its vertices are no
    samples of top or bottom, and empty lattice sites past the wall do not bound the body.

    Attributes
    ----------
    surfaces : tuple of FaultSurface
        Working units.
    signs : tuple of float
        Side of each on which the block lies, +1 or -1.
    touches : tuple of float
        Distance from each within which a vertex of the hull is at it, in blocks.
    """

    surfaces: tuple[FaultSurface, ...]
    signs: tuple[float, ...]
    touches: tuple[float, ...]

    @classmethod
    def around(
        cls, points: Floats, surfaces: tuple[FaultSurface, ...], touches: float = _TOUCHES
    ) -> FaultWalls | None:
        """Return the walls of a block among surfaces; None if no surface bounds it.

        Parameters
        ----------
        points : (n, 3) float
            The block's own blocks, working units.
        surfaces : tuple of FaultSurface
            All surfaces, working units.
        touches : float
            Distance within which a vertex of the hull is at a wall, in blocks.
        """
        kept, signs = [], []
        for surface in surfaces:
            seen = surface.sides(points)
            near = (seen.distance < 2.5) & ~seen.past
            sign = float(np.sign(np.sign(seen.signed[near]).sum())) if near.sum() > 5 else 0.0
            if sign:
                kept.append(surface)
                signs.append(sign)
        return cls(tuple(kept), tuple(signs), (touches,) * len(kept)) if kept else None

    def scaled(self, factor: float) -> FaultWalls:
        """Return the walls in another unit: lengths times a factor."""
        if factor == 1:
            return self
        return replace(self, surfaces=tuple(s.moved(s.V * factor) for s in self.surfaces))

    def and_at(self, other: FaultWalls) -> FaultWalls:
        """Return these walls and others."""
        return FaultWalls(
            self.surfaces + other.surfaces, self.signs + other.signs, self.touches + other.touches
        )

    def named(self, name: str) -> FaultWalls | None:
        """Return the walls of one name alone; None if there are none."""
        own = [k for k, surface in enumerate(self.surfaces) if surface.name == name]
        if not own:
            return None
        return FaultWalls(
            tuple(self.surfaces[k] for k in own),
            tuple(self.signs[k] for k in own),
            tuple(self.touches[k] for k in own),
        )

    def at_faces(self, centres: Floats, normals: Floats, within: float = _FACE) -> Bools:
        """Return which faces of a hull, with centres and normals (n, 3), are at a wall."""
        return self._looking(centres, normals, within)

    def at_vertices(self, points: Floats, normals: Floats) -> Bools:
        """Return which vertices of a hull, with normals (n, 3), are at a wall."""
        out = self._looking(points, normals, _VERTEX)
        for surface, touches in zip(self.surfaces, self.touches, strict=True):
            out |= surface.sides(points).distance < touches
        return np.zeros(len(points), dtype=bool) if out.mean() > _MOST else out

    def _looking(self, points: Floats, normals: Floats, within: float) -> Bools:
        out = np.zeros(len(points), dtype=bool)
        for surface, sign in zip(self.surfaces, self.signs, strict=True):
            seen = surface.sides(points)
            looks = -sign * np.einsum("ij,ij->i", surface.normal[seen.face], normals)
            out |= (seen.distance < within) & (looks > _LOOKS)
        return out

    def past(self, points: Floats) -> Bools:
        """Return which places (n, 3) lie past a wall, seen from the block, (n,)."""
        out = np.zeros(len(points), dtype=bool)
        for surface, sign in zip(self.surfaces, self.signs, strict=True):
            seen = surface.sides(points)
            out |= (seen.distance < _SITES[0]) & (seen.signed * sign < _SITES[1])
        return out
