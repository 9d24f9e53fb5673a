"""A block model's own frame: its origin, and the bearing, plunge and dip of its axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.geometry.mesh import Floats
from geounfold.geometry.rotations import rotate, rotation_from_angles

_ORTHONORMAL = 1e-9  # largest error of axes that were computed, not typed


def axes_from_angles(bearing: float, plunge: float = 0.0, dip: float = 0.0) -> Floats:
    """Return a block model's own axes as rows, (3, 3), a right-handed rotation.

    Simulated bodies' lattices, variograms and search ellipsoids are turned by the same angles.

    Parameters
    ----------
    bearing : float
        Compass direction of the model's y axis, degrees clockwise from north (world y); 0 for a
        model that is not turned.
    plunge : float
        Inclination of the y axis, degrees below the horizontal.
    dip : float
        Degrees by which the x axis then turns down around the y axis.

    Raises
    ------
    OptionError
        An angle is not finite, or the plunge is beyond 90 degrees.

    Examples
    --------
    >>> bool(np.allclose(axes_from_angles(0.0), np.eye(3)))
    True
    >>> bool(np.allclose(axes_from_angles(90.0)[1], [1, 0, 0]))  # the y axis points east
    True
    """
    if not np.isfinite([bearing, plunge, dip]).all():
        raise OptionError("bearing, plunge and dip must be finite numbers of degrees")
    if abs(plunge) > 90:
        raise OptionError(f"a plunge must lie within 90 degrees, but is {plunge:g}")
    return rotation_from_angles(bearing, plunge, dip) + 0.0


@dataclass(frozen=True, eq=False)
class ModelFrame:
    """A block model's own coordinates: their origin in the world and their axes.

    Attributes
    ----------
    origin : (3,) float
        World coordinates of the model's own (0, 0, 0).
    axes : (3, 3) float
        The model's own axes as rows, a rotation of the world's (see `axes_from_angles`).

    Raises
    ------
    OptionError
        The origin is not three finite numbers, or the axes are not a right-handed rotation.

    Examples
    --------
    >>> frame = ModelFrame.turned((500000.0, 7000000.0, 250.0), bearing=90.0)
    >>> frame.to_world(np.array([[0.0, 10.0, 5.0]])).round(6).tolist()  # 10 along y: to the east
    [[500010.0, 7000000.0, 255.0]]
    """

    origin: Floats
    axes: Floats = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        if self.origin.shape != (3,) or not (np.abs(self.origin) <= LARGEST_COORDINATE).all():
            raise OptionError(
                f"an origin must be three numbers within {LARGEST_COORDINATE:g}, but is "
                f"{self.origin.tolist()}"
            )
        if self.axes.shape != (3, 3) or not np.allclose(
            self.axes @ self.axes.T, np.eye(3), rtol=0, atol=_ORTHONORMAL
        ):
            raise OptionError("a model's axes must be three perpendicular rows of unit length")
        if np.linalg.det(self.axes) < 0:
            raise OptionError("a model's axes must be right-handed: these would mirror the body")

    @classmethod
    def turned(
        cls,
        origin: tuple[float, float, float],
        bearing: float = 0.0,
        plunge: float = 0.0,
        dip: float = 0.0,
    ) -> ModelFrame:
        """Return the frame at an origin whose axes are turned by `axes_from_angles`."""
        place = np.asarray(origin, dtype=np.float64)
        return cls(place, axes_from_angles(bearing, plunge, dip))

    def facts(self) -> dict[str, object]:
        """Return the frame for a summary: ``origin`` (x, y, z) and ``axes``, row by row."""
        return {"origin": self.origin.tolist(), "axes": self.axes.tolist()}

    def to_world(self, points: Floats) -> Floats:
        """Return world coordinates of points (n, 3) in the model's own."""
        own = np.asarray(points, dtype=np.float64)
        return np.stack(rotate(own, self.axes.T), axis=1) + self.origin

    def to_own(self, points: Floats) -> Floats:
        """Return the model's own coordinates of points (n, 3) in the world."""
        from_origin = np.asarray(points, dtype=np.float64) - self.origin
        return np.stack(rotate(from_origin, self.axes), axis=1)
