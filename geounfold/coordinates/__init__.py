"""Generalised barycentric coordinates: Wachspress and mean value coordinates of prisms."""

from __future__ import annotations

from geounfold.coordinates.interpolant import COORDINATES, PrismInterpolant
from geounfold.coordinates.mean_value import mean_value
from geounfold.coordinates.wachspress import wachspress

__all__ = ["COORDINATES", "PrismInterpolant", "mean_value", "wachspress"]
