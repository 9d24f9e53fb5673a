"""Carry points through a control mesh, both ways, and keep the map in a small file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np

from geounfold.backends.igl import SurfaceIndex, TetIndex, barycentric_in_tets
from geounfold.control import ControlMesh
from geounfold.coordinates import COORDINATES, PrismInterpolant
from geounfold.distortion import deformation_gradients
from geounfold.errors import InputError, OptionError
from geounfold.frame import Frame
from geounfold.geometry import boundary_faces
from geounfold.location import TetWalk
from geounfold.mapfile import read_arrays, write_arrays
from geounfold.mesh import Bools, Floats, Ints, Numbers, TetMesh
from geounfold.threads import over_slices, slices

INSIDE, EXTRAPOLATED, OUTSIDE = "inside", "extrapolated", "outside"

REACH = 3.0
"""How far past the control mesh points are carried, in blocks, where nothing else is asked for."""

_SLICE = 1 << 14  # points that a thread carries at once: they stay in its cache
_MISSED = 1 << 18  # points that libigl places at once

TOUCHING = 1e-9
"""A point this near to a mesh, as a share of the mesh's size, lies in it: rounding."""


@dataclass(frozen=True, eq=False)
class Carried:
    """Points carried by a map.

    Attributes
    ----------
    points : (n, 3) float
        Their images; NaN where the point lies beyond the map's reach.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top; NaN where there is no image.
    inside : (n,) bool
        Whether the control mesh holds the point.
    placed : (n,) bool
        Whether the point has an image: inside, or within the map's reach.
    element : (n,) int
        The tetrahedron that carried each point: of the control mesh, from
        ``len(control.folded.T)`` on of the shell around it; -1 where there is no image.
    distance : (n,) float
        From the control mesh, in the space the points were given in and their unit; 0 inside.
    unsolved : int
        Points in a prism for which no image was found: its coordinates have no closed inverse.
        They have none, then, and are not placed; always 0 with the coordinates of tetrahedra.
    """

    points: Floats
    stratigraphic: Floats
    inside: Bools
    placed: Bools
    element: Ints
    distance: Floats
    unsolved: int = 0

    @property
    def location(self) -> np.ndarray:
        """``inside``, ``extrapolated`` or ``outside`` (no image) for every point, (n,) of str."""
        words = np.array([OUTSIDE, EXTRAPOLATED, INSIDE])
        return words[self.placed * (1 + self.inside.astype(np.int8))]

    def spread(self, rows: Bools) -> Carried:
        """Return these points as the True rows (m,) among others that have no image."""
        if rows.all():
            return self
        out = Carried(
            points=np.full((len(rows), 3), np.nan),
            stratigraphic=np.full(len(rows), np.nan),
            inside=np.zeros(len(rows), bool),
            placed=np.zeros(len(rows), bool),
            element=np.full(len(rows), -1, dtype=np.int64),
            distance=np.full(len(rows), np.nan),
            unsolved=self.unsolved,
        )
        for name in ("points", "stratigraphic", "inside", "placed", "element", "distance"):
            getattr(out, name)[rows] = getattr(self, name)
        return out

    def part(self, rows: slice) -> Carried:
        """Return what became of some of the points."""
        return Carried(
            self.points[rows],
            self.stratigraphic[rows],
            self.inside[rows],
            self.placed[rows],
            self.element[rows],
            self.distance[rows],
        )


@dataclass(frozen=True, eq=False)
class Returned:
    """How points came back.

    Attributes
    ----------
    largest : float
        Largest distance between a point and its return, over those that have both; else 0.
    lost : (n,) bool
        Points that did not come back though the mesh holds their image: no inverse was found.
    """

    largest: float
    lost: Bools


@dataclass(frozen=True, eq=False)
class _Place:
    """Where points lie in one space: see Carried; barycentric coordinates (n, 4)."""

    element: Ints
    inside: Bools
    distance: Floats
    weights: Floats


class _Image:
    """Where each tetrahedron's places come to lie: affine in barycentric coordinates."""

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


class _Space:
    """One space of a control mesh and its shell, indexed for point location.

    Parameters
    ----------
    mesh : TetMesh
        The control mesh.
    shell : TetMesh or None
        Tetrahedra around it.
    reach : float
        How far points are continued by the nearest element where there is no shell.
    known : sequence of TetIndex
        Trees already built, used where one is over this very mesh.
    """

    def __init__(
        self, mesh: TetMesh, shell: TetMesh | None, reach: float, known: Sequence[TetIndex]
    ) -> None:
        self._mesh, self._shell, self._reach, self._known = mesh, shell, reach, known
        self._V = mesh.V if shell is None else shell.V
        self._T = mesh.T if shell is None else np.concatenate([mesh.T, shell.T])
        self._touching = TOUCHING * float(np.ptp(mesh.V, axis=0).max())

    @cached_property
    def walk(self) -> TetWalk:
        """What places nearly all points of the control mesh."""
        return TetWalk(self._mesh.V, self._mesh.T)

    @cached_property
    def _index(self) -> TetIndex:
        """What places the others, and says what is right."""
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

    def locate(self, points: Floats) -> _Place:
        """Return where points (n, 3) lie: the reference, libigl's."""
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
        return _Place(element, inside, distance, barycentric_in_tets(points, self._V, corners))

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


class UnfoldingMap:
    """A fitted unfolding: carries any points to the flat space and back.

    Points of the control mesh, and of the shell around it, go there and back exactly: both are
    the same tetrahedra in either space, none of which overlap where the map is certified.  A
    control mesh without a shell is continued by its nearest element, which is no such map: a
    point outside comes back to another place.  What lies farther than the reach has no image.

    Parameters
    ----------
    frame : Frame
        Working frame of the control mesh.
    control : ControlMesh
        In working units.
    shell : ControlMesh, optional
        Tetrahedra around it; its first vertices are those of the control mesh.
    reach : float
        Largest distance from the control mesh at which points are carried, in working units
        (blocks).  A shell may end nearer, where limbs or a hinge's inner side leave no room.
    known : sequence of TetIndex, optional
        Trees already built, used where they are over a space of the control mesh.
    coordinates : str
        ``tet``: the map is affine in every tetrahedron.  ``wachspress`` or ``mvc``: points in
        prisms go by coordinates of the prism's corners, which is smooth inside; the inverse is
        found by Newton's method to 1e-12 of the mesh's size.

    Raises
    ------
    OptionError
        Unknown coordinates.
    """

    def __init__(
        self,
        frame: Frame,
        control: ControlMesh,
        shell: ControlMesh | None = None,
        reach: float = REACH,
        known: Sequence[TetIndex] = (),
        coordinates: str = "tet",
    ) -> None:
        if coordinates not in COORDINATES:
            valid = ", ".join(COORDINATES)
            raise OptionError(f"unknown coordinates {coordinates!r}; valid: {valid}")
        self.coordinates = coordinates
        self.frame = frame
        self.control = control
        self.shell = shell
        self.reach = reach
        self._known = tuple(known)

    @cached_property
    def _folded(self) -> _Space:
        shell = None if self.shell is None else self.shell.folded
        return _Space(self.control.folded, shell, self.reach, self._known)

    @cached_property
    def _unfolded(self) -> _Space:
        shell = None if self.shell is None else self.shell.unfolded
        return _Space(self.control.unfolded, shell, self.reach, self._known)

    @cached_property
    def whole(self) -> ControlMesh:
        """The control mesh and its shell as one."""
        if self.shell is None:
            return self.control
        T = np.concatenate([self.control.folded.T, self.shell.folded.T])
        return ControlMesh(
            TetMesh(self.shell.folded.V, T),
            TetMesh(self.shell.unfolded.V, T),
            self.shell.stratigraphic,
        )

    @cached_property
    def prisms(self) -> PrismInterpolant | None:
        """The prisms and their coordinates; None where the tetrahedra carry all points."""
        if self.coordinates == "tet":
            return None
        return PrismInterpolant.of(self.whole, self.coordinates)

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Carry points to the flat space, or with ``inverse`` from it back.

        Parameters
        ----------
        points : (n, 3) float
            Folded points in the data's coordinates; with ``inverse`` unfolded points, whose
            empty rows (all NaN: no image) stay empty.
        inverse : bool
            Direction.

        Returns
        -------
        Carried

        Raises
        ------
        InputError
            Points of another shape, or not finite.
        """
        P = np.ascontiguousarray(points, dtype=np.float64)
        if inverse and P.ndim == 2 and np.isnan(P).any():
            there: Bools = np.logical_not(np.isnan(P).all(axis=1))
            return self.carry(P[there], inverse=True).spread(there)
        P = checked_points(P)
        n = len(P)
        space, image = (self._unfolded, self._fold) if inverse else (self._folded, self._unfold)
        out = Carried(
            points=np.empty((n, 3)),
            stratigraphic=np.empty(n),
            inside=np.empty(n, bool),
            placed=np.empty(n, bool),
            element=np.empty(n, np.int64),
            distance=np.zeros(n),
        )

        def fill(rows: slice | Ints, place: Ints | Numbers, weights: Sequence[Floats]) -> None:
            x, y, z, height = image(np.maximum(place, 0), *weights)
            out.points[rows] = self._from_work(x, y, z, inverse=inverse)
            out.stratigraphic[rows] = height
            out.element[rows] = place

        def walk(rows: slice) -> None:
            place, weights = space.walk.locate(*self._to_work(P[rows], inverse=inverse))
            fill(rows, place, list(weights))
            out.inside[rows] = out.placed[rows] = place >= 0

        over_slices(walk, n, _SLICE)
        missed = np.flatnonzero(~out.inside)
        for part in slices(len(missed), _MISSED):
            rows = missed[part]
            work = np.stack(self._to_work(P[rows], inverse=inverse), axis=1)
            found = space.locate(work)
            fill(rows, found.element, list(found.weights.T[1:]))
            out.inside[rows], out.placed[rows] = found.inside, found.element >= 0
            out.distance[rows] = found.distance * self.frame.scale
        empty = missed[~out.placed[missed]]
        out.points[empty] = np.nan
        out.stratigraphic[empty] = np.nan
        if self.prisms is None:
            return out
        return replace(out, unsolved=self._by_prisms(self.prisms, P, out, inverse=inverse))

    def _by_prisms(
        self, prisms: PrismInterpolant, points: Floats, carried: Carried, *, inverse: bool
    ) -> int:
        """Put what prisms carry in the place of the tetrahedra's answer; count the unsolved."""
        mesh = self.whole.unfolded if inverse else self.whole.folded
        placed, unsolved = np.flatnonzero(carried.placed), 0
        for part in slices(len(placed), _MISSED):
            rows = placed[part]
            work = np.stack(self._to_work(points[rows], inverse=inverse), axis=1)
            element = carried.element[rows]
            share = barycentric_in_tets(work, mesh.V, mesh.T[element])
            held = prisms.held(element, share)
            rows, work, element = rows[held], work[held], element[held]
            if inverse:
                start = self.frame.to_work(carried.points[rows])
                image, height, solved = prisms.back(work, element, start)
            else:
                image, height = prisms.carry(work, element)
                solved = np.ones(len(rows), dtype=bool)
            carried.points[rows] = self._from_work(*image.T, inverse=inverse)
            carried.stratigraphic[rows] = height
            lost = rows[~solved]
            carried.points[lost], carried.stratigraphic[lost] = np.nan, np.nan
            carried.placed[lost] = False
            unsolved += len(lost)
        return unsolved

    def returned(self, points: Floats, carried: Carried) -> Returned:
        """Return how points come back from where they were carried.

        Parameters
        ----------
        points : (n, 3) float
            In the data's coordinates.
        carried : Carried
            As ``carry`` gave them.
        """
        largest, lost = 0.0, np.zeros(len(points), dtype=bool)
        for rows in slices(len(points), _MISSED):
            back = self.carry(carried.points[rows], inverse=True)
            lost[rows] = back.inside & ~back.placed
            placed = carried.placed[rows] & ~lost[rows]
            away = np.linalg.norm(back.points[placed] - points[rows][placed], axis=1)
            largest = max(largest, float(away.max(initial=0.0)))
        return Returned(largest, lost)

    @cached_property
    def _unfold(self) -> _Image:
        return _Image(self.whole.unfolded, self.whole.stratigraphic)

    @cached_property
    def _fold(self) -> _Image:
        return _Image(self.whole.folded, self.whole.stratigraphic)

    def _to_work(self, points: Floats, *, inverse: bool) -> tuple[Floats, Floats, Floats]:
        """Return x, y, z in the working frame of points (k, 3) of either space."""
        if not inverse:
            return self.frame.work_columns(points)
        x, y, z = (np.ascontiguousarray(column) for column in (points / self.frame.scale).T)
        return x, y, z

    def _from_work(self, x: Floats, y: Floats, z: Floats, *, inverse: bool) -> Floats:
        """Return points (k, 3) of the other space from their working coordinates."""
        points = np.stack([x, y, z], axis=1)
        return self.frame.to_world(points) if inverse else points * self.frame.scale

    def gradients(self, points: Floats, element: Ints) -> Floats:
        """Return the deformation gradient at folded points, folded to unfolded.

        Parameters
        ----------
        points : (n, 3) float
            In the data's coordinates.
        element : (n,) int
            The tetrahedron that carries each (see Carried), none of them -1.

        Returns
        -------
        (n, 3, 3) float
            As ``deformation_gradients``, folded directions in the working frame; that of the
            prism's coordinates where a prism carries the point.
        """
        used, back = np.unique(element, return_inverse=True)
        out = deformation_gradients(self.whole, used)[back]
        if self.prisms is not None and len(points):
            work, folded = self.frame.to_work(points), self.whole.folded
            share = barycentric_in_tets(work, folded.V, folded.T[element])
            rows = self.prisms.held(element, share)
            out[rows] = self.prisms.gradients(work[rows], element[rows])
        return out

    def to_flat(self, points: Floats) -> Floats:
        """Return folded points (n, 3) in the flat space, same unit; NaN beyond the reach."""
        return self.carry(points).points

    def to_folded(self, points: Floats) -> Floats:
        """Return flat points (n, 3) in the folded space, the data's; NaN beyond the reach."""
        return self.carry(points, inverse=True).points

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map as .npz without pickles: control mesh, frame, version, checksum."""
        write_arrays(path, self._arrays())

    def __reduce__(self) -> tuple[Callable[..., UnfoldingMap], tuple[dict[str, np.ndarray]]]:
        """Pickle as plain arrays: trees and tables are made anew where they are needed."""
        return _of_arrays, (self._arrays(),)

    def _arrays(self) -> dict[str, np.ndarray]:
        frame, whole = self.frame, self.whole
        count = len(self.control.folded.T)
        return {
            "origin": frame.origin,
            "rotation": frame.rotation,
            "scale": np.array(frame.scale),
            "steps": np.full(3, np.nan) if frame.steps is None else frame.steps,
            "reach": np.array(self.reach),
            "coordinates": np.array(COORDINATES.index(self.coordinates)),
            "folded": whole.folded.V,
            "unfolded": whole.unfolded.V,
            "inner": np.array(len(self.control.folded.V)),
            "tetrahedra": self.control.folded.T,
            "shell": whole.folded.T[count:],
            "stratigraphic": whole.stratigraphic,
        }


def checked_points(points: Floats) -> Floats:
    """Return points as finite, contiguous (n, 3) floats, or raise InputError."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"points must have shape (n, 3), but have {P.shape}")
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise InputError(f"{len(bad)} points are not finite, the first is row {bad[0] + 1}")
    return P


def load(path: str | Path) -> UnfoldingMap:
    """Read a map written by ``save``.

    Raises
    ------
    InputError
        No such file, not a map, of another version, or damaged.
    """
    return _of_arrays(read_arrays(path))


def _of_arrays(arrays: dict[str, np.ndarray]) -> UnfoldingMap:
    """Return the map that such arrays keep."""
    steps = arrays["steps"]
    frame = Frame(
        arrays["origin"],
        arrays["rotation"],
        float(arrays["scale"]),
        None if np.isnan(steps).any() else steps,
    )
    T, S = arrays["tetrahedra"].astype(np.int64), arrays["shell"].astype(np.int64)
    whole = [arrays["folded"], arrays["unfolded"], arrays["stratigraphic"]]
    core = [a[: int(arrays["inner"])] for a in whole]
    control = ControlMesh(TetMesh(core[0], T), TetMesh(core[1], T), core[2])
    shell = None
    if len(S):
        shell = ControlMesh(TetMesh(whole[0], S), TetMesh(whole[1], S), whole[2])
    coordinates = COORDINATES[int(arrays["coordinates"])]
    return UnfoldingMap(frame, control, shell, float(arrays["reach"]), coordinates=coordinates)
