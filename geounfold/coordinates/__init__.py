"""Generalised barycentric coordinates: Wachspress and mean value coordinates of prisms."""

from __future__ import annotations

from geounfold.coordinates.interpolant import COORDINATES, PrismInterpolant
from geounfold.coordinates.mean_value import mean_value, mean_value_gradients
from geounfold.coordinates.wachspress import wachspress, wachspress_gradients

__all__ = [
    "COORDINATES",
    "PrismInterpolant",
    "mean_value",
    "mean_value_gradients",
    "wachspress",
    "wachspress_gradients",
]
