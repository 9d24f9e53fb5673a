"""Flat positions from the distances to a few landmarks, by classical scaling.

The plane that best reproduces the squared distances among landmarks, centred, is spanned by the
two largest eigenvectors (Torgerson 1952); the other vertices follow from their distances to the
landmarks (de Silva and Tenenbaum 2004).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geounfold.errors import FlatteningError
from geounfold.flattening._problem import History, Problem, finish, upright
from geounfold.flattening._result import Flattening, Stop
from geounfold.geometry.mesh import Floats, Ints

#: Second eigenvalue over the first below which the distances are those of a line.
LINE = 1e-9


def to_landmarks(field: Callable[[int], Floats], V: Floats, most: int) -> tuple[Ints, Floats]:
    """Return landmarks (k,) and the distances (k, n) from each of them.

    The first is the vertex farthest from the mean, each further one the farthest from all before.

    Parameters
    ----------
    field : callable
        ``field(i)`` returns the distances from vertex i to all vertices, (n,).
    V : (n, 3) float
        Vertices.
    most : int
        Number of landmarks; all vertices if there are fewer.
    """
    if len(V) <= most:
        chosen = np.arange(len(V))
        return chosen, np.stack([field(k) for k in range(len(V))])
    nearest = np.full(len(V), np.inf)
    following = int(np.argmax(((V - V.mean(axis=0)) ** 2).sum(axis=1)))
    picked, rows = [], []
    for _ in range(most):
        picked.append(following)
        rows.append(field(following))
        nearest = np.minimum(nearest, rows[-1])
        nearest[picked] = -np.inf
        following = int(np.argmax(nearest))
    return np.array(picked), np.stack(rows)


def by_distances(problem: Problem, chosen: Ints, D: Floats, method: str, kind: str) -> Flattening:
    """Return the flattening with distances from the landmarks nearest to those given.

    Parameters
    ----------
    problem : Problem
        The surface.
    chosen : (k,) int
        Landmarks.
    D : (k, n) float
        Distance of every vertex from each of them, in the mesh's unit.
    method, kind : str
        Name of the method and kind of the distances, for the note.

    Raises
    ------
    FlatteningError
        The distances are those of a line.
    """
    uv = upright(scaled(D, chosen, method), problem.mesh.F)
    history = History.empty(problem)
    error = 0.0
    for k, row in zip(chosen, D, strict=True):
        error += float(np.mean((np.linalg.norm(uv - uv[k], axis=1) - row) ** 2))
    history.record(uv, error / len(chosen))
    note = f"{kind} distances from {len(chosen)} of {len(uv)} vertices"
    return finish(problem, uv, method, Stop.DIRECT, 0, history, note)


def scaled(D: Floats, chosen: Ints, method: str) -> Floats:
    """Return plane positions (n, 2) by the distances (k, n) from the landmarks.

    Raises
    ------
    FlatteningError
        The distances are those of a line; the message begins with the method's name.
    """
    squared = D * D
    among = squared[:, chosen]
    among = (among + among.T) / 2  # distances by the heat method are not symmetric
    mean = among.mean(axis=0)
    values, vectors = np.linalg.eigh(-(among - mean - mean[:, None] + mean.mean()) / 2)
    large, small = values[-1], values[-2]
    if not small > LINE * large:
        raise FlatteningError(f"{method}: the distances span no plane; take another method")
    axes = vectors[:, [-1, -2]] / np.sqrt([large, small])
    out: Floats = -(squared - mean[:, None]).T @ axes / 2
    return out
