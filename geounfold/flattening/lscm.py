"""Least-squares conformal flattening (Levy et al. 2002) by libigl."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends import igl as backend
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._problem import History, Problem, collapsed, finish, flip_count
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import tutte
from geounfold.flattening.measures import conformal_energy
from geounfold.geometry.measures import triangle_areas
from geounfold.geometry.mesh import Floats, Ints


@dataclass(frozen=True, kw_only=True)
class LscmOptions:
    """Options of ``lscm``: it has none."""


def lscm(problem: Problem, start: Floats | None, options: LscmOptions) -> Flattening:
    """Flatten by libigl's LSCM, scaled so that the flat area is the folded area.

    The two outermost border vertices of the start are pinned.  If libigl fails, returns positions
    that are not finite or collapses the surface (issues 2409 and 54), a second pair across the
    first is tried, with a note.  A conformal map keeps angles, not lengths.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Flat positions whose border determines the pins; None for Tutte's embedding.
    options : LscmOptions
        None.
    """
    plan = tutte(problem) if start is None else start
    failures: list[str] = []
    for pins in _pins(problem.loops[0], plan):
        try:
            uv = _scaled(problem, _solve(problem, pins))
        except (BackendError, FlatteningError) as err:
            failures.append(str(err))
            continue
        history = History.empty(problem)
        history.record(uv, conformal_energy(problem.mesh.V, problem.mesh.F, uv))
        note = f"first pins failed ({failures[0]}): a second pair was taken" if failures else ""
        flips = flip_count(uv, problem.mesh.F)
        if flips:
            note = "; ".join(filter(None, [note, f"libigl's LSCM flipped {flips} triangles"]))
        return finish(problem, uv, "lscm", Stop.DIRECT, 0, history, note)
    raise FlatteningError(f"lscm: {'; then '.join(failures)}")


def _pins(loop: Ints, plan: Floats) -> list[Ints]:
    """Return two pairs of distant border vertices, the second across the first."""
    border = plan[loop] - plan[loop].mean(axis=0)
    axis = np.linalg.svd(border, full_matrices=False)[2]
    return [loop[[int(np.argmin(border @ a)), int(np.argmax(border @ a))]] for a in axis]


def _solve(problem: Problem, pins: Ints) -> Floats:
    """Return libigl's map with two vertices pinned at their distance in space."""
    V = (problem.mesh.V - problem.mesh.V.mean(axis=0)) / problem.size
    apart = float(np.linalg.norm(V[pins[1]] - V[pins[0]]))
    # Pins that touch in space (a nearly closed surface) still need a distance; its value is free.
    at = np.array([[0.0, 0.0], [max(apart, 1e-3), 0.0]])
    return backend.lscm(V, problem.mesh.F, pins, at) * problem.size


def _scaled(problem: Problem, uv: Floats) -> Floats:
    """Return the map at the folded area, or FlatteningError if it has collapsed."""
    area = float(triangle_areas(uv, problem.mesh.F).sum())
    if not area > 0:
        raise FlatteningError("the conformal map has collapsed: its signed area is not positive")
    scaled: Floats = uv * np.sqrt(problem.areas.sum() / area)
    if collapsed(problem, scaled):
        raise FlatteningError("the conformal map has collapsed: most edges have lost their length")
    return scaled
