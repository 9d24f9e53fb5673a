"""A barrier that keeps triangles from folding over while the springs relax."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.measures import cross2, triangle_areas
from geounfold.geometry.mesh import Floats, Ints

#: Area ratio below which the barrier acts.
REACH = 0.9

#: Share of the way to the first folded triangle that a step may go.
SHARE = 0.9


class FoldGuard:
    """The barrier ``B = C sum A psi(A'/A)``, ``psi(r) = -(r - REACH)^2 ln(r / REACH)``.

    It is zero, with two continuous derivatives, if a triangle keeps more than ``REACH`` of
    its rest area, and infinite if a triangle has none left (Li et al. 2020 use this function
    against contact).  Wang et al. (2002) penalise overlaps likewise, by extra springs.

    Parameters
    ----------
    F : (m, 3) int
        Faces.
    areas : (m,) float
        Rest areas.
    """

    def __init__(self, F: Ints, areas: Floats) -> None:
        self._F, self._areas = F, areas

    def energy(self, uv: Floats) -> float:
        """Return B; infinite if a triangle is folded over."""
        ratio = triangle_areas(uv, self._F) / self._areas
        if not (ratio > 0).all():
            return float("inf")
        near = ratio < REACH
        r = ratio[near]
        return float((self._areas[near] * -((r - REACH) ** 2) * np.log(r / REACH)).sum())

    def near(self, uv: Floats) -> tuple[Ints, Floats, Floats, Floats]:
        """Return the faces the barrier acts on and, per face, its derivatives.

        Returns
        -------
        faces : (q, 3) int
            Vertices of these faces.
        slope : (q,) float
            First derivative of psi.
        curvature : (q,) float
            Second derivative of psi over the rest area.
        gradient : (q, 3, 2) float
            Derivative of the flat area with respect to each corner.
        """
        ratio = triangle_areas(uv, self._F) / self._areas
        index = np.flatnonzero(ratio < REACH)
        r, F = ratio[index], self._F[index]
        log, gap = np.log(r / REACH), r - REACH
        slope = -2 * gap * log - gap**2 / r
        curvature = (-2 * log - 4 * gap / r + (gap / r) ** 2) / self._areas[index]
        side = uv[F[:, [2, 0, 1]]] - uv[F[:, [1, 2, 0]]]
        gradient = np.stack([-side[..., 1], side[..., 0]], axis=-1) / 2
        return F, slope, curvature, gradient

    def longest_step(self, uv: Floats, step: Floats) -> float:
        """Return the length (at most 1) of a step before a triangle would lose its area."""
        F = self._F
        p, q = uv[F[:, 1]] - uv[F[:, 0]], uv[F[:, 2]] - uv[F[:, 0]]
        dp, dq = step[F[:, 1]] - step[F[:, 0]], step[F[:, 2]] - step[F[:, 0]]
        c, b, a = cross2(p, q), cross2(p, dq) + cross2(dp, q), cross2(dp, dq)
        # Smallest positive root of a t^2 + b t + c, c > 0, without cancellation.
        root = np.sqrt(np.maximum(b * b - 4 * a * c, 0))
        real = (b * b - 4 * a * c >= 0) & ((b < 0) | (a < 0))
        divisor = -b + root
        ok = real & (divisor > 0)
        first = 2 * c[ok] / divisor[ok]
        return float(min(1.0, SHARE * first.min(initial=np.inf)))
