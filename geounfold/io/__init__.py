"""Files in and out: tables of points, surfaces, and outputs that appear whole or not at all."""

from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.io.coordinate_columns import coordinate_columns
from geounfold.io.json_text import write_json
from geounfold.io.outputs import Outputs, replacing
from geounfold.io.paths import TABLE_ENDINGS
from geounfold.io.surfaces import holds_surface, read_surface, write_surface
from geounfold.io.tables.files import read_table, write_table
from geounfold.io.tables.points import PointTable, read_points

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
