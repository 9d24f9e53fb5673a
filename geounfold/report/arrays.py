"""Arrays as base64 of little-endian numbers, for a page to read."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Floats
from geounfold.report.plots.rendering import level_step

_LEVELS = 65534  # the highest code of 16 bits; one more means no value


def encoded(values: ArrayLike, form: str) -> dict[str, Any]:
    """Return values as base64 of a little-endian form such as ``f4``, ``u2`` or ``i2``.

    Examples
    --------
    >>> encoded([1, 256], "u2")
    {'form': 'u2', 'data': 'AQAAAQ=='}
    """
    plain = np.ascontiguousarray(values, dtype=f"<{form}")
    return {"form": form, "data": base64.b64encode(plain.tobytes()).decode("ascii")}


def quantised(values: Floats, origin: float, step: float) -> dict[str, Any]:
    """Return ``round((values - origin) / step)`` in 16 bits; 65535 if there is no value."""
    codes = np.rint((values - origin) / step)
    codes = np.where(np.isnan(codes), _LEVELS + 1, np.clip(codes, 0, _LEVELS))
    return {"offset": origin, "step": step, **encoded(codes, "u2")}


def quantised_points(points: Floats) -> dict[str, Any]:
    """Return points in 16 bits per coordinate, relative to their bounding box.

    Coordinates that lie on equally spaced levels come back exactly but for rounding; of others no
    one is off by more than half a step, 1/131068 of the box's side.

    Parameters
    ----------
    points : (n, 3) float
        Finite coordinates.

    Returns
    -------
    dict
        ``offset`` (3) and ``step`` (3) in the points' unit; ``form`` and ``data`` of (n, 3) codes.
    """
    low = points.min(axis=0)
    steps = np.array([_step(column) for column in points.T])
    codes = np.rint((points - low) / steps)
    return {"offset": low.tolist(), "step": steps.tolist(), **encoded(codes, "u2")}


def _step(column: Floats) -> float:
    """Return the smallest step that reaches over a column and meets the levels it may have."""
    span = float(np.ptp(column))
    if span == 0:
        return 1.0
    level = level_step(column)
    parts = 0 if level is None else math.floor(_LEVELS * level / span)
    return level / parts if level is not None and parts else span / _LEVELS


def floating_points(points: Floats, origin: Floats) -> dict[str, Any]:
    """Return points as float32 relative to an origin; NaN if there is none."""
    return {"offset": origin.tolist(), **encoded(points - origin, "f4")}
