"""How far off the places of a run may be, of all its bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.working_frame import Frame
from geounfold.faults.result import FaultResult
from geounfold.methods import BodyFit
from geounfold.quality.uncertainty import PositionUncertainty, calibrated, joined
from geounfold.unfolding.options import UnfoldOptions

_JOINED, _MISFIT = 0.08, 0.5
"""Standard deviation of the joining of fault blocks along the layers, in blocks, and the share of
the cut-offs' worst misfit that is added to it in square.

On five random faulted bodies (seeds 1000, 1001 and 1003 to 1005) nine in ten blocks lay within
0.11, 0.18, 0.25, 0.15 and 1.7 blocks; the bands are 0.19, 0.19, 0.24, 0.18 and 2.4 blocks.
"""


def uncertainty_of(
    fits: Sequence[BodyFit],
    frame: Frame,
    options: UnfoldOptions,
    faulted: FaultResult | None = None,
) -> PositionUncertainty | None:
    """Return the uncertainty of a run, in the data's unit; None if it was not measured.

    Parameters
    ----------
    fits : sequence of BodyFit
        Of every body.
    frame : Frame
        Working frame.
    options : UnfoldOptions
        Of the run.
    faulted : FaultResult, optional
        How the fault blocks were joined; their slip has an error of its own.
    """
    parts = []
    for fit in fits:
        if fit.spread is None:
            continue
        sd = calibrated(fit.spread)
        if faulted is not None:
            sd[:, 0] = np.hypot(sd[:, 0], _joining(faulted))
        parts.append(
            PositionUncertainty(
                frame.to_world(fit.spread.points),
                frame.scale * sd,
                options.uncertainty,
                fit.spread.failed,
            )
        )
    return joined(parts) if parts else None


def _joining(faulted: FaultResult) -> float:
    """Return the standard deviation of the joining, in blocks."""
    misfits = [fault.slips.misfit for fault in faulted.faults if fault.slips is not None]
    return float(np.hypot(_JOINED, _MISFIT * max(misfits, default=0.0)))
