"""File formats by ending, one module for each family, loaded when a file needs it.

A module has those of these functions that its format allows:

- ``read_points(path) -> Points`` and ``write_points(path, points)``; if points are rows of a table,
  ``read_frame(path) -> DataFrame`` and ``write_frame(path, frame, meta)``,
- ``read_surface(path) -> Surface`` and ``write_surface(path, surface)``,
- of a format whose files hold several elements (`Format.elements`): both readers take the name of
  one, and ``elements_of(path)`` lists all.

CSV and Parquet tables, which keep all text, are in `geounfold.io.tables`.
"""

from geounfold.io.formats.registry import (
    FORMATS,
    Format,
    Points,
    Strings,
    Surface,
    find_format,
    point_endings,
    string_endings,
    surface_endings,
)

__all__ = [
    "FORMATS",
    "Format",
    "Points",
    "Strings",
    "Surface",
    "find_format",
    "point_endings",
    "string_endings",
    "surface_endings",
]
