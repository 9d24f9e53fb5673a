"""Vertical simple shear: vertical lines slide past each other until the reference is level."""

from __future__ import annotations

from geounfold.methods.contract import BodyFit, PreparedBody, by_rule
from geounfold.methods.sheet.stages import sheet_stages
from geounfold.methods.vertical_heights import vertical_rule, vertical_warnings


def fit_shear(body: PreparedBody) -> BodyFit:
    """Return the map that keeps x and y and subtracts the reference surface's height from z.

    The reference lies midway, along the vertical, between top and bottom; ``datum`` moves it to the
    top or the bottom, or makes both level.  Volumes are kept; lengths along dipping layers shrink
    by the cosine of the dip.  x and y are those of the working frame, a rigid motion of the data's.

    Raises
    ------
    SplitError
        The sheet is vertical, or has no mid surface (as for ``sheet``).
    """
    return vertical_fit(body, body.datum)


def vertical_fit(body: PreparedBody, datum: str) -> BodyFit:
    """Return the map by vertical coordinates with a datum (see VerticalRule)."""
    sheet = sheet_stages(body, "mid", 0.0)
    with body.stage("heights"):
        rule, at = vertical_rule(body, sheet, datum)
        warnings, notes = vertical_warnings(at, len(body.blocks))
        folded = {name: pair[0] for name, pair in sheet.mesh.surfaces.items()}
        return by_rule(body, sheet, rule, folded, notes, warnings)
