"""The axes of a variogram: their azimuths in the unfolded space, and their trends in the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.estimation.variogram import Variogram
from geounfold.geometry.mesh import Floats
from geounfold.geometry.rotations import rotation_from_angles


@dataclass(frozen=True)
class AxisInBody:
    """One axis of a variogram.

    Attributes
    ----------
    axis : int
        1 and 2 lie in the layer if the model is not tilted, 3 across it.
    flat_azimuth : float
        Degrees clockwise from the unfolded y axis, 0 to 360. That axis is not north.
    trend, plunge : float
        Of the axis carried to the body: compass direction in degrees, 0 to 360, and degrees
        below the horizontal, 0 to 90. The mean over the samples: an axis across a fold has
        other directions on its limbs.
    """

    axis: int
    flat_azimuth: float
    trend: float
    plunge: float

    def row(self) -> dict[str, Any]:
        """Return the row of the summary."""
        return {
            "axis": self.axis,
            "flat_azimuth": round(self.flat_azimuth, 1),
            "trend": round(self.trend, 1),
            "plunge": round(self.plunge, 1),
        }


def axes_in_body(model: Variogram, flat: Floats, folded: Floats) -> tuple[AxisInBody, ...]:
    """Return axes 1 and 2 of a model, with their mean directions in the body.

    The mean is that of the linear map which carries the samples' unfolded places nearest to
    their folded ones (least squares).

    Parameters
    ----------
    model : Variogram
        In the unfolded space.
    flat, folded : (n, 3) float
        Samples in both spaces.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> flat = rng.uniform(size=(50, 3))
    >>> east = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # unfolded y points east
    >>> model = Variogram(0.1, (), (30.0, 0.0, 0.0))
    >>> [a.row()["trend"] for a in axes_in_body(model, flat, flat @ east.T + 100)]
    [30.0, 120.0]
    """
    axes = rotation_from_angles(*model.rotation)
    A, B = flat - flat.mean(axis=0), folded - folded.mean(axis=0)
    carried = np.linalg.lstsq(A, B, rcond=None)[0]
    return tuple(_axis(k + 1, axes[k], axes[k] @ carried) for k in range(2))


def _axis(number: int, flat: Floats, there: Floats) -> AxisInBody:
    x, y, z = -there if there[2] > 0 else there
    return AxisInBody(
        axis=number,
        flat_azimuth=_azimuth(flat[0], flat[1]),
        trend=_azimuth(x, y),
        plunge=float(np.degrees(np.arctan2(-z, np.hypot(x, y)))),
    )


def _azimuth(x: float, y: float) -> float:
    return float(np.degrees(np.arctan2(x, y))) % 360


def axes_told(axes: tuple[AxisInBody, ...]) -> tuple[str, ...]:
    """Return a sentence for each axis, for the variogram's file."""
    return tuple(
        f"Axis {a.axis}: azimuth {a.flat_azimuth:.0f} in the unfolded space; in the body it trends "
        f"{a.trend:.0f} and plunges {a.plunge:.0f} degrees (mean over the samples)."
        for a in axes
    )
