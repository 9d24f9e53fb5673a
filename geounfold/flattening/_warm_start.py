"""As-rigid-as-possible steps: the warm start of the springs."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from geounfold.flattening._linear import PinnedSolver, edge_laplacian, incidence
from geounfold.flattening._problem import Problem, displacement, edge_of_side, flip_count
from geounfold.geometry.mesh import Floats

#: The rigid steps end if one moves no vertex by more than this share of the surface's size, or
#: after this number.
TOL, STEPS = 1e-3, 60


class RigidSteps:
    """Local-global steps of the ARAP energy on rest triangles (Liu et al. 2008).

    Each step turns every rest triangle to its image and solves one Laplacian system, factored once.
    It uses rest lengths only, so it also works for lengths along arcs.

    Attributes
    ----------
    laplacian : PinnedSolver
        Solver of the cotangent Laplacian; includes a fill-reducing order of the vertices.
    """

    laplacian: PinnedSolver

    def __init__(self, problem: Problem) -> None:
        F, z = problem.mesh.F, problem.corners
        n = len(problem.mesh.V)
        first, second = [1, 2, 0], [2, 0, 1]
        self._side = z[:, second] - z[:, first]
        inner = (z[:, first] - z) * np.conj(z[:, second] - z)
        cotangent = inner.real / (2 * problem.areas)[:, None]
        ends = np.stack([F[:, first].ravel(), F[:, second].ravel()], axis=1)
        self._difference = incidence(ends, n)
        # Its transpose, each side of each face weighted by half its cotangent.
        d = self._difference
        half = cotangent.ravel() / 2
        weighted = d.data * np.repeat(half, 2)
        self._gather = sp.csc_array((weighted, d.indices, d.indptr), shape=d.shape[::-1])
        self._pull = cotangent * np.conj(self._side)
        edge = edge_of_side(F, problem.edges, n).ravel()
        weights = np.bincount(edge, half, len(problem.edges)).astype(np.float64)
        self.laplacian = PinnedSolver(edge_laplacian(problem.edges, weights, n))

    def __call__(self, uv: Floats) -> Floats:
        """Return the positions after one step, (n, 2), centred."""
        now = (self._difference @ (uv[:, 0] + 1j * uv[:, 1])).reshape(-1, 3)
        turn = (self._pull * now).sum(axis=1)
        turn /= np.maximum(np.abs(turn), np.finfo(float).tiny)
        load = self._gather @ (turn[:, None] * self._side).ravel()
        out = self.laplacian.solve(np.column_stack([load.real, load.imag]))
        centred: Floats = out - out.mean(axis=0)
        return centred


def relax(step: RigidSteps, uv: Floats, problem: Problem) -> tuple[Floats, Floats | None, int]:
    """Return the positions after some steps, the last ones without flips, and the steps taken."""
    F = problem.mesh.F
    unfolded = None if flip_count(uv, F) else uv
    for count in range(1, STEPS + 1):
        after = step(uv)
        moved = displacement(uv, after)
        uv = after
        if flip_count(uv, F) == 0:
            unfolded = uv
        if moved <= TOL * problem.size:
            return uv, unfolded, count
    return uv, unfolded, STEPS
