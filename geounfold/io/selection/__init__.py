"""The choice of rows by an expression such as ``ROCK=ORE and AU>0.2``."""

from geounfold.io.selection.where import (
    Where,
    column_position,
    nearest_name,
    not_chosen,
    read_where,
)

__all__ = ["Where", "column_position", "nearest_name", "not_chosen", "read_where"]
