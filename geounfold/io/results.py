"""The columns that a result is told in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geounfold.io.coordinates import Triple

if TYPE_CHECKING:
    from geounfold.mapping import Carried

UNFOLDED: Triple = ("unfolded_x", "unfolded_y", "unfolded_z")
FOLDED: Triple = ("folded_x", "folded_y", "folded_z")


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
