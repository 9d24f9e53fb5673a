"""fTetWild (Hu et al. 2020, arXiv 1908.03581): tetrahedra within an envelope of a surface.

It draws random numbers that cannot be seeded, so two runs give different meshes. It is imported on
first use, in a process of its own (see `own_process`).
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
        Length of edges that fTetWild aims at, in the vertices' unit.
    envelope : float
        Largest distance between the tetrahedra's border and the surface, in the same unit.
    """
    import pytetwild

    size = float(np.linalg.norm(np.ptp(V, axis=0)))
    # The surface is evenly triangulated already, and simplifying takes longer than all the rest.
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
