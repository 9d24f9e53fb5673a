"""File formats by ending, one module for each family, loaded when a file asks for it.

A module offers what its format holds, of

- ``read_points(path) -> Points`` and ``write_points(path, points)``, or where points are rows of a
  table ``read_frame(path) -> DataFrame`` and ``write_frame(path, frame, meta)``,
- ``read_surface(path) -> Surface`` and ``write_surface(path, surface)``.

CSV and Parquet tables are not here but in `geounfold.io.tables`, as they keep whatever text they
hold.
"""

from geounfold.io.formats.registry import (
    FORMATS,
    Format,
    Points,
    Surface,
    find_format,
    point_endings,
    surface_endings,
)

__all__ = [
    "FORMATS",
    "Format",
    "Points",
    "Surface",
    "find_format",
    "point_endings",
    "surface_endings",
]
