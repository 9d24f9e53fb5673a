"""The map inside the prisms of a control mesh by Wachspress or mean value coordinates.

Inside a tetrahedron barycentric coordinates are unique and the map is affine.  Its gradient jumps
from one tetrahedron to the next, within a prism too.  Coordinates of the prism's six corners make
the map smooth inside.  On the split border they are linear like those of the tetrahedra, so the map
is continuous on every border, to another prism or to a tetrahedron that belongs to none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from geounfold.backends.igl import barycentric_in_tets, upright
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.geometry.prisms import whole_prisms
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.prism_coordinates._prism import convex
from geounfold.mapping.prism_coordinates.mean_value import mean_value, mean_value_gradients
from geounfold.mapping.prism_coordinates.wachspress import wachspress, wachspress_gradients

COORDINATES = ("tet", "wachspress", "mvc")
"""Kinds of coordinates: of the tetrahedra, or of the prisms from which they were cut."""

TOLERANCE = 1e-12
"""Tolerance of the inverse, as a share of the mesh's size."""

_BORDER = 1e-12  # barycentric coordinate up to which a point lies on the prism's border
_INSIDE = -1e-9  # least barycentric coordinate of a point inside, to rounding
_STEPS = 50  # largest number of steps of Newton's method
_HALVINGS = 12
_DECREASE = 1e-4  # smallest decrease of the residual, as a share of the predicted one
_CHUNK = 1 << 11  # points at a time: 8 MB

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class PrismInterpolant:
    """The prisms of a control mesh, which carry the points in them.

    Attributes
    ----------
    control : ControlMesh
        The tetrahedra, in both spaces.
    name : str
        ``wachspress`` or ``mvc``.
    rows, corners : (p, 3), (p, 6) int
        Tetrahedra and corners of the prisms that are upright in both spaces (``whole_prisms``).
    prism : (m,) int
        The prism of each tetrahedron, -1 if it belongs to none and carries points itself.
    border : (m, 4) bool
        Whether the face opposite to each corner of a tetrahedron is on its prism's border.
    rational : (p,) bool
        Prisms with Wachspress coordinates: those strictly convex when folded.  The others have mean
        value coordinates.
    tolerance : float
        Tolerance of the inverse, a distance in the unfolded space.
    """

    control: ControlMesh
    name: str
    rows: Ints
    corners: Ints
    prism: Ints
    border: Bools
    rational: Bools
    tolerance: float

    @classmethod
    def of(cls, control: ControlMesh, name: str) -> PrismInterpolant:
        """Return the prisms of a control mesh with coordinates by name, not ``tet``."""
        T, V, W = control.folded.T, control.folded.V, control.unfolded.V
        rows, corners = whole_prisms(T)
        sound = upright(V, T) & upright(W, T)
        rows, corners = (a[sound[rows].all(axis=1)] for a in (rows, corners))
        prism = np.full(len(T), -1)
        prism[rows] = np.arange(len(rows))[:, None]
        border = np.ones((len(T), 4), dtype=bool)
        b, c, above_a, above_b = corners[:, [1, 2, 3, 4]].T[..., None]
        border[rows[:, 0]] = T[rows[:, 0]] != c
        border[rows[:, 1]] = (T[rows[:, 1]] != b) & (T[rows[:, 1]] != above_b)
        border[rows[:, 2]] = T[rows[:, 2]] != above_a
        rational = np.zeros(len(rows), dtype=bool)
        if name == "wachspress":
            rational = convex(V[corners])
        size = float(np.ptp(W, axis=0).max())
        return cls(control, name, rows, corners, prism, border, rational, TOLERANCE * size)

    def counts(self) -> dict[str, int]:
        """Return the number of prisms by kind of coordinates, and of tetrahedra in no prism."""
        return {
            "prisms": len(self.corners),
            "wachspress": int(self.rational.sum()),
            "mvc": int((~self.rational).sum()),
            "single_tetrahedra": int((self.prism < 0).sum()),
        }

    def held(self, element: Ints, weights: Floats) -> Ints:
        """Return the rows of points carried by prisms: those inside one, off its border.

        Tetrahedra carry the points on the border and outside of the mesh.

        Parameters
        ----------
        element : (n,) int
            The tetrahedron of each point, -1 for none.
        weights : (n, 4) float
            Its barycentric coordinates there.
        """
        e = np.maximum(element, 0)
        within = (element >= 0) & (self.prism[e] >= 0)
        return np.flatnonzero(within & ((weights > _BORDER) | ~self.border[e]).all(axis=1))

    def carry(self, points: Floats, element: Ints) -> tuple[Floats, Floats]:
        """Return points inside prisms in the unfolded space.

        Parameters
        ----------
        points : (k, 3) float
            Folded, off the prisms' borders.
        element : (k,) int
            The tetrahedron of each.

        Returns
        -------
        image : (k, 3) float
            Unfolded.
        stratigraphic : (k,) float
            The coordinate there.
        """
        image, third = np.empty_like(points), np.empty(len(points))
        for here in _chunks(len(points)):
            prism = self.prism[element[here]]
            corners, values = self.corners[prism], self._values(points[here], prism)
            image[here] = np.einsum("ni,nij->nj", values, self.control.unfolded.V[corners])
            third[here] = np.einsum("ni,ni->n", values, self.control.stratigraphic[corners])
        return image, third

    def gradients(self, points: Floats, element: Ints) -> Floats:
        """Return the deformation gradients (k, 3, 3) at points inside prisms; see ``carry``."""
        out = np.empty((len(points), 3, 3))
        for here in _chunks(len(points)):
            prism = self.prism[element[here]]
            _, slopes = self._slopes(points[here], prism)
            out[here] = _jacobian(self.control.unfolded.V[self.corners[prism]], slopes)
        return out

    def back(self, points: Floats, element: Ints, start: Floats) -> tuple[Floats, Floats, Bools]:
        """Return unfolded points in the folded space: Newton's method with halved steps.

        Parameters
        ----------
        points : (k, 3) float
            Unfolded, inside prisms and off their borders.
        element : (k,) int
            The tetrahedron of each.
        start : (k, 3) float
            Their images by the tetrahedra.

        Returns
        -------
        image : (k, 3) float
            Folded, in the same prism.
        stratigraphic : (k,) float
            The coordinate there.
        solved : (k,) bool
            Whether the image is carried to the point, to the tolerance.
        """
        image, third = np.empty_like(points), np.empty(len(points))
        solved = np.empty(len(points), dtype=bool)
        for here in _chunks(len(points)):
            prism = self.prism[element[here]]
            image[here], values, solved[here] = self._solve(points[here], prism, start[here])
            heights = self.control.stratigraphic[self.corners[prism]]
            third[here] = np.einsum("ni,ni->n", values, heights)
        return image, third, solved

    def _values(self, points: Floats, prism: Ints) -> Floats:
        """Return coordinates (k, 6) of folded points in prisms (k,)."""
        values = np.empty((len(points), 6))
        for rows, kind in self._by_kind(prism, wachspress, mean_value):
            corners = self.control.folded.V[self.corners[prism[rows]]]
            values[rows] = kind(points[rows], corners)
        return values

    def _slopes(self, points: Floats, prism: Ints) -> tuple[Floats, Floats]:
        """Return coordinates (k, 6) and gradients (k, 6, 3) of folded points in prisms (k,)."""
        values, slopes = np.empty((len(points), 6)), np.empty((len(points), 6, 3))
        for rows, kind in self._by_kind(prism, wachspress_gradients, mean_value_gradients):
            corners = self.control.folded.V[self.corners[prism[rows]]]
            values[rows], slopes[rows] = kind(points[rows], corners)
        return values, slopes

    def _by_kind(self, prism: Ints, first: _T, second: _T) -> Iterator[tuple[Ints, _T]]:
        """Yield the rows of prisms with Wachspress coordinates, then the other rows."""
        rational = self.rational[prism]
        for rows, kind in ((np.flatnonzero(rational), first), (np.flatnonzero(~rational), second)):
            if len(rows):
                yield rows, kind

    def _solve(self, target: Floats, prism: Ints, start: Floats) -> tuple[Floats, Floats, Bools]:
        """Return folded points (k, 3), their coordinates (k, 6) and which of them are solved."""
        there = self.control.unfolded.V[self.corners[prism]]

        def off(rows: Ints, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
            with np.errstate(all="ignore"):  # trial points on a border are rejected
                values, slopes = self._slopes(x, prism[rows])
                missing = target[rows] - np.einsum("ni,nij->nj", values, there[rows])
            return values, slopes, missing, np.linalg.norm(missing, axis=1)

        x, every = start.copy(), np.arange(len(target))
        values, slopes, missing, gap = off(every, x)
        stuck = ~np.isfinite(gap)
        for _ in range(_STEPS):
            rows = every[~stuck & (gap > self.tolerance)]
            if not len(rows):
                break
            step = _newton_step(_jacobian(there[rows], slopes[rows]), missing[rows])
            for halving in range(_HALVINGS):
                length = 0.5**halving
                trial = x[rows] + length * step
                found = off(rows, trial)
                better = found[3] <= np.maximum(
                    gap[rows] * (1 - _DECREASE * length), self.tolerance
                )
                better &= self._inside(trial, prism[rows])
                taken = rows[better]
                x[taken] = trial[better]
                values[taken], slopes[taken], missing[taken], gap[taken] = (
                    a[better] for a in found
                )
                rows, step = rows[~better], step[~better]
                if not len(rows):
                    break
            stuck[rows] = True
        return x, values, gap <= self.tolerance

    def _inside(self, points: Floats, prism: Ints) -> Bools:
        """Return which folded points (k, 3) lie in their prisms (k,)."""
        inside = np.zeros(len(points), dtype=bool)
        for rows in self.rows[prism].T:
            share = barycentric_in_tets(points, self.control.folded.V, self.control.folded.T[rows])
            inside |= share.min(axis=1) >= _INSIDE
        return inside


def _chunks(count: int) -> Iterator[slice]:
    """Yield slices over so many rows."""
    for start in range(0, count, _CHUNK):
        yield slice(start, min(start + _CHUNK, count))


def _jacobian(corners: Floats, slopes: Floats) -> Floats:
    """Return the derivative (n, 3, 3) of a map with images (n, 6, 3) of the corners."""
    return np.asarray(np.einsum("nia,nib->nab", corners, slopes))


def _newton_step(J: Floats, missing: Floats) -> Floats:
    """Return the solutions (n, 3) of J x = missing; infinite if J is singular."""
    a, b, c = J[:, 0], J[:, 1], J[:, 2]
    normals = (np.cross(b, c), np.cross(c, a), np.cross(a, b))
    with np.errstate(all="ignore"):
        det = np.einsum("ij,ij->i", a, normals[0])[:, None]
        out: Floats = sum(n * missing[:, [k]] for k, n in enumerate(normals)) / det
    return out
