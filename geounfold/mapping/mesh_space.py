"""One space of a control mesh: point location in its tetrahedra and outside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geounfold.backends.igl import SurfaceIndex, TetIndex, barycentric_in_tets
from geounfold.geometry.measures import boundary_faces
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers, TetMesh
from geounfold.geometry.point_location import TetWalk

TOUCHING = 1e-9
"""Distance, as a share of the mesh's size, up to which a point counts as inside: rounding."""


@dataclass(frozen=True, eq=False)
class Place:
    """Location of points in one space, as in Carried, and barycentric coordinates (n, 4)."""

    element: Ints
    inside: Bools
    distance: Floats
    weights: Floats


class MeshImage:
    """Images of points in each tetrahedron: affine in barycentric coordinates."""

    def __init__(self, mesh: TetMesh, stratigraphic: Floats) -> None:
        values = [*mesh.V.T, stratigraphic]
        first = [np.ascontiguousarray(v[mesh.T[:, 0]]) for v in values]
        self._columns = [
            (a, *(v[mesh.T[:, k]] - a for k in (1, 2, 3)))
            for v, a in zip(values, first, strict=True)
        ]

    def __call__(self, element: Ints | Numbers, w1: Floats, w2: Floats, w3: Floats) -> list[Floats]:
        """Return x, y, z and the stratigraphic coordinate, (k,) each."""
        out = []
        for a, b, c, d in self._columns:
            value = b.take(element)
            value *= w1
            for column, w in ((c, w2), (d, w3)):
                part = column.take(element)
                part *= w
                value += part
            value += a.take(element)
            out.append(value)
        return out


class _Border:
    """The border of some tetrahedra."""

    def __init__(self, V: Floats, T: Ints) -> None:
        F, self.owner, _ = boundary_faces(T)
        self._index = SurfaceIndex(V, F)

    def closest(self, points: Floats) -> tuple[Floats, Ints]:
        """Return distance (k,) and the tetrahedron at the closest place (k,)."""
        distance, face, _ = self._index.closest(points)
        return distance, self.owner[face]


class MeshSpace:
    """One space of a control mesh and its shell, indexed for point location.

    Parameters
    ----------
    mesh : TetMesh
        The control mesh.
    shell : TetMesh or None
        Tetrahedra around it.
    reach : float
        Largest distance at which the nearest element carries points, if there is no shell.
    known : sequence of TetIndex
        Trees already built, used if one is over this mesh.
    """

    def __init__(
        self, mesh: TetMesh, shell: TetMesh | None, reach: float, known: Sequence[TetIndex]
    ) -> None:
        self._mesh, self._shell, self._reach, self._known = mesh, shell, reach, known
        self._V = mesh.V if shell is None else shell.V
        self._T = mesh.T if shell is None else np.concatenate([mesh.T, shell.T])
        self._touching = TOUCHING * float(np.ptp(mesh.V, axis=0).max())

    def may_hold(self, points: Floats) -> Bools:
        """Return which points (n, 3) are near enough to lie in the space, (n,)."""
        margin = self._reach if self._shell is None else self._touching
        low, high = self._V.min(axis=0) - margin, self._V.max(axis=0) + margin
        out: Bools = np.logical_and(points >= low, points <= high).all(axis=1)
        return out

    @cached_property
    def walk(self) -> TetWalk:
        """The index that locates nearly all points of the control mesh."""
        return TetWalk(self._mesh.V, self._mesh.T)

    @cached_property
    def _index(self) -> TetIndex:
        """The reference index, which locates the other points."""
        V, T = self._mesh.V, self._mesh.T
        same = [t for t in self._known if np.array_equal(t.T, T) and np.array_equal(t.V, V)]
        return same[0] if same else TetIndex(V, T)

    @cached_property
    def _border(self) -> _Border:
        return _Border(self._mesh.V, self._mesh.T)

    @cached_property
    def _rind(self) -> _Border:
        """Return the outer border, the shell's included."""
        return _Border(self._V, self._T)

    @cached_property
    def _shell_index(self) -> TetIndex | None:
        return None if self._shell is None else TetIndex(self._shell.V, self._shell.T)

    def walked(self, x: Floats, y: Floats, z: Floats) -> tuple[Numbers | Ints, Floats]:
        """Return the tetrahedra to which walks lead, as TetWalk.locate returns them."""
        return self.walk.locate(x, y, z)

    def locate(self, points: Floats) -> Place:
        """Return the location of points (n, 3) by the reference index, libigl's."""
        element = self._index.locate(points)
        inside = element >= 0
        distance = np.zeros(len(points))
        missed = np.flatnonzero(~inside)
        if len(missed):
            element = element.copy()
            away, owner = self._border.closest(points[missed])
            near = away <= self._touching
            inside[missed] = near
            distance[missed] = np.where(near, 0.0, away)
            element[missed[near]] = owner[near]
            around = missed[~near]
            element[around] = self._around(points[around], away[~near], owner[~near])
        corners = self._T[np.maximum(element, 0)]
        return Place(element, inside, distance, barycentric_in_tets(points, self._V, corners))

    def _around(self, points: Floats, away: Floats, owner: Ints) -> Ints:
        """Return the elements that carry points outside the control mesh, -1 for none."""
        if self._shell_index is None:
            return np.where(away <= self._reach, owner, -1)
        found = self._shell_index.locate(points)
        element = np.where(found >= 0, found + len(self._mesh.T), -1)
        lost = np.flatnonzero(found < 0)
        if len(lost):
            gap, near = self._rind.closest(points[lost])
            element[lost] = np.where(gap <= self._touching, near, -1)
        return element
