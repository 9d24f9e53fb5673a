"""Fold profiles given by their heading along arc length, and flexural slip on them.

In cross-section the mid surface of a cylindrical fold is a plane curve ``P(s)`` of arc length s,
with tangent ``T = (cos theta, sin theta)`` and normal ``N = (-sin theta, cos theta)``. A point at
signed normal offset t lies at ``P(s) + t N(s)``; the layer at that offset is ``1 - t theta'`` times
as long as the mid surface. Flexural slip keeps the length of every layer and the thickness, so
before folding the point was at

    u = s - t (theta(s) - pin),    w = t,

with pin the heading at which layers do not slip (the pin line). The area element is
``(1 - t theta') ds dt = du dw`` on both sides, so the map preserves volume exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_SMOOTH_PEAK = 15 / 8  # largest slope of the quintic smoothstep

Residual = Callable[[Floats, Ints], tuple[Floats, Floats]]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))


def require_positive(name: str, value: float) -> None:
    """Raise OptionError unless a value is finite and above zero."""
    if not (_is_number(value) and value > 0):
        raise OptionError(f"{name} must be a positive number, not {value!r}")


def require_finite(name: str, value: float) -> None:
    """Raise OptionError unless a value is finite."""
    if not _is_number(value):
        raise OptionError(f"{name} must be a finite number, not {value!r}")


class Element(Protocol):
    """One term of a heading profile (see Sinusoid, Bend, Bump)."""

    def heading(self, s: Floats) -> Floats:
        """Return the heading, radians, at arc lengths s (n,)."""

    def curvature(self, s: Floats) -> Floats:
        """Return the heading's derivative along arc length, (n,), radians per length unit."""

    def swing(self) -> float:
        """Return a bound on the size of the heading, radians."""

    def breaks(self) -> tuple[float, ...]:
        """Return the arc lengths at which the heading is not smooth."""

    def scale(self) -> float:
        """Return the shortest length, along the arc, over which the heading varies."""

    def stretched(self, factor: float) -> Element:
        """Return the element for a sheet ``factor`` times as long."""


@dataclass(frozen=True, kw_only=True)
class Sinusoid:
    """A heading ``amplitude * sin(2 pi s / wavelength + phase)``: a train of folds.

    Parameters
    ----------
    amplitude : float
        Largest limb dip, degrees.
    wavelength : float
        Arc length of one anticline and one syncline together.
    phase : float
        Phase at s = 0, degrees; with 90 the profile starts at the steepest upward limb.
    """

    amplitude: float
    wavelength: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require_finite("amplitude", self.amplitude)
        require_positive("wavelength", self.wavelength)
        require_finite("phase", self.phase)

    def _angle(self, s: Floats) -> Floats:
        out: Floats = s * (2 * np.pi / self.wavelength) + np.radians(self.phase)
        return out

    def heading(self, s: Floats) -> Floats:
        """Return the heading, radians, at arc lengths s (n,)."""
        out: Floats = np.radians(self.amplitude) * np.sin(self._angle(s))
        return out

    def curvature(self, s: Floats) -> Floats:
        """Return the heading's derivative along arc length, (n,)."""
        rate = 2 * np.pi / self.wavelength
        out: Floats = np.radians(self.amplitude) * rate * np.cos(self._angle(s))
        return out

    def swing(self) -> float:
        """Return a bound on the size of the heading, radians."""
        return float(np.abs(np.radians(self.amplitude)))

    def breaks(self) -> tuple[float, ...]:
        """Return no arc lengths: the heading is smooth."""
        return ()

    def scale(self) -> float:
        """Return the length over which the heading varies."""
        return self.wavelength / 4

    def stretched(self, factor: float) -> Sinusoid:
        """Return the element itself: a longer sheet has more folds."""
        return self


@dataclass(frozen=True, kw_only=True)
class Bend:
    """A hinge: the heading changes by ``change`` around arc length ``at``.

    Parameters
    ----------
    at : float
        Arc length of the hinge's middle.
    change : float
        Change of heading, degrees; negative for an anticline's crest.
    radius : float
        Smallest radius of curvature of the mid surface in the hinge.
    shape : {'smooth', 'arc'}
        Change of heading along the hinge: linear (a circular arc), or a quintic smoothstep, for
        which the hinge is 15/8 as long.
    """

    at: float
    change: float
    radius: float
    shape: str = "smooth"

    def __post_init__(self) -> None:
        require_finite("at", self.at)
        require_finite("change", self.change)
        require_positive("radius", self.radius)
        if self.shape not in ("smooth", "arc"):
            raise OptionError(f"bend shape {self.shape!r} is not one of: smooth, arc")

    @property
    def extent(self) -> float:
        """Arc length of the hinge."""
        peak = _SMOOTH_PEAK if self.shape == "smooth" else 1.0
        return float(max(peak * self.radius * self.swing(), 1e-9 * self.radius))

    def _share(self, s: Floats) -> Floats:
        out: Floats = np.clip((s - self.at) / self.extent + 0.5, 0.0, 1.0)
        return out

    def heading(self, s: Floats) -> Floats:
        """Return the heading, radians, at arc lengths s (n,)."""
        x = self._share(s)
        if self.shape == "smooth":
            x = x**3 * (10 + x * (6 * x - 15))
        out: Floats = np.radians(self.change) * x
        return out

    def curvature(self, s: Floats) -> Floats:
        """Return the heading's derivative along arc length, (n,)."""
        x = self._share(s)
        slope = 30 * (x * (1 - x)) ** 2 if self.shape == "smooth" else (x > 0) & (x < 1)
        out: Floats = np.radians(self.change) / self.extent * slope
        return out

    def swing(self) -> float:
        """Return a bound on the size of the heading, radians."""
        return float(np.abs(np.radians(self.change)))

    def breaks(self) -> tuple[float, ...]:
        """Return the arc lengths at which the hinge begins and ends."""
        return (self.at - self.extent / 2, self.at + self.extent / 2)

    def scale(self) -> float:
        """Return the length over which the heading varies."""
        return self.extent / 2

    def stretched(self, factor: float) -> Bend:
        """Return the hinge moved and opened."""
        return replace(self, at=self.at * factor, radius=self.radius * factor)


@dataclass(frozen=True, kw_only=True)
class Bump:
    """A change of heading that fades out, ``amplitude * exp(-((s - at) / width)^2 / 2)``.

    Parameters
    ----------
    at : float
        Arc length of the bump's middle.
    amplitude : float
        Largest change of heading, degrees.
    width : float
        Standard deviation along arc length.
    """

    at: float
    amplitude: float
    width: float

    def __post_init__(self) -> None:
        require_finite("at", self.at)
        require_finite("amplitude", self.amplitude)
        require_positive("width", self.width)

    def heading(self, s: Floats) -> Floats:
        """Return the heading, radians, at arc lengths s (n,)."""
        out: Floats = np.radians(self.amplitude) * np.exp(-(((s - self.at) / self.width) ** 2) / 2)
        return out

    def curvature(self, s: Floats) -> Floats:
        """Return the heading's derivative along arc length, (n,)."""
        out: Floats = -(s - self.at) / self.width**2 * self.heading(s)
        return out

    def swing(self) -> float:
        """Return a bound on the size of the heading, radians."""
        return float(np.abs(np.radians(self.amplitude)))

    def breaks(self) -> tuple[float, ...]:
        """Return no arc lengths: the heading is smooth."""
        return ()

    def scale(self) -> float:
        """Return the length over which the heading varies."""
        return self.width

    def stretched(self, factor: float) -> Bump:
        """Return the bump moved and widened."""
        return replace(self, at=self.at * factor, width=self.width * factor)


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A fold's profile: the heading of its mid surface as a function of arc length.

    Parameters
    ----------
    elements : tuple of Sinusoid, Bend or Bump
        Terms of which the headings are added; none for a plane.
    start : float
        Constant heading, degrees; 0 is horizontal, 90 is straight up.

    Examples
    --------
    >>> chevron = Profile(start=40, elements=(Bend(at=300, change=-80, radius=50),))
    >>> [round(float(a)) for a in np.degrees(chevron.heading(np.array([0.0, 300.0, 600.0])))]
    [40, 0, -40]
    """

    elements: tuple[Element, ...] = ()
    start: float = 0.0

    def __post_init__(self) -> None:
        require_finite("start", self.start)

    def heading(self, s: Floats) -> Floats:
        """Return the heading, radians, at arc lengths s (n,)."""
        out = np.full(np.shape(s), np.radians(self.start))
        for element in self.elements:
            out += element.heading(s)
        return out

    def curvature(self, s: Floats) -> Floats:
        """Return the heading's derivative along arc length, (n,); positive if it turns upwards."""
        out = np.zeros(np.shape(s))
        for element in self.elements:
            out += element.curvature(s)
        return out

    def swing(self) -> float:
        """Return a bound on the heading's distance from ``start``, radians."""
        return sum(element.swing() for element in self.elements)

    def stretched(self, factor: float) -> Profile:
        """Return the profile of a sheet ``factor`` times as long (see the elements)."""
        return replace(self, elements=tuple(e.stretched(factor) for e in self.elements))


@dataclass(frozen=True, eq=False)
class FlexuralSlip:
    """The volume-preserving map of a fold's section, between (u, w) and (x, z), both ways.

    Attributes
    ----------
    profile : Profile
        Heading along the mid surface.
    length : float
        Extent of the sheet before folding: u runs over ``[0, length]``.
    reach : float
        Largest normal offset at which the map is used.
    pin : float or None
        Heading, radians, at which layers do not slip; None for the mean over the length.
    origin : float
        Arc length of the point x = z = 0.
    closed : bool
        Whether the mid curve ends where it starts. The feet of all points are then in
        ``[0, length]``.
    """

    profile: Profile
    length: float
    reach: float
    pin: float | None = None
    origin: float = 0.0
    closed: bool = False

    @cached_property
    def still(self) -> float:
        """Heading at which layers do not slip, radians: ``pin``, or the mean over the length."""
        if self.pin is not None:
            return self.pin
        knots = self._cut(0.0, self.length)
        middle, half = (knots[1:] + knots[:-1]) / 2, np.diff(knots) / 2
        heading = self.profile.heading(middle[:, None] + half[:, None] * _NODES)
        return float((heading @ _WEIGHTS * half).sum() / self.length)

    @cached_property
    def knots(self) -> Floats:
        """Arc lengths, rising, between which the heading is smooth and nearly straight."""
        slip = self.reach * (self.profile.swing() + np.abs(self._start() - self.still))
        return self._cut(min(-slip, self.origin), max(self.length + slip, self.origin))

    @cached_property
    def _anchors(self) -> Floats:
        """The mid curve's points at the knots, (k, 2)."""
        steps = self._advance(self.knots[:-1], np.diff(self.knots))
        anchors = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        k = min(int(np.searchsorted(self.knots, self.origin, "right")) - 1, len(steps) - 1)
        here = np.array([self.origin - self.knots[k]])
        out: Floats = anchors - anchors[k] - self._advance(self.knots[k : k + 1], here)
        return out

    @cached_property
    def _feet(self) -> tuple[cKDTree, Floats]:
        """A tree of samples of the mid curve that the sheet covers, and their arc lengths."""
        if self.closed:
            s = self._cut(0.0, self.length)
            return cKDTree(self.points(s)), s
        heights = np.linspace(-self.reach, self.reach, 33)
        ends = [self.arc_length(np.full(33, u), heights) for u in (0.0, self.length)]
        spare = 2 * float(np.diff(self.knots).max())
        s = self._cut(float(ends[0].min()) - spare, float(ends[1].max()) + spare)
        return cKDTree(self.points(s)), s

    def _start(self) -> float:
        return float(np.radians(self.profile.start))

    def _cut(self, low: float, high: float) -> Floats:
        """Return arc lengths from low to high, all breaks among them, finely spaced."""
        scales = [e.scale() for e in self.profile.elements]
        step = min([self.length / 500, *(scale / 10 for scale in scales)])
        count = int(np.ceil((high - low) / max(step, self.length / 2e5))) + 1
        breaks = [b for e in self.profile.elements for b in e.breaks() if low < b < high]
        return np.unique(np.concatenate([np.linspace(low, high, count), breaks]))

    def _advance(self, s: Floats, ds: Floats) -> Floats:
        """Return the integral of the tangent from s to s + ds, (n, 2), by Gauss's rule."""
        out = np.zeros((len(s), 2))
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            heading = self.profile.heading(s + ds * (1 + node) / 2)
            out[:, 0] += weight * np.cos(heading)
            out[:, 1] += weight * np.sin(heading)
        out *= ds[:, None] / 2
        return out

    def points(self, s: Floats) -> Floats:
        """Return the mid curve's points (x, z), (n, 2), at arc lengths s (n,)."""
        k = np.clip(np.searchsorted(self.knots, s, "right") - 1, 0, len(self.knots) - 2)
        out: Floats = self._anchors[k] + self._advance(self.knots[k], s - self.knots[k])
        return out

    def arc_length(self, u: Floats, w: Floats) -> Floats:
        """Return the arc lengths s (n,) of points' normals: ``s - w (theta(s) - still) = u``.

        The left side grows with s if ``1 - w theta' > 0``, so s is unique.
        """

        def residual(s: Floats, rows: Ints) -> tuple[Floats, Floats]:
            slip = w[rows] * (self.profile.heading(s) - self.still)
            return s - slip - u[rows], 1 - w[rows] * self.profile.curvature(s)

        bound = np.abs(w) * (self.profile.swing() + np.abs(self._start() - self.still)) + 1e-9
        guess = u + w * (self.profile.heading(u) - self.still)
        return bracketed_newton(residual, u - bound, u + bound, guess, 1e-14 * self.length)

    def slipped(self, s: Floats, w: Floats) -> Floats:
        """Return u (n,) of points at heights w (n,) on the normals at arc lengths s (n,)."""
        out: Floats = s - w * (self.profile.heading(s) - self.still)
        return out

    def fold(self, u: Floats, w: Floats) -> Floats:
        """Return the folded points (x, z), (n, 2), of points (u, w), each (n,)."""
        s = self.arc_length(u, w)
        heading = self.profile.heading(s)
        normal = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        out: Floats = self.points(s) + w[:, None] * normal
        return out

    def unfold(self, xz: Floats) -> tuple[Floats, Bools]:
        """Return (u, w), (n, 2), of folded points (x, z), and whether the sheet reaches them, (n,).

        A point out of reach has no truth; it gets False and a row of zeros. Such a point is farther
        from the mid curve than ``reach``, beyond its ends or beyond its centres of curvature.
        """
        tree, samples = self._feet
        limit = float(np.hypot(self.reach, np.diff(samples).max()) * (1 + 1e-9))
        nearest = np.asarray(tree.query(xz, distance_upper_bound=limit)[1])
        found: Bools = nearest < len(samples)
        rows = np.flatnonzero(found)
        near = np.clip(nearest[rows], 1, len(samples) - 2)
        s = self._foot(xz[rows], samples[near - 1], samples[near + 1], samples[near])
        along, t = self._offsets(xz[rows], s)
        good = (np.abs(along) <= 1e-9 * self.length) & (np.abs(t) <= self.reach * (1 + 1e-9))
        good &= 1 - t * self.profile.curvature(s) > 0
        found[rows] = good
        out = np.zeros((len(xz), 2))
        out[rows[good]] = np.stack([self.slipped(s, t)[good], t[good]], axis=1)
        return out, found

    def _offsets(self, xz: Floats, s: Floats) -> tuple[Floats, Floats]:
        """Return the points' offsets along the tangent and the normal at s."""
        heading = self.profile.heading(s)
        c, d = np.cos(heading), np.sin(heading)
        x, z = (xz - self.points(s)).T
        return c * x + d * z, c * z - d * x

    def _foot(self, xz: Floats, low: Floats, high: Floats, guess: Floats) -> Floats:
        """Return the arc lengths (n,) of the feet of perpendiculars on the mid curve."""

        def residual(s: Floats, rows: Ints) -> tuple[Floats, Floats]:
            along, t = self._offsets(xz[rows], s)
            return -along, 1 - t * self.profile.curvature(s)

        return bracketed_newton(residual, low, high, guess, 1e-14 * self.length)


def bracketed_newton(
    residual: Residual, low: Floats, high: Floats, guess: Floats, tol: float, max_iter: int = 80
) -> Floats:
    """Return roots (n,) of increasing functions by Newton's method, kept inside brackets.

    Parameters
    ----------
    residual : callable
        Function of trial values and their rows that returns values and slopes.
    low, high, guess : (n,) float
        Brackets and first trials. A step that leaves its bracket becomes a bisection.
    tol : float
        Size of a step below which a row's search ends.
    max_iter : int
        Largest number of steps.
    """
    low, high, x = low.copy(), high.copy(), np.clip(guess, low, high)
    rows = np.arange(len(x))
    for _ in range(max_iter):
        if not len(rows):
            break
        here = x[rows]
        value, slope = residual(here, rows)
        low[rows] = np.where(value < 0, here, low[rows])
        high[rows] = np.where(value > 0, here, high[rows])
        step = np.divide(value, slope, out=np.full_like(value, np.inf), where=slope > 0)
        trial = here - step
        outside = (trial < low[rows]) | (trial > high[rows])
        trial = np.where(outside, (low[rows] + high[rows]) / 2, trial)
        x[rows] = trial
        rows = rows[(np.abs(trial - here) > tol) & (value != 0)]
    return x
