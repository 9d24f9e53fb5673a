"""From raw triangles to a hull: largest component, repair, orientation, remeshing, checks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from geounfold.backends import igl as _igl
from geounfold.backends import meshlab
from geounfold.errors import HullError
from geounfold.geometry.measures import enclosed_volume
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.surfaces.hull._result import Hull

#: Sweeps of isotropic remeshing.  With 1 and with 4 the rms of five bodies changes by at most 0.01
#: blocks; of two more it grows by 0.2 to 0.8 with either.
REMESHING = 2

#: Taubin steps that take the stairs of blocks out of a hull.  With 5 and with 20 the rms of a body
#: of flat blocks grows by 0.001 and 0.005 blocks.
SMOOTHING = 10


def finish(
    V: Floats,
    F: Ints,
    *,
    method: str,
    blocks: float,
    edge: float,
    project: Callable[[Floats], Floats] | None = None,
    smooth: bool = False,
) -> Hull:
    """Return the hull made of the largest component of raw, closed triangles.

    Parameters
    ----------
    V : (n, 3) float
        Vertices, working units.
    F : (m, 3) int
        Faces of a closed manifold surface, in a coherent orientation, outward or inward.
    method : str
        The method that made them.
    blocks : float
        Volume of the blocks, working units: their number.
    edge : float
        Edge length of the hull, working units.
    project : callable, optional
        Moves points (n, 3) near the surface on to it; applied after remeshing.
    smooth : bool
        Whether the stairs of blocks are smoothed before remeshing.

    Returns
    -------
    Hull
        With an inset and a blur of zero.

    Raises
    ------
    HullError
        The surface is not closed or not manifold, before or after remeshing.
    """
    keep = largest_component(F)
    V, F = compact(V, F[keep])
    check_closed_manifold(F, method)
    if enclosed_volume(V, F) < 0:
        F = F[:, ::-1]
    if smooth:
        V = meshlab.taubin(V, F, SMOOTHING)
    V, F = meshlab.remesh(V, F, edge, REMESHING)
    if project is not None:
        V = project(V)
    check_closed_manifold(F, method)
    volume = enclosed_volume(V, F)
    if volume <= 0:
        raise HullError(f"the {method} hull encloses no volume; {_advice(method)}")
    return Hull(
        mesh=TriMesh(V, F),
        method=method,
        volume=volume,
        blocks_volume=float(blocks),
        inset=0.0,
        blur=0.0,
        dropped=int((~keep).sum()),
    )


def smoothed(hull: Hull) -> Hull:
    """Return a hull with vertices smoothed by Taubin's steps, which keep the volume."""
    V = meshlab.taubin(hull.mesh.V, hull.mesh.F, SMOOTHING)
    return replace(hull, mesh=hull.mesh.with_vertices(V), volume=enclosed_volume(V, hull.mesh.F))


def largest_component(F: Ints) -> Bools:
    """Return which faces belong to the component (across edges) with the most faces, (m,)."""
    if not len(F):
        return np.zeros(0, dtype=bool)
    component = _igl.face_components(F)
    out: Bools = component == np.bincount(component).argmax()
    return out


def compact(V: Floats, F: Ints) -> tuple[Floats, Ints]:
    """Return the mesh without unused vertices."""
    used, inverse = np.unique(F, return_inverse=True)
    return V[used], inverse.reshape(F.shape)


def check_closed_manifold(F: Ints, method: str) -> None:
    """Raise HullError unless the faces bound a solid and are oriented coherently.

    Each directed edge and its reverse then occur once, and the faces around each vertex form one
    fan.
    """
    if len(F) < 4:
        raise HullError(f"the {method} hull has no faces; {_advice(method)}")
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    n = int(F.max()) + 1
    edges, reverse = start * n + end, end * n + start
    order, back = np.argsort(edges), np.argsort(reverse)
    if (edges[order][1:] == edges[order][:-1]).any():
        raise HullError(f"the {method} hull is not manifold; {_advice(method)}")
    unpaired = int((~np.isin(edges, reverse)).sum()) if _differ(edges, reverse, order, back) else 0
    if unpaired:
        raise HullError(f"the {method} hull has {unpaired} open edges; {_advice(method)}")
    twin = np.empty_like(order)
    twin[order] = back
    around = twin.reshape(-1, 3)[:, [2, 0, 1]].ravel()  # the next half-edge out of its start
    half = np.arange(len(start))
    graph = coo_array((np.ones(len(half), dtype=np.int8), (half, around)), (len(half), len(half)))
    fans = int(connected_components(graph, directed=False)[0])
    if fans != len(np.unique(F)):
        raise HullError(f"the {method} hull touches itself in a vertex; {_advice(method)}")


def _differ(edges: Ints, reverse: Ints, order: Ints, back: Ints) -> bool:
    return not np.array_equal(edges[order], reverse[back])


def _advice(method: str) -> str:
    other = "alpha" if method == "density" else "density"
    return f"try hull '{other}'"
