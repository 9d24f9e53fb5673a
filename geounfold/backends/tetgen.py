"""TetGen (Si 2015): constrained Delaunay tetrahedra over a surface's own triangles.

TetGen is AGPL and no dependency: the extra ``tetgen`` brings it.  Imported on first use, in a
process of its own (see `apart`).
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
        Tetrahedra inside are no larger than regular ones with edges of this length.
    ratio : float, optional
        Largest ratio of circumradius to shortest edge that is aimed at inside.
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
