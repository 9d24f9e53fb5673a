"""Carry points through a control mesh, both ways, and keep the map in a small file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np

from geounfold.backends.igl import SurfaceIndex, TetIndex
from geounfold.control import ControlMesh
from geounfold.errors import InputError
from geounfold.frame import Frame
from geounfold.mapfile import read_arrays, write_arrays
from geounfold.mesh import Bools, Floats, Ints, TetMesh

TURNED_OVER = np.array([1.0, -1.0, -1.0])
"""Half a turn about the flat space's x axis: what exchanges top and bottom."""

INSIDE, EXTRAPOLATED = "inside", "extrapolated"


def boundary_faces(T: Ints) -> tuple[Ints, Ints]:
    """Return the faces that belong to one tetrahedron only, outward, and their tetrahedra.

    Examples
    --------
    >>> faces, owner = boundary_faces(np.array([[0, 1, 2, 3]]))
    >>> len(faces), owner.tolist()
    (4, [0, 0, 0, 0])
    """
    corners = ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])
    F = np.concatenate([T[:, c] for c in corners])
    owner = np.tile(np.arange(len(T)), 4)
    key = np.sort(F, axis=1)
    _, index, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    once = count[index.ravel()] == 1
    return F[once], owner[once]


@dataclass(frozen=True, eq=False)
class Carried:
    """Points carried by a map.

    Attributes
    ----------
    points : (n, 3) float
        Their images.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top.
    inside : (n,) bool
        False where the point lies outside the control mesh and was extrapolated.
    element : (n,) int
        The tetrahedron that carried each point.
    """

    points: Floats
    stratigraphic: Floats
    inside: Bools
    element: Ints

    @property
    def location(self) -> np.ndarray:
        """``inside`` or ``extrapolated`` for every point, (n,) of str."""
        return np.where(self.inside, INSIDE, EXTRAPOLATED)


class _Space:
    """One space of a control mesh, indexed for point location."""

    def __init__(self, mesh: TetMesh, known: Sequence[TetIndex]) -> None:
        self._mesh = mesh
        self._turn: Floats | None = None
        self._index = self._found(known) or TetIndex(mesh.V, mesh.T)

    def _found(self, known: Sequence[TetIndex]) -> TetIndex | None:
        """Return the tree among those known that is this mesh's, as it is or turned over."""
        V, T = self._mesh.V, self._mesh.T
        for index in known:
            if index.V.shape != V.shape or not np.array_equal(index.T, T):
                continue
            for turn in (None, TURNED_OVER):
                if np.array_equal(index.V if turn is None else index.V * turn, V):
                    self._turn = turn
                    return index
        return None

    @cached_property
    def _border(self) -> tuple[SurfaceIndex, Ints]:
        faces, owner = boundary_faces(self._mesh.T)
        return SurfaceIndex(self._index.V, faces), owner

    def locate(self, points: Floats) -> tuple[Ints, Bools, Floats]:
        """Return element, inside and barycentric coordinates of points (n, 3).

        A point outside takes the element behind the nearest boundary face.
        """
        if self._turn is not None:
            points = points * self._turn
        element = self._index.locate(points)
        inside = element >= 0
        if not inside.all():
            surface, owner = self._border
            element = element.copy()
            element[~inside] = owner[surface.closest(points[~inside])[1]]
        weights = self._index.barycentric(points, element)
        return element, inside | (weights.min(axis=1) >= -1e-9), weights


class UnfoldingMap:
    """A fitted unfolding: carries any points to the flat space and back.

    Parameters
    ----------
    frame : Frame
        Working frame of the control mesh.
    control : ControlMesh
        In working units.
    known : sequence of TetIndex, optional
        Trees already built, used where they are over a space of the control mesh.
    """

    def __init__(self, frame: Frame, control: ControlMesh, known: Sequence[TetIndex] = ()) -> None:
        self.frame = frame
        self.control = control
        self._known = tuple(known)

    @cached_property
    def _folded(self) -> _Space:
        return _Space(self.control.folded, self._known)

    @cached_property
    def _unfolded(self) -> _Space:
        return _Space(self.control.unfolded, self._known)

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Carry points to the flat space, or with ``inverse`` from it back.

        Parameters
        ----------
        points : (n, 3) float
            Folded points in the data's coordinates; with ``inverse`` unfolded points.
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
        P = checked_points(points)
        mesh = self.control.folded if inverse else self.control.unfolded
        if not len(P):
            return Carried(P, np.empty(0), np.empty(0, bool), np.empty(0, np.int64))
        work = P / self.frame.scale if inverse else self.frame.to_work(P)
        element, inside, weights = (self._unfolded if inverse else self._folded).locate(work)
        corners = mesh.T[element]
        image = np.einsum("ij,ijk->ik", weights, mesh.V[corners])
        stratigraphic = np.einsum("ij,ij->i", weights, self.control.stratigraphic[corners])
        out = self.frame.to_world(image) if inverse else image * self.frame.scale
        return Carried(out, stratigraphic, inside, element)

    def to_flat(self, points: Floats) -> Floats:
        """Return folded points (n, 3) in the flat space, same unit."""
        return self.carry(points).points

    def to_folded(self, points: Floats) -> Floats:
        """Return flat points (n, 3) in the folded space, the data's coordinates."""
        return self.carry(points, inverse=True).points

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map as .npz without pickles: control mesh, frame, version, checksum."""
        write_arrays(path, self._arrays())

    def _arrays(self) -> dict[str, np.ndarray]:
        frame, control = self.frame, self.control
        return {
            "origin": frame.origin,
            "rotation": frame.rotation,
            "scale": np.array(frame.scale),
            "steps": np.full(3, np.nan) if frame.steps is None else frame.steps,
            "folded": control.folded.V,
            "unfolded": control.unfolded.V,
            "tetrahedra": control.folded.T,
            "stratigraphic": control.stratigraphic,
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
        No such file, not a map, of a later version, or damaged.
    """
    arrays = read_arrays(path)
    steps = arrays["steps"]
    frame = Frame(
        arrays["origin"],
        arrays["rotation"],
        float(arrays["scale"]),
        None if np.isnan(steps).any() else steps,
    )
    T = arrays["tetrahedra"].astype(np.int64)
    control = ControlMesh(
        TetMesh(arrays["folded"], T), TetMesh(arrays["unfolded"], T), arrays["stratigraphic"]
    )
    return UnfoldingMap(frame, control)
