"""The sheet method on a body: ours."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from geounfold.methods.contract import BodyFit, PreparedBody, SurfacePair
from geounfold.methods.sheet.stages import SheetResult, fit_body


def sheet_method(body: PreparedBody) -> BodyFit:
    """Return the control mesh of prisms along the fitted mid surface's normals.

    Raises
    ------
    SplitError, FlatteningError
        As the stages do.
    """
    result = sheet_stages(body, body.datum, body.reach)
    mesh = result.mesh
    surfaces = {
        name: SurfacePair(folded, unfolded, mesh.flattenings[name])
        for name, (folded, unfolded) in mesh.surfaces.items()
    }
    unit = 1 if body.coarse is None else body.coarse.merge
    notes = {
        "merged": unit,
        "rung": mesh.rungs[-1].name,
        "rungs": [asdict(rung) for rung in mesh.rungs],
        "roughness": result.fitted.roughness,
        "smoothing": result.fitted.smoothing,
        "accepted_samples": result.fitted.accepted,
        "sharpened": result.sharpened,
        "layers_follow": {0.0: "mid", 1.0: "top", -1.0: "bottom"}[result.fitted.lean],
    }
    return BodyFit(
        None if body.hull is None else body.hull.scaled(unit),
        body.split.scaled(unit),
        mesh.control,
        mesh.shell,
        surfaces,
        mesh.flattenings,
        result,
        notes,
    )


def sheet_stages(body: PreparedBody, datum: str, shell: float) -> SheetResult:
    """Return the stages of the sheet method; other methods take their surfaces from them.

    Parameters
    ----------
    body : Body
        See there.
    datum : str
        Which surface is flat.
    shell : float
        How far past the control mesh its shell reaches, in blocks.
    """
    variance = np.zeros(3) if body.hull is None else body.hull.blur_variance(body.frame.sides)
    chosen = body.sheet_options
    with body.stage("sheet"):
        return fit_body(
            body.split,
            body.points,
            body.blocks,
            body.frame.steps,
            variance,
            0.0 if body.hull is None else body.hull.inset,
            body.flatten,
            replace(chosen, control=replace(chosen.control, shell=shell)),
            datum,
            exact=body.hull is None,
            coarse=body.coarse,
        )
