"""Meshes that other meshers make of the control mesh's border, and figures that compare them."""

from __future__ import annotations

import time
from importlib.util import find_spec

import numpy as np

from geounfold.backends.igl import SurfaceIndex
from geounfold.backends.own_process import call_apart
from geounfold.comparison.crosscheck._options import MESHERS, CrossCheckOptions
from geounfold.comparison.crosscheck._result import MeshFigures
from geounfold.errors import BackendError, MissingDependencyError
from geounfold.extras import check as check_library
from geounfold.geometry.measures import boundary_faces, enclosed_volume, tet_volumes, unique_edges
from geounfold.geometry.mesh import Floats, TetMesh, TriMesh
from geounfold.geometry.tet_shapes import dihedral_angles, radius_ratios


def border(mesh: TetMesh) -> TriMesh:
    """Return a mesh's boundary faces, oriented outward, with all vertices of the mesh."""
    return TriMesh(mesh.V, boundary_faces(mesh.T)[0])


def without_unused(mesh: TetMesh) -> TetMesh:
    """Return a mesh without vertices that belong to no tetrahedron; no rule could move those."""
    used, T = np.unique(mesh.T, return_inverse=True)
    return TetMesh(mesh.V[used], T.reshape(-1, 4))


def fill(name: str, surface: TriMesh, options: CrossCheckOptions) -> tuple[TetMesh, float]:
    """Return a mesher's tetrahedra inside a closed surface, and its wall time in seconds.

    Raises
    ------
    MissingDependencyError
        The mesher is not installed.
    BackendError
        The mesher failed, crashed, took too long or returned no valid mesh.
    """
    if find_spec(MESHERS[name]) is None:
        raise MissingDependencyError(
            f"{name} is not installed: pip install 'geounfold[tetgen]'"
            if name == "tetgen"
            else f"{name} is not installed: pip install {MESHERS[name]}"
        )
    check_library("pyvista", f"meshes of {name}")  # both packages import it, and declare it not
    tight, _ = surface.submesh(np.arange(len(surface.F)))
    arguments: dict[str, np.ndarray | float] = {"V": tight.V, "F": tight.F, "edge": options.edge}
    if name == "tetwild":
        arguments["envelope"] = options.envelope
    started = time.perf_counter()
    function = f"geounfold.backends.{name}:tetrahedralize"
    V, T = call_apart(name, function, arguments, options.seconds)
    if not len(T):
        raise BackendError(f"{name} made no tetrahedron inside the border")
    return TetMesh(V, T), time.perf_counter() - started


def figures(
    name: str, mesh: TetMesh, surface: TriMesh, scale: float, seconds: float
) -> MeshFigures:
    """Return the figures of a mesh that fills a surface.

    Parameters
    ----------
    name : str
        The mesher, or ``prism``.
    mesh : TetMesh
        The mesh, in working units.
    surface : TriMesh
        The control mesh's border, closed, in working units.
    scale : float
        Length of the working unit in the input's unit.
    seconds : float
        Wall time of the mesher.
    """
    own, volumes = border(mesh), tet_volumes(mesh.V, mesh.T)
    angles, ratios = dihedral_angles(mesh.V, mesh.T), radius_ratios(mesh.V, mesh.T)
    low, middle, high = np.percentile(angles, [5, 50, 95])
    low_ratio, middle_ratio = np.percentile(ratios, [5, 50])
    cube = scale**3
    return MeshFigures(
        mesh=name,
        vertices=len(mesh.V),
        tetrahedra=len(mesh.T),
        boundary_faces=len(own.F),
        inverted=int(np.count_nonzero(volumes <= 0)),
        volume=float(volumes.sum()) * cube,
        boundary_volume=enclosed_volume(own.V, own.F) * cube,
        volume_difference=float(volumes.sum()) / enclosed_volume(surface.V, surface.F) - 1,
        hausdorff_to=farthest(own, surface),
        hausdorff_from=farthest(surface, own),
        dihedral_min=float(angles.min()),
        dihedral_p05=float(low),
        dihedral_median=float(middle),
        dihedral_p95=float(high),
        dihedral_max=float(angles.max()),
        radius_ratio_min=float(ratios.min()),
        radius_ratio_p05=float(low_ratio),
        radius_ratio_median=float(middle_ratio),
        seconds=seconds,
    )


def farthest(one: TriMesh, other: TriMesh) -> float:
    """Return the largest distance from one surface to another (one-sided Hausdorff distance).

    The distance is measured at vertices and at midpoints of edges and faces.  It is too small by
    at most the spacing of these points, a third of an edge.
    """
    index = SurfaceIndex(other.V, other.F)
    return float(index.closest(_places(one))[0].max())


def _places(surface: TriMesh) -> Floats:
    """Return a surface's vertices and the midpoints of its edges and faces."""
    E, V = unique_edges(surface.F), surface.V
    used = np.unique(surface.F)
    return np.concatenate([V[used], V[E].mean(axis=1), V[surface.F].mean(axis=1)])
