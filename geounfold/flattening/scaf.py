"""Isometric flattening that is one-to-one: scaffold maps (Jiang et al. 2017) by libigl."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.backends.slim_scaf import ScaffoldSteps
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._border import is_one_to_one
from geounfold.flattening._checked_descent import Run, descend
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import Problem, finish
from geounfold.flattening._result import Flattening
from geounfold.flattening._start import tutte
from geounfold.geometry.mesh import Floats


@dataclass(frozen=True, kw_only=True)
class ScafOptions(IterationOptions):
    """Options of ``scaf``."""

    tol: float = 1e-6

    max_iter: int = 100


def scaf(problem: Problem, start: Floats | None, options: ScafOptions) -> Flattening:
    """Flatten by libigl's scaffold maps: the energy of ``slim``, with a border that cannot overlap.

    The plane around the surface and its holes are meshed too, and no triangle of that mesh may
    flip, so the border cannot meet itself.  Each step is checked by exact predicates.  A step that
    is not finite or not one-to-one ends the run, with a note, and the step before it is returned.
    So the answer is always one-to-one.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Flat positions to start from.  Tutte's embedding is used if None or if they are not
        one-to-one.
    options : ScafOptions
        Conditions to stop.
    """
    F, loops, uv, note = problem.mesh.F, problem.loops, start, ""
    if uv is not None and not is_one_to_one(uv, F, loops):
        uv, note = None, "the start is not one-to-one: from Tutte's embedding instead"
    uv = tutte(problem) if uv is None else uv
    if not is_one_to_one(uv, F, loops):
        raise FlatteningError(
            "scaf: Tutte's embedding has triangles too small to tell from folded ones: "
            "remesh the surface"
        )
    run = scaffold_run(problem, uv, options)
    if not run.steps:
        raise FlatteningError(f"scaf: {run.note}")
    notes = "; ".join(filter(None, [note, run.note]))
    return finish(problem, run.uv, "scaf", run.stop, run.steps, run.history, notes)


def scaffold_run(problem: Problem, uv: Floats, options: IterationOptions) -> Run:
    """Return the descent from one-to-one positions; FlatteningError if libigl cannot begin."""
    F, loops = problem.mesh.F, problem.loops
    try:
        steps = ScaffoldSteps(problem.mesh.V, F, uv)
    except BackendError as err:
        raise FlatteningError(f"scaf: {err}") from err
    return descend(problem, uv, steps, options, lambda flat: is_one_to_one(flat, F, loops))
