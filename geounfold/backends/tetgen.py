"""TetGen (Si 2015): constrained Delaunay tetrahedra over a surface's own triangles.

TetGen's licence is AGPL, so it is no dependency: the extra ``tetgen`` installs it. It is imported
on first use, in a process of its own (see `own_process`).
"""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Floats, Ints


def tetrahedralize(V: Floats, F: Ints, edge: float, ratio: float = 1.5) -> tuple[Floats, Ints]:
    """Return right-handed tetrahedra (V, T) that fill a closed surface and keep its triangles.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles, outward.
    edge : float
        Length of edges in the vertices' unit; no tetrahedron is larger than a regular one of it.
    ratio : float, optional
        Largest ratio of circumradius to shortest edge that TetGen aims at.
    """
    import tetgen

    mesh = tetgen.TetGen(
        np.ascontiguousarray(V, dtype=np.float64), np.ascontiguousarray(F, dtype=np.int32)
    )
    vertices, T, *_ = mesh.tetrahedralize(
        plc=True,
        quality=True,
        minratio=float(ratio),
        fixedvolume=True,
        maxvolume=float(edge) ** 3 / (6 * np.sqrt(2)),
        nobisect=True,
        quiet=True,
    )
    return np.asarray(vertices, dtype=np.float64), np.asarray(T, dtype=np.int64)
