"""Limits: surfaces at which a block model was cut off, so that the rim there is no pinch-out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.body.fault_surface import LIMIT_TOUCHES, FaultSurface, FaultWalls
from geounfold.body.prepare import BodyPoints
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, OptionError
from geounfold.faults.given import named_surfaces
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.io.coordinate_columns import numbers
from geounfold.io.messages import listing
from geounfold.io.packages.names import plain_name
from geounfold.io.tables.files import read_table

NEAR = 2.5  # blocks from a limit within which blocks lie at it
_AT = 1.4  # the same from a limit that takes their faces: 0.9 blocks, and half a block

_CUT = 0.2
"""Share of the blocks near a limit that may lie on its other side: more, and it cuts the body."""

_BOX = ("west", "east", "south", "north", "below", "above")


@dataclass(frozen=True, eq=False)
class FoundLimit:
    """A limit as the blocks lie to it.

    Attributes
    ----------
    surface : FaultSurface
        Working units.
    blocks : int
        Number of blocks whose centres are within 1.4 blocks of it, so that their faces are at it.
    nearest : float
        Distance of the nearest block's centre, in blocks.
    used : bool
        False for a side of a box or polygon that no block is near: the model does not end there.
    """

    surface: FaultSurface
    blocks: int
    nearest: float
    used: bool

    @property
    def name(self) -> str:
        """Name of the surface."""
        return self.surface.name


@dataclass(frozen=True, eq=False)
class Limits:
    """Surfaces that cut a model off.

    Attributes
    ----------
    surfaces : dict of TriMesh
        By name, in the data's coordinates.
    boxes : frozenset of str
        Names of those that are faces of a box or a polygon; some may be far from the body.
    """

    surfaces: dict[str, TriMesh]
    boxes: frozenset[str]

    @classmethod
    def of(cls, given: Any, points: Floats) -> Limits | None:
        """Return the limits given; None if there are none.

        Parameters
        ----------
        given : sequence, optional
            Each of its items is one of: a surface (file, TriMesh or (V, F)); a box of six numbers
            x0, x1, y0, y1, z0, z1, NaN or None where the model goes on; a polygon (k, 2) of x and
            y, or a .csv file of them, whose sides stand upright.
        points : (n, 3) float
            The blocks, in the same coordinates.

        Raises
        ------
        InputError
            A file that is no surface and no polygon.
            Or a box that holds no block.
        OptionError
            A box without a side, or whose sides are the wrong way round.
        """
        if given is None:
            return None
        items = [given] if isinstance(given, str | Path | TriMesh | tuple) else list(given)
        if items and all(item is None or isinstance(item, Real) for item in items):
            items = [items]
        low, high = points.min(axis=0), points.max(axis=0)
        low, high = low - 0.1 * (high - low) - 1, high + 0.1 * (high - low) + 1
        surfaces: dict[str, TriMesh] = {}
        boxes: set[str] = set()
        for item in items:
            name, polygon = _polygon(item)
            if polygon is not None:
                sides = _upright(name, polygon, low, high)
            elif (box := _box(item)) is not None:
                sides = _sides(box, low, high)
                _holds(box, points)
            else:
                surfaces |= named_surfaces([item])
                continue
            boxes |= set(sides)
            surfaces |= sides
        if not surfaces:
            raise OptionError("limits is empty: give a surface, a box or a polygon")
        return cls(surfaces, frozenset(boxes))

    def in_work(self, frame: Frame, fitted: Floats) -> tuple[FoundLimit, ...]:
        """Return the limits as the blocks lie to them, in working units.

        Parameters
        ----------
        frame : Frame
            Working frame.
        fitted : (n, 3) float
            All blocks, working units.

        Raises
        ------
        InputError
            No block is near a surface, or near any side of a box; or a surface cuts the body.
        """
        up, out = frame.up_in_work(), []
        for name, mesh in self.surfaces.items():
            surface = FaultSurface.facing(name, frame.to_work(mesh.V), mesh.F, up)
            seen = surface.sides(fitted)
            near = (seen.distance < NEAR) & ~seen.past
            nearest, used = float(seen.distance.min()), bool(near.any())
            out.append(FoundLimit(surface, int((seen.distance < _AT).sum()), nearest, used))
            if not used:
                if name in self.boxes:
                    continue
                raise InputError(
                    f"limit {name}: no block is near it (the nearest is "
                    f"{nearest:.1f} blocks away): is it in the blocks' coordinates?"
                )
            over = float((seen.signed[near] > 0).mean())
            if min(over, 1 - over) > _CUT:
                raise InputError(
                    f"limit {name} cuts through the body: {over:.0%} of the blocks near it lie on "
                    "one side; a limit has all on one. Give a fault by --faults"
                )
        if not any(limit.used for limit in out):
            nearest = min(limit.nearest for limit in out)
            raise InputError(
                f"limits: no block is near a side (the nearest is {nearest:.1f} blocks away): are "
                "they in the blocks' coordinates?"
            )
        return tuple(out)


def limited(bodies: Sequence[BodyPoints], found: Sequence[FoundLimit]) -> list[BodyPoints]:
    """Return bodies with the limits that end each added to their walls."""
    out, surfaces = [], tuple(limit.surface for limit in found if limit.used)
    for body in bodies:
        walls = FaultWalls.around(body.fitted, surfaces, LIMIT_TOUCHES)
        if walls is not None and body.walls is not None:
            walls = body.walls.and_at(walls)
        out.append(body if walls is None else replace(body, walls=walls))
    return out


def _box(item: Any) -> list[float] | None:
    """Return the six numbers of a box, NaN for a side that is open; None if it is no box."""
    if isinstance(item, str):
        words = [word.strip() for word in item.split(",")]
        if len(words) != 6:
            return None
        try:
            return [float(word) if word else np.nan for word in words]
        except ValueError:
            return None
    if isinstance(item, str | Path | TriMesh) or len(item) != 6:
        return None
    if not all(value is None or isinstance(value, Real) for value in item):
        return None
    return [np.nan if value is None else float(value) for value in item]


def _holds(box: list[float], points: Floats) -> None:
    """Raise InputError if a box holds none of the blocks."""
    first, last = np.array(box).reshape(3, 2).T
    first, last = np.where(np.isnan(first), -np.inf, first), np.where(np.isnan(last), np.inf, last)
    if not ((points > first) & (points < last)).all(axis=1).any():
        raise InputError(
            "limits: the box holds no block: a model that was cut off lies inside; its sides are "
            "x0, x1, y0, y1, z0, z1"
        )


def _sides(box: list[float], low: Floats, high: Floats) -> dict[str, TriMesh]:
    """Return the sides of a box as squares of two triangles."""
    if not np.isfinite(box).any():
        raise OptionError("limits: the box has no side: give at least one of x0,x1,y0,y1,z0,z1")
    ends = np.array(box).reshape(3, 2)
    for axis, (first, last) in zip("xyz", ends, strict=True):
        if first >= last:
            raise OptionError(f"limits: the box ends in {axis} at {last:g} before {first:g}")
    out = {}
    corner = np.where(np.isfinite(ends), ends, np.stack([low, high], axis=1))
    for k in range(3):
        a, b = [axis for axis in range(3) if axis != k]
        for end in range(2):
            if np.isfinite(ends[k, end]):
                V = np.empty((4, 3))
                V[:, k] = corner[k, end]
                V[:, a] = corner[a][[0, 1, 1, 0]]
                V[:, b] = corner[b][[0, 0, 1, 1]]
                out[_BOX[2 * k + end]] = TriMesh(V, _QUAD)
    return out


_QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def _polygon(item: Any) -> tuple[str, Floats | None]:
    """Return the name and corners (k, 2) of a polygon; None if it is none."""
    if isinstance(item, str | Path):
        path = Path(item)
        if path.suffix.lower() != ".csv":
            return path.name, None
        table = read_table(path).frame
        places = {plain_name(name): k for k, name in enumerate(table.columns)}
        if not {"x", "y"} <= set(places):
            raise InputError(
                f"{path}: a polygon is a .csv file with columns x and y, a corner per row; it has: "
                f"{listing(table.columns)}"
            )
        at = (table.iloc[:, places[axis]] for axis in "xy")
        return path.stem, np.column_stack([numbers(column, source=str(path)) for column in at])
    if isinstance(item, np.ndarray) and item.ndim == 2 and item.shape[1] == 2:
        return "polygon", np.asarray(item, dtype=np.float64)
    return "", None


def _upright(name: str, corners: Floats, low: Floats, high: Floats) -> dict[str, TriMesh]:
    """Return the sides of a polygon as upright surfaces from below the blocks to above them."""
    if len(corners) > 1 and (corners[0] == corners[-1]).all():
        corners = corners[:-1]
    if len(corners) < 3 or not np.isfinite(corners).all():
        raise InputError(f"limit {name}: a polygon has three or more corners, all finite numbers")
    out = {}
    for k, (first, last) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True), 1):
        if (first == last).all():
            continue
        V = np.empty((4, 3))
        V[:, :2] = [first, last, last, first]
        V[:, 2] = [low[2], low[2], high[2], high[2]]
        out[f"{name} side {k}"] = TriMesh(V, _QUAD)
    return out
