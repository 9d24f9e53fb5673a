"""Carry points through a control mesh, both ways, and store the map in a small file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np

from geounfold.backends.igl import TetIndex, barycentric_in_tets
from geounfold.backends.threads import over_slices, slices
from geounfold.body.fault_cells import FaultCells
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, check_one_of
from geounfold.geometry.mesh import Bools, Floats, Ints, Numbers, TetMesh
from geounfold.mapping.body_cells import BodyCells
from geounfold.mapping.carried import Carried, Returned, checked_points
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.distortion import deformation_gradients
from geounfold.mapping.domain_file import holds_domains
from geounfold.mapping.fault_space import JoinedSpace
from geounfold.mapping.map_file import arrays_of, read_arrays, write_arrays
from geounfold.mapping.mesh_space import MeshImage, MeshSpace
from geounfold.mapping.parts_space import MapParts, PartsSpace, part_elements, part_spaces
from geounfold.mapping.prism_coordinates import COORDINATES, PrismInterpolant

REACH = 3.0
"""Default of the largest distance from the control mesh at which points are carried, in blocks."""

_SLICE = 1 << 14  # points that a thread carries at a time; they fit in its cache

_BEYOND = 0.02  # height beyond bottom and top that counts as the body's, without its blocks

_MISSED = 1 << 18  # points that libigl places at a time


class UnfoldingMap:
    """A fitted unfolding: carries any points to the flat space and back.

    Points in the control mesh and in the shell return exactly: both spaces have the same
    tetrahedra, and none overlap if the map is certified. A control mesh without a shell is
    continued by its nearest element. That continuation is not one-to-one: a point outside returns
    to another place. A point farther away than the reach has no image.

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
        (blocks).  A shell may end nearer if limbs or a hinge's inner side leave no room.
    known : sequence of TetIndex, optional
        Trees already built, used if they are over a space of the control mesh.
    coordinates : str
        ``tet``: the map is affine in every tetrahedron.  ``wachspress`` or ``mvc``: points in
        prisms are carried by coordinates of the prism's corners, smooth inside; the inverse is
        found by Newton's method to 1e-12 of the mesh's size.
    parts : MapParts, optional
        The parts of a map whose control mesh is several that touch: each folded point is carried
        by the mesh of its own part.
    body : BodyCells, optional
        The body's own blocks; without, the map does not hold them.

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
        parts: MapParts | None = None,
        body: BodyCells | None = None,
    ) -> None:
        check_one_of("coordinates", coordinates, COORDINATES)
        self.coordinates = coordinates
        self.frame = frame
        self.control = control
        self.shell = shell
        self.reach = reach
        self.parts = parts
        self.body = body
        self._known = tuple(known)

    def __repr__(self) -> str:
        return f"<UnfoldingMap of {len(self.control.folded.T)} tetrahedra, {self.coordinates}>"

    @cached_property
    def _folded(self) -> MeshSpace | PartsSpace:
        shell = None if self.shell is None else self.shell.folded
        if self.parts is not None:
            return PartsSpace(self.control.folded, shell, self.reach, self.parts)
        return MeshSpace(self.control.folded, shell, self.reach, self._known)

    @cached_property
    def _unfolded(self) -> MeshSpace | JoinedSpace:
        shell = None if self.shell is None else self.shell.unfolded
        if self.parts is not None and isinstance(self.parts.cells, FaultCells):
            spaces = part_spaces(self.control.unfolded, shell, self.reach, self.parts)
            return JoinedSpace(spaces, self.whole.folded, self.parts.cells)
        return MeshSpace(self.control.unfolded, shell, self.reach, self._known)

    @property
    def faulted(self) -> bool:
        """Whether the parts are fault blocks in one flat space."""
        return self.parts is not None and isinstance(self.parts.cells, FaultCells)

    @cached_property
    def whole(self) -> ControlMesh:
        """The control mesh and its shell as one."""
        if self.shell is None:
            return self.control
        T = np.concatenate([self.control.folded.T, self.shell.folded.T])
        folded, unfolded = TetMesh(self.shell.folded.V, T), TetMesh(self.shell.unfolded.V, T)
        return ControlMesh(folded, unfolded, self.shell.stratigraphic)

    @cached_property
    def prisms(self) -> PrismInterpolant | None:
        """The prisms and their coordinates; None if the tetrahedra carry all points."""
        if self.coordinates == "tet":
            return None
        return PrismInterpolant.of(self.whole, self.coordinates)

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Carry points to the flat space, or back with ``inverse``.

        Parameters
        ----------
        points : (n, 3) float
            Folded points in the data's coordinates; with ``inverse`` unfolded points.  Empty rows
            (all NaN: no image) stay empty.
        inverse : bool
            True for the way from the flat space back to the folded one.

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
            place, weights = space.walked(*self._to_work(P[rows], inverse=inverse))
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
        out = replace(out, block=self._blocks_of(out.element))
        if self.prisms is None:
            return out
        return replace(out, unsolved=self._by_prisms(self.prisms, P, out, inverse=inverse))

    def _blocks_of(self, element: Ints) -> Ints | None:
        """Return the fault block of each element (n,), -1 for none; None without faults."""
        if self.parts is None or not self.faulted:
            return None
        first = self.whole.folded.T[np.maximum(element, 0), 0]
        return np.where(element >= 0, self.parts.vertex[first], -1)

    def _by_prisms(
        self, prisms: PrismInterpolant, points: Floats, carried: Carried, *, inverse: bool
    ) -> int:
        """Replace the tetrahedra's images by those of prisms; count the unsolved points."""
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

    def carry_by_block(
        self, points: Floats, fault_block: Ints | None, *, inverse: bool = False
    ) -> Carried:
        """Carry points by the fault block that each belongs to; by its place if none is given.

        Flat places at a cut-off may lie in two fault blocks, so that only the number tells which
        of two folded places is meant.

        Parameters
        ----------
        points : (n, 3) float
            As `carry` takes them.
        fault_block : (n,) int or None
            Fault block of each point; -1 leaves the choice to the map.
        inverse : bool
            As `carry` takes it.

        Raises
        ------
        InputError
            There is no fault block of a number.
        """
        if fault_block is None:
            return self.carry(points, inverse=inverse)
        block = np.asarray(fault_block, dtype=np.int64)
        P = np.asarray(points, dtype=np.float64)
        if block.shape != (len(points),):
            raise InputError(
                f"fault_block must have one number per point, ({len(points)},), but has "
                f"{block.shape}"
            )
        most = -1 if self.parts is None else self.parts.count - 1
        if block.max(initial=-1) > most or block.min(initial=-1) < -1:
            raise InputError(
                f"fault_block must be -1 to {most}, but reaches {block.min()} to {block.max()}"
            )
        out = self.carry(points, inverse=inverse)
        for k in range(most + 1):
            rows = np.flatnonzero((block == k) & np.isfinite(P).all(axis=1))
            if not len(rows):
                continue
            own, elements = self._of_part(k)
            found = own.carry(P[rows], inverse=inverse)
            for name in ("points", "stratigraphic", "inside", "placed", "distance"):
                getattr(out, name)[rows] = getattr(found, name)
            out.element[rows] = np.where(
                found.element >= 0, elements[np.maximum(found.element, 0)], -1
            )
            if out.block is not None:
                out.block[rows] = np.where(found.placed, k, -1)
        return out

    def _of_part(self, part: int) -> tuple[UnfoldingMap, Ints]:
        """Return the map of one part by itself, and its elements' numbers among those of all."""
        if self.parts is None:
            raise TypeError("the map has no parts")
        core, rest, number = part_elements(
            self.control.folded, None if self.shell is None else self.shell.folded, self.parts, part
        )
        own = self.parts.vertex == part
        count = len(self.control.folded.V)
        control = _some(self.control, own[:count], number[self.control.folded.T[core]])
        shell = None
        if self.shell is not None and len(rest):
            shell = _some(self.shell, own, number[self.shell.folded.T[rest]])
        elements = np.concatenate([core, len(self.control.folded.T) + rest])
        return UnfoldingMap(
            self.frame, control, shell, self.reach, coordinates=self.coordinates
        ), elements

    def returned(self, points: Floats, carried: Carried) -> Returned:
        """Return the round trip of points from their images.

        Parameters
        ----------
        points : (n, 3) float
            In the data's coordinates.
        carried : Carried
            Result of ``carry``.
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
    def _unfold(self) -> MeshImage:
        return MeshImage(self.whole.unfolded, self.whole.stratigraphic)

    @cached_property
    def _fold(self) -> MeshImage:
        return MeshImage(self.whole.folded, self.whole.stratigraphic)

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
            As ``deformation_gradients``, folded directions in the working frame; of the prism's
            coordinates if a prism carries the point.
        """
        used, back = np.unique(element, return_inverse=True)
        out = deformation_gradients(self.whole, used)[back]
        if self.prisms is not None and len(points):
            work, folded = self.frame.to_work(points), self.whole.folded
            share = barycentric_in_tets(work, folded.V, folded.T[element])
            rows = self.prisms.held(element, share)
            out[rows] = self.prisms.gradients(work[rows], element[rows])
        return out

    def in_body(self, points: Floats, carried: Carried) -> Bools:
        """Return which folded points (n, 3) lie in the body's own blocks.

        A map without the blocks (of scattered points, or saved by an older version) has points
        inside the control mesh between the bottom and the top surface instead, by 0.02 beyond
        them: the blocks of the common body reach from -0.018 to 1.018. The control mesh reaches
        beyond the body's rim, so that these are too many.

        Parameters
        ----------
        points : (n, 3) float
            In the data's coordinates.
        carried : Carried
            Result of ``carry``.
        """
        if self.body is not None:
            return self.body.hold(self.frame.to_work(points))
        with np.errstate(invalid="ignore"):
            between = np.abs(carried.stratigraphic - 0.5) <= 0.5 + _BEYOND
        return np.asarray(carried.inside & between)

    def body_distance(self, points: Floats, carried: Carried) -> Floats:
        """Return how far folded points (n, 3) lie from the body, in blocks, (n,); 0 inside.

        See `BodyCells.distance`. Without the blocks, it is the distance from the control mesh, and
        half a block if a point inside the mesh does not lie in the body.
        """
        if self.body is not None:
            return self.body.distance(self.frame.to_work(points))
        away = np.maximum(carried.distance / self.frame.scale, 0.5)
        return np.where(self.in_body(points, carried), 0.0, away)

    def to_flat(self, points: Floats, fault_block: Ints | None = None) -> Floats:
        """Return folded points (n, 3) in the flat space, same unit; NaN beyond the reach."""
        return self.carry_by_block(points, fault_block).points

    def to_folded(self, points: Floats, fault_block: Ints | None = None) -> Floats:
        """Return flat points (n, 3) in the folded space, the data's; NaN beyond the reach."""
        return self.carry_by_block(points, fault_block, inverse=True).points

    def block_of(self, points: Floats) -> Ints | None:
        """Return the fault block that folded points (n, 3) belong to; None without faults."""
        if self.parts is None or not isinstance(self.parts.cells, FaultCells):
            return None
        return self.parts.cells.of(self.frame.to_work(points))

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map as .npz without pickles: control mesh, frame, version, checksum."""
        write_arrays(path, self._arrays())

    def __reduce__(self) -> tuple[Callable[..., UnfoldingMap], tuple[dict[str, np.ndarray]]]:
        """Pickle as plain arrays; trees and tables are rebuilt when they are needed."""
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
            **({} if self.parts is None else self.parts.arrays()),
            **({} if self.body is None else self.body.arrays()),
        }


def _some(mesh: ControlMesh, vertices: Bools, T: Ints) -> ControlMesh:
    """Return tetrahedra of some vertices of a control mesh, numbered among these."""
    return ControlMesh(
        TetMesh(mesh.folded.V[vertices], T),
        TetMesh(mesh.unfolded.V[vertices], T),
        mesh.stratigraphic[vertices],
    )


def load(path: str | Path) -> UnfoldingMap:
    """Read a map written by ``save``.

    Raises
    ------
    InputError
        No such file, not a map of one body, of another version, or damaged.
    """
    if holds_domains(path):
        raise InputError(
            f"{path}: holds the maps of several domains; geounfold.load_domains reads it, and "
            "--domain NAME chooses one"
        )
    return _of_arrays(read_arrays(path))


def of_bytes(content: bytes, path: Path) -> UnfoldingMap:
    """Return the map in a map file's bytes; ``path`` is for messages."""
    return _of_arrays(arrays_of(content, path))


def _of_arrays(arrays: dict[str, np.ndarray]) -> UnfoldingMap:
    """Return the map stored in the arrays."""
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
    return UnfoldingMap(
        frame,
        control,
        shell,
        float(arrays["reach"]),
        coordinates=coordinates,
        parts=MapParts.of_arrays(arrays, frame.steps),
        body=BodyCells.of_arrays(arrays, frame.steps),
    )
