"""The recipe of a faulted body: a layer before anything happened to it, and the events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Protocol

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic.faulted.events import Event, Fault, FoldEvent
from geounfold.synthetic.profile import require_finite, require_positive

_Triple = tuple[float, float, float]
Sides = dict[str, Bools]
"""By fault: which points lie in its hanging wall, (n,)."""

GRIDS = ("after", "scattered")


class Outline(Protocol):
    """The layer's outline over its length and width."""

    def holds(self, u: Floats, v: Floats, length: float, width: float) -> Bools:
        """Return which places (u, v) lie inside, (n,)."""


@dataclass(frozen=True)
class Rectangle:
    """The whole length and width."""

    def holds(self, u: Floats, v: Floats, length: float, width: float) -> Bools:
        """Return which places (u, v) lie inside, (n,)."""
        out: Bools = (u >= 0) & (u <= length) & (v >= 0) & (v <= width)
        return out


@dataclass(frozen=True)
class Oval:
    """The ellipse whose axes are the length and the width."""

    def holds(self, u: Floats, v: Floats, length: float, width: float) -> Bools:
        """Return which places (u, v) lie inside, (n,)."""
        out: Bools = (2 * u / length - 1) ** 2 + (2 * v / width - 1) ** 2 <= 1
        return out


@dataclass(frozen=True)
class Wandering:
    """A rectangle whose four sides wander by up to ``depth``, as natural limits of ore do.

    Parameters
    ----------
    depth : float
        Largest distance of a side from the rectangle.
    seed : int
        Draws three waves for each side.
    """

    depth: float = 25.0
    seed: int = 0

    def holds(self, u: Floats, v: Floats, length: float, width: float) -> Bools:
        """Return which places (u, v) lie inside, (n,)."""
        rng = np.random.default_rng(self.seed)
        phases = rng.uniform(0, 2 * np.pi, (4, 3))
        waves = rng.uniform(0.35, 1.1, (4, 3))

        def side(k: int, share: Floats) -> Floats:
            total = np.zeros(share.shape)
            for wave, phase in zip(waves[k], phases[k], strict=True):
                total += np.sin(2 * np.pi * share / wave + phase)
            return self.depth * total / 3

        along, across = u / length, v / width
        out: Bools = (u >= side(0, across)) & (u <= length + side(1, across))
        return out & (v >= side(2, along)) & (v <= width + side(3, along))


@dataclass(frozen=True, kw_only=True)
class FaultedSpec:
    """The recipe of a faulted body.

    Flat coordinates W are (u, v, w): u from 0 to ``length``, v from 0 to ``width``, w the height
    above the mid surface.

    Parameters
    ----------
    events : tuple of FoldEvent or Fault
        What happened to the layer, in the order of time.
    length, width, thickness : float
        Extents of the layer in flat coordinates.
    outline : Outline
        Outline of the layer; ``Rectangle()`` by default.
    swell : float
        Largest change of the thickness, as a share of it.
    crop : ((float, float, float), (float, float, float)), optional
        Lower and upper corner of a box in final coordinates, outside which the model has no blocks.
    steps : (float, float, float)
        Block sides along the lattice's axes.
    bearing : float
        Direction of the lattice's y axis, degrees clockwise from north.
    offset : (float, float, float)
        Added to all final coordinates, such as a national grid's.
    sub_blocks : int
        Number of sub-blocks along each side of a block that a limit or a fault cuts; 1 for none.
    grid : {'after', 'scattered'}
        A lattice laid over the final body, or random points, one per volume of a block.
    seed : int
        Seed of scattered points.
    about : str
        One line for tables.

    Raises
    ------
    OptionError
        A value is outside its range, two faults have the same name, or a fault is confined by one
        that does not come before it.
    """

    events: tuple[Event, ...]
    length: float = 400.0
    width: float = 300.0
    thickness: float = 50.0
    outline: Outline = Rectangle()
    swell: float = 0.0
    crop: tuple[_Triple, _Triple] | None = None
    steps: _Triple = (10.0, 10.0, 10.0)
    bearing: float = 0.0
    offset: _Triple = (0.0, 0.0, 0.0)
    sub_blocks: int = 1
    grid: str = "after"
    seed: int = 0
    about: str = ""

    def __post_init__(self) -> None:
        for name in ("length", "width", "thickness"):
            require_positive(name, getattr(self, name))
        for step in self.steps:
            require_positive("steps", step)
        for value in (self.bearing, *self.offset):
            require_finite("bearing or offset", value)
        if not 0 <= self.swell < 1:
            raise OptionError(f"swell must lie in [0, 1), not {self.swell!r}")
        if self.grid not in GRIDS:
            raise OptionError(f"grid {self.grid!r} is not one of: {', '.join(GRIDS)}")
        for name, least in (("sub_blocks", 1), ("seed", 0)):
            value = getattr(self, name)
            if not isinstance(value, int) or value < least:
                raise OptionError(f"{name} must be a whole number from {least} up, not {value!r}")
        if self.grid == "scattered" and self.sub_blocks > 1:
            raise OptionError("scattered points have no sub_blocks")
        self._check_faults()

    def _check_faults(self) -> None:
        names: list[str] = []
        for fault in self.faults:
            if fault.name in names:
                raise OptionError(f"two faults are named {fault.name!r}")
            for host, _ in fault.within:
                if host not in names:
                    raise OptionError(
                        f"fault {fault.name} is confined by {host!r}, which is no earlier fault"
                    )
            names.append(fault.name)
        if not names:
            raise OptionError("a faulted body needs a fault among its events")

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The faults, in the order of time."""
        return tuple(event for event in self.events if isinstance(event, Fault))

    @property
    def step(self) -> float:
        """Side of a cube of a block's volume."""
        return float(np.cbrt(np.prod(self.steps)))

    @property
    def lattice_axes(self) -> Floats:
        """The lattice's axes, rows of (3, 3)."""
        return rotation_from_angles(self.bearing, 0.0, 0.0)

    def with_options(self, **overrides: object) -> FaultedSpec:
        """Return the recipe with other values of some fields.

        Raises
        ------
        OptionError
            No field has this name.
        """
        names = [f.name for f in fields(self)]
        for name in overrides:
            if name not in names:
                raise OptionError(f"no option {name!r}; valid: {', '.join(names)}")
        return replace(self, **overrides)  # type: ignore[arg-type]

    def with_blocks(self, count: int) -> FaultedSpec:
        """Return the recipe with larger or smaller blocks, about ``count`` of them.

        Raises
        ------
        OptionError
            The count is below 1.
        """
        if count < 1:
            raise OptionError(f"blocks must be at least 1, not {count!r}")
        share = np.linspace(-0.1, 1.1, 240)  # a wandering outline leaves the rectangle
        u, v = np.meshgrid(share * self.length, share * self.width)
        inside = self.in_outline(u, v)
        area = 1.2**2 * self.length * self.width * float(inside.mean())
        volume = 2 * float(self.half_thickness(u, v)[inside].mean()) * area
        factor = float(np.cbrt(volume / count / np.prod(self.steps)))
        x, y, z = (step * factor for step in self.steps)
        return replace(self, steps=(x, y, z))

    def half_thickness(self, u: Floats, v: Floats) -> Floats:
        """Return half the thickness at flat places (u, v)."""
        wave = np.sin(2 * np.pi * u / (0.9 * self.length) + 1)
        wave = wave * np.cos(2 * np.pi * v / (1.3 * self.width))
        out: Floats = self.thickness / 2 * (1 + self.swell * wave)
        return out

    def in_outline(self, u: Floats, v: Floats) -> Bools:
        """Return which flat places (u, v) lie inside the outline."""
        return self.outline.holds(u, v, self.length, self.width)

    def holds(self, W: Floats) -> Bools:
        """Return which flat points (n, 3) lie in the layer."""
        u, v, w = W.T
        out: Bools = self.in_outline(u, v) & (np.abs(w) <= self.half_thickness(u, v))
        return out

    def in_model(self, X: Floats) -> Bools:
        """Return which final points (n, 3), without offset, the model covers."""
        if self.crop is None:
            return np.ones(len(X), bool)
        low, high = np.asarray(self.crop, float)
        out: Bools = np.all((X > low) & (X < high), axis=1)
        return out

    def forward(
        self, P: Floats, start: int = 0, known: Mapping[str, Bools] | None = None
    ) -> tuple[Floats, Sides]:
        """Return final places of points, without offset, and their sides of every fault.

        Parameters
        ----------
        P : (n, 3) float
            Places before the event of index ``start``.
        start : int
            Index of the first event that still happens.
        known : mapping of fault name to (n,) bool, optional
            Sides that are given instead of found, such as those of points on a fault.
        """
        P = P.copy()
        sides: Sides = dict(known or {})
        for event in self.events[start:]:
            if isinstance(event, FoldEvent):
                P = event.forward(P)
                continue
            hanging = sides[event.name] if event.name in sides else event.hanging(P)
            for host, side in event.within:
                hanging = hanging & (sides[host] == side)
            sides[event.name] = hanging
            P[hanging] = event.forward(P[hanging])
        return P, sides

    def back(self, X: Floats, stop: int = 0) -> tuple[Floats, Bools, Sides]:
        """Return earlier places of final points, which of them have one, and their sides.

        Parameters
        ----------
        X : (n, 3) float
            Final places, without offset.
        stop : int
            Index of the first event that is undone; 0 gives flat coordinates.
        """
        return self.before(X, len(self.events), stop)

    def before(self, P: Floats, end: int, stop: int) -> tuple[Floats, Bools, Sides]:
        """Undo the events of indices ``stop`` to ``end - 1``; see ``back``."""
        P, reached, sides = P.copy(), np.ones(len(P), bool), Sides()
        for k in range(end - 1, stop - 1, -1):
            event = self.events[k]
            if isinstance(event, FoldEvent):
                P, good = event.back(P)
                reached &= good
            else:
                sides[event.name] = self.hanging(k, P)
                P = np.where(sides[event.name][:, None], event.back(P), P)
        return P, reached, sides

    def hanging(self, k: int, P: Floats) -> Bools:
        """Return which points (n, 3), just after event ``k``, a fault, lie in its hanging wall."""
        fault = self.events[k]
        assert isinstance(fault, Fault)
        return fault.hanging(P) & self.exists(k, P)

    def exists(self, k: int, P: Floats) -> Bools:
        """Return which points (n, 3), just after event ``k``, lie where that fault exists.

        A confined fault ends at its host's surface and does not move it. The host's side can
        therefore be found by undoing the events between the two, the fault itself left out.
        """
        fault = self.events[k]
        assert isinstance(fault, Fault)
        out = np.ones(len(P), bool)
        for name, side in fault.within:
            host = self._index(name)
            Q, _, _ = self.before(P, k, host + 1)
            out &= self.faults_by_index[host].hanging(Q) == side
        return out

    @property
    def faults_by_index(self) -> dict[int, Fault]:
        """The faults by their index among the events."""
        return {k: event for k, event in enumerate(self.events) if isinstance(event, Fault)}

    def _index(self, name: str) -> int:
        return next(k for k, fault in self.faults_by_index.items() if fault.name == name)


def blocks_of(sides: Sides, names: Iterable[str]) -> Bools:
    """Return sides as an array (n, number of faults), in the order of the names."""
    return np.stack([sides[name] for name in names], axis=1)
