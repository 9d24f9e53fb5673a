"""The signed graph of a hull's faces and its lowest eigenvector."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from geounfold.errors import SplitError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.split.faces import CREASE_WIDTH, Faces, valleys

WEAKEST_PULL = 1e-3
"""Pull that is left across the sharpest edge.

Measured: half or twice moves sides by up to 1.3 % of the area.
"""

COARSE_ABOVE = 12_000
"""Faces above which the graph is contracted before it is solved.

Measured: half moves the sides of one hull (of 17,664 faces) by 44 % of the area, twice those of
another (of 22,854 faces) by 50 %; the other hulls' stay.
"""

COARSENINGS = 2
"""Rounds of contraction, each to about 40 % of the nodes.

Measured: half or twice moves the sides of a hull of 40,470 faces by up to 0.09 % of the area.
"""

SMOOTHINGS = 15
"""Damped Jacobi sweeps after contraction.

Measured: half or twice moves its sides by 0.01 % of the area, none by 0.12 %.
"""


def signed_laplacian(faces: Faces) -> sp.csc_array:
    """Return D - A + B: A the pull of neighbours, B the push of opposite faces (symmetrised)."""
    n = len(faces.normal)
    i, j = np.repeat(np.arange(n), 3), faces.adjacency.ravel()
    cosine = np.einsum("ij,ij->i", faces.normal[i], faces.normal[j]).clip(-1, 1)
    pull = (
        np.where(valleys(faces, faces.normal).ravel(), 1.0, np.exp((cosine - 1) / CREASE_WIDTH))
        + WEAKEST_PULL
    )
    seen = np.flatnonzero(faces.facing > 0)
    hit = faces.hit[seen]
    push = faces.facing[seen] ** 2 * np.exp(-faces.distance[seen] / faces.median) / 2
    rows, columns = np.concatenate([i, seen, hit]), np.concatenate([j, hit, seen])
    degree = np.bincount(rows, np.concatenate([pull, push, push]), n)
    values = np.concatenate([degree, -pull, push, push])
    diagonal = np.arange(n)
    at = np.concatenate([diagonal, rows]), np.concatenate([diagonal, columns])
    return sp.coo_array((values, at), (n, n)).tocsc()


def lowest_vector(L: sp.csc_array) -> Floats:
    """Return the eigenvector (n,) of the lowest eigenvalue of the signed Laplacian.

    A large graph is first contracted along its strongest pulls, so that the factorisation stays
    small; the eigenvector of the contracted graph, constant on each cluster, is then smoothed.

    The signs are what a split needs, and the vector is their relaxation.  If two eigenvalues are
    close (two limbs that hardly hold on to each other, 2 % apart), the second vector may have the
    better signs: of the two, the one is returned whose signs break less (see `broken`).
    """
    if L.shape[0] <= COARSE_ABOVE:
        return _less_broken(L, _lowest_exact(L)[1])
    cluster = _clusters(L, COARSENINGS)
    size = np.bincount(cluster)
    scale = 1 / np.sqrt(size)
    coarse = _contract(L, cluster)
    scaled = sp.csc_array(sp.diags_array(scale) @ coarse @ sp.diags_array(scale))
    values, vectors = _lowest_exact(scaled)
    fine: Floats = (scale[:, None] * vectors)[cluster]
    diagonal = L.diagonal()[:, None]
    for _ in range(SMOOTHINGS):
        fine = fine - 0.6 * (L @ fine - values * fine) / diagonal
    return _less_broken(L, fine)


def broken(L: sp.csc_array, x: Floats) -> float:
    """Return the weight of pulls between opposite signs of ``x`` and of pushes between equal ones.

    The lowest eigenvector minimises this sum relaxed to real numbers; signs alone count here.
    """
    graph = L.tocoo()
    once = graph.row < graph.col
    row, column, value = graph.row[once], graph.col[once], graph.data[once]
    opposite = (x[row] >= 0) != (x[column] >= 0)
    return float(np.abs(value[opposite == (value < 0)]).sum())


def _less_broken(L: sp.csc_array, vectors: Floats) -> Floats:
    """Return the column of ``vectors`` (n, k) whose signs break least, the first of equal ones."""
    costs = [broken(L, x) for x in vectors.T]
    best: Floats = vectors[:, int(np.argmin(costs))]
    return best


def _lowest_exact(L: sp.csc_array) -> tuple[Floats, Floats]:
    """Return the two lowest eigenvalues and their eigenvectors (n, 2), by shift-invert Lanczos."""
    n = L.shape[0]
    shifted = sp.csc_array(L + 1e-6 * sp.eye_array(n))
    lu = spl.splu(shifted, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solve = spl.LinearOperator((n, n), matvec=lu.solve, dtype=np.float64)
    start = np.cos(np.arange(n) * 2.399963)
    options = {"sigma": -1e-6, "which": "LM", "OPinv": solve, "v0": start, "tol": 1e-6}
    try:
        values, vectors = spl.eigsh(L, k=min(2, n - 1), ncv=min(n, 12), **options)
    except spl.ArpackNoConvergence as error:
        raise SplitError("the signed split did not converge; try split 'normal'") from error
    order = np.argsort(values, kind="stable")
    return values[order], vectors[:, order]


def _clusters(L: sp.csc_array, rounds: int) -> Ints:
    """Return a cluster for each node, (n,): mutual strongest pulls are joined, round by round."""
    cluster = np.arange(L.shape[0])
    for _ in range(rounds):
        joined = _match(L)
        cluster = joined[cluster]
        L = _contract(L, joined)
    return cluster


def _match(L: sp.csc_array) -> Ints:
    """Return a cluster number per node, (n,): pairs that pull each other most, and followers.

    Equal pulls are told apart by a fixed hash of the pair, so that a flat face is cut into
    compact clusters.
    """
    graph = L.tocoo()
    pulls = (graph.row != graph.col) & (graph.data < 0)
    row, column = graph.row[pulls].astype(np.int64), graph.col[pulls].astype(np.int64)
    low, high = np.minimum(row, column), np.maximum(row, column)
    order = np.lexsort(((low * 7919 + high * 104729) % 1000003, -graph.data[pulls].round(6), row))
    last = np.append(row[order][1:] != row[order][:-1], True)
    own = np.arange(L.shape[0])
    best = own.copy()
    best[row[order][last]] = column[order][last]
    mutual = best[best] == own
    root = np.where(mutual, np.minimum(best, own), own)
    root = np.where(mutual, root, root[best])
    return np.unique(root, return_inverse=True)[1].astype(np.int64)


def _contract(L: sp.csc_array, cluster: Ints) -> sp.csc_array:
    """Return the Laplacian of the graph whose nodes are the clusters of L's."""
    graph = L.tocoo()
    n = int(cluster.max()) + 1
    return sp.coo_array((graph.data, (cluster[graph.row], cluster[graph.col])), (n, n)).tocsc()
