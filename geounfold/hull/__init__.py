"""Hull extraction: a closed, outward, manifold surface around the blocks."""

from __future__ import annotations

import numpy as np

from geounfold.hull._finish import HullOptions, finish
from geounfold.hull._result import Hull
from geounfold.hull.density import density_field
from geounfold.mesh import Floats

__all__ = ["Hull", "HullOptions", "density", "extract_hull"]


def density(points: Floats, steps: Floats | None, options: HullOptions) -> Hull:
    """Density hull (draft door)."""
    s = np.ones(3) if steps is None or steps.max() / steps.min() <= 1.2 else steps
    field = density_field(points / s, options.sigma)
    V, F = field.level_set(options.level)
    return finish(
        V * s,
        F,
        method="density",
        blocks=len(points),
        inset=0.0,
        blur=field.blur,
        options=options,
        project=lambda V: field.project(V / s, options.level) * s,
    )


def extract_hull(
    points: Floats, steps: Floats | None, method: str = "auto", options: HullOptions | None = None
) -> Hull:
    """Return the hull of points in working units."""
    return density(points, steps, options or HullOptions())
