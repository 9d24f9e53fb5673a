"""What happens to a layer, one event after another: folds and faults, each exact both ways.

Every fault moves its hanging wall along its own surface, so no gap opens. Strike follows the
right-hand rule: a fault dips to the right of its strike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.synthetic.profile import (
    FlexuralSlip,
    Profile,
    require_finite,
    require_positive,
)

_Triple = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class FoldEvent:
    """Flexural slip of all space about horizontal fold axes.

    Parameters
    ----------
    profile : Profile
        Heading along the mid curve; its arc length starts at ``start``.
    length : float
        Length of the mid curve. The body must lie well inside it.
    reach : float
        Largest distance from the mid curve, before folding, that is folded.
    start : float
        Distance across the fold axes, before folding, at which the mid curve starts.
    azimuth : float
        Angle by which the fold axes are turned from y about z, degrees anticlockwise.
    height : float
        z of the mid curve before folding.
    """

    profile: Profile
    length: float
    reach: float
    start: float = 0.0
    azimuth: float = 0.0
    height: float = 0.0

    def __post_init__(self) -> None:
        for name in ("length", "reach"):
            require_positive(name, getattr(self, name))
        for name in ("start", "azimuth", "height"):
            require_finite(name, getattr(self, name))

    @cached_property
    def slip(self) -> FlexuralSlip:
        """The fold's section; the middle of its length keeps its place."""
        return FlexuralSlip(self.profile, self.length, self.reach, origin=self.length / 2)

    @cached_property
    def _turn(self) -> Floats:
        a = np.radians(self.azimuth)
        return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) lie after the fold."""
        Q = P @ self._turn
        xz = self.slip.fold(Q[:, 0] - self.start, Q[:, 2] - self.height)
        Q[:, 0] = xz[:, 0] + self.start + self.length / 2
        Q[:, 2] = xz[:, 1] + self.height
        out: Floats = Q @ self._turn.T
        return out

    def back(self, P: Floats) -> tuple[Floats, Bools]:
        """Return where points (n, 3) lay before the fold, and whether it reaches them, (n,)."""
        Q = P @ self._turn
        section = np.stack([Q[:, 0] - self.start - self.length / 2, Q[:, 2] - self.height], axis=1)
        uw, reached = self.slip.unfold(section)
        Q[:, 0], Q[:, 2] = uw[:, 0] + self.start, uw[:, 1] + self.height
        return Q @ self._turn.T, reached

    def reaches(self, P: Floats) -> Bools:
        """Return which points (n, 3), before the fold, it can fold."""
        Q = P @ self._turn
        u, w = Q[:, 0] - self.start, Q[:, 2] - self.height
        out: Bools = (np.abs(w) < 0.999 * self.reach) & (u > 0) & (u < self.length)
        return out


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault surface and the movement of its hanging wall; see its four kinds.

    Parameters
    ----------
    name : str
        Name in the body's ``surfaces`` and ``slips``.
    point : (float, float, float)
        A point of the surface at the time of the fault.
    strike, dip : float
        Degrees; strike clockwise from y, dip below the horizontal.
    within : tuple of (str, bool)
        Names of earlier faults and the side (True: hanging wall) to which this fault is confined,
        as a splay is; empty if it cuts everything.
    """

    name: str
    point: _Triple
    strike: float
    dip: float
    within: tuple[tuple[str, bool], ...] = ()

    def __post_init__(self) -> None:
        for value in self.point:
            require_finite("point", value)
        require_finite("strike", self.strike)
        if not 0 < self.dip <= 90:
            raise OptionError(f"the dip of fault {self.name} must lie in (0, 90], not {self.dip!r}")

    @cached_property
    def axes(self) -> Floats:
        """Unit vectors (3, 3): along strike, down dip, and the normal into the hanging wall."""
        return fault_axes(self.strike, self.dip)

    def coordinates(self, P: Floats) -> Floats:
        """Return (n, 3): along strike, down dip, and distance off the surface of points (n, 3).

        The distance is positive in the hanging wall.
        """
        out: Floats = (P - np.asarray(self.point, float)) @ self.axes.T
        return out

    def surface(self, along: Floats, down: Floats) -> Floats:
        """Return the surface's points (n, 3) at places along strike (n,) and down dip (n,)."""
        return self._world(np.stack([along, down, np.zeros(len(along))], axis=1))

    def hanging(self, P: Floats) -> Bools:
        """Return which points (n, 3) lie in the hanging wall; the movement does not change it."""
        out: Bools = self.coordinates(P)[:, 2] > 0
        return out

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lie after the fault."""
        raise NotImplementedError

    def back(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lay before the fault."""
        raise NotImplementedError

    def _world(self, local: Floats) -> Floats:
        out: Floats = local @ self.axes + np.asarray(self.point, float)
        return out


@dataclass(frozen=True, kw_only=True)
class PlanarFault(Fault):
    """A plane along which the hanging wall is shifted; it may be corrugated along the shift.

    Parameters
    ----------
    dip_slip : float
        Shift down dip; negative for a reverse fault.
    strike_slip : float
        Shift of the hanging wall along strike.
    amplitude, wavelength, phase : float
        Corrugations, whose crests run along the shift: height, wavelength, and phase in radians.
    """

    dip_slip: float = 0.0
    strike_slip: float = 0.0
    amplitude: float = 0.0
    wavelength: float = 100.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("dip_slip", "strike_slip", "amplitude", "phase"):
            require_finite(name, getattr(self, name))
        require_positive("wavelength", self.wavelength)
        if not self.dip_slip and not self.strike_slip:
            raise OptionError(f"fault {self.name} needs a dip_slip or a strike_slip")

    @property
    def shift(self) -> Floats:
        """The hanging wall's shift, (3,)."""
        along, down, _ = self.axes
        out: Floats = self.dip_slip * down + self.strike_slip * along
        return out

    def _corrugation(self, along: Floats, down: Floats) -> Floats:
        across = along * self.dip_slip - down * self.strike_slip
        across = across / np.hypot(self.dip_slip, self.strike_slip)
        out: Floats = self.amplitude * np.sin(2 * np.pi * across / self.wavelength + self.phase)
        return out

    def coordinates(self, P: Floats) -> Floats:
        """Return (n, 3): along strike, down dip, and distance off the surface (see Fault)."""
        out = super().coordinates(P)
        out[:, 2] -= self._corrugation(out[:, 0], out[:, 1])
        return out

    def surface(self, along: Floats, down: Floats) -> Floats:
        """Return the surface's points (n, 3) at places along strike (n,) and down dip (n,)."""
        return self._world(np.stack([along, down, self._corrugation(along, down)], axis=1))

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lie after the fault."""
        return P + self.shift

    def back(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lay before the fault."""
        return P - self.shift


@dataclass(frozen=True, kw_only=True)
class ListricFault(Fault):
    """A circular arc about a horizontal axis, on which the hanging wall turns as a rigid body.

    The surface has the ``dip`` at ``point`` and flattens with depth.

    Parameters
    ----------
    radius : float
        Radius of the arc.
    angle : float
        Degrees by which the hanging wall turns down dip.
    """

    radius: float = 300.0
    angle: float = 10.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive("radius", self.radius)
        require_finite("angle", self.angle)

    @property
    def _centre(self) -> Floats:
        out: Floats = np.asarray(self.point, float) + self.radius * self.axes[2]
        return out

    def coordinates(self, P: Floats) -> Floats:
        """Return (n, 3): along strike, arc length down dip, and distance off the surface."""
        along, x, y = ((P - self._centre) @ self.axes.T).T
        return np.stack(
            [along, self.radius * np.arctan2(x, -y), self.radius - np.hypot(x, y)], axis=1
        )

    def surface(self, along: Floats, down: Floats) -> Floats:
        """Return the surface's points (n, 3) at places along strike (n,) and down dip (n,)."""
        t = down / self.radius
        local = np.stack([along, self.radius * np.sin(t), -self.radius * np.cos(t)], axis=1)
        out: Floats = local @ self.axes + self._centre
        return out

    def _turned(self, P: Floats, degrees: float) -> Floats:
        along, x, y = ((P - self._centre) @ self.axes.T).T
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        local = np.stack([along, c * x - s * y, s * x + c * y], axis=1)
        out: Floats = local @ self.axes + self._centre
        return out

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lie after the fault."""
        return self._turned(P, self.angle)

    def back(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lay before the fault."""
        return self._turned(P, -self.angle)


@dataclass(frozen=True, kw_only=True)
class ScissorFault(Fault):
    """A plane on which the hanging wall turns about the plane's normal at ``point``.

    Parameters
    ----------
    angle : float
        Degrees by which strike turns towards down dip.
    dip_slip : float
        Shift down dip after the turn.
    """

    angle: float = 5.0
    dip_slip: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("angle", "dip_slip"):
            require_finite(name, getattr(self, name))

    def _turned(self, along: Floats, down: Floats, degrees: float) -> tuple[Floats, Floats]:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        return c * along - s * down, s * along + c * down

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lie after the fault."""
        along, down, off = self.coordinates(P).T
        along, down = self._turned(along, down, self.angle)
        return self._world(np.stack([along, down + self.dip_slip, off], axis=1))

    def back(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lay before the fault."""
        along, down, off = self.coordinates(P).T
        along, down = self._turned(along, down - self.dip_slip, -self.angle)
        return self._world(np.stack([along, down, off], axis=1))


@dataclass(frozen=True, kw_only=True)
class TipFault(Fault):
    """A plane whose slip dies out smoothly along strike and ends at a tip inside the body.

    Parameters
    ----------
    dip_slip : float
        Shift down dip before it fades.
    fade : float
        Length along strike over which the slip fades.
    tip : float
        Place along strike, from ``point``, at which the slip is zero. The surface ends there.
    """

    dip_slip: float = 0.0
    fade: float = 200.0
    tip: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("dip_slip", "tip"):
            require_finite(name, getattr(self, name))
        require_positive("fade", self.fade)

    def _slip(self, along: Floats) -> Floats:
        x = np.clip((self.tip - along) / self.fade, 0, 1)
        out: Floats = self.dip_slip * x * x * (3 - 2 * x)
        return out

    def _shifted(self, P: Floats, sign: float) -> Floats:
        local = self.coordinates(P)
        local[:, 1] += sign * self._slip(local[:, 0])
        return self._world(local)

    def forward(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lie after the fault."""
        return self._shifted(P, 1.0)

    def back(self, P: Floats) -> Floats:
        """Return where points (n, 3) of the hanging wall lay before the fault."""
        return self._shifted(P, -1.0)


Event = FoldEvent | Fault


def fault_axes(strike: float, dip: float) -> Floats:
    """Return unit vectors (3, 3) of a plane: along strike, down dip, normal into the hanging wall.

    Parameters
    ----------
    strike, dip : float
        Degrees; strike clockwise from y, dip below the horizontal to the right of the strike.

    Examples
    --------
    >>> fault_axes(0.0, 90.0).round(12) + 0.0
    array([[ 0.,  1.,  0.],
           [ 0.,  0., -1.],
           [ 1.,  0.,  0.]])
    """
    a, d = np.radians(strike), np.radians(dip)
    along = np.array([np.sin(a), np.cos(a), 0.0])
    across = np.array([np.cos(a), -np.sin(a), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack(
        [along, across * np.cos(d) - up * np.sin(d), across * np.sin(d) + up * np.cos(d)]
    )
