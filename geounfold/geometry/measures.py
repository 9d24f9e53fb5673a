"""Lengths, areas, volumes, normals and edges, on plain arrays.

Signs are kept: a volume or an area is negative if an element is turned inside out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.geometry.mesh import Floats, Ints, TriMesh


def unique_edges(F: Ints) -> Ints:
    """Return the undirected edges of triangles, (k, 2), lower index first, sorted.

    >>> unique_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    """
    E = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    key = E[:, 0] * (int(F.max(initial=0)) + 1) + E[:, 1]
    first = np.unique(key, return_index=True)[1]
    return np.ascontiguousarray(E[first])


def sorted_distinct(keys: Ints) -> Ints:
    """Return the distinct values of keys (n,) in increasing order, faster than np.unique.

    >>> sorted_distinct(np.array([3, 1, 3])).tolist()
    [1, 3]
    """
    ordered = np.sort(keys)
    fresh = np.ones(len(keys), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=fresh[1:])
    out: Ints = ordered[fresh]
    return out


def bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest values of points' columns (n, d), (d,) each.

    It is six times as fast as ``points.min(axis=0)`` on a million rows of three.

    >>> [b.tolist() for b in bounds(np.array([[3, 1], [2, 5]]))]
    [[2, 1], [3, 5]]
    """
    columns = points.T
    return np.array([x.min() for x in columns]), np.array([x.max() for x in columns])


def lengths(V: Floats, E: Ints) -> Floats:
    """Return the length of each edge, (k,), in the vertices' unit."""
    out: Floats = np.linalg.norm(V[E[:, 1]] - V[E[:, 0]], axis=1)
    return out


def lengths_between(a: Sequence[Floats], b: Sequence[Floats]) -> Floats:
    """Return the distances between points given by columns x, y, z, (k,) each."""
    square = np.zeros_like(a[0])
    for p, q in zip(a, b, strict=True):
        d = q - p
        d *= d
        square += d
    return np.sqrt(square, out=square)


def cross2(a: Floats, b: Floats) -> Floats:
    """Return the z of the cross product of (…, 2) vectors; positive counter-clockwise."""
    out: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def triangle_areas(V: Floats, F: Ints) -> Floats:
    """Return the area of each triangle, (m,): signed in 2-D (counter-clockwise positive).

    >>> flat = np.array([[0.0, 0], [1, 0], [0, 1]])
    >>> triangle_areas(flat, np.array([[0, 1, 2], [0, 2, 1]])).tolist()
    [0.5, -0.5]
    """
    a, b = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    if V.shape[1] == 2:
        return cross2(a, b) / 2
    out: Floats = np.linalg.norm(np.cross(a, b), axis=1) / 2
    return out


def face_normals(V: Floats, F: Ints) -> Floats:
    """Return the unit normal of each triangle, (m, 3); zero for a degenerate one."""
    N = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    length = np.linalg.norm(N, axis=1, keepdims=True)
    out: Floats = np.divide(N, length, out=np.zeros_like(N), where=length > 0)
    return out


def vertex_sum(values: Floats, F: Ints, n: int) -> Floats:
    """Return the sum over each vertex's faces of a value per face, (n,) or (n, d)."""
    index = F.ravel()
    columns = [
        np.bincount(index, weights=np.repeat(column, F.shape[1]), minlength=n).astype(np.float64)
        for column in np.atleast_2d(values.T)
    ]
    return columns[0] if values.ndim == 1 else np.stack(columns, axis=1)


def unit(vectors: Floats) -> Floats:
    """Return vectors (n, d) scaled to length one; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    out: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return out


def vertex_normals(V: Floats, F: Ints) -> Floats:
    """Return area-weighted unit normals at the vertices, (n, 3)."""
    N = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    return unit(vertex_sum(N, F, len(V)))


def enclosed_volume(V: Floats, F: Ints) -> float:
    """Return the signed volume inside a closed surface; positive if normals point outwards."""
    C = V - V.mean(axis=0)
    a, b, c = C[F[:, 0]], C[F[:, 1]], C[F[:, 2]]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def tet_volumes(V: Floats, T: Ints) -> Floats:
    """Return the signed volume of each tetrahedron, (m,); negative if inverted.

    >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> (6 * tet_volumes(corner, np.array([[0, 1, 2, 3], [1, 0, 2, 3]]))).round(12).tolist()
    [1.0, -1.0]
    """
    a = V[T[:, 0]]
    out: Floats = (
        np.einsum("ij,ij->i", V[T[:, 1]] - a, np.cross(V[T[:, 2]] - a, V[T[:, 3]] - a)) / 6
    )
    return out


def boundary_faces(T: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the faces that belong to one tetrahedron only, and their tetrahedra.

    Parameters
    ----------
    T : (m, 4) int
        Tetrahedra, right-handed if upright.

    Returns
    -------
    F : (b, 3) int
        Boundary faces, seen counter-clockwise from outside upright tetrahedra.
    owner : (b,) int
        Tetrahedron of each face.
    misglued : (k,) int
        Tetrahedra at faces that more than two share, or that two share from the same side.

    Examples
    --------
    >>> F, owner, misglued = boundary_faces(np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))
    >>> len(F), owner.tolist(), misglued.tolist()
    (6, [0, 0, 0, 1, 1, 1], [])
    """
    corners = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    a, b, c = (T.T[corners[:, k]].T.ravel() for k in range(3))
    least, most = np.minimum(a, b), np.maximum(a, b)
    low, high = np.minimum(least, c), np.maximum(most, c)
    middle = np.maximum(least, np.minimum(most, c))
    n = int(T.max(initial=0)) + 1
    fresh = np.ones(len(a), dtype=bool)
    if n**3 < 2**63:
        keys = (low * n + middle) * n + high
        order = np.argsort(keys)
        keys = keys[order]
        fresh[1:] = keys[1:] != keys[:-1]
    else:
        order = np.lexsort((high, middle, low))
        rows = np.stack([low, middle, high], axis=1)[order]
        fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    start = np.flatnonzero(fresh)
    count = np.diff(start, append=len(a))
    once = np.sort(order[start[count == 1]])
    first, second = order[start[count == 2]], order[start[count == 2] + 1]
    even = np.where(low == a, middle == b, np.where(low == b, middle == c, middle == a))
    alike = even[first] == even[second]
    crowded = order[np.repeat(count > 2, count)]
    misglued = np.concatenate([first[alike], second[alike], crowded])
    return np.stack([a, b, c], axis=1)[once], once // 4, np.unique(misglued // 4)


def bilateral_normals(mesh: TriMesh, adjacency: Ints, sweeps: int, width: float = 0.12) -> Floats:
    """Return face normals smoothed by a filter that keeps creases, (m, 3).

    A neighbour's weight is 1/e if 1 - cosine is ``width``.
    """
    N = face_normals(mesh.V, mesh.F)
    area = 2 * triangle_areas(mesh.V, mesh.F)
    own = np.arange(len(mesh.F))[:, None]
    near = np.where(adjacency >= 0, adjacency, own)
    for _ in range(sweeps):
        cos = np.einsum("ijk,ik->ij", N[near], N)
        weight = np.exp((cos - 1) / width) * area[near]
        N = unit(N * area[:, None] + np.einsum("ij,ijk->ik", weight, N[near]))
    return N


def corner_angles(V: Floats, F: Ints) -> Floats:
    """Return the angle at each corner of each triangle, radians, (m, 3)."""
    out = np.empty(F.shape)
    for k in range(3):
        a, b = V[F[:, (k + 1) % 3]] - V[F[:, k]], V[F[:, (k + 2) % 3]] - V[F[:, k]]
        out[:, k] = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
    return out


def loop_turning(V: Floats, F: Ints, loop: Ints) -> float:
    """Return the total turning of a boundary loop of a surface, radians, positive inwards.

    The sum of pi less the surface's angle at every vertex of the loop (k,): the total geodesic
    curvature.  Over a surface that can be laid flat it is 2 pi on the outer loop and -2 pi
    around a hole (Gauss-Bonnet); a cylinder's ends turn by 0.
    """
    at = np.bincount(F.ravel(), corner_angles(V, F).ravel(), len(V))
    return float((np.pi - at[loop]).sum())


LARGEST_COORDINATE = 1e15
"""Largest coordinate; beyond it neighbouring doubles lie 0.125 or more apart."""
