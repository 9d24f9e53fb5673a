"""The mid surface as a spline: frames, curvature, closest points, flexural slip."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.igl import SurfaceIndex, barycentric_in_triangles
from geounfold.backends.threads import over_slices
from geounfold.geometry.measures import unit
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods.sheet.mid_surface.normal_equations import Stencils
from geounfold.methods.sheet.mid_surface.spline import Jet, SplineGrid

SLICE = 1 << 14
"""Points whose feet are found at once, by one core."""


class Foot(NamedTuple):
    """Feet of points: the closest points of a mid surface.

    ``U`` (n, 2): parameters; ``t`` (n,): signed offset along the normal, positive on the top's
    side; ``normal`` (n, 3): unit normal of the surface there; ``miss`` (n,): distance between the
    point and ``P(U) + t normal``, zero for a true foot.
    """

    U: Floats
    t: Floats
    normal: Floats
    miss: Floats

    @classmethod
    def empty(cls, count: int) -> Foot:
        """Return feet of ``count`` points that are still to be set."""
        return cls(*(np.empty((count, *last)) for last in ((2,), (), (3,), ())))


def normals(jet: Jet) -> Floats:
    """Return the unit normals P_u x P_v of a surface's jet, (n, 3)."""
    return unit(np.cross(jet.u, jet.v))


def second_form(jet: Jet, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients L, M, N of the second fundamental form, each (n,)."""
    return (
        np.einsum("ij,ij->i", jet.uu, normal),
        np.einsum("ij,ij->i", jet.uv, normal),
        np.einsum("ij,ij->i", jet.vv, normal),
    )


def principal_curvatures(jet: Jet) -> tuple[Floats, Floats]:
    """Return the principal curvatures (k1 >= k2), positive if the top side is concave."""
    L, M, N = second_form(jet, normals(jet))
    E, F, G = (
        np.einsum("ij,ij->i", a, b) for a, b in ((jet.u, jet.u), (jet.u, jet.v), (jet.v, jet.v))
    )
    area2 = np.maximum(E * G - F * F, 1e-12)
    mean = (L * G - 2 * M * F + N * E) / (2 * area2)
    gauss = (L * N - M * M) / area2
    spread = np.sqrt(np.maximum(mean * mean - gauss, 0))
    return mean + spread, mean - spread


@dataclass(frozen=True, eq=False)
class MidSurface:
    """A mid surface P(U): spline coefficients and a triangulated sampling to search in.

    Attributes
    ----------
    grid : SplineGrid
        Basis in the flattened parameters U.
    C : (grid.size, 3) float
        Coefficients, working units.
    low, high : (2,) float
        Rectangle of U that the sampling covers.
    cell : float
        Spacing of the sampling.
    """

    grid: SplineGrid
    C: Floats
    low: Floats
    high: Floats
    cell: float = 1.5

    def with_coefficients(self, C: Floats) -> MidSurface:
        """Return the sheet with other coefficients over the same parameters."""
        return replace(self, C=C)

    def scaled(self, factor: float) -> MidSurface:
        """Return the sheet in another unit: lengths times a factor."""
        return MidSurface(
            self.grid.scaled(factor),
            self.C * factor,
            self.low * factor,
            self.high * factor,
            self.cell * factor,
        )

    def samples(self) -> tuple[Floats, Ints]:
        """Return the sampling's parameters (k, 2) and its triangles (m, 3)."""
        n = np.maximum(np.ceil((self.high - self.low) / self.cell).astype(int) + 1, 2)
        ij = np.stack(np.meshgrid(*map(np.arange, n), indexing="ij"), axis=-1).reshape(-1, 2)
        k = np.arange(n.prod()).reshape(n)
        a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
        F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        return self.low + ij * self.cell, F

    def at(self, U: Floats) -> Floats:
        """Return the points P(U), (n, 3)."""
        return self.grid.value(self.C, U)

    def jet(self, U: Floats) -> Jet:
        """Return P and its derivatives at U (n, 2)."""
        return self.grid.jet(self.C, U)

    def set_feet(self, foot: Foot, rows: slice, Q: Floats, U: Floats) -> None:
        """Set some rows of feet to those of points Q (k, 3) at parameters U (k, 2)."""
        P, Pu, Pv = self.grid.gradient(self.C, U)
        normal = unit(np.cross(Pu, Pv))
        t = np.einsum("ij,ij->i", Q - P, normal)
        foot.U[rows], foot.t[rows], foot.normal[rows] = U, t, normal
        foot.miss[rows] = np.linalg.norm(Q - P - t[:, None] * normal, axis=1)

    def search(self, near: Floats | None = None, reach: float = np.inf) -> FootSearch:
        """Return a search for feet on the part of the sheet within ``reach`` of parameters."""
        U, F = self.samples()
        if near is not None and np.isfinite(reach):
            distance = cKDTree(near).query(U, distance_upper_bound=reach)[0]
            keep = np.asarray(distance < reach)
            F = F[keep[F].all(axis=1)]
            used, F = np.unique(F, return_inverse=True)
            U, F = U[used], F.reshape(-1, 3)
        return FootSearch(self, U, F, SurfaceIndex(self.at(U), F))


@dataclass(frozen=True, eq=False)
class FootSearch:
    """A search structure over part of a sheet (`MidSurface.search`)."""

    sheet: MidSurface
    U: Floats
    F: Ints
    index: SurfaceIndex

    def feet(self, Q: Floats, newton: int = 2) -> Foot:
        """Return the feet of points Q (n, 3): nearest sample triangle, then Newton steps."""
        _, face, closest = self.index.closest(Q)
        out = Foot.empty(len(Q))

        def work(rows: slice) -> None:
            corners = self.F[face[rows]]
            weights = barycentric_in_triangles(closest[rows], self.index.V, corners)
            weights = np.where(np.isfinite(weights), weights, 1 / 3)  # triangles without area
            U = np.einsum("ij,ijk->ik", weights, self.U[corners])
            for _ in range(newton):
                U = U + newton_step(self.sheet, Q[rows], self.sheet.jet(U))
            self.sheet.set_feet(out, rows, Q[rows], U)

        over_slices(work, len(Q), SLICE)
        return out


def newton_step(sheet: MidSurface, Q: Floats, jet: Jet) -> Floats:
    """Return the step (n, 2) in the parameters towards the feet of points Q (n, 3).

    The Newton matrix is the first form minus t times the second: the Hessian of half the squared
    distance without third derivatives.  Steps are clipped to one knot.
    """
    normal = normals(jet)
    r = Q - jet.value
    t = np.einsum("ij,ij->i", r, normal)
    L, M, N = second_form(jet, normal)
    E = np.einsum("ij,ij->i", jet.u, jet.u) - t * L
    F = np.einsum("ij,ij->i", jet.u, jet.v) - t * M
    G = np.einsum("ij,ij->i", jet.v, jet.v) - t * N
    bu, bv = np.einsum("ij,ij->i", r, jet.u), np.einsum("ij,ij->i", r, jet.v)
    det = E * G - F * F
    good = det > 0.05  # past the focal surface a step would lead away from the foot
    safe = np.where(good, det, 1.0)
    step = np.stack([G * bu - F * bv, E * bv - F * bu], axis=1) / safe[:, None]
    limit = sheet.grid.step
    return np.where(good[:, None], np.clip(step, -limit, limit), 0.0)


def blur_shift(jet: Jet, t: Floats, variance: Floats) -> Floats:
    """Return the shift, along +normal, of the level surface at offset t by a Gaussian blur.

    The half level of a blurred indicator moves to the concave side by half the variance times the
    sum of the curvatures of the parallel surface, k / (1 - t k).  ``variance`` (3,) is given per
    working axis; its component along each principal direction is used.
    """
    normal = normals(jet)
    L, M, N = second_form(jet, normal)
    mean, half = (L + N) / 2, (L - N) / 2
    spread = np.sqrt(half * half + M * M)
    angle = 0.5 * np.arctan2(2 * M, L - N)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]

    def along(direction: Floats, k: Floats) -> Floats:
        d2 = direction * direction
        share = (d2 * variance).sum(axis=1) / np.maximum(d2.sum(axis=1), 1e-12)
        out: Floats = share * k / np.maximum(1 - t * k, 0.2)
        return out

    first = along(cos * jet.u + sin * jet.v, mean + spread)
    return (first + along(cos * jet.v - sin * jet.u, mean - spread)) / 2


def slip_potential(sheet: MidSurface, U: Floats, weights: Floats, bending: Stencils) -> Floats:
    """Return coefficients (size, 2) of the slip potential phi: grad phi = second form.

    In flexural slip, the point at offset t over U lay at u = U - t phi(U) before folding.  The free
    constant is the pin line; it is set so that the weighted mean over the samples U (n, 2) is zero.
    ``bending`` is the grid's second-order energy, a weak regularisation away from samples.
    """
    grid = sheet.grid
    jet = sheet.jet(U)
    L, M, N = second_form(jet, normals(jet))
    Bu, Bv = grid.basis(U, 1, 0), grid.basis(U, 0, 1)
    w = weights * grid.step**2
    K = grid.gram(Bu, w) + grid.gram(Bv, w) + 1e-3 * bending
    rhs = np.stack([Bu.T @ (w * L) + Bv.T @ (w * M), Bu.T @ (w * M) + Bv.T @ (w * N)], axis=1)
    phi = K.solver(ridge=1e-9)(rhs)
    mean: Floats = np.average(grid.value(phi, U), axis=0, weights=weights)
    return phi - mean


def near_any(points: Floats, marked: Bools, radius: float) -> Bools:
    """Return which points lie within a radius of any marked point, (n,)."""
    if not marked.any():
        return np.zeros(len(points), dtype=bool)
    distance = cKDTree(points[marked]).query(points, distance_upper_bound=radius)[0]
    return np.asarray(distance <= radius)
