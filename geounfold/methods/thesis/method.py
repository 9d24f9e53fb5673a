"""The thesis's method on a body."""

from __future__ import annotations

from geounfold.errors import OptionError
from geounfold.methods.contract import BodyFit, PreparedBody, SurfacePair, level, mean_top_normal
from geounfold.methods.thesis import thesis_control


def fit_thesis(body: PreparedBody) -> BodyFit:
    """Return the fit by the thesis's method; both its sheets are flat for every datum."""
    hull = body.hull
    if hull is None:
        raise OptionError(
            "--method thesis takes its surfaces from the hull; leave out --top and --bottom, "
            "or use --method sheet"
        )
    with body.stage("thesis"):
        up = mean_top_normal(body.split)
        mesh = thesis_control(body.points, hull.mesh, up, body.options, hull.inset, body.flatten)
    sides = {"top": (mesh.top, mesh.top_flat, 0.5), "bottom": (mesh.bottom, mesh.bottom_flat, -0.5)}
    surfaces = {
        name: SurfacePair(folded, level(folded, flat.uv, share * mesh.thickness), flat)
        for name, (folded, flat, share) in sides.items()
    }
    flattenings = {name: flat for name, (_, flat, _) in sides.items()}
    notes: dict[str, object] = {
        name: getattr(mesh, name)
        for name in ("thickness", "bottom_missed", "top_missed", "extended", "squeezed", "steep")
    }
    return BodyFit(hull, body.split, mesh.control, None, surfaces, flattenings, None, notes)
