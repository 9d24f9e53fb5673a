"""Where carried points lie: in the control mesh, around it, or beyond its reach."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.cli.terminal.console import Console
from geounfold.io.result_columns import UNFOLDED, result_columns

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats
    from geounfold.mapping.mesh_map import UnfoldingMap
    from geounfold.methods import PointwiseMap


def flat_columns(saved: UnfoldingMap | PointwiseMap) -> Callable[[Floats], dict[str, Any]]:
    """Return what carries points to the flat side, into output columns."""
    return lambda points: result_columns(UNFOLDED, saved.carry(points))


def place_counts(columns: dict[str, Any]) -> dict[str, int]:
    """Return how many points were carried, and how many of them not by the control mesh."""
    location = columns["location"]
    words = ("extrapolated", "outside")
    return {"carried": len(location), **{w: int(np.count_nonzero(location == w)) for w in words}}


def warn_of_outside(path: str, places: dict[str, int], console: Console) -> None:
    """Say how many carried points the control mesh does not hold."""
    total, extrapolated, empty = (places[word] for word in ("carried", "extrapolated", "outside"))
    if extrapolated:
        console.warn(
            f"{path}: {extrapolated} of {total} points lie outside the control mesh and "
            "were carried by its continuation; they are marked extrapolated"
        )
    if empty:
        console.warn(
            f"{path}: {empty} of {total} points lie farther from the control mesh than "
            "the map reaches; they were left empty and are marked outside"
        )
