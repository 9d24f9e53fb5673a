"""Generalised barycentric coordinates: Wachspress and mean value coordinates of prisms."""

from __future__ import annotations

from geounfold.mapping.prism_coordinates.interpolant import COORDINATES, PrismInterpolant
from geounfold.mapping.prism_coordinates.mean_value import mean_value, mean_value_gradients
from geounfold.mapping.prism_coordinates.wachspress import wachspress, wachspress_gradients

__all__ = [
    "COORDINATES",
    "PrismInterpolant",
    "mean_value",
    "mean_value_gradients",
    "wachspress",
    "wachspress_gradients",
]
