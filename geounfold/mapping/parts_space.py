"""Point location in control meshes that overlap: each point in the mesh of its own part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from geounfold.body.fault_cells import FaultCells
from geounfold.body.fault_surface import FaultSurface
from geounfold.body.parts.division import PartCells
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints, Numbers, TetMesh
from geounfold.mapping.mesh_space import MeshSpace, Place


@dataclass(frozen=True, eq=False)
class MapParts:
    """The parts of a map whose control mesh is several side by side.

    Parts that touch have meshes that overlap a little in the folded space, so that the part of a
    point decides which mesh carries it.

    Attributes
    ----------
    vertex : (n,) int
        Part of each vertex of the control mesh and its shell.
    cells : PartCells or FaultCells
        What gives a folded point its part; FaultCells if the parts are fault blocks, which share
        one flat space.
    """

    vertex: Ints
    cells: PartCells | FaultCells

    @property
    def count(self) -> int:
        """Number of parts."""
        return int(self.vertex.max()) + 1

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the parts as the arrays of a map file."""
        if isinstance(self.cells, FaultCells):
            return {"vertex_part": self.vertex, **_NO_CELLS, **_fault_arrays(self.cells)}
        return {
            "vertex_part": self.vertex,
            "part_cells": self.cells.cells,
            "cell_part": self.cells.part,
        }

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, np.ndarray], steps: Floats | None) -> MapParts | None:
        """Return the parts in the arrays of a map file; None for bodies that are not divided.

        Raises
        ------
        InputError
            The arrays do not fit the map's others.
        """
        if not len(arrays.get("vertex_part", ())):
            return None
        vertex, cells, part = (
            arrays[name].astype(np.int64) for name in ("vertex_part", "part_cells", "cell_part")
        )
        if len(arrays["fault_points"]):
            if len(vertex) != len(arrays["folded"]):
                raise InputError("the map's fault blocks do not fit its mesh; save it again")
            return cls(vertex, _fault_cells(arrays))
        if steps is None or len(vertex) != len(arrays["folded"]) or not len(cells):
            raise InputError("the map's parts do not fit its control mesh; save it again")
        return cls(vertex, PartCells(cells, part, steps))


_NO_CELLS = {"part_cells": np.zeros((0, 3), np.int64), "cell_part": np.zeros(0, np.int64)}
"""Arrays of bodies divided into sheets, which those divided by faults do not have."""


def _fault_arrays(cells: FaultCells) -> dict[str, np.ndarray]:
    """Return fault blocks and faults as the arrays of a map file."""
    surfaces = cells.surfaces
    first = np.cumsum([0, *(len(s.V) for s in surfaces)])
    return {
        "fault_points": cells.points,
        "fault_block": cells.part,
        "fault_side": np.array(cells.side),
        "fault_vertices": np.concatenate([np.zeros((0, 3)), *(s.V for s in surfaces)]),
        "fault_triangles": np.concatenate(
            [np.zeros((0, 3), np.int64), *(s.F + n for s, n in zip(surfaces, first, strict=False))]
        ),
        "fault_surface": np.repeat(np.arange(len(surfaces)), [len(s.F) for s in surfaces]),
    }


def _fault_cells(arrays: Mapping[str, np.ndarray]) -> FaultCells:
    """Return fault blocks and faults from the arrays of a map file; faults are numbered."""
    V, F = arrays["fault_vertices"], arrays["fault_triangles"].astype(np.int64)
    number = arrays["fault_surface"].astype(np.int64)
    surfaces = []
    for k in range(int(number.max(initial=-1)) + 1):
        used, own = np.unique(F[number == k], return_inverse=True)
        surfaces.append(FaultSurface(str(k), V[used], own.reshape(-1, 3)))
    part = arrays["fault_block"].astype(np.int64)
    return FaultCells(arrays["fault_points"], part, tuple(surfaces), float(arrays["fault_side"]))


def part_elements(
    mesh: TetMesh, shell: TetMesh | None, parts: MapParts, part: int
) -> tuple[Ints, Ints, Ints]:
    """Return the elements of a part in mesh and shell, and its vertices' numbers among its own."""
    own = parts.vertex == part
    core = np.flatnonzero(own[mesh.T[:, 0]])
    rest = np.zeros(0, np.int64) if shell is None else np.flatnonzero(own[shell.T[:, 0]])
    return core, rest, np.cumsum(own) - 1


def part_spaces(
    mesh: TetMesh, shell: TetMesh | None, reach: float, parts: MapParts
) -> tuple[tuple[MeshSpace, Ints], ...]:
    """Return for each part its space, and the numbers of its elements among those of all.

    Parameters as `PartsSpace` takes them.
    """
    spaces: list[tuple[MeshSpace, Ints]] = []
    whole = mesh if shell is None else shell
    for part in range(parts.count):
        own = parts.vertex == part
        core, rest, number = part_elements(mesh, shell, parts, part)
        inner = TetMesh(mesh.V[own[: len(mesh.V)]], number[mesh.T[core]])
        outer = None
        if shell is not None and len(rest):
            outer = TetMesh(whole.V[own], number[shell.T[rest]])
        elements = np.concatenate([core, len(mesh.T) + rest])
        spaces.append((MeshSpace(inner, outer, reach, ()), elements))
    return tuple(spaces)


class PartsSpace:
    """The folded space of a map of several parts, with the interface of MeshSpace.

    Parameters
    ----------
    mesh : TetMesh
        The control meshes of all parts as one.
    shell : TetMesh or None
        Their shells as one; its first vertices are the mesh's.
    reach : float
        As MeshSpace takes it.
    parts : MapParts
        Which part each vertex belongs to.
    """

    def __init__(self, mesh: TetMesh, shell: TetMesh | None, reach: float, parts: MapParts) -> None:
        self._cells = parts.cells
        self._spaces = part_spaces(mesh, shell, reach, parts)

    def walked(self, x: Floats, y: Floats, z: Floats) -> tuple[Numbers | Ints, Floats]:
        """Return what MeshSpace returns."""
        part = self._cells.of(np.stack([x, y, z], axis=1))
        element = np.full(len(x), -1, dtype=np.int64)
        weights = np.zeros((3, len(x)))
        for k, (space, elements) in enumerate(self._spaces):
            rows = np.flatnonzero(part == k)
            if len(rows):
                found, weight = space.walked(x[rows], y[rows], z[rows])
                element[rows] = np.where(found >= 0, elements[np.maximum(found, 0)], -1)
                weights[:, rows] = weight
        return element, weights

    def locate(self, points: Floats) -> Place:
        """Return where points (n, 3) lie in the mesh and shell of their parts."""
        n = len(points)
        part = self._cells.of(points) if n else np.zeros(0, np.int64)
        out = Place(np.full(n, -1), np.zeros(n, bool), np.zeros(n), np.zeros((n, 4)))
        for k, (space, elements) in enumerate(self._spaces):
            rows = np.flatnonzero(part == k)
            if not len(rows):
                continue
            found = space.locate(points[rows])
            own = np.where(found.element >= 0, elements[np.maximum(found.element, 0)], -1)
            out.element[rows], out.inside[rows] = own, found.inside
            out.distance[rows], out.weights[rows] = found.distance, found.weights
        return out
