"""Two open surfaces that bound a body: the sides that face each other, and the wall around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.igl import SurfaceIndex, face_components
from geounfold.backends.igl_solids import coherent
from geounfold.body.fill.edges import border_edges
from geounfold.errors import InputError
from geounfold.geometry.measures import face_normals, triangle_areas
from geounfold.geometry.mesh import Floats, Ints, TriMesh


@dataclass(frozen=True, eq=False)
class Pair:
    """The surfaces above and below a body, their normals turned away from it.

    Attributes
    ----------
    top, bottom : TriMesh
        The surfaces, in the data's coordinates.
    thickness : float
        Median distance from one surface to the other.
    """

    top: TriMesh
    bottom: TriMesh
    thickness: float

    @property
    def volume(self) -> float:
        """About the volume between them: the smaller area times the distance."""
        areas = [float(triangle_areas(m.V, m.F).sum()) for m in (self.top, self.bottom)]
        return min(areas) * self.thickness


def border_loop(F: Ints) -> Ints | None:
    """Return the vertices around coherent triangles in order, (n,); None of several loops.

    >>> border_loop(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [0, 1, 3, 2]
    """
    start, end = border_edges(F).T
    if not len(start) or len(np.unique(start)) < len(start):
        return None
    after = dict(zip(start.tolist(), end.tolist(), strict=True))
    loop = [int(start[0])]
    while (following := after[loop[-1]]) != loop[0]:
        loop.append(following)
    return np.array(loop) if len(loop) == len(start) else None


def walled(pair: Pair) -> TriMesh | None:
    """Return both surfaces with a wall that joins their borders; None if a border is not one loop.

    The wall's triangles take the shorter of two diagonals from vertex to vertex around the borders.
    """
    V = np.concatenate([pair.top.V, pair.bottom.V])
    lower = pair.bottom.F + len(pair.top.V)
    high, low = border_loop(pair.top.F), border_loop(lower)
    if high is None or low is None:
        return None
    low = low[::-1]  # the lower surface faces down, so its border runs the other way
    first = int(cKDTree(V[low]).query(V[high[0]])[1])
    low = np.roll(low, -first)
    high, low = np.append(high, high[0]), np.append(low, low[0])
    i = j = 0
    wall = []
    while i < len(high) - 1 or j < len(low) - 1:
        a, b = high[i], low[j]
        across = np.inf if i == len(high) - 1 else float(np.linalg.norm(V[high[i + 1]] - V[b]))
        other = np.inf if j == len(low) - 1 else float(np.linalg.norm(V[a] - V[low[j + 1]]))
        if across <= other:
            wall.append((high[i + 1], a, b))
            i += 1
        else:
            wall.append((b, low[j + 1], a))
            j += 1
    return TriMesh(V, np.concatenate([pair.top.F, lower, np.array(wall, dtype=np.int64)]))


def facing_pair(top: TriMesh, bottom: TriMesh) -> Pair:
    """Return two surfaces turned away from each other.

    Raises
    ------
    InputError
        They are one surface, or lie in each other.
    """
    upper, lower = (TriMesh(mesh.V, coherent(mesh.F)) for mesh in (top, bottom))
    distance = np.concatenate([_distance(upper, lower), _distance(lower, upper)])
    thickness = float(np.median(distance))
    if not thickness > 0:
        raise InputError(
            "--top and --bottom are the same surface, so that nothing lies between them"
        )
    return Pair(facing_away(upper, lower), facing_away(lower, upper), thickness)


def facing_away(mesh: TriMesh, other: TriMesh) -> TriMesh:
    """Return a surface with the normals of each of its parts turned away from another surface."""
    centres = mesh.V[mesh.F].mean(axis=1)
    nearest = SurfaceIndex(other.V, other.F).closest(centres)[2]
    outward = np.einsum("ij,ij->i", centres - nearest, face_normals(mesh.V, mesh.F))
    part = face_components(mesh.F)
    total = np.bincount(part, outward * triangle_areas(mesh.V, mesh.F))
    return TriMesh(mesh.V, np.where((total < 0)[part][:, None], mesh.F[:, ::-1], mesh.F))


def _distance(mesh: TriMesh, other: TriMesh) -> Floats:
    """Return the distance of each triangle's centre from another surface."""
    return SurfaceIndex(other.V, other.F).closest(mesh.V[mesh.F].mean(axis=1))[0]
