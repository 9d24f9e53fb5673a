"""Fit one body: hull, split, control mesh by the chosen method; all in working units."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from geounfold.control import ControlMesh
from geounfold.errors import OptionError
from geounfold.flattening import Flattening, flatten
from geounfold.frame import Frame
from geounfold.geometry import face_normals, triangle_areas
from geounfold.hull import Hull, extract_hull
from geounfold.mesh import Floats, Space, TriMesh, in_space
from geounfold.options import UnfoldOptions
from geounfold.reference import split_reference
from geounfold.sheet import SheetResult, fit_body
from geounfold.split import SurfaceSplit, split
from geounfold.thesis import thesis_control

if TYPE_CHECKING:
    import pyvista

Stage = Callable[[str], AbstractContextManager[None]]
"""``with stage("hull"):`` times a stage and shows its name."""


_OTHER_SIDE = {"top": "bottom", "bottom": "top"}


@dataclass(frozen=True, eq=False)
class SurfacePair:
    """A reference surface in both spaces, and how it was flattened."""

    folded: TriMesh
    unfolded: TriMesh
    flattening: Flattening

    def to_pyvista(self, space: Space = "folded") -> pyvista.PolyData:
        """Return the surface in one space for pyvista.

        The point data of the other space's name, (n, 3), holds where each vertex lies there.
        """
        here, there, other = in_space(space, self.folded, self.unfolded)
        surface = here.to_pyvista()
        surface.point_data[other] = there.to_pyvista().points
        return surface


@dataclass(frozen=True, eq=False)
class BodyFit:
    """Everything made of one body, working units.

    Attributes
    ----------
    hull : Hull or None
        None where reference surfaces were given.
    split : SurfaceSplit
        The hull's faces as top, bottom and rim.
    control : ControlMesh
        Tetrahedra in both spaces; unfolded z up is the top side.
    shell : ControlMesh or None
        Tetrahedra around them, for points outside; over the control mesh's vertices and others.
    surfaces : dict of SurfacePair
        ``top``, ``bottom`` and, for the sheet method, ``mid``.
    flattenings : dict of Flattening
        Every surface that was flattened.
    sheet : SheetResult or None
        The sheet method's stages.
    notes : dict
        Figures of the method for the summary.
    """

    hull: Hull | None
    split: SurfaceSplit
    control: ControlMesh
    shell: ControlMesh | None
    surfaces: dict[str, SurfacePair]
    flattenings: dict[str, Flattening]
    sheet: SheetResult | None
    notes: dict[str, object]


def fit(
    points: Floats,
    blocks: Floats,
    frame: Frame,
    options: UnfoldOptions,
    reference: tuple[TriMesh, TriMesh] | None,
    stage: Stage,
) -> BodyFit:
    """Return the fit of one body.

    Parameters
    ----------
    points : (n, 3) float
        What the body is fitted to, working units: its blocks moved onto their lattice, sub-blocks
        and gaps filled.
    blocks : (b, 3) float
        Its blocks as they were given, which the control mesh has to hold.
    frame : Frame
        Working frame.
    options : UnfoldOptions
        See there.
    reference : (TriMesh, TriMesh) or None
        Top and bottom given by the user, working units.
    stage : callable
        See Stage.

    Raises
    ------
    HullError, NoSheetError, SplitError, FlatteningError
        As the stages do.
    """
    hull = None
    if reference is None:
        with stage("hull"):
            method = options.hull
            if options.method == "thesis" and method == "auto":
                method = "alpha"
            hull = extract_hull(points, frame.sides, method, options.hull_options)
        with stage("split"):
            parts = split(hull.mesh, options.split)
    else:
        with stage("split"):
            parts = split_reference(*reference)
    over = top_looks_down(parts, frame.up_in_work(options.up))
    if options.method == "thesis":
        result = _fit_thesis(points, hull, parts, options, stage)
    else:
        datum = _OTHER_SIDE.get(options.datum, options.datum) if over else options.datum
        result = _fit_sheet(points, blocks, frame, hull, parts, options, datum, stage)
    if over:
        result = _turned_over(result)
    return result


def _flattener(options: UnfoldOptions) -> Callable[[TriMesh, Floats | None], Flattening]:
    """Return the chosen flattener; a start is passed on where the method uses one."""

    def run(mesh: TriMesh, start: Floats | None) -> Flattening:
        # As it comes: the sheet tries nearer surfaces where one folds over.
        return flatten(mesh, options.flattener, start=start, repair=False)

    return run


def _fit_sheet(
    points: Floats,
    blocks: Floats,
    frame: Frame,
    hull: Hull | None,
    parts: SurfaceSplit,
    options: UnfoldOptions,
    datum: str,
    stage: Stage,
) -> BodyFit:
    variance = np.zeros(3) if hull is None else hull.blur_variance(frame.sides)
    inset = 0.0 if hull is None else hull.inset
    with stage("sheet"):
        result = fit_body(
            parts,
            points,
            blocks,
            frame.steps,
            variance,
            inset,
            _flattener(options),
            replace(
                options.sheet_options,
                control=replace(options.sheet_options.control, shell=options.reach),
            ),
            datum,
            exact=hull is None,
        )
    mesh = result.mesh
    surfaces = {
        name: SurfacePair(folded, unfolded, mesh.flattenings[name])
        for name, (folded, unfolded) in mesh.surfaces.items()
    }
    notes = {
        "rung": mesh.rungs[-1].name,
        "rungs": [asdict(rung) for rung in mesh.rungs],
        "roughness": result.fitted.roughness,
        "smoothing": result.fitted.smoothing,
        "accepted_samples": result.fitted.accepted,
        "sharpened": result.sharpened,
        "layers_follow": {0.0: "mid", 1.0: "top", -1.0: "bottom"}[result.fitted.lean],
    }
    return BodyFit(hull, parts, mesh.control, mesh.shell, surfaces, mesh.flattenings, result, notes)


def _fit_thesis(
    points: Floats, hull: Hull | None, parts: SurfaceSplit, options: UnfoldOptions, stage: Stage
) -> BodyFit:
    """Fit by the thesis's method; both its sheets are flat, whatever the datum."""
    if hull is None:
        raise OptionError(
            "--method thesis takes its surfaces from the hull; leave out --top and --bottom, "
            "or use --method sheet"
        )
    chosen = replace(options.thesis_options, flattener=options.flattener)
    with stage("thesis"):
        up = mean_top_normal(parts)
        mesh = thesis_control(points, hull.mesh, up, chosen, hull.inset)
    sides = {"top": (mesh.top, mesh.top_flat, 0.5), "bottom": (mesh.bottom, mesh.bottom_flat, -0.5)}
    surfaces = {
        name: SurfacePair(folded, _level(folded, flat.uv, share * mesh.thickness), flat)
        for name, (folded, flat, share) in sides.items()
    }
    flattenings = {name: flat for name, (_, flat, _) in sides.items()}
    notes: dict[str, object] = {
        name: getattr(mesh, name)
        for name in ("thickness", "bottom_missed", "top_missed", "extended", "squeezed", "steep")
    }
    return BodyFit(hull, parts, mesh.control, None, surfaces, flattenings, None, notes)


def _level(mesh: TriMesh, uv: Floats, z: float) -> TriMesh:
    """Return a mesh laid flat at a height."""
    return mesh.with_vertices(np.column_stack([uv, np.full(len(uv), z)]))


def mean_top_normal(parts: SurfaceSplit) -> Floats:
    """Return the area-weighted sum of the top's normals, (3,), working units."""
    F = parts.mesh.F[parts.side > 0]
    area = triangle_areas(parts.mesh.V, F)
    out: Floats = (area[:, None] * face_normals(parts.mesh.V, F)).sum(axis=0)
    return out


def top_looks_down(parts: SurfaceSplit, up: Floats) -> bool:
    """Return whether the split's top side looks away from up, (3,) in working units.

    Decided once for the whole sheet by the area-weighted normals of its top; a sheet whose
    mean normal is square to up (within 3 degrees) keeps the top the split chose.
    """
    mean = mean_top_normal(parts)
    return bool(mean @ up < -0.05 * float(np.linalg.norm(mean)))


def _over(V: Floats) -> Floats:
    out: Floats = V * np.array([1.0, -1.0, -1.0])
    return out


def _over_control(control: ControlMesh) -> ControlMesh:
    return ControlMesh(
        control.folded,
        control.unfolded.with_vertices(_over(control.unfolded.V)),
        1 - control.stratigraphic,
    )


def _turned_over(result: BodyFit) -> BodyFit:
    """Return the fit with top and bottom exchanged: the flat space turned about its x axis."""
    shell = None if result.shell is None else _over_control(result.shell)
    surfaces = {
        _OTHER_SIDE.get(name, name): SurfacePair(
            pair.folded, pair.unfolded.with_vertices(_over(pair.unfolded.V)), pair.flattening
        )
        for name, pair in result.surfaces.items()
    }
    flattenings = {_OTHER_SIDE.get(name, name): f for name, f in result.flattenings.items()}
    parts = result.split
    notes = dict(result.notes)
    if "layers_follow" in notes:
        notes["layers_follow"] = _OTHER_SIDE.get(str(notes["layers_follow"]), "mid")
    turned = replace(parts, side=-parts.side, flipped_up=not parts.flipped_up)
    return BodyFit(
        result.hull,
        turned,
        _over_control(result.control),
        shell,
        surfaces,
        flattenings,
        result.sheet,
        notes,
    )
