"""libigl: adjacency, ray casts, closest points, point location, barycentric coordinates."""

from __future__ import annotations

import igl
import igl.predicates
import numpy as np

from geounfold.backends.checks import call_libigl, finite_array
from geounfold.geometry.mesh import Bools, Floats, Ints


def _f(a: Floats) -> Floats:
    return np.ascontiguousarray(a, dtype=np.float64)


def _i(a: Ints) -> Ints:
    return np.ascontiguousarray(a, dtype=np.int64)


class SurfaceIndex:
    """A tree over triangles, built once, for closest points and ray casts.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    """

    def __init__(self, V: Floats, F: Ints) -> None:
        self.V, self.F = _f(V), _i(F)
        self._tree = igl.AABB()
        self._tree.init(self.V, self.F)

    def closest(self, Q: Floats) -> tuple[Floats, Ints, Floats]:
        """Return distance (k,), face (k,) and closest point (k, 3) for each query point."""
        d2, face, point = self._tree.squared_distance(self.V, self.F, _f(Q))
        return np.sqrt(d2), np.asarray(face, dtype=np.int64), point

    def first_hit(self, origins: Floats, directions: Floats) -> tuple[Ints, Floats]:
        """Return the first face met by each ray (-1 for none) and the distance (inf for none)."""
        face, distance, _ = self._tree.intersect_ray_first(
            self.V, self.F, _f(origins), _f(directions)
        )
        face = np.asarray(face, dtype=np.int64)
        missed = (face < 0) | ~np.isfinite(distance)
        return np.where(missed, -1, face), np.where(missed, np.inf, distance)


class TetIndex:
    """A tree over tetrahedra, built once, for point location.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    T : (m, 4) int
        Right-handed tetrahedra.
    """

    def __init__(self, V: Floats, T: Ints) -> None:
        self.V, self.T = _f(V), _i(T)
        self._tree = igl.AABB()
        self._tree.init(self.V, self.T)

    def locate(self, Q: Floats) -> Ints:
        """Return the tetrahedron that holds each query point, (k,); -1 outside all."""
        return np.asarray(igl.in_element(self.V, self.T, _f(Q), self._tree), dtype=np.int64)


def barycentric_in_tets(Q: Floats, V: Floats, T: Ints) -> Floats:
    """Return barycentric coordinates (k, 4) of points Q, each in its own tetrahedron T (k, 4)."""
    corners = [_f(V[T[:, k]]) for k in range(4)]
    return np.asarray(igl.barycentric_coordinates(_f(Q), *corners))


def barycentric_in_triangles(Q: Floats, V: Floats, F: Ints) -> Floats:
    """Return barycentric coordinates (k, 3) of points Q, each in its own triangle F (k, 3)."""
    corners = [_f(V[F[:, k]]) for k in range(3)]
    return np.asarray(igl.barycentric_coordinates(_f(Q), *corners))


def triangle_adjacency(F: Ints) -> Ints:
    """Return the neighbour across each edge of each triangle, (m, 3); -1 on the border."""
    return np.asarray(igl.triangle_triangle_adjacency(_i(F))[0], dtype=np.int64)


def face_components(F: Ints) -> Ints:
    """Return the connected component (across edges) of each triangle, (m,)."""
    result = igl.facet_components(_i(F))
    component = result[1] if isinstance(result, tuple) and np.ndim(result[1]) else result
    component = component[0] if isinstance(component, tuple) else component
    return np.asarray(component, dtype=np.int64).ravel()


def oriented_alike(F: Ints) -> Ints:
    """Return triangles (m, 3) wound alike within each connected component, where they can be."""
    out = igl.bfs_orient(_i(F))
    return np.asarray(out[0] if isinstance(out, tuple) else out, dtype=np.int64)


def boundary_loops(F: Ints) -> list[Ints]:
    """Return the border loops of a triangle mesh, the one of most vertices first."""
    loops = [np.asarray(loop, dtype=np.int64) for loop in igl.boundary_loop_all(_i(F))]
    return sorted(loops, key=len, reverse=True)


def upright(V: Floats, T: Ints) -> Bools:
    """Return which tetrahedra have positive volume, (m,): Shewchuk's exact predicate."""
    V = _f(V)
    a, b, c, d = (V[T[:, k]] for k in range(4))
    sign = igl.predicates.orient3d(a, b, c, d)  # positive for a left-handed one, d below
    return np.asarray(sign).ravel() < 0


def self_intersections(V: Floats, F: Ints) -> Ints:
    """Return the pairs of triangles that intersect, (k, 2), by exact predicates.

    Shared vertices and edges do not count. Neighbours that overlap do, and so does a touch
    between triangles that share nothing there.
    """
    _, pairs, _ = igl.predicates.find_self_intersections(_f(V), _i(F))
    return np.asarray(pairs, dtype=np.int64).reshape(-1, 2)


def winding_number(V: Floats, F: Ints, Q: Floats) -> Floats:
    """Return how often a closed surface winds about each query point, (k,)."""
    return np.asarray(igl.winding_number(_f(V), _i(F), _f(Q))).ravel()


def is_manifold(F: Ints) -> bool:
    """Return whether every edge has at most two faces and every vertex one fan of faces."""
    edge = igl.is_edge_manifold(_i(F))
    edge_ok = bool(np.all(edge[0] if isinstance(edge, tuple) else edge))
    return edge_ok and not len(pinched_vertices(F))


def marching_cubes(
    field: Floats, origin: Floats, step: Floats, level: float
) -> tuple[Floats, Ints]:
    """Return the level surface on a regular grid as (V, F), facing lower values.

    Parameters
    ----------
    field : (nx, ny, nz) float
        Values at the grid's nodes; below ``level`` on the grid's border.
    origin, step : (3,) float
        Position of node (0, 0, 0) and node spacing per axis.
    level : float
        Value on the surface.
    """
    nx, ny, nz = field.shape
    axes = [origin[k] + step[k] * np.arange(n) for k, n in enumerate(field.shape)]
    grid = np.empty((nz, ny, nx, 3))
    grid[..., 0] = axes[0]
    grid[..., 1] = axes[1][:, None]
    grid[..., 2] = axes[2][:, None, None]
    values = np.ascontiguousarray(field.transpose(2, 1, 0)).ravel().astype(np.float64)
    V, F = igl.marching_cubes(values, grid.reshape(-1, 3), nx, ny, nz, level)[:2]
    return np.asarray(V), np.asarray(F[:, ::-1], dtype=np.int64).copy()


def marching_cubes_sparse(
    field: Floats, nodes: Floats, cubes: Ints, level: float
) -> tuple[Floats, Ints]:
    """Return the level surface in the given cubes as (V, F), facing lower values.

    Parameters
    ----------
    field : (n,) float
        Values at the nodes.
    nodes : (n, 3) float
        Positions of the nodes.
    cubes : (c, 8) int
        Corners of each cube: counter-clockwise on its lower face, then on its upper face.
    level : float
        Value on the surface.
    """
    V, F = igl.marching_cubes(_f(field), _f(nodes), _i(cubes), float(level))[:2]
    return np.asarray(V), np.asarray(F[:, ::-1], dtype=np.int64).copy()


def pinched_vertices(F: Ints) -> Ints:
    """Return the vertices at which two fans of triangles meet in the vertex alone."""
    manifold = igl.is_vertex_manifold(_i(F))
    flags = np.asarray(manifold[1] if isinstance(manifold, tuple) else manifold)
    return np.setdiff1d(np.flatnonzero(~flags.ravel()), np.setdiff1d(np.arange(len(flags)), F))


def lscm(V: Floats, F: Ints, fixed: Ints, uv_fixed: Floats) -> Floats:
    """Return the least-squares conformal map (n, 2) with the vertices ``fixed`` at ``uv_fixed``.

    Raises
    ------
    BackendError
        libigl failed, or returned positions that are not finite.
    """
    uv, _ = call_libigl("lscm", igl.lscm, _f(V), _i(F), _i(fixed), _f(uv_fixed))
    return finite_array(uv, (len(V), 2), "lscm")


class ArapSteps:
    """libigl's as-rigid-as-possible parameterisation, one local-global step at a time.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    F : (m, 3) int
        Triangles.
    """

    def __init__(self, V: Floats, F: Ints) -> None:
        self._data = igl.ARAPData()
        self._data.max_iter = 1
        self._n = len(V)
        # libigl refuses an empty list of held vertices: vertex 0 is held at the origin.
        held = np.zeros(1, dtype=np.int32)
        name = "arap_precomputation"
        call_libigl(name, igl.arap_precomputation, _f(V), _i(F), 2, held, self._data)

    def __call__(self, uv: Floats) -> Floats:
        """Return the positions after one step, (n, 2), vertex 0 at the origin.

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        # libigl moves only the held vertex to its position, so all are shifted with it first.
        start = _f(uv - uv[0])
        after = call_libigl("arap_solve", igl.arap_solve, np.zeros((1, 2)), self._data, start)
        return finite_array(after, (self._n, 2), "arap_solve")


class TetDeformation:
    """Deformations of tetrahedra with some vertices, such as the border's, at given positions.

    Parameters
    ----------
    V : (n, 3) float
        Vertices at rest.
    T : (m, 4) int
        Right-handed tetrahedra.
    held : (k,) int
        Vertices whose positions are given.
    """

    def __init__(self, V: Floats, T: Ints, held: Ints) -> None:
        self._V, self._T, self._held = _f(V), _i(T), _i(held)

    def harmonic(self, places: Floats) -> Floats:
        """Return all positions (n, 3), harmonic over the rest shape.

        Parameters
        ----------
        places : (k, 3) float
            Positions of the held vertices.

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        if len(self._held) == len(self._V):
            return self._in_order(places)
        given = _f(places)
        out = call_libigl("harmonic", igl.harmonic, self._V, self._T, self._held, given, 1)
        return finite_array(out, self._V.shape, "harmonic")

    def rigid(self, places: Floats, start: Floats, tol: float, max_iter: int) -> tuple[Floats, int]:
        """Return all positions (n, 3), as rigid as possible, and the number of local-global steps.

        Parameters
        ----------
        places : (k, 3) float
            Positions of the held vertices.
        start : (n, 3) float
            All positions to start from.
        tol : float
            Largest move of a vertex in the last step, in the vertices' unit.
        max_iter : int
            Largest number of steps.

        Raises
        ------
        BackendError
            libigl failed, or returned positions that are not finite.
        """
        if len(self._held) == len(self._V):
            return self._in_order(places), 0
        data = igl.ARAPData()
        data.max_iter = 1
        held = self._held.astype(np.int32)
        name = "arap_precomputation"
        call_libigl(name, igl.arap_precomputation, self._V, self._T, 3, held, data)
        now, given = _f(start), _f(places)
        for step in range(1, max_iter + 1):
            after = call_libigl("arap_solve", igl.arap_solve, given, data, now)
            after = finite_array(after, self._V.shape, "arap_solve")
            moved = float(np.abs(after - now).max())
            now = after
            if moved <= tol:
                return now, step
        return now, max_iter

    def _in_order(self, places: Floats) -> Floats:
        out = np.empty_like(self._V)
        out[self._held] = places
        return out
