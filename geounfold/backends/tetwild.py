"""fTetWild (Hu et al. 2020, arXiv 1908.03581): tetrahedra within an envelope of a surface.

It draws random numbers that cannot be seeded, so two runs give different meshes.  Imported on first
use, in a process of its own (see `apart`).
"""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Floats, Ints


def tetrahedralize(V: Floats, F: Ints, edge: float, envelope: float) -> tuple[Floats, Ints]:
    """Return right-handed tetrahedra (V, T) that fill a closed surface.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles, outward.
    edge : float
        Length of edges aimed at, in the vertices' unit.
    envelope : float
        How far the tetrahedra's border may lie from the surface, same unit.
    """
    import pytetwild

    size = float(np.linalg.norm(np.ptp(V, axis=0)))
    # The surface is evenly triangulated already: simplifying it takes longer than all the rest.
    vertices, T = pytetwild.tetrahedralize(
        np.ascontiguousarray(V, dtype=np.float64),
        np.ascontiguousarray(F, dtype=np.int32),
        edge_length_abs=float(edge),
        epsilon=float(envelope) / size,
        simplify=False,
        num_threads=1,
        quiet=True,
        vtk_ordering=True,
    )
    return np.asarray(vertices, dtype=np.float64), np.asarray(T, dtype=np.int64)
