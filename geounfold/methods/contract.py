"""Input and output of every method of whole bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from geounfold.body.fault_surface import FaultWalls
from geounfold.body.merged_blocks import MergedBlocks
from geounfold.body.working_frame import Frame
from geounfold.flattening import Flattening, flatten
from geounfold.geometry.measures import face_normals, triangle_areas
from geounfold.geometry.mesh import Bools, Floats, Space, TriMesh, in_space
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.sheet.result import SheetResult
from geounfold.quality.trust import Signs
from geounfold.quality.uncertainty import Spread
from geounfold.surfaces.hull import Hull
from geounfold.surfaces.split.result import SurfaceSplit

if TYPE_CHECKING:
    import pyvista


Stage = Callable[[str], AbstractContextManager[None]]
"""``with stage("hull"):`` times a stage and shows its name."""


@dataclass(frozen=True, eq=False)
class PreparedBody:
    """Input of a method for one body, in working units.

    Attributes
    ----------
    points : (n, 3) float
        Blocks moved onto their lattice, with gaps filled: what the method fits.
    blocks : (b, 3) float
        Blocks as the user gave them.
    frame : Frame
        Working frame.
    hull : Hull or None
        None if reference surfaces were given.
    split : SurfaceSplit
        The hull's (or the reference surfaces') faces as top, bottom and rim.
    up : (3,) float
        World direction towards which the top faces, unit vector.
    datum : str
        Surface that becomes flat; sides as in ``split``.
    flattener : str
        Name of the flattener, a key of FLATTENERS.
    flattener_options : dataclass or None
        The flattener's options; None for its defaults.
    reach : float
        Distance past the body, in blocks, up to which points are carried.
    options : Any
        The method's own options.
    sheet_options : SheetOptions
        Options of the mid surface, for every method that takes its surfaces from ``sheet``.
    stage : callable
        Times and names a stage: ``with stage("hull"):``.
    coarse : MergedBlocks or None
        The points merged into cells, if there are many; hull and split are then in cells.
    walls : FaultWalls or None
        The faults and limits at which the body was cut off; None if no cut is known.
    count : int or None
        Number of blocks, if ``points`` and ``blocks`` are those at the surface alone.
    """

    points: Floats
    blocks: Floats
    frame: Frame
    hull: Hull | None
    split: SurfaceSplit
    up: Floats
    datum: str
    flattener: str
    flattener_options: Any
    reach: float
    options: Any
    sheet_options: SheetOptions
    stage: Stage
    coarse: MergedBlocks | None = None
    walls: FaultWalls | None = None
    count: int | None = None

    def flatten(self, mesh: TriMesh, start: Floats | None) -> Flattening:
        """Return a surface flattened by the chosen flattener; nothing is repaired."""
        how = self.flattener_options
        return flatten(mesh, self.flattener, start=start, options=how, repair=False)


@dataclass(frozen=True, eq=False)
class Placed:
    """Points that a method placed in the flat space.

    Attributes
    ----------
    points : (n, 3) float
        Their images, working units; NaN if there is none.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top; NaN if there is no image.
    anchored : (n,) bool
        True if the surfaces reach over the point; False if they were continued past their border.
    """

    points: Floats
    stratigraphic: Floats
    anchored: Bools


class Pointwise(Protocol):
    """A map without a control mesh: a rule for single points, working units."""

    @property
    def way_back(self) -> bool:
        """Whether the rule has an inverse."""

    def to_flat(self, points: Floats) -> Placed:
        """Place folded points (n, 3) in the flat space."""

    def to_folded(self, points: Floats) -> Floats:
        """Return flat points (n, 3) in the folded space, NaN if there is no place."""


@dataclass(frozen=True, eq=False)
class SurfacePair:
    """A reference surface in both spaces, and how it was flattened.

    ``flattening`` is None for a surface that was not flattened itself but carried by the map.
    """

    folded: TriMesh
    unfolded: TriMesh
    flattening: Flattening | None

    def in_world(self, frame: Frame) -> SurfacePair:
        """Return the pair, given in working units, in the data's coordinates and unit."""
        return SurfacePair(
            self.folded.with_vertices(frame.to_world(self.folded.V)),
            self.unfolded.with_vertices(self.unfolded.V * frame.scale),
            self.flattening,
        )

    def to_pyvista(self, space: Space = "folded") -> pyvista.PolyData:
        """Return the surface in one space for pyvista.

        Each vertex's place in the other space is point data, (n, 3), under that space's name.
        """
        here, there, other = in_space(space, self.folded, self.unfolded)
        surface = here.to_pyvista()
        surface.point_data[other] = there.to_pyvista().points
        return surface


@dataclass(frozen=True, eq=False)
class BodyFit:
    """The fit of one body, working units.

    Either ``control`` or ``rule`` is set: a control mesh, which can be certified, or a rule for
    single points, about which nothing is proved.

    Attributes
    ----------
    hull : Hull or None
        None if reference surfaces were given.
    split : SurfaceSplit
        The hull's faces as top, bottom and rim.
    control : ControlMesh or None
        Tetrahedra in both spaces; unfolded z up is the top side.
    shell : ControlMesh or None
        Tetrahedra around the control mesh, for points outside; its vertices come first.
    surfaces : dict of SurfacePair
        ``top``, ``bottom`` and, for all methods but the thesis's, ``mid``.
    flattenings : dict of Flattening
        Every surface that was flattened.
    sheet : SheetResult or None
        Stages of the sheet method, if the method uses them.
    notes : dict
        Figures of the method for the summary.
    rule : Pointwise or None
        Map of a method without a control mesh.
    points : (n, 3) float or None
        The body's blocks if ``rule`` is set: points near them count as inside.
    warnings : tuple of str
        One sentence each.
    signs : Signs or None
        What the hull shows of the control mesh; None if there is no control mesh, or if it was not
        measured yet.
    spread : Spread or None
        How far other unfoldings of the body spread; None if the user did not choose to measure it.
    """

    hull: Hull | None
    split: SurfaceSplit
    control: ControlMesh | None
    shell: ControlMesh | None
    surfaces: dict[str, SurfacePair]
    flattenings: dict[str, Flattening]
    sheet: SheetResult | None
    notes: dict[str, object]
    rule: Pointwise | None = None
    points: Floats | None = None
    warnings: tuple[str, ...] = ()
    signs: Signs | None = None
    spread: Spread | None = None


@dataclass(frozen=True)
class Method:
    """A method of the table.

    Attributes
    ----------
    name : str
        Key in METHODS.
    fit : callable
        ``fit(body) -> BodyFit``.
    options : str
        Name of the field of UnfoldOptions that holds the method's options.
    control : bool
        Whether its map is a control mesh, which can be certified, saved and drawn.
    reach : float or None
        Distance from the control mesh, in blocks, up to which points are carried; None for the
        user's.  Set for methods without a shell whose mesh leaves blocks outside.
    hull : str
        Hull that ``auto`` selects.
    surfaces : bool
        Whether it accepts reference surfaces in place of a hull.
    flattens : bool
        Whether it uses the flattener.
    """

    name: str
    fit: Callable[[PreparedBody], BodyFit]
    options: str
    control: bool = True
    reach: float | None = None
    hull: str = "auto"
    surfaces: bool = True
    flattens: bool = True


def mean_top_normal(parts: SurfaceSplit) -> Floats:
    """Return the area-weighted sum of the top's normals, (3,), working units."""
    F = parts.mesh.F[parts.side > 0]
    area = triangle_areas(parts.mesh.V, F)
    out: Floats = (area[:, None] * face_normals(parts.mesh.V, F)).sum(axis=0)
    return out


def level(mesh: TriMesh, uv: Floats, z: float) -> TriMesh:
    """Return a mesh laid flat at a height."""
    return mesh.with_vertices(np.column_stack([uv, np.full(len(uv), z)]))


def by_rule(
    body: PreparedBody,
    sheet: SheetResult,
    rule: Pointwise,
    folded: Mapping[str, TriMesh],
    notes: dict[str, object],
    warnings: tuple[str, ...] = (),
) -> BodyFit:
    """Return the fit of a method that has a rule for single points and no control mesh.

    Parameters
    ----------
    body, sheet, rule, notes, warnings
        Fields of BodyFit.
    folded : mapping of TriMesh
        Surfaces by name, working units, which the rule lays flat.
    """
    return BodyFit(
        hull=body.hull,
        split=body.split,
        control=None,
        shell=None,
        surfaces={name: carried_pair(mesh, rule) for name, mesh in folded.items()},
        flattenings={},
        sheet=sheet,
        notes=notes,
        rule=rule,
        points=body.blocks,
        warnings=warnings,
    )


def carried_pair(folded: TriMesh, rule: Pointwise) -> SurfacePair:
    """Return a surface carried by a pointwise map, without the faces that have no image."""
    flat = rule.to_flat(folded.V).points
    there: Bools = np.asarray(np.isfinite(flat).all(axis=1))
    whole: Bools = np.asarray(there[folded.F].all(axis=1))
    part, old = folded.submesh(whole)
    return SurfacePair(part, part.with_vertices(flat[old]), None)
