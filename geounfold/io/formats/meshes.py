"""PLY, OBJ, OFF and STL: read by MeshLab, written here.

PLY, OBJ and OFF keep every bit of a coordinate. STL holds single precision, in which coordinates of
millions are off by a quarter of a unit. It has no vertex numbers; MeshLab merges equal corners into
one vertex.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geounfold.errors import InputError
from geounfold.io.formats.meshcheck import checked_vertices
from geounfold.io.formats.registry import Surface


def read_surface(path: Path) -> Surface:
    """Return a mesh file's vertices and faces; polygons are cut into triangles.

    Raises
    ------
    BackendError, InputError
        The file is damaged.
    """
    from geounfold.backends import meshlab

    count = checked_vertices(path)
    V, F = meshlab.read_mesh(path)
    if count is not None and len(V) != count:
        raise InputError(
            f"{path}: is not a surface: it counts {count} vertices, but {len(V)} can be used; "
            "check that all coordinates are finite numbers"
        )
    return Surface(V, F)


def write_surface(path: Path, surface: Surface) -> None:
    """Write a mesh in the format of the path's ending; PLY and STL are binary, little-endian."""
    writers = {".ply": _ply, ".obj": _obj, ".off": _off, ".stl": _stl}
    path.write_bytes(writers[path.suffix.lower()](surface))


def _ply(surface: Surface) -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(surface.V)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(surface.F)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(surface.F), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, surface.F
    return head.encode() + surface.V.astype("<f8").tobytes() + faces.tobytes()


def _obj(surface: Surface) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.V.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (surface.F + 1).tolist()]
    return "\n".join([*lines, ""]).encode()


def _off(surface: Surface) -> bytes:
    lines = ["OFF", f"{len(surface.V)} {len(surface.F)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in surface.V.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in surface.F.tolist()]
    return "\n".join([*lines, ""]).encode()


def _stl(surface: Surface) -> bytes:
    kind = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    facets = np.zeros(len(surface.F), dtype=kind)
    corners = surface.V[surface.F]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    facets["normal"] = normal / np.where(size > 0, size, 1.0)
    facets["corners"] = corners
    return b"geounfold".ljust(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
