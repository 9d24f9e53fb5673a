"""Vertical simple shear: every vertical line slides as one until the reference is level."""

from __future__ import annotations

from geounfold.methods.contract import BodyFit, PreparedBody, by_rule
from geounfold.methods.sheet.stages import sheet_stages
from geounfold.methods.vertical_heights import vertical_rule, vertical_warnings


def fit_shear(body: PreparedBody) -> BodyFit:
    """Return the map that keeps x and y and takes from z the height of a reference surface.

    The reference lies midway, along the vertical, between top and bottom; ``datum`` moves it to
    the top or the bottom, or makes both level.  Volumes stay, and lengths along dipping layers
    shrink by the cosine of the dip.  x and y are the frame's: those of the data but for a rigid
    motion.

    Raises
    ------
    SplitError
        The sheet stands on end; see also ``sheet``.
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
