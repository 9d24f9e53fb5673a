"""First guess of the mid surface: medial points below the top, laid flat for parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from geounfold.backends.igl import face_components, pinched_vertices
from geounfold.errors import SplitError
from geounfold.geometry import (
    face_normals,
    triangle_areas,
    unit,
    vertex_normals,
    vertex_sum,
)
from geounfold.mesh import Bools, Floats, Ints, TriMesh
from geounfold.sheet.normal import graph_laplacian, spd_solver
from geounfold.sheet.surface import near_any
from geounfold.split import SurfaceSplit


@dataclass(frozen=True, kw_only=True)
class MedialOptions:
    """How the trusted core and the parameter domain are cut out of the hull's top.

    Lengths in blocks.  ``parallel``: a core face and its opposite face, normals smoothed by
    ``sweeps`` bilateral passes, must satisfy -N.N' > parallel; ``closing``: width closed in
    that region; ``erosion``: distance kept from the rim; ``domain``: the flattened domain
    keeps any face farther than this many median thicknesses from the change of side.
    """

    parallel: float = 0.94
    sweeps: int = 6
    closing: float = 2.5
    erosion: float = 1.5
    domain: float = 1.2


@dataclass(frozen=True, eq=False)
class MedialSheet:
    """Medial points with parameters.

    Attributes
    ----------
    mesh : TriMesh
        Medial points, (n, 3), joined as the top's faces are.
    uv : (n, 2) float
        Isometric parameters, turned towards the working axes.
    half : (n,) float
        Half thickness.
    trusted : (n,) bool
        True on the core, where the half thickness was measured.
    core_faces : (m,) bool
        For every hull face: in the core.
    normals : (k, 3) float
        Smoothed outward normals of the hull's vertices.
    """

    mesh: TriMesh
    uv: Floats
    half: Floats
    trusted: Bools
    core_faces: Bools
    normals: Floats


def bilateral_normals(mesh: TriMesh, adjacency: Ints, sweeps: int) -> Floats:
    """Return face normals smoothed without blunting creases, (m, 3)."""
    N = face_normals(mesh.V, mesh.F)
    area = 2 * triangle_areas(mesh.V, mesh.F)
    own = np.arange(len(mesh.F))[:, None]
    near = np.where(adjacency >= 0, adjacency, own)
    for _ in range(sweeps):
        cos = np.einsum("ijk,ik->ij", N[near], N)
        weight = np.exp((cos - 1) / 0.12) * area[near]
        N = unit(N * area[:, None] + np.einsum("ij,ijk->ik", weight, N[near]))
    return N


def _core(
    split: SurfaceSplit, normals: Floats, centres: Floats, options: MedialOptions
) -> tuple[Bools, Bools]:
    """Return the trusted core and the faces away from the rim, (m,) each."""
    away = ~split.rim & ~near_any(centres, split.rim, options.erosion)
    seen = (split.opposite >= 0) & np.isfinite(split.thickness)
    other = normals[np.where(seen, split.opposite, 0)]
    cos = np.where(seen, -np.einsum("ij,ij->i", normals, other), 0.0)
    closed = near_any(centres, away & (cos > options.parallel), options.closing)
    return away & closed & ~near_any(centres, ~closed, options.closing), away


def _harmonic_half(
    split: SurfaceSplit, F: Ints, faces: Ints, core: Bools, n: int
) -> tuple[Floats, Bools]:
    """Return half the thickness per vertex, measured on the core, harmonic elsewhere."""
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
    options: MedialOptions,
) -> MedialSheet:
    """Return medial points of a split hull, half a thickness below the top, and parameters.

    Parameters
    ----------
    split : SurfaceSplit
        Hull in working units.
    flatten : callable
        ``flatten(mesh, start)`` -> uv (n, 2), an isometric flattening; start may be None.
    options : MedialOptions
        See there.

    Raises
    ------
    SplitError
        No top face has a parallel bottom opposite it.
    """
    mesh = split.mesh
    centres = mesh.V[mesh.F].mean(axis=1)
    normals = bilateral_normals(mesh, split.adjacency, options.sweeps)
    core, away = _core(split, normals, centres, options)
    top = (split.side > 0) & (away | _far_inside(split, centres, options.domain))
    if not top.any():
        raise SplitError("the split left no top away from the rim; try another --hull")
    faces = _one_sheet(mesh.F, np.flatnonzero(top))
    part, old = mesh.submesh(faces)
    half, trusted = _harmonic_half(split, part.F, faces, core, len(old))
    smooth = spd_solver(sp.eye_array(len(old)) + 2.0 * graph_laplacian(part.F, len(old)))
    inward = unit(smooth(vertex_normals(mesh.V, mesh.F)[old]))
    medial = TriMesh(part.V - half[:, None] * inward, part.F)
    uv = flatten(medial, None)
    area = triangle_areas(mesh.V, mesh.F)
    at_vertices = unit(vertex_sum(normals * area[:, None], mesh.F, len(mesh.V)))
    return MedialSheet(medial, _oriented(uv, medial.V), half, trusted, core, at_vertices)


def _one_sheet(F: Ints, faces: Ints) -> Ints:
    """Return the largest part of some faces that is a manifold surface.

    Faces around a vertex where two fans meet are left out.
    """
    while len(faces):
        component = face_components(F[faces])
        faces = faces[component == np.bincount(component).argmax()]
        pinched = pinched_vertices(F[faces])
        if not len(pinched):
            return faces
        faces = faces[~np.isin(F[faces], pinched).any(axis=1)]
    raise SplitError("the top is no surface: every part of it is pinched; try another --hull")


def _far_inside(split: SurfaceSplit, centres: Floats, domain: float) -> Bools:
    """Return the faces farther than some median thicknesses from the change of side."""
    near = np.where(split.adjacency >= 0, split.adjacency, np.arange(len(centres))[:, None])
    change = (split.side[near] != split.side[:, None]).any(axis=1)
    if not change.any():
        return np.ones(len(centres), dtype=bool)
    distance = cKDTree(centres[change]).query(centres)[0]
    return np.asarray(distance > domain * split.median_thickness)


def _oriented(uv: Floats, V: Floats) -> Floats:
    """Return parameters centred and turned, never mirrored, towards the working axes.

    Of the isometry of the plane nearest to the map uv -> V, the first working axis (the
    body's longest) has no component along the second parameter, and a positive one along the
    first: flat x runs where the folded body's first axis does.
    """
    centred = uv - uv.mean(axis=0)
    left, _, right = np.linalg.svd((V - V.mean(axis=0)).T @ centred, full_matrices=False)
    x = (left @ right)[0]
    length = float(np.linalg.norm(x))
    cos, sin = x / length if length > 1e-6 else np.array([1.0, 0.0])
    out: Floats = centred @ np.array([[cos, -sin], [sin, cos]])
    return out
