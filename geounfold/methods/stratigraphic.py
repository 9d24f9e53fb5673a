"""The stratigraphic coordinate of geostatistics: the relative height between bottom and top."""

from __future__ import annotations

from geounfold.methods.contract import BodyFit, PreparedBody
from geounfold.methods.shear import vertical_fit


def fit_stratigraphic(body: PreparedBody) -> BodyFit:
    """Return the map that keeps x and y and makes z the proportional height.

    ``z = (share - 1/2) T`` with ``share = (height - bottom) / (top - bottom)`` along the vertical
    and T the mean vertical thickness over the blocks: the coordinate in which tabular deposits
    are estimated if top and bottom have one height at each place (geostatisticslessons.com,
    stratcoords).  ``datum`` does not matter, since both surfaces become level.

    Raises
    ------
    SplitError
        The sheet is vertical, or has no mid surface (as for ``sheet``).
    """
    return vertical_fit(body, "proportional")
