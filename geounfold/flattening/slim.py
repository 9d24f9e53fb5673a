"""Isometric flattening without flips: SLIM (Rabinovich et al. 2017) by libigl."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.backends.slim_scaf import SlimSteps
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._border import turned_over
from geounfold.flattening._checked_descent import descend
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import Problem, finish
from geounfold.flattening._result import Flattening
from geounfold.flattening._start import tutte
from geounfold.geometry.mesh import Floats


@dataclass(frozen=True, kw_only=True)
class SlimOptions(IterationOptions):
    """Options of ``slim``."""

    tol: float = 1e-6
    max_iter: int = 200


def slim(problem: Problem, start: Floats | None, options: SlimOptions) -> Flattening:
    """Flatten by libigl's SLIM: the mean of s1^2 + s2^2 + 1/s1^2 + 1/s2^2 over the folded area.

    The energy is infinite if a triangle has no area, and every step stops before that, so no
    triangle flips.  The border may still cross itself.  Each step is checked by an exact predicate.
    A step that is not finite or flips a triangle ends the run, with a note, and the step before it
    is returned.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Flat positions to start from.  Tutte's embedding is used if None or if triangles are
        flipped.
    options : SlimOptions
        Conditions to stop.
    """
    F, uv, note = problem.mesh.F, start, ""
    if uv is not None and len(turned_over(uv, F)):
        uv, note = None, "the start has flipped triangles: from Tutte's embedding instead"
    uv = tutte(problem) if uv is None else uv
    if len(turned_over(uv, F)):
        raise FlatteningError(
            "slim: Tutte's embedding has triangles too small to tell from folded ones: "
            "remesh the surface"
        )
    try:
        steps = SlimSteps(problem.mesh.V, F, uv)
    except BackendError as err:
        raise FlatteningError(f"slim: {err}") from err
    run = descend(problem, uv, steps, options, lambda flat: not len(turned_over(flat, F)))
    if not run.steps:
        raise FlatteningError(f"slim: {run.note}")
    notes = "; ".join(filter(None, [note, run.note]))
    return finish(problem, run.uv, "slim", run.stop, run.steps, run.history, notes)
