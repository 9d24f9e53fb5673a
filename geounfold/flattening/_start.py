"""The start of every flattener: check of the surface, and first flat positions."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from geounfold.backends import igl as backend
from geounfold.errors import MeshError
from geounfold.flattening._linear import edge_laplacian, factor
from geounfold.flattening._problem import Problem, upright
from geounfold.geometry.measures import lengths, triangle_areas, unique_edges
from geounfold.geometry.mesh import Floats, Ints, TriMesh

#: A triangle is degenerate if its area is below this share of its longest side squared.
DEGENERATE = 1e-12

NOT_MANIFOLD = (
    "the surface is not an oriented manifold: an edge or a vertex is shared by too many faces, "
    "or neighbouring faces face opposite ways"
)


def check_disk(mesh: TriMesh) -> tuple[Ints, ...]:
    """Return the border loops of a disk, holes allowed: the longest (outer) loop first.

    Raises
    ------
    MeshError
        No faces; vertices that are not in 3-D or belong to no face; a degenerate face; faces that
        are not manifold or not oriented alike; several components; no border; handles.
    """
    _check_faces(mesh)
    F, n = mesh.F, len(mesh.V)
    parts = int(backend.face_components(F).max()) + 1
    bad = _misfit(F, n)
    if bad >= 0:
        at = ", ".join(f"{x:.6g}" for x in mesh.V[bad])
        also = f" (and it has {parts} components)" if parts > 1 else ""
        raise MeshError(f"{NOT_MANIFOLD}, first at vertex {bad} ({at}){also}")
    if parts > 1:
        raise MeshError(f"the surface has {parts} components, flatten each one alone")
    loops = backend.boundary_loops(F)
    if not loops:
        raise MeshError("the surface is closed: it has no border, so it cannot be flattened")
    # With one component and simple loops, every handle lowers Euler's number by two, and every
    # vertex at which fans of faces touch lowers it by one.
    missing = 2 - len(loops) - (n - len(unique_edges(F)) + len(F))
    if missing and not backend.is_manifold(F):
        raise MeshError(NOT_MANIFOLD)
    if missing:
        raise MeshError(
            f"the surface has {missing // 2} handle(s), so it cannot be laid flat: take out the "
            "faces of a bridge, or close the hole, of each"
        )
    perimeter = [float(lengths(mesh.V, _cycle(loop)).sum()) for loop in loops]
    order = sorted(range(len(loops)), key=lambda k: (-perimeter[k], k))
    return tuple(loops[k] for k in order)


def _misfit(F: Ints, n: int) -> int:
    """Return a vertex of a directed edge used twice, or on two borders; -1 if there is none."""
    sides = F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = np.sort(sides[:, 0] * n + sides[:, 1])
    twice = key[1:] == key[:-1]
    if twice.any():
        return int(key[int(np.argmax(twice))]) // n
    back = sides[:, 1] * n + sides[:, 0]
    at = np.minimum(np.searchsorted(key, back), len(key) - 1)
    border = sides[key[at] != back, 0]
    shared = np.bincount(border, minlength=n) > 1
    return int(np.argmax(shared)) if shared.any() else -1


def _check_faces(mesh: TriMesh) -> None:
    """Raise MeshError for vertices or faces that no flattener can use."""
    V, F = mesh.V, mesh.F
    if not len(F):
        raise MeshError("the surface has no faces")
    if V.shape[1] != 3:
        raise MeshError(
            f"a surface to flatten has vertices of shape (n, 3), but they are {V.shape}"
        )
    unused = np.flatnonzero(np.bincount(F.ravel(), minlength=len(V)) == 0)
    if unused.size:
        raise MeshError(f"{unused.size} vertices belong to no face, the first is {unused[0]}")
    longest = np.max([((V[F[:, k]] - V[F[:, k - 1]]) ** 2).sum(axis=1) for k in range(3)], axis=0)
    flat = np.flatnonzero(~(triangle_areas(V, F) > DEGENERATE * longest))
    if flat.size:
        raise MeshError(f"{flat.size} faces are degenerate (no area), the first is {flat[0]}")


def _cycle(loop: Ints) -> Ints:
    """Return the edges along a closed loop, (b, 2)."""
    return np.stack([loop, np.roll(loop, -1)], axis=1)


def tutte(problem: Problem) -> Floats:
    """Return Tutte's embedding of a disk, (n, 2), centred: no triangle flips.

    The outer loop lies on the circle of the surface's area, spaced by its rest lengths; every
    other vertex is the mean of its neighbours (Tutte 1963).  Each hole is closed by a virtual
    vertex joined to its loop, so that the theorem holds for the remaining triangles.
    """
    n, outer = len(problem.mesh.V), problem.loops[0]
    faces = [problem.mesh.F]
    for k, loop in enumerate(problem.loops[1:]):
        faces.append(np.column_stack([_cycle(loop), np.full(len(loop), n + k)]))
    edges = unique_edges(np.concatenate(faces))
    total = n + len(problem.loops) - 1
    uv = np.zeros((total, 2))
    uv[outer] = circle(problem, outer)
    laplacian = sp.csr_array(edge_laplacian(edges, np.ones(len(edges)), total))
    free = np.ones(total, dtype=bool)
    free[outer] = False
    if free.any():
        rows = laplacian[free]
        uv[free] = factor(sp.csc_array(rows[:, free])).solve(-(rows[:, ~free] @ uv[~free]))
    return upright(uv[:n], problem.mesh.F)


def plan(problem: Problem) -> Floats:
    """Return the vertices projected on their best-fit plane, (n, 2), centred.

    Triangles that are turned over in space, as on an overturned limb, are folded over.
    """
    centred = problem.mesh.V - problem.mesh.V.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    return upright(centred @ axes[:2].T, problem.mesh.F)


def circle(problem: Problem, loop: Ints) -> Floats:
    """Return a loop on a circle of the surface's area, spaced by the loop's rest lengths."""
    n = len(problem.mesh.V)
    ends = np.sort(_cycle(loop), axis=1)
    key = problem.edges[:, 0] * n + problem.edges[:, 1]
    step = problem.rest[np.searchsorted(key, ends[:, 0] * n + ends[:, 1])]
    turn = 2 * np.pi * (np.cumsum(step) - step) / step.sum()
    radius = np.sqrt(problem.areas.sum() / np.pi)
    out: Floats = np.column_stack([np.cos(turn), np.sin(turn)]) * radius
    return out
