"""How far off the places of a run may be, of all its bodies."""

from __future__ import annotations

from collections.abc import Sequence

from geounfold.body.working_frame import Frame
from geounfold.methods import BodyFit
from geounfold.quality.uncertainty import PositionUncertainty, calibrated, joined
from geounfold.unfolding.options import UnfoldOptions


def uncertainty_of(
    fits: Sequence[BodyFit], frame: Frame, options: UnfoldOptions
) -> PositionUncertainty | None:
    """Return the uncertainty of a run, in the data's unit; None if it was not measured."""
    parts = [
        PositionUncertainty(
            frame.to_world(fit.spread.points),
            frame.scale * calibrated(fit.spread),
            options.uncertainty,
            fit.spread.failed,
        )
        for fit in fits
        if fit.spread is not None
    ]
    return joined(parts) if parts else None
