"""Turn inverted tetrahedra upright by moving few vertices (foldover-free energy).

Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, "Foldover-free maps in 50 lines of
code", 2021 (arXiv 2102.03069): with J the deformation of a tetrahedron from its rest shape and
``chi(d) = (d + sqrt(eps^2 + d^2)) / 2``, the energy

    |J|^2 / chi(det J)^(2/3) + (1 + det(J)^2) / chi(det J)

is finite for inverted elements as long as eps > 0.  It is minimised repeatedly, and eps goes to
zero with the worst determinant; then no element can invert any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import Floats, Ints

_ROUNDS = 10  # values of eps
_STEPS = 50  # L-BFGS steps for each
_RINGS = (1, 2, 4)  # rings around the bad elements whose vertices may move, tried in order
_SOUND = 1e-3  # least determinant of an element that counts as upright
_LEAST = 1e-6  # eps if nothing is inverted

_FALLS = 0.5
"""Share of the inverted elements, of two values of eps before, below which others are tried.

Measured: 14 neighbourhoods of four bodies, 10 of them with inverted elements, came out upright
within three values, and two values left a sixth at most.  Of a body that never did, two values left
0.8 and 0.95, in each of its neighbourhoods alike.
"""


def untangle(V: Floats, T: Ints, rest: Floats, bad: Ints) -> Floats:
    """Return vertices, with as few as possible moved, such that no tetrahedron is inverted.

    Parameters
    ----------
    V : (n, 3) float
        Vertices.
    T : (m, 4) int
        Tetrahedra, right-handed if upright.
    rest : (n, 3) float
        Vertices of the rest shapes: those in the other space.  A tetrahedron that is not upright
        there has a regular rest shape of the median volume.
    bad : (k,) int
        Vertices of the inverted elements.

    Returns
    -------
    (n, 3) float
        The answer of the first neighbourhood without inverted elements; else that of the last,
        after which wider ones are hopeless.
    """
    inverse = _rest_shapes(rest, T)
    free = np.zeros(len(V), dtype=bool)
    free[bad] = True
    out: Floats = V
    done = 0
    for rings in _RINGS:
        for _ in range(rings - done):
            free[T[free[T].any(axis=1)]] = True
        done = rings
        near = free[T].any(axis=1)
        used, local = np.unique(T[near], return_inverse=True)
        problem = _Problem(V[used], local.reshape(-1, 4), inverse[near], np.flatnonzero(free[used]))
        places, left = problem.solve()
        out = V.copy()
        out[used] = places
        if not 0 < left[-1] <= _FALLS * left[0]:
            break
    return out


def _rest_shapes(rest: Floats, T: Ints) -> Floats:
    """Return the inverse of each rest tetrahedron's edge matrix (edges as rows), (m, 3, 3)."""
    volume = tet_volumes(rest, T)
    sound = volume > 0
    typical = float(np.median(volume[sound])) if sound.any() else 1.0
    regular = np.array([[0.0, 1, 1], [1, 0, 1], [1, 1, 0]]) * (3 * typical) ** (1 / 3)
    edges = rest[T[:, 1:]] - rest[T[:, :1]]
    edges[~sound] = regular * np.sign(np.linalg.det(regular))
    return np.asarray(np.linalg.inv(edges), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Problem:
    """The elements around the free vertices, and the energy as a function of these vertices."""

    V: Floats
    T: Ints
    inverse: Floats
    free: Ints

    def solve(self) -> tuple[Floats, list[int]]:
        """Return all vertices, and the inverted elements at first and after each value of eps."""
        x = self.V[self.free].ravel()
        found = self._determinants(x)
        worst, left = found.min(), [int((found <= 0).sum())]
        for _ in range(_ROUNDS):
            eps = float(np.sqrt(_LEAST**2 + 0.04 * min(worst, 0.0) ** 2))
            result = minimize(
                self._energy, x, (eps,), "L-BFGS-B", jac=True, options={"maxiter": _STEPS}
            )
            x, found = result.x, self._determinants(result.x)
            worst = found.min()
            left.append(int((found <= 0).sum()))
            if worst > _SOUND or (len(left) > 2 and left[-1] > max(1, _FALLS * left[-3])):
                break
        return self._placed(x), left

    def _placed(self, x: Floats) -> Floats:
        out = self.V.copy()
        out[self.free] = x.reshape(-1, 3)
        return out

    def _deformations(self, x: Floats) -> Floats:
        V = self._placed(x)
        out: Floats = self.inverse @ (V[self.T[:, 1:]] - V[self.T[:, :1]])
        return out

    def _determinants(self, x: Floats) -> Floats:
        return np.asarray(np.linalg.det(self._deformations(x)))

    def _energy(self, x: Floats, eps: float) -> tuple[float, Floats]:
        """Return the energy and its gradient at x."""
        K = self._deformations(x)  # transposed deformation gradients
        a, b, c = K[:, 0], K[:, 1], K[:, 2]
        cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        det = np.einsum("ij,ij->i", a, cofactor[:, 0])
        root = np.sqrt(eps * eps + det * det)
        # The direct formula cancels if det is far below zero.
        chi = np.where(det > 0, (det + root) / 2, eps * eps / (2 * (root - det)))
        slope = chi / root
        square = np.einsum("ijk,ijk->i", K, K)
        power = chi ** (-2 / 3)
        energy = float((square * power + (1 + det * det) / chi).sum())
        along = (
            2 * det / chi - (1 + det * det) * slope / chi**2 - square * slope * power / chi / 1.5
        )
        gradient_K = 2 * power[:, None, None] * K + along[:, None, None] * cofactor
        edges = self.inverse.transpose(0, 2, 1) @ gradient_K
        corners = np.concatenate([-edges.sum(axis=1)[:, None], edges], axis=1)
        pull = [
            np.bincount(self.T.ravel(), c.ravel(), len(self.V)) for c in corners.T.swapaxes(1, 2)
        ]
        gradient: Floats = np.stack(pull, axis=1).astype(np.float64)
        return energy, gradient[self.free].ravel()
