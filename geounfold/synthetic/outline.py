"""The shape of a sheet before folding: thickness, edge and holes.

Coordinates are those before folding: u in [0, length], v in [0, width], w the height above the
mid surface. Shapes that grow with the sheet are given as shares of its length and width; shapes
that depend on the blocks are given in length units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.synthetic.profile import require_finite, require_positive

SIDES = ("u0", "u1", "v0", "v1")


def _require_side(side: str) -> None:
    if side not in SIDES:
        raise OptionError(f"side {side!r} is not one of: {', '.join(SIDES)}")


def _require_share(name: str, value: float) -> None:
    require_positive(name, value)
    if value > 1:
        raise OptionError(f"{name} is a share and must lie in (0, 1], not {value!r}")


class Thickness(Protocol):
    """Heights of the bottom and top surfaces over the sheet (see Even, Lens, Swell, …)."""

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each, at shares a of length, b of width."""

    def reach(self) -> float:
        """Return a bound on the size of the heights."""


def _symmetric(thickness: Floats) -> tuple[Floats, Floats]:
    return -thickness / 2, thickness / 2


@dataclass(frozen=True)
class Even:
    """The same thickness everywhere."""

    thickness: float

    def __post_init__(self) -> None:
        require_positive("thickness", self.thickness)

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each."""
        return _symmetric(np.full(np.shape(a), self.thickness))

    def reach(self) -> float:
        """Return a bound on the size of the heights."""
        return self.thickness / 2


@dataclass(frozen=True)
class Lens:
    """A lens: ``thickness * (1 - r^2)``, with r = 0 in the middle and 1 on the ellipse."""

    thickness: float

    def __post_init__(self) -> None:
        require_positive("thickness", self.thickness)

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each."""
        r2 = (2 * a - 1) ** 2 + (2 * b - 1) ** 2
        return _symmetric(self.thickness * np.clip(1 - r2, 0, None))

    def reach(self) -> float:
        """Return a bound on the size of the heights."""
        return self.thickness / 2


@dataclass(frozen=True)
class Swell:
    """Pinch and swell: ``thickness * (1 + amplitude cos(2 pi p a) cos(2 pi q b))``.

    Parameters
    ----------
    thickness : float
        Mean thickness.
    amplitude : float
        Largest change, as a share of the thickness, below 1.
    cycles : (float, float)
        Number of periods p along the length, q along the width.
    """

    thickness: float
    amplitude: float
    cycles: tuple[float, float] = (2.0, 1.0)

    def __post_init__(self) -> None:
        require_positive("thickness", self.thickness)
        if not 0 <= self.amplitude < 1:
            raise OptionError(f"swell amplitude must lie in [0, 1), not {self.amplitude!r}")

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each."""
        p, q = self.cycles
        wave = np.cos(2 * np.pi * p * a) * np.cos(2 * np.pi * q * b)
        return _symmetric(self.thickness * (1 + self.amplitude * wave))

    def reach(self) -> float:
        """Return a bound on the size of the heights."""
        return self.thickness * (1 + self.amplitude) / 2


@dataclass(frozen=True)
class Wedge:
    """A thickness that falls linearly along the length, from ``thickness`` to ``tip``."""

    thickness: float
    tip: float = 0.0

    def __post_init__(self) -> None:
        require_positive("thickness", self.thickness)
        if not 0 <= self.tip <= self.thickness:
            raise OptionError(f"wedge tip must lie in [0, thickness], not {self.tip!r}")

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each."""
        return _symmetric(self.thickness + (self.tip - self.thickness) * a)

    def reach(self) -> float:
        """Return a bound on the size of the heights."""
        return self.thickness / 2


@dataclass(frozen=True)
class Bulge:
    """An even sheet with a Gaussian bulge on one side only.

    Parameters
    ----------
    thickness : float
        Thickness of the even sheet.
    height : float
        Height of the bulge above it.
    at : (float, float)
        Middle of the bulge, shares of length and width.
    size : (float, float)
        Standard deviations of the bulge, shares of length and width.
    side : {'top', 'bottom'}
        Surface that has the bulge.
    """

    thickness: float
    height: float
    at: tuple[float, float] = (0.5, 0.5)
    size: tuple[float, float] = (0.15, 0.25)
    side: str = "top"

    def __post_init__(self) -> None:
        require_positive("thickness", self.thickness)
        require_positive("bulge height", self.height)
        if self.side not in ("top", "bottom"):
            raise OptionError(f"bulge side {self.side!r} is not one of: top, bottom")
        for value in self.size:
            require_positive("bulge size", value)

    def heights(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return bottom and top heights, (n,) each."""
        r2 = ((a - self.at[0]) / self.size[0]) ** 2 + ((b - self.at[1]) / self.size[1]) ** 2
        low, high = _symmetric(np.full(np.shape(a), self.thickness))
        rise = self.height * np.exp(-r2 / 2)
        return (low, high + rise) if self.side == "top" else (low - rise, high)

    def reach(self) -> float:
        """Return a bound on the size of the heights."""
        return self.thickness / 2 + self.height


@dataclass(frozen=True, eq=False)
class Place:
    """Points before folding, in the sheet's coordinates: u, v, w (n,) and the sheet's sides."""

    u: Floats
    v: Floats
    w: Floats
    length: float
    width: float

    def from_side(self, side: str) -> tuple[Floats, Floats, float]:
        """Return the distance from a side, the distance along it, and the side's length."""
        if side[0] == "u":
            inward = self.u if side == "u0" else self.length - self.u
            return inward, self.v, self.width
        inward = self.v if side == "v0" else self.width - self.v
        return inward, self.u, self.length


class Region(Protocol):
    """A part of the sheet's rectangle that the body keeps (see Ellipse, Hole, Ragged, …)."""

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""


@dataclass(frozen=True)
class Ellipse:
    """Keep the ellipse inscribed in the rectangle."""

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        r2 = (2 * p.u / p.length - 1) ** 2 + (2 * p.v / p.width - 1) ** 2
        out: Bools = r2 <= 1
        return out


@dataclass(frozen=True)
class Hole:
    """Leave out an ellipse right through the sheet.

    Parameters
    ----------
    at : (float, float)
        Middle of the hole, shares of length and width.
    size : (float, float)
        Half-axes of the hole, shares of length and width.
    """

    at: tuple[float, float] = (0.5, 0.5)
    size: tuple[float, float] = (0.1, 0.15)

    def __post_init__(self) -> None:
        for value in self.size:
            require_positive("hole size", value)

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        a = (p.u / p.length - self.at[0]) / self.size[0]
        b = (p.v / p.width - self.at[1]) / self.size[1]
        out: Bools = a**2 + b**2 > 1
        return out


@dataclass(frozen=True)
class Ragged:
    """Move every side of the edge inwards by a smooth random depth between 0 and ``depth``.

    Parameters
    ----------
    depth : float
        Largest depth, in length units.
    scale : float
        Length along the edge over which the depth varies, in length units.
    seed : int
        Seed of the depths.
    """

    depth: float
    scale: float
    seed: int = 0

    def __post_init__(self) -> None:
        require_positive("ragged depth", self.depth)
        require_positive("ragged scale", self.scale)

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        rng = np.random.default_rng(self.seed)
        out = np.ones(np.shape(p.u), bool)
        for side in SIDES:
            inward, along, _ = p.from_side(side)
            waves = rng.uniform(0.5, 1.5, 6)
            phases = rng.uniform(0, 2 * np.pi, 6)
            total = np.zeros(np.shape(p.u))
            for wave, phase in zip(waves, phases, strict=True):
                total += np.sin(along * (2 * np.pi * wave / self.scale) + phase)
            out &= inward >= self.depth * (1 + np.tanh(total / 2)) / 2
        return out


@dataclass(frozen=True)
class Embayment:
    """Leave out a half-ellipse at one side of the edge.

    Parameters
    ----------
    side : {'u0', 'u1', 'v0', 'v1'}
        The side at u = 0, u = length, v = 0 or v = width.
    at, size : float
        Middle and half-length of the embayment along the side, shares of the side.
    depth : float
        Depth of the embayment, a share of the sheet's extent across the side.
    """

    side: str = "v0"
    at: float = 0.5
    size: float = 0.15
    depth: float = 0.4

    def __post_init__(self) -> None:
        _require_side(self.side)
        _require_share("embayment size", self.size)
        _require_share("embayment depth", self.depth)

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        inward, along, side = p.from_side(self.side)
        across = p.length if self.side[0] == "u" else p.width
        a = (along / side - self.at) / self.size
        out: Bools = a**2 + (inward / (self.depth * across)) ** 2 > 1
        return out


@dataclass(frozen=True)
class ObliqueCut:
    """Cut one side of the edge along a plane that leans from the layers' normal.

    Parameters
    ----------
    angle : float
        Angle between the cut and the normal, degrees, in (-90, 90); a positive one shortens the
        top.
    side : {'u0', 'u1', 'v0', 'v1'}
        The side at u = 0, u = length, v = 0 or v = width.
    setback : float
        Distance from the side at which the cut crosses the mid surface, in length units.
    """

    angle: float
    side: str = "u1"
    setback: float = 0.0

    def __post_init__(self) -> None:
        _require_side(self.side)
        if not -90 < self.angle < 90:
            raise OptionError(f"cut angle must lie in (-90, 90) degrees, not {self.angle!r}")
        require_finite("setback", self.setback)

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        inward = p.from_side(self.side)[0]
        out: Bools = inward - self.setback >= p.w * np.tan(np.radians(self.angle))
        return out


@dataclass(frozen=True)
class Neck:
    """Narrow the middle of the length, so that a neck joins two wide parts.

    Parameters
    ----------
    extent : float
        Length of the neck, as a share of the sheet's.
    breadth : float
        Width of the neck, in length units.
    """

    extent: float
    breadth: float

    def __post_init__(self) -> None:
        _require_share("neck extent", self.extent)
        require_positive("neck breadth", self.breadth)

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        island = np.abs(p.u / p.length - 0.5) >= self.extent / 2
        out: Bools = island | (np.abs(p.v - p.width / 2) <= self.breadth / 2)
        return out


@dataclass(frozen=True)
class Gap:
    """Leave out a slab of blocks: those whose coordinate lies in [low, high).

    Parameters
    ----------
    axis : {'u', 'v', 'w'}
        Coordinate across the slab.
    low, high : float
        Limits of the slab, in length units, before folding.
    """

    axis: str
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.axis not in ("u", "v", "w"):
            raise OptionError(f"gap axis {self.axis!r} is not one of: u, v, w")
        if not self.low < self.high:
            raise OptionError(f"gap must have low < high, not {self.low!r} and {self.high!r}")

    def keeps(self, p: Place) -> Bools:
        """Return which points the region keeps, (n,)."""
        x: Floats = {"u": p.u, "v": p.v, "w": p.w}[self.axis]
        out: Bools = (x < self.low) | (x >= self.high)
        return out
