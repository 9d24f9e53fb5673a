"""Landmark Isomap: shortest paths through a graph of near points, and classical scaling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from geounfold.errors import check_whole
from geounfold.flattening._classical_scaling import by_distances, to_landmarks
from geounfold.flattening._problem import Problem
from geounfold.flattening._result import Flattening
from geounfold.geometry.measures import lengths
from geounfold.geometry.mesh import Floats, Ints

#: Relative difference of distances that counts as rounding.  All neighbours as far as the last of
#: the k are taken, so that the result does not depend on the order of the vertices.
TIE = 1e-6


@dataclass(frozen=True, kw_only=True)
class IsomapOptions:
    """Options of ``isomap``.

    Parameters
    ----------
    neighbours : int
        Number of nearest vertices in space that each vertex is joined to; ties with the last are
        joined too.
    landmarks : int
        Number of vertices from which paths are measured, spread as far apart as possible; all
        vertices if there are fewer.
    """

    neighbours: int = 16
    landmarks: int = 300

    def __post_init__(self) -> None:
        check_whole("flattener_options.neighbours", self.neighbours, 1)
        check_whole("flattener_options.landmarks", self.landmarks, 3)


def isomap(problem: Problem, start: Floats | None, options: IsomapOptions) -> Flattening:
    """Flatten by landmark Isomap (Tenenbaum et al. 2000; de Silva and Tenenbaum 2004).

    Vertices are joined to their nearest ones in space (16, as in Unfolding.jl), distances are the
    shortest paths through this graph, and classical scaling follows (``_classical_scaling``).  The
    surface's own edges are joined too, so that the graph is always connected.

    It has two errors that ``mds`` has not.  Paths zigzag, so distances are too long by some per
    cent; and if limbs are nearer to each other than a few edges, paths take short cuts between them
    and the map folds.  Like ``mds`` it needs a convex flat image.  It is a direct solve, so a start
    has no effect.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Not used.
    options : IsomapOptions
        Neighbours and landmarks.

    Returns
    -------
    Flattening
        ``energy`` is the mean squared error of the distances to the landmarks, in square units.
    """
    V = problem.mesh.V - problem.mesh.V.mean(axis=0)
    graph = _graph(V, problem.edges, options.neighbours)

    def paths(vertex: int) -> Floats:
        found: Floats = csgraph.dijkstra(graph, directed=False, indices=np.array([vertex]))[0]
        return found

    chosen, D = to_landmarks(paths, V, options.landmarks)
    return by_distances(problem, chosen, D, "isomap", "shortest-path")


def _graph(V: Floats, edges: Ints, neighbours: int) -> sp.csr_array:
    """Return the lengths between near vertices and along edges, (n, n), both ways."""
    n = len(V)
    # The nearest one is the vertex itself; twice as many include all ties, on lattices too.
    near, index = (np.asarray(a) for a in cKDTree(V).query(V, k=min(2 * neighbours + 1, n)))
    last = near[:, min(neighbours, near.shape[1] - 1), None]
    row, column = np.nonzero(near <= last * (1 + TIE))
    pairs = np.concatenate([np.stack([row, index[row, column]], axis=1), edges])
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    data = np.tile(lengths(V, pairs), 2)
    return sp.csr_array((data, (both[:, 0], both[:, 1])), shape=(n, n))
