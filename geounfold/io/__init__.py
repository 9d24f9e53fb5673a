"""Files in and out: tables of points, surfaces, and outputs that appear whole or not at all."""

from geounfold.io.coordinates import LARGEST_COORDINATE, coordinate_columns
from geounfold.io.outputs import Outputs, replacing
from geounfold.io.points import PointTable, read_points
from geounfold.io.surfaces import holds_surface, read_surface, write_surface
from geounfold.io.tables import TABLE_ENDINGS, read_table, write_json, write_table

__all__ = [
    "LARGEST_COORDINATE",
    "TABLE_ENDINGS",
    "Outputs",
    "PointTable",
    "coordinate_columns",
    "holds_surface",
    "read_points",
    "read_surface",
    "read_table",
    "replacing",
    "write_json",
    "write_surface",
    "write_table",
]
