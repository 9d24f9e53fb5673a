"""Analytic surfaces with known flat images, to test flatteners on one surface alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats, Ints, TriMesh
from geounfold.synthetic.profile import require_finite, require_positive


@dataclass(frozen=True, eq=False)
class AnalyticSurface:
    """A triangulated surface and its flat image.

    Attributes
    ----------
    mesh : TriMesh
        The curved surface; normals point to the outer (convex) side.
    uv : (n, 2) float
        Flat image of the smooth surface (arc lengths); the mesh's edges agree with it to second
        order in the spacing. For the cap, which cannot be flattened, the equidistant image.
    chord_uv : (n, 2) float or None
        Flat image of the mesh itself, in which every edge keeps its length to rounding; None if
        the mesh cannot be flattened.
    """

    mesh: TriMesh
    uv: Floats
    chord_uv: Floats | None

    @property
    def developable(self) -> bool:
        """Whether an exact flattening of the mesh exists."""
        return self.chord_uv is not None


def _grid(n: int, m: int) -> tuple[Floats, Floats, Ints]:
    """Return parameters in [0, 1], (n m,) each, and faces (2 (n-1)(m-1), 3)."""
    if min(n, m) < 2:
        raise OptionError(f"n must be two numbers from 2 up, not {(n, m)!r}")
    a, b = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    k = np.arange(n * m).reshape(n, m)
    p, q, r, s = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    F = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
    return a.ravel(), b.ravel(), F


def slab(
    length: float = 100.0, width: float = 60.0, n: tuple[int, int] = (33, 17), dip: float = 0.0
) -> AnalyticSurface:
    """Return a plane, which flattening does not change.

    Parameters
    ----------
    length, width : float
        Sides of the plane; the length is along the dip.
    n : (int, int)
        Vertices along length and width.
    dip : float
        Angle from the horizontal, degrees.
    """
    require_positive("length", length)
    require_positive("width", width)
    require_finite("dip", dip)
    a, b, F = _grid(*n)
    uv = np.stack([a * length, b * width], axis=1)
    c, s = np.cos(np.radians(dip)), np.sin(np.radians(dip))
    V = np.stack([uv[:, 0] * c, uv[:, 1], uv[:, 0] * s], axis=1)
    return AnalyticSurface(TriMesh(V, F), uv, uv)


def cylinder(
    radius: float = 50.0,
    angle: float = 120.0,
    length: float = 100.0,
    n: tuple[int, int] = (33, 17),
) -> AnalyticSurface:
    """Return part of a cylinder about the y axis, with edges along its rulings and the crest up.

    Parameters
    ----------
    radius : float
        Radius of the cylinder.
    angle : float
        Opening, degrees, below 360.
    length : float
        Length along the axis.
    n : (int, int)
        Vertices around and along the axis.
    """
    require_positive("radius", radius)
    require_positive("length", length)
    opening = _opening(angle)
    a, b, F = _grid(*n)
    turn = (a - 0.5) * opening
    V = np.stack([radius * np.sin(turn), b * length, radius * np.cos(turn)], axis=1)
    uv = np.stack([a * radius * opening, b * length], axis=1)
    half = opening / (n[0] - 1) / 2
    return AnalyticSurface(TriMesh(V, F), uv, uv * [np.sin(half) / half, 1.0])


def cone(
    inner: float = 30.0,
    outer: float = 130.0,
    angle: float = 120.0,
    half_apex: float = 40.0,
    n: tuple[int, int] = (33, 17),
) -> AnalyticSurface:
    """Return part of a cone about the z axis, apex at the origin, opening downwards.

    Parameters
    ----------
    inner, outer : float
        Distances from the apex along the rulings.
    angle : float
        Opening about the axis, degrees, below 360.
    half_apex : float
        Angle between axis and rulings, degrees, between 0 and 90.
    n : (int, int)
        Vertices along the rulings and around.

    Notes
    -----
    Rulings at an angle psi from the axis keep their lengths. Two of them an angle phi apart about
    the axis have a flat angle of ``phi sin psi`` on the cone, and of
    ``2 asin(sin psi sin(phi / 2))`` on the pyramid of the mesh.
    """
    require_positive("inner", inner)
    require_positive("outer", outer)
    if not inner < outer:
        raise OptionError(f"cone must have inner < outer, not {inner!r} and {outer!r}")
    require_positive("half_apex", half_apex)
    if half_apex >= 90:
        raise OptionError(f"half_apex must lie in (0, 90) degrees, not {half_apex!r}")
    opening, sine = _opening(angle), float(np.sin(np.radians(half_apex)))
    a, b, F = _grid(*n)
    r, turn = inner + a * (outer - inner), b * opening
    cosine = float(np.cos(np.radians(half_apex)))
    V = np.stack([r * sine * np.cos(turn), r * sine * np.sin(turn), -r * cosine], axis=1)
    count = n[1] - 1
    chord = count * 2 * np.arcsin(sine * np.sin(opening / count / 2))
    return AnalyticSurface(
        TriMesh(V, F), _polar(r, turn * sine), _polar(r, turn * (chord / opening))
    )


def spherical_cap(
    radius: float = 100.0, angle: float = 40.0, n: tuple[int, int] = (33, 33)
) -> AnalyticSurface:
    """Return a square patch of a sphere around its top.

    It has Gaussian curvature, so no flattening keeps its lengths; uv is the azimuthal
    equidistant image, exact along the lines through the top.

    Parameters
    ----------
    radius : float
        Radius of the sphere.
    angle : float
        Angle from the top to the middle of a side, degrees, below 127.
    n : (int, int)
        Vertices along the sides.
    """
    require_positive("radius", radius)
    require_positive("angle", angle)
    if angle * np.sqrt(2) >= 180:
        raise OptionError(f"cap angle must lie below 127 degrees, not {angle!r}")
    a, b, F = _grid(*n)
    xy = np.stack([2 * a - 1, 2 * b - 1], axis=1) * np.radians(angle)
    turn = np.linalg.norm(xy, axis=1)
    shrink = np.sinc(turn / np.pi)
    V = np.column_stack([xy * shrink[:, None], np.cos(turn)]) * radius
    return AnalyticSurface(TriMesh(V, F), xy * radius, None)


def _opening(angle: float) -> float:
    require_positive("angle", angle)
    if angle >= 360:
        raise OptionError(f"angle must lie below 360 degrees, not {angle!r}")
    return float(np.radians(angle))


def _polar(r: Floats, turn: Floats) -> Floats:
    return np.stack([r * np.cos(turn), r * np.sin(turn)], axis=1)
