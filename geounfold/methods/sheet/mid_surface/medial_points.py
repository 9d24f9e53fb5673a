"""First guess of the mid surface: medial points below the top, laid flat for parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geounfold.backends.igl import boundary_loops, face_components, pinched_vertices
from geounfold.errors import NoSheetError, SplitError
from geounfold.geometry.measures import (
    bilateral_normals,
    loop_turning,
    triangle_areas,
    unique_edges,
    unit,
    vertex_normals,
    vertex_sum,
)
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.methods.sheet.mid_surface.normal_equations import graph_laplacian, spd_solver
from geounfold.methods.sheet.mid_surface.surface import near_any
from geounfold.surfaces.split.faces import THICKEST
from geounfold.surfaces.split.result import SurfaceSplit

CORE = 0.94
"""Least cosine between the normal of a face of the core and the reversed normal opposite it."""

_SWEEPS = 6
"""Number of bilateral passes that smooth the face normals before they are compared."""

_CLOSING = 2.5
"""Width of gaps that are closed in the core, in blocks."""

_ISLAND = 0.05
"""Least share of the core's largest part that another part must have to be kept.

The tip of an oblique cut may be parallel to the other side by chance.
"""

_EROSION = 1.5
"""Distance of the core from the rim, in blocks; halved, then set to 0, if little would be left."""

_DEEP = 1.2
"""Distance from the change of side, in median thicknesses, beyond which a face is kept."""

_FAIR = 0.5
"""Least share of a side's area that is laid flat before the distance from the rim is reduced."""

_MORE_COMPLETE = 0.2
"""Share of its area by which the bottom must be more complete to replace the top."""


@dataclass(frozen=True, eq=False)
class MedialSheet:
    """Medial points with parameters.

    Attributes
    ----------
    mesh : TriMesh
        Medial points, (n, 3), with the faces of the top.
    uv : (n, 2) float
        Isometric parameters, turned towards the working axes.
    half : (n,) float
        Half thickness.
    trusted : (n,) bool
        True on the core, where the half thickness was measured.
    core_faces : (m,) bool
        Whether each face of the hull is in the core.
    normals : (k, 3) float
        Smoothed outward normals of the hull's vertices.
    """

    mesh: TriMesh
    uv: Floats
    half: Floats
    trusted: Bools
    core_faces: Bools
    normals: Floats

    def scaled(self, factor: float) -> MedialSheet:
        """Return the medial points in another unit: lengths times a factor."""
        mesh = self.mesh.with_vertices(self.mesh.V * factor)
        return replace(self, mesh=mesh, uv=self.uv * factor, half=self.half * factor)


_SHORT = 0.25
"""Share of the longest boundary loop's length up to which a loop is a hole, however it turns.

Every loop of a tube runs around it, so its two ends are about as long as each other. Rough holes
of a few faces turn by anything. Measured: 0.01 in a fold whose hinge has one, 1.0 in a tube.
"""


def _check_open(mesh: TriMesh) -> None:
    """Raise NoSheetError if a surface closes on itself like a tube, or has handles.

    A pierced sheet has several boundary loops too, but its outer loop turns by about 2 pi.  If a
    surface is closed around an axis, every loop runs around the axis and turns by about 0.

    Parameters
    ----------
    mesh : TriMesh
        Connected faces of one side of the hull.  Medial points do not serve: they crumple at tight
        hinges, so that their loops turn by anything.
    """
    loops = boundary_loops(mesh.F)
    _check_handles(mesh, len(loops))
    if len(loops) == 1:
        return
    length = np.array([_length(mesh.V[loop]) for loop in loops])
    long = [loop for loop, own in zip(loops, length, strict=True) if own > _SHORT * length.max()]
    if len(long) == 1:
        return
    if loops and max(loop_turning(mesh.V, mesh.F, loop) for loop in long) > np.pi:
        return
    what = "around an axis" if loops else "on all sides"
    raise NoSheetError(
        f"the layer closes on itself {what}, so it has no flat image without a cut; leave out a "
        "row of blocks along a cut, or unfold its parts one by one"
    )


def _check_handles(mesh: TriMesh, loops: int) -> None:
    """Raise NoSheetError if a connected surface with some boundary loops has handles."""
    euler = len(mesh.V) - len(unique_edges(mesh.F)) + len(mesh.F)
    handles = (2 - loops - euler) // 2
    if loops and handles > 0:
        raise NoSheetError(
            f"the top of the layer has {handles} handle(s): bridges join parts of the body, or "
            "waste pierces it; model the domain with a smoother boundary, or leave out the "
            "blocks of the bridges"
        )


def _length(loop: Floats) -> float:
    """Return the length of a closed polyline (k, 3)."""
    return float(np.linalg.norm(loop - np.roll(loop, 1, axis=0), axis=1).sum())


@dataclass(frozen=True, eq=False)
class _Domain:
    """Faces of one side (the top if ``top``) to lay flat; their ``share`` of the side's area."""

    faces: Ints
    top: bool
    share: float


def _regions(
    split: SurfaceSplit, normals: Floats, centres: Floats, least: float
) -> tuple[Bools, Ints, bool]:
    """Return the trusted core (m,), the faces to lay flat, and whether they are the top's.

    Most of a narrow strip lies near its rim.  So the distance from the rim is reduced until the
    faces are at least the share `_FAIR` of their side.
    """
    area = triangle_areas(split.mesh.V, split.mesh.F)
    deep = _far_inside(split, centres)
    for erosion in (_EROSION, _EROSION / 2, 0.0):
        core, away = _core(split, normals, centres, erosion, least)
        domain = _domain(split, (away | deep) & ~split.beyond, area)
        if domain is not None and domain.share > _FAIR:
            return core, domain.faces, domain.top
    whole = _domain(split, ~split.beyond, area)
    if domain is None or (whole is not None and whole.share > 2 * domain.share):
        domain = whole
    if domain is None:
        raise SplitError("the split left no top away from the rim; try another --hull")
    return core, domain.faces, domain.top


def _core(
    split: SurfaceSplit, normals: Floats, centres: Floats, erosion: float, least: float
) -> tuple[Bools, Bools]:
    """Return the trusted core and the faces away from the rim, (m,) each."""
    away = ~split.rim & ~near_any(centres, split.rim, erosion) if erosion else ~split.rim
    seen = (split.opposite >= 0) & np.isfinite(split.thickness)
    other = normals[np.where(seen, split.opposite, 0)]
    cos = np.where(seen, -np.einsum("ij,ij->i", normals, other), 0.0)
    closed = near_any(centres, away & (cos > least), _CLOSING)
    core = away & closed & ~near_any(centres, ~closed, _CLOSING)
    return _large_parts(core, split.adjacency), away


def _large_parts(faces: Bools, adjacency: Ints) -> Bools:
    """Return faces (m,) without connected parts much smaller than the largest (`_ISLAND`)."""
    n = len(faces)
    row, column = np.repeat(np.arange(n), 3), adjacency.ravel()
    links = faces[row] & (column >= 0) & faces[column]
    graph = sp.coo_array((np.ones(links.sum()), (row[links], column[links])), (n, n))
    part = connected_components(graph, directed=False)[1]
    size = np.bincount(part, faces)
    out: Bools = faces & (size >= _ISLAND * size.max())[part]
    return out


def _harmonic_half(
    split: SurfaceSplit, F: Ints, faces: Ints, core: Bools, n: int
) -> tuple[Floats, Bools]:
    """Return the half thickness per vertex: measured on the core, harmonic elsewhere."""
    good = core[faces] & np.isfinite(split.thickness[faces])
    value = np.where(good, split.thickness[faces] / 2, 0.0)
    count = vertex_sum(good.astype(float), F, n)
    trusted = count > 0
    if not trusted.any():
        raise SplitError(
            "no part of the top has a parallel bottom opposite it; "
            "the body may be no sheet: try --split normal or another --hull"
        )
    mean = vertex_sum(value, F, n) / np.maximum(count, 1)
    L = graph_laplacian(F, n)
    K = sp.diags_array(trusted.astype(float)) + 2.0 * L + 1e-9 * sp.eye_array(n)
    return spd_solver(K)(mean), trusted


def medial_sheet(
    split: SurfaceSplit,
    flatten: Callable[[TriMesh, Floats | None], Floats],
    core: float = CORE,
) -> MedialSheet:
    """Return the medial points of a split hull, half a thickness below the top, and parameters.

    Parameters
    ----------
    split : SurfaceSplit
        Hull in working units.
    flatten : callable
        ``flatten(mesh, start)`` returns an isometric flattening, (n, 2); start may be None.
    core : float
        Least cosine between a core face's normal and the reversed normal of its opposite face.

    Raises
    ------
    SplitError
        No top face has a parallel bottom opposite it.
    NoSheetError
        The top closes on itself.
    """
    mesh = split.mesh
    centres = mesh.V[mesh.F].mean(axis=1)
    normals = bilateral_normals(mesh, split.adjacency, _SWEEPS)
    trusted_faces, faces, outward = _regions(split, normals, centres, core)
    part, old = mesh.submesh(faces)
    half, trusted = _harmonic_half(split, part.F, faces, trusted_faces, len(old))
    smooth = spd_solver(sp.eye_array(len(old)) + 2.0 * graph_laplacian(part.F, len(old)))
    inward = unit(smooth(vertex_normals(mesh.V, mesh.F)[old]))
    medial = TriMesh(part.V - half[:, None] * inward, part.F if outward else part.F[:, ::-1])
    _check_open(part)
    uv = flatten(medial, None)
    area = triangle_areas(mesh.V, mesh.F)
    at_vertices = unit(vertex_sum(normals * area[:, None], mesh.F, len(mesh.V)))
    return MedialSheet(medial, _oriented(uv, medial.V), half, trusted, trusted_faces, at_vertices)


def _domain(split: SurfaceSplit, inside: Bools, area: Floats) -> _Domain | None:
    """Return the faces inside that are laid flat; None if there are none.

    The top's, unless the largest part of the bottom is more complete by `_MORE_COMPLETE`: on the
    inside of a tight hinge a side may be almost hidden.
    """
    found = []
    for side in (1, -1):
        mine = split.side == side
        if (mine & inside).any():
            faces = _one_sheet(split.mesh.F, np.flatnonzero(mine & inside))
            share = float(area[faces].sum() / area[mine & ~split.beyond].sum())
            found.append(_Domain(faces, side > 0, share))
    if len(found) == 2 and found[1].share > found[0].share + _MORE_COMPLETE:
        return found[1]
    return found[0] if found else None


def _one_sheet(F: Ints, faces: Ints) -> Ints:
    """Return the largest part of some faces that is a manifold surface.

    Faces around a vertex at which two fans meet are left out.
    """
    while len(faces):
        component = face_components(F[faces])
        faces = faces[component == np.bincount(component).argmax()]
        pinched = pinched_vertices(F[faces])
        if not len(pinched):
            return faces
        faces = faces[~np.isin(F[faces], pinched).any(axis=1)]
    raise SplitError("the top is no surface: every part of it is pinched; try another --hull")


def _far_inside(split: SurfaceSplit, centres: Floats) -> Bools:
    """Return the faces farther than `_DEEP` median thicknesses from the change of side.

    Faces whose ray missed the other side are excluded: at the ends of limbs that meet, normals
    point along the limbs.
    """
    near = np.where(split.adjacency >= 0, split.adjacency, np.arange(len(centres))[:, None])
    change = (split.side[near] != split.side[:, None]).any(axis=1)
    if not change.any():
        return np.ones(len(centres), dtype=bool)
    distance = cKDTree(centres[change]).query(centres)[0]
    near_side = split.thickness <= THICKEST * split.median_thickness
    return np.asarray(near_side & (distance > _DEEP * split.median_thickness))


def _oriented(uv: Floats, V: Floats) -> Floats:
    """Return parameters centred and turned, never mirrored, towards the working axes.

    Flat x points along the folded body's first (longest) axis: in the isometry of the plane nearest
    to the map uv -> V, that axis has a positive component along the first parameter and none along
    the second.
    """
    centred = uv - uv.mean(axis=0)
    left, _, right = np.linalg.svd((V - V.mean(axis=0)).T @ centred, full_matrices=False)
    x = (left @ right)[0]
    length = float(np.linalg.norm(x))
    cos, sin = x / length if length > 1e-6 else np.array([1.0, 0.0])
    out: Floats = centred @ np.array([[cos, -sin], [sin, cos]])
    return out
