"""MeshLab's filters: remeshing and surface reconstruction.

pymeshlab is slow to import, so it is imported on first use. Each call names every parameter,
because a parameter that is left out keeps its value from the filter's previous call in the process
instead of its documented default.
"""

from __future__ import annotations

import sys
from os import PathLike, fspath
from typing import Any

import numpy as np

from geounfold.backends.system.console import answers_kept_clean
from geounfold.errors import BackendError, MissingDependencyError
from geounfold.geometry.mesh import Floats, Ints

# MeshLab's messages after it left out a plugin on import, because a system library is missing.
_ABSENT = ("Filter does not exists", "Unknown format")
_CURE = "install OpenGL (Debian and Ubuntu: apt-get install libgl1 libopengl0)"


def _pymeshlab() -> Any:
    if (loaded := sys.modules.get("pymeshlab")) is not None:
        return loaded
    try:
        with answers_kept_clean():  # it prints the names of plugins that lack a system library
            import pymeshlab
    except ImportError as error:
        raise MissingDependencyError(
            f"pymeshlab cannot be loaded ({error}); pip install pymeshlab, or if it names a "
            f"system library, {_CURE}"
        ) from error
    return pymeshlab


def _mesh_set(V: Floats, F: Ints | None = None, normals: Floats | None = None) -> Any:
    ml = _pymeshlab()
    parts: dict[str, Any] = {"vertex_matrix": np.ascontiguousarray(V, dtype=np.float64)}
    if F is not None:
        parts["face_matrix"] = np.ascontiguousarray(F, dtype=np.int32)
    if normals is not None:
        parts["v_normals_matrix"] = np.ascontiguousarray(normals, dtype=np.float64)
    meshes = ml.MeshSet(verbose=False)
    try:
        meshes.add_mesh(ml.Mesh(**parts))
    except ml.PyMeshLabException as error:
        raise BackendError(f"MeshLab cannot take the surface: {_one_line(error)}") from error
    return meshes


def _apply(meshes: Any, name: str, **options: Any) -> None:
    ml = _pymeshlab()
    try:
        meshes.apply_filter(name, **options)
    except ml.PyMeshLabException as error:
        if _ABSENT[0] in str(error):
            raise MissingDependencyError(f"MeshLab's {name} cannot be loaded: {_CURE}") from error
        raise BackendError(f"MeshLab's {name} failed: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _arrays(meshes: Any) -> tuple[Floats, Ints]:
    mesh = meshes.current_mesh()
    V = np.array(mesh.vertex_matrix(), dtype=np.float64)
    return V, np.array(mesh.face_matrix(), dtype=np.int64)


def remesh(V: Floats, F: Ints, length: float, iterations: int) -> tuple[Floats, Ints]:
    """Return an isotropic triangulation of a surface with edges of about ``length``."""
    exact = _pymeshlab().PureValue
    meshes = _mesh_set(V, F)
    _apply(
        meshes,
        "meshing_isotropic_explicit_remeshing",
        iterations=iterations,
        adaptive=False,
        selectedonly=False,
        targetlen=exact(length),
        featuredeg=30.0,
        checksurfdist=False,
        maxsurfdist=exact(length),
        splitflag=True,
        collapseflag=True,
        swapflag=True,
        smoothflag=True,
        reprojectflag=True,
    )
    return _arrays(meshes)


def taubin(V: Floats, F: Ints, steps: int) -> Floats:
    """Return the vertices smoothed by Taubin's shrinking and swelling steps, at equal volume."""
    meshes = _mesh_set(V, F)
    _apply(
        meshes,
        "apply_coord_taubin_smoothing",
        lambda_=0.5,
        mu=-0.53,
        stepsmoothnum=steps,
        selected=False,
    )
    return _arrays(meshes)[0]


def ball_pivoting(points: Floats, normals: Floats, radius: float) -> tuple[Floats, Ints]:
    """Return the triangles of points on which a ball of the given radius rests."""
    meshes = _mesh_set(points, normals=normals)
    _apply(
        meshes,
        "generate_surface_reconstruction_ball_pivoting",
        ballradius=_pymeshlab().PureValue(radius),
        clustering=20.0,
        creasethr=90.0,
        deletefaces=False,
    )
    return _arrays(meshes)


def poisson(points: Floats, normals: Floats, depth: int) -> tuple[Floats, Ints]:
    """Return the screened Poisson surface of oriented points, on an octree of given depth."""
    meshes = _mesh_set(points, normals=normals)
    _apply(
        meshes,
        "generate_surface_reconstruction_screened_poisson",
        visiblelayer=False,
        depth=depth,
        fulldepth=min(5, depth),
        cgdepth=0,
        scale=1.1,
        samplespernode=1.5,
        pointweight=4.0,
        iters=8,
        confidence=False,
        preclean=False,
        threads=1,
    )
    return _arrays(meshes)


def repair_manifold(V: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Return the surface without faces at non-manifold edges, vertices of several fans split."""
    meshes = _mesh_set(V, F)
    _apply(meshes, "meshing_remove_duplicate_faces")
    _apply(meshes, "meshing_remove_null_faces")
    _apply(meshes, "meshing_repair_non_manifold_edges", method="Remove Faces")
    _apply(meshes, "meshing_repair_non_manifold_vertices", vertdispratio=0.0)
    _apply(meshes, "meshing_remove_unreferenced_vertices")
    return _arrays(meshes)


def close_holes(V: Floats, F: Ints, edges: int) -> tuple[Floats, Ints]:
    """Return the surface with the holes closed that have at most the given number of edges."""
    meshes = _mesh_set(V, F)
    _apply(
        meshes,
        "meshing_close_holes",
        maxholesize=edges,
        selected=False,
        newfaceselected=False,
        selfintersection=False,
        refinehole=False,
        refineholeedgelen=_pymeshlab().PureValue(1.5),
    )
    return _arrays(meshes)


def orient_coherently(V: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Return the surface with faces oriented alike, all outwards or all inwards."""
    meshes = _mesh_set(V, F)
    _apply(meshes, "meshing_re_orient_faces_coherently")
    return _arrays(meshes)


def read_mesh(path: str | PathLike[str]) -> tuple[Floats, Ints]:
    """Return vertices (n, 3) and faces (m, 3) of a mesh file, polygons cut into triangles.

    The file's ending selects the format. Coordinates keep double precision if the file has it.

    Raises
    ------
    BackendError
        The file is damaged.
    MissingDependencyError
        MeshLab does not know the format. It knows none if its library of formats is not loaded.
    """
    ml = _pymeshlab()
    meshes = ml.MeshSet(verbose=False)
    try:
        meshes.load_new_mesh(fspath(path))
    except ml.PyMeshLabException as error:
        if _ABSENT[1] in str(error):
            raise MissingDependencyError(
                f"MeshLab cannot read {fspath(path)}: its readers cannot be loaded; {_CURE}"
            ) from error
        details = _one_line(error).rpartition("Error details:")[2]
        raise BackendError(f"MeshLab cannot read it: {details.strip()}") from error
    return _arrays(meshes)
