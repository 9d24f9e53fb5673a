"""libigl: winding numbers, coherent orientation and unions of closed surfaces."""

from __future__ import annotations

import igl
import numpy as np

from geounfold.backends.checks import call_libigl, finite_array
from geounfold.errors import BackendError
from geounfold.geometry.mesh import Floats, Ints


class FastWinding:
    """The fast winding number of triangles, whose tree is built once.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles, closed or open.
    """

    def __init__(self, V: Floats, F: Ints) -> None:
        # Near the origin, because the tree's sums of far coordinates lose digits.
        self._origin = (V.min(axis=0) + V.max(axis=0)) / 2
        self._tree = igl.FastWindingNumberBVH()
        self._tree.init(
            np.ascontiguousarray(V - self._origin), np.ascontiguousarray(F, dtype=np.int64)
        )

    def __call__(self, Q: Floats) -> Floats:
        """Return the winding number at each query point, (k,).

        It is 1 inside a closed outward surface and 0 outside. Near an open one it is the share of
        the solid angle that the surface fills.
        """
        if not len(Q):
            return np.empty(0)
        query = np.ascontiguousarray(Q - self._origin)
        return finite_array(self._tree.winding_number(query), (len(Q),), "fast winding number")


def coherent(F: Ints) -> Ints:
    """Return triangles turned so that neighbours across edges of two triangles face alike."""
    turned = call_libigl("bfs_orient", igl.bfs_orient, np.ascontiguousarray(F, dtype=np.int64))
    return np.asarray(turned[0], dtype=np.int64)


def union_of_parts(V: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Return the border of what closed triangles enclose, without their crossings: (V, F).

    The arithmetic is exact (CGAL); corners are rounded to doubles at the end.

    Raises
    ------
    BackendError
        The triangles are not closed, or libigl failed.
    """
    from igl.copyleft import cgal

    none, no_faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    found = call_libigl(
        *("mesh_boolean", cgal.mesh_boolean),
        *(np.ascontiguousarray(V), np.ascontiguousarray(F), none, no_faces, "union"),
    )
    W, G = np.asarray(found[0], dtype=np.float64), np.asarray(found[1], dtype=np.int64)
    if not len(G) or not np.isfinite(W).all():
        raise BackendError("libigl's mesh_boolean returned no surface")
    return W, G
