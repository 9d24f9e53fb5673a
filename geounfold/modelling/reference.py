"""The surface over which a body's walls are drawn: a plane, or a curve moved along a fold axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.modelling.fold_axis import across, angles_of_axis, axis_from_angles, found_axis
from geounfold.modelling.fold_profile import on_curve, profile_curve
from geounfold.modelling.intercepts import Intercepts
from geounfold.modelling.traced import Traced

_THIN = 1e-3  # second over first extent of the intercepts below which they lie on a line
_CROSSED = 0.2  # median cosine between holes and a plane's normal: 78 degrees off it


class Reference(Protocol):
    """A surface with coordinates: along it (two) and height above it."""

    @property
    def follows(self) -> bool:
        """Whether the surface itself follows the layer."""
        ...

    def local(self, points: Floats) -> Floats:
        """Return coordinates (n, 3) of world points (n, 3)."""
        ...

    def world(self, local: Floats) -> Floats:
        """Return world points (n, 3) of coordinates (n, 3)."""
        ...

    def told(self) -> str:
        """Return a sentence about the surface."""
        ...

    def redrawn(self, found: Intercepts, trace: Traced) -> Reference:
        """Return the surface drawn from other intercepts, its axes kept."""
        ...


@dataclass(frozen=True, eq=False)
class FoldReference:
    """A curve in a profile plane, moved along the fold axis.

    Attributes
    ----------
    origin : (3,) float
    axes : (3, 3) float
        Rows: the two directions of the profile plane, and the fold axis.
    curve : (k, 2) float
        Vertices in the profile plane; the height is positive left of it, and up on most of it.
    follows : bool
        True: heights are across the layer.
    """

    origin: Floats
    axes: Floats
    curve: Floats
    follows: bool = True

    def local(self, points: Floats) -> Floats:
        """Return coordinates (n, 3): along the curve, along the axis, and height."""
        flat = (points - self.origin) @ self.axes.T
        place, height, _ = on_curve(self.curve, flat[:, :2])
        return np.column_stack([place, flat[:, 2], height])

    def world(self, local: Floats) -> Floats:
        """Return world points (n, 3)."""
        step = np.diff(self.curve, axis=0)
        length = np.linalg.norm(step, axis=1)
        start = np.r_[0.0, np.cumsum(length)]
        k = np.clip(np.searchsorted(start, local[:, 0], side="right") - 1, 0, len(step) - 1)
        way = step / length[:, None]
        flat = self.curve[k] + (local[:, 0] - start[k])[:, None] * way[k]
        # Normals turn evenly between the middles of the segments, so that the image has no gaps.
        middles = 0.5 * (start[1:] + start[:-1])
        turn = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
        angle = np.interp(local[:, 0], middles, turn)
        normal = np.column_stack([-np.sin(angle), np.cos(angle)])
        flat = flat + local[:, 2:] * normal
        return np.asarray(np.column_stack([flat, local[:, 1]]) @ self.axes + self.origin)

    @property
    def turn(self) -> float:
        """Degrees between the curve's extreme headings."""
        step = np.diff(self.curve, axis=0)
        return float(np.ptp(np.degrees(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))))

    def told(self) -> str:
        """Return a sentence with the axis and the turn of the curve."""
        trend, plunge = angles_of_axis(self.axes[2])
        return (
            f"the walls are drawn over a fold about an axis that plunges {plunge:.0f} degrees to "
            f"{trend:03.0f}, whose layer turns by {self.turn:.0f} degrees"
        )

    def redrawn(self, found: Intercepts, trace: Traced) -> FoldReference:
        """Return the fold about the same axis whose curve is drawn from other intercepts."""
        return fold_about(found, trace, self.axes[2])


@dataclass(frozen=True, eq=False)
class PlaneReference:
    """A plane.

    Attributes
    ----------
    origin : (3,) float
    axes : (3, 3) float
        Rows: two in the plane, and its normal, which points up (of an upright plane, to +x or +y).
    follows : bool
        False: the layer may slope on the plane.
    """

    origin: Floats
    axes: Floats
    follows: bool = False

    def local(self, points: Floats) -> Floats:
        """Return coordinates (n, 3): along the two axes, and height."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def world(self, local: Floats) -> Floats:
        """Return world points (n, 3)."""
        return np.asarray(local @ self.axes + self.origin)

    def told(self) -> str:
        """Return a sentence with the plane's dip and dip direction."""
        dip, direction = dip_of(self.axes[2])
        return f"the walls are drawn over a plane that dips {dip:.0f} degrees to {direction:03.0f}"

    def redrawn(self, found: Intercepts, trace: Traced) -> PlaneReference:
        """Return the plane itself: heights above any other would give nearly the same walls."""
        return self


def dip_of(normal: Floats) -> tuple[float, float]:
    """Return dip and dip direction, degrees, of a plane's upward normal.

    >>> dip_of(np.array([0.0, -0.5, np.sqrt(0.75)]))
    (30.000000000000004, 180.0)
    """
    up = normal if normal[2] >= 0 else -normal
    dip = float(np.degrees(np.arccos(np.clip(up[2], -1, 1))))
    return dip, float(np.degrees(np.arctan2(up[0], up[1])) % 360)


def upward(normal: Floats) -> Floats:
    """Return a normal or its opposite: the one that points up, of level ones to +x or +y."""
    flat = abs(normal[2]) < 1e-9
    sign = (normal[0] if abs(normal[0]) > 1e-9 else normal[1]) if flat else normal[2]
    return normal if sign > 0 else -normal


def mean_plane(found: Intercepts) -> PlaneReference:
    """Return the plane nearest to the intercepts' middles, by least squares, that holes cross.

    A cloud of intercepts may be narrower along a fold's axis than the fold is high; the plane
    across the axis is then nearest to it, but holes do not cross that plane.

    Raises
    ------
    InputError
        The middles lie on one line.
    """
    middles = 0.5 * (found.upper + found.lower)
    origin = middles.mean(axis=0)
    _, extent, axes = np.linalg.svd(middles - origin, full_matrices=False)
    if extent[1] <= _THIN * extent[0]:
        raise InputError(
            "the intercepts lie on one line, so no surface goes through them; drill or choose "
            "holes off the line"
        )
    chord = found.lower - found.upper
    chord = chord / np.linalg.norm(chord, axis=1)[:, None]
    steep = np.median(np.abs(chord @ axes.T), axis=0)
    crossed = [k for k in (2, 1, 0) if steep[k] >= _CROSSED]
    k = crossed[0] if crossed else int(np.argmax(steep))
    normal = upward(axes[k])
    first = axes[0 if k else 1]
    first = first if first[np.argmax(np.abs(first))] > 0 else -first
    return PlaneReference(origin, np.stack([first, np.cross(normal, first), normal]))


def fold_of(
    found: Intercepts, trace: Traced, axis: tuple[float, float] | None = None
) -> FoldReference:
    """Return the fold through the intercepts.

    Parameters
    ----------
    found : Intercepts
    trace : Traced
        Body and waste along the holes.
    axis : (float, float), optional
        Trend and plunge of the fold axis, degrees; found by default.

    Raises
    ------
    InputError
        The body falls apart in the profile of the fold.
    """
    way = found_axis(_near(found, trace)) if axis is None else axis_from_angles(*axis)
    return fold_about(found, trace, way)


def _near(found: Intercepts, trace: Traced) -> Traced:
    """Return the points in intercepts and within two of their lengths."""
    return trace.near(found, 2 * float(np.median(found.end - found.start)))


def fold_about(found: Intercepts, trace: Traced, way: Floats) -> FoldReference:
    """Return the fold about an axis, a unit vector (3,), as `fold_of`."""
    usual = float(np.median(found.end - found.start))
    near = _near(found, trace)
    rows = np.vstack([across(way), way])
    origin = near.points[near.ore].mean(axis=0)
    flat = (near.points - origin) @ rows.T
    curve = profile_curve(flat[near.ore, :2], flat[~near.ore, :2], usual)
    # The height is up over most of the layer's length.
    if np.diff(curve[:, 0]).sum() < 0:
        curve = curve[::-1]
    return FoldReference(origin, rows, curve)
