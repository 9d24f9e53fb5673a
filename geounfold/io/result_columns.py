"""The columns of a result: unfolded or folded coordinates, stratigraphic coordinate, location."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.coordinate_columns import coordinate_columns, numbers
from geounfold.io.packages.names import Triple

if TYPE_CHECKING:
    from geounfold.mapping.carried import Carried

UNFOLDED: Triple = ("unfolded_x", "unfolded_y", "unfolded_z")
FOLDED: Triple = ("folded_x", "folded_y", "folded_z")
FAULT_BLOCK = "fault_block"
WORLD: Triple = ("world_x", "world_y", "world_z")


def result_columns(names: Triple, carried: Carried) -> dict[str, Any]:
    """Return the result for carried points by output column, (n,) each.

    A result in the folded space has no ``stratigraphic``; ``fault_block`` is there if faults were
    taken out.
    """
    points = {name: carried.points[:, axis] for axis, name in enumerate(names)}
    height = {} if names == FOLDED else {"stratigraphic": carried.stratigraphic}
    block = getattr(carried, "block", None)
    return {
        **points,
        **height,
        "location": carried.location,
        "mesh_distance": carried.distance,
        **({} if block is None else {FAULT_BLOCK: block}),
    }


def world_columns(points: Floats) -> dict[str, Any]:
    """Return world coordinates (n, 3) by output column, for a file in a model's own coordinates."""
    return {name: points[:, axis] for axis, name in enumerate(WORLD)}


def frame_points(frame: pd.DataFrame, prefer: Triple | None = None) -> Floats:
    """Return the coordinates in a DataFrame, (n, 3), from the columns `prefer` if they exist.

    Raises
    ------
    InputError
        No coordinate columns, several sets of them, or values that are not numbers.
    """
    names = [str(name) for name in frame.columns]
    there = prefer if prefer is not None and set(prefer) <= set(names) else None
    columns = [frame.iloc[:, k] for k in coordinate_columns(names, there)]
    return np.column_stack([numbers(column) for column in columns])


def with_carried(
    frame: pd.DataFrame, carry: Callable[[Floats], Carried], names: Triple
) -> pd.DataFrame:
    """Return a DataFrame with the result for its points; index, columns and types are kept.

    A map back to the folded space reads the columns unfolded_x, unfolded_y and unfolded_z if they
    exist. A column with the name of a result is replaced in its place.
    """
    points = frame_points(frame, UNFOLDED if names == FOLDED else None)
    return frame.assign(**result_columns(names, carry(points)))


def given_blocks(frame: pd.DataFrame, *, inverse: bool) -> Ints | None:
    """Return the fault block of flat points that a table names; None if it names none.

    Folded points need none: the faults part them.
    """
    if not inverse or FAULT_BLOCK not in frame.columns:
        return None
    values = pd.to_numeric(frame[FAULT_BLOCK], errors="coerce").fillna(-1).to_numpy(np.float64)
    return values.astype(np.int64)
