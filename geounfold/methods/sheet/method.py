"""The sheet method applied to a body."""

from __future__ import annotations

from dataclasses import asdict

from geounfold.methods.contract import BodyFit, PreparedBody, SurfacePair
from geounfold.methods.sheet.stages import sheet_stages


def sheet_method(body: PreparedBody) -> BodyFit:
    """Return the control mesh of prisms along the fitted mid surface's normals.

    Raises
    ------
    SplitError, FlatteningError
        Raised by the stages (see `sheet_stages`).
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
        "split": [candidate.row() for candidate in body.split.candidates],
        "attempts": [trial.row() for trial in result.trials],
        "finishes": [finish.row() for finish in result.finishes],
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
        signs=result.finish.signs,
    )
