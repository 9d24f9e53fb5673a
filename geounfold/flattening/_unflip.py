"""Turn back the few triangles that a flattener turned over, moving as little as possible.

Garanzha et al. 2021 (arXiv 2102.03069): the energy

    sum over triangles of A (tr(J'J) + det^2 J + 1) / chi(det J),
    chi(d) = (d + sqrt(e^2 + d^2)) / 2,

is finite for turned triangles, and grows without bound as e falls if d < 0; J is the map's
derivative on the triangle.  L-BFGS minimises it in rounds; e follows the worst determinant, ``e^2 =
1e-12 + 0.04 min(0, det)^2``.  If no triangle is turned, the minimum is an isometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.optimize as so

from geounfold.flattening._border import turned_over
from geounfold.flattening._problem import Problem
from geounfold.geometry.mesh import Bools, Floats, Ints

#: Rings of triangles around the turned ones whose vertices may move, from few to many.
RINGS = (1, 3, 8)

#: Rounds of L-BFGS, each with its own e, and steps in a round.
ROUNDS, STEPS = 12, 60

#: Share of turned triangles above which patches are not tried.
MOST = 0.05


@dataclass(frozen=True, eq=False)
class Untangled:
    """Positions without turned triangles, and the number of vertices free to move."""

    uv: Floats
    moved: int


def untangle(problem: Problem, uv: Floats) -> Untangled | None:
    """Return the flat positions with no triangle turned over, or None if that fails.

    Parameters
    ----------
    problem : Problem
        The surface and its rest triangles.
    uv : (n, 2) float
        Flat positions, some triangles turned over.
    """
    F = problem.mesh.F
    turned = turned_over(uv, F)
    if len(turned) > MOST * len(F):
        return None
    for rings in RINGS:
        free = _patch(F, turned, rings, len(uv))
        after = _relaxed(problem, uv, free)
        if not len(turned_over(after, F)):
            return Untangled(after, int(free.sum()))
    return None


def _patch(F: Ints, turned: Ints, rings: int, n: int) -> Bools:
    """Return the vertices of some faces and of ``rings - 1`` rings of faces around them, (n,)."""
    free = np.zeros(n, dtype=bool)
    free[F[turned]] = True
    for _ in range(rings - 1):
        free[F[free[F].any(axis=1)]] = True
    return free


def _relaxed(problem: Problem, uv: Floats, free: Bools) -> Floats:
    """Return the positions of least energy; vertices that are not free stay."""
    faces = free[problem.mesh.F].any(axis=1)
    F, z = problem.mesh.F[faces], problem.corners[faces]
    energy = _Energy(F, z, problem.areas[faces] / problem.areas[faces].sum())
    uv = uv.copy()

    def value(x: Floats, floor: float) -> tuple[float, Floats]:
        uv[free] = x.reshape(-1, 2)
        total, slope = energy(uv, floor)
        return total, slope[free].ravel()

    last = np.inf
    for _ in range(ROUNDS):
        worst = min(0.0, energy.least_determinant(uv))
        floor = float(np.sqrt(1e-12 + 0.04 * worst * worst))
        found = so.minimize(
            value,
            uv[free].ravel(),
            args=(floor,),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": STEPS},
        )
        uv[free] = found.x.reshape(-1, 2)
        if worst == 0 and found.fun >= last * (1 - 1e-6):
            break
        last = found.fun if worst == 0 else np.inf
    return uv


class _Energy:
    """The energy above and its gradient, on some triangles with weights that sum to 1."""

    def __init__(self, F: Ints, rest: np.ndarray, weights: Floats) -> None:
        self._F, self._weights = F, weights
        self._base, self._top = rest[:, 1].real, rest[:, 2]

    def _columns(self, uv: Floats) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns of J as complex numbers, two (m,) arrays."""
        w = uv[:, 0] + 1j * uv[:, 1]
        corner = w[self._F]
        along = (corner[:, 1] - corner[:, 0]) / self._base
        across = (corner[:, 2] - corner[:, 0] - self._top.real * along) / self._top.imag
        return along, across

    def least_determinant(self, uv: Floats) -> float:
        """Return the smallest determinant."""
        along, across = self._columns(uv)
        return float((np.conj(along) * across).imag.min())

    def __call__(self, uv: Floats, floor: float) -> tuple[float, Floats]:
        """Return the energy and its gradient, (n, 2)."""
        a, b = self._columns(uv)
        det = (np.conj(a) * b).imag
        root = np.hypot(floor, det)
        # This form does not cancel if the determinant is negative.
        chi = np.where(det > 0, (det + root) / 2, floor * floor / (2 * (root - np.minimum(det, 0))))
        top = (a * np.conj(a)).real + (b * np.conj(b)).real + det * det + 1
        by_det = (2 * det - top / root) / chi
        slope_a = self._weights * (2 * a / chi + by_det * (-1j * b))
        slope_b = self._weights * (2 * b / chi + by_det * (1j * a))
        third = slope_b / self._top.imag
        second = (slope_a - third * self._top.real) / self._base
        corners = np.stack([-second - third, second, third], axis=1)
        n = len(uv)
        pull = [
            np.bincount(self._F.ravel(), part.ravel(), n) for part in (corners.real, corners.imag)
        ]
        return float((self._weights * top / chi).sum()), np.column_stack(pull)
