"""Fit every fault block of a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geounfold.body.prepare import BodyPoints
from geounfold.body.working_frame import Frame
from geounfold.errors import GeounfoldError
from geounfold.mapping.certificate import certify
from geounfold.methods import BodyFit
from geounfold.methods.contract import Stage
from geounfold.unfolding.fit_body import fit
from geounfold.unfolding.options import UnfoldOptions


def fit_blocks(
    bodies: Sequence[BodyPoints], frame: Frame, options: UnfoldOptions, stage: Stage
) -> list[BodyFit]:
    """Return the fits of all fault blocks.

    A block is fitted with its walls known. If that fails or is not proved, it is fitted as a body
    without walls, and then with another hull; the first proved fit is taken, or the first of all.

    Parameters
    ----------
    bodies : sequence of BodyPoints
        The blocks, with their walls.
    frame, options, stage
        As `fit` takes them.

    Raises
    ------
    GeounfoldError
        A block cannot be unfolded; the message names it.
    """
    return [_fitted(k, body, frame, options, stage) for k, body in enumerate(bodies)]


def fit_untold(
    bodies: Sequence[BodyPoints], frame: Frame, options: UnfoldOptions, stage: Stage
) -> list[BodyFit | None]:
    """Return the fits of fault blocks whose walls are not known yet; None if one fails.

    Parameters as `fit_blocks` takes them.
    """
    out: list[BodyFit | None] = []
    options = replace(options, uncertainty=0)
    for body in bodies:
        try:
            out.append(fit(body, frame, options, None, stage))
        except GeounfoldError:  # its surfaces are sought without the normals of its layers
            out.append(None)
    return out


def _fitted(
    number: int, body: BodyPoints, frame: Frame, options: UnfoldOptions, stage: Stage
) -> BodyFit:
    other = replace(options, hull="alpha") if options.hull == "auto" else options
    tries = [(body, options), (replace(body, walls=None), options), (body, other)]
    first: BodyFit | None = None
    failed: list[GeounfoldError] = []
    for own, chosen in tries:
        try:
            found = fit(own, frame, chosen, None, stage)
        except GeounfoldError as error:
            failed.append(error)
            continue
        none = np.empty(0, np.int64)
        if found.control is not None and certify(found.control, found.shell, none).injective:
            return found
        first = first or found
    if first is not None:
        return first
    raise type(failed[0])(
        f"fault block {number} ({len(body.blocks)} blocks): {failed[0]}"
    ) from failed[0]
