"""Harmonic maps onto a disk: one-to-one, but neither lengths nor angles are kept."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.backends import geodesics as backend
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._border import is_one_to_one
from geounfold.flattening._problem import History, Problem, finish
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import circle, tutte
from geounfold.flattening.measures import symmetric_dirichlet
from geounfold.geometry.mesh import Floats


@dataclass(frozen=True, kw_only=True)
class HarmonicOptions:
    """Options of ``harmonic``: it has none."""


def harmonic(problem: Problem, start: Floats | None, options: HarmonicOptions) -> Flattening:
    """Map onto the disk of the surface's area, the border spaced by its lengths.

    The map has the least Dirichlet energy: its weights are cotangents.  At obtuse angles these may
    be negative and fold triangles; then Tutte's embedding (1963), which is one-to-one, replaces the
    map, with a note.  Both are direct solves, so a start has no effect.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Not used.
    options : HarmonicOptions
        None.
    """
    V, F, outer = problem.mesh.V, problem.mesh.F, problem.loops[0]
    uv, note = None, ""
    try:
        scaled = (V - V.mean(axis=0)) / problem.size
        uv = backend.harmonic(scaled, F, outer, circle(problem, outer))
    except BackendError as err:
        note = f"{err}: Tutte's embedding instead"
    if uv is not None and not is_one_to_one(uv, F, problem.loops):
        uv, note = None, "cotangent weights fold triangles: Tutte's embedding instead"
    uv = tutte(problem) if uv is None else uv
    if not is_one_to_one(uv, F, problem.loops):
        raise FlatteningError(
            "harmonic: Tutte's embedding has triangles too small to tell from folded ones: "
            "remesh the surface"
        )
    history = History.empty(problem)
    history.record(uv, symmetric_dirichlet(V, F, uv))
    return finish(problem, uv, "harmonic", Stop.DIRECT, 0, history, note)
