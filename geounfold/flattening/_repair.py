"""Repair of an answer that folds or overlaps: a one-to-one answer, or an error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from geounfold.backends.slim_scaf import SlimSteps
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._border import is_one_to_one, turned_over
from geounfold.flattening._checked_descent import Run, descend
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import History, Problem, finish
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import tutte
from geounfold.flattening._unflip import untangle
from geounfold.flattening.measures import symmetric_dirichlet
from geounfold.geometry.mesh import Floats

# : Conditions to stop the descents of the ladder; their energy is then within a few per cent of its
# minimum.
_ENOUGH = IterationOptions(tol=1e-3, max_iter=50)
_ENOUGH_ENERGY = 1e-2


def one_to_one(problem: Problem, flat: Flattening, isometric: bool) -> Flattening:
    """Return a one-to-one flattening: the one given, or that of the first rung that gives one.

    1. *Untangling*: the vertices around a few turned triangles are moved, all others stay. 2.
    *SLIM* from Tutte's embedding, only for isometric methods and the mesh's own lengths;
       nothing flips.
    3. The last one-to-one step of 2, if its border came to overlap.  Scaffold maps could continue
    from there, but they mesh the surroundings with Triangle, which is not free software; users who
    may run it can choose ``scaf``.

    The answer keeps its method's name; its note names the rung.

    Parameters
    ----------
    problem : Problem
        The surface.
    flat : Flattening
        Answer of the method.
    isometric : bool
        Whether the method keeps lengths, so that 2 and 3 may replace it.

    Raises
    ------
    FlatteningError
        No rung gives a one-to-one map.  The message counts folded triangles and overlapping pairs
        of border edges, and names the first place.
    """
    if flat.one_to_one:
        return flat
    for rung in _rungs(problem, flat, isometric):
        if rung.one_to_one:
            note = "; ".join(filter(None, [flat.note, f"{_counts(flat)}: {rung.note}"]))
            steps = flat.iterations + rung.iterations
            return replace(rung, method=flat.method, iterations=steps, note=note)
    raise FlatteningError(f"{flat.method}: {_counts(flat)}, {_place(flat)}; {_cure(isometric)}")


def _rungs(problem: Problem, flat: Flattening, isometric: bool) -> Iterator[Flattening]:
    """Yield the answers of the rungs; each is computed only if the one before was not enough."""
    if flat.flips and not flat.overlaps:
        loose = untangle(problem, flat.uv)
        if loose is not None:
            history = History.empty(problem)
            history.record(loose.uv, _energy(problem, loose.uv))
            note = f"untangled, {loose.moved} of {len(loose.uv)} vertices free to move"
            yield finish(problem, loose.uv, "", flat.stop, 0, history, note)
    if not (isometric and problem.own):
        return
    uv = tutte(problem)
    if not is_one_to_one(uv, problem.mesh.F, problem.loops):
        return
    run, sound = _slim_run(problem, uv)
    note = "; ".join(filter(None, ["SLIM from Tutte's embedding instead", run.note]))
    yield finish(problem, run.uv, "", run.stop, run.steps, run.history, note)
    note = "SLIM's last step before its border overlapped"
    history = _one_record(problem, sound)
    yield finish(problem, sound, "", Stop.STALLED, run.steps, history, note)


def _slim_run(problem: Problem, uv: Floats) -> tuple[Run, Floats]:
    """Return SLIM's descent from Tutte's embedding and its last one-to-one step."""
    F, loops, last = problem.mesh.F, problem.loops, uv

    def sound(flat: Floats) -> bool:
        nonlocal last
        if len(turned_over(flat, F)):
            return False
        if is_one_to_one(flat, F, loops):
            last = flat
        return True

    try:
        run = descend(problem, uv, SlimSteps(problem.mesh.V, F, uv), _ENOUGH, sound, _ENOUGH_ENERGY)
    except BackendError as err:
        run = Run(uv, 0, Stop.STALLED, _one_record(problem, uv), f"{err}")
    return run, last


def _one_record(problem: Problem, uv: Floats) -> History:
    """Return a history of one step."""
    history = History.empty(problem)
    history.record(uv, _energy(problem, uv))
    return history


def _energy(problem: Problem, uv: Floats) -> float:
    return symmetric_dirichlet(problem.mesh.V, problem.mesh.F, uv)


def _counts(flat: Flattening) -> str:
    """Return the faults of a flattening as a phrase."""
    parts = []
    if flat.flips:
        parts.append(f"{flat.flips} of {len(flat.mesh.F)} triangles are folded over")
    if len(flat.border.crossings):
        parts.append(f"{flat.overlaps} pairs of border edges overlap")
    elif flat.overlaps:
        parts.append(f"{flat.overlaps} border loops are turned inside out")
    return " and ".join(parts)


def _place(flat: Flattening) -> str:
    """Return the place of the first fault on the folded surface, as a phrase."""
    mesh = flat.mesh
    if flat.flips:
        at = mesh.V[mesh.F[turned_over(flat.uv, mesh.F)[0]]].mean(axis=0)
    elif len(flat.border.crossings):
        at = mesh.V[flat.border.crossings[0].ravel()].mean(axis=0)
    else:
        at = mesh.V[flat.loops[-1]].mean(axis=0)
    return "the first near " + ", ".join(f"{x:.6g}" for x in at)


def _cure(isometric: bool) -> str:
    if isometric:
        return "cut the surface there, or remesh it"
    return "take an isometric method (spring, arap, slim, scaf), or cut the surface there"
