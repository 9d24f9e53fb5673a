"""The columns that a result is told in."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Floats
from geounfold.io.coordinate_columns import Triple, coordinate_columns, numbers

if TYPE_CHECKING:
    from geounfold.mapping.carried import Carried

UNFOLDED: Triple = ("unfolded_x", "unfolded_y", "unfolded_z")
FOLDED: Triple = ("folded_x", "folded_y", "folded_z")
WORLD: Triple = ("world_x", "world_y", "world_z")


def result_columns(names: Triple, carried: Carried) -> dict[str, Any]:
    """Return where points came to lie, by output column, (n,) each.

    ``stratigraphic`` is left out on the way back to the folded space.
    """
    points = {name: carried.points[:, axis] for axis, name in enumerate(names)}
    height = {} if names == FOLDED else {"stratigraphic": carried.stratigraphic}
    return {
        **points,
        **height,
        "location": carried.location,
        "mesh_distance": carried.distance,
    }


def world_columns(points: Floats) -> dict[str, Any]:
    """Return the world coordinates of points (n, 3) read in a model's own, by output column."""
    return {name: points[:, axis] for axis, name in enumerate(WORLD)}


def frame_points(frame: pd.DataFrame, prefer: Triple | None = None) -> Floats:
    """Return the coordinates in a DataFrame, (n, 3); those called as `prefer` where they exist.

    Raises
    ------
    InputError
        No coordinate columns, several sets of them, or values that are no numbers.
    """
    names = [str(name) for name in frame.columns]
    there = prefer if prefer is not None and set(prefer) <= set(names) else None
    columns = [frame.iloc[:, k] for k in coordinate_columns(names, there)]
    return np.column_stack([numbers(column) for column in columns])


def with_carried(
    frame: pd.DataFrame, carry: Callable[[Floats], Carried], names: Triple
) -> pd.DataFrame:
    """Return a DataFrame with where its points came to lie: index, columns and types are kept.

    The way back looks for the unfolded coordinates first.  A column called as a result is replaced
    in its place.
    """
    points = frame_points(frame, UNFOLDED if names == FOLDED else None)
    return frame.assign(**result_columns(names, carry(points)))
