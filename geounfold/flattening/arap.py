"""As-rigid-as-possible flattening (Liu et al. 2008) by libigl."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.backends import igl as backend
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import History, Problem, displacement, finish, flip_count
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import tutte
from geounfold.flattening.measures import arap_energy
from geounfold.geometry.mesh import Floats

#: Steps between two entries of the history.
RECORD = 10


@dataclass(frozen=True, kw_only=True)
class ArapOptions(IterationOptions):
    """Options of ``arap``."""

    tol: float = 1e-6
    max_iter: int = 1000


def arap(problem: Problem, start: Floats | None, options: ArapOptions) -> Flattening:
    """Flatten by libigl's ARAP, ``sum A (s1 - 1)^2 + A (s2 - 1)^2`` over the faces.

    libigl's ARAP does not prevent flipped triangles (libigl issue 680): flips are counted in the
    note.  Positions that are not finite (issue 2439) raise FlatteningError.

    Parameters
    ----------
    problem : Problem
        The checked surface; its rest lengths are its edges' own.
    start : (n, 2) float or None
        Flat positions to start from; None for Tutte's embedding.
    options : ArapOptions
        Conditions to stop.
    """
    uv = tutte(problem) if start is None else start
    # Scaled to a common size, because libigl's solver has absolute thresholds.
    V, F, size = problem.mesh.V, problem.mesh.F, problem.size
    history = History.empty(problem)
    history.record(uv, arap_energy(V, F, uv))
    stop, count = Stop.MAX_ITER, 0
    try:
        step = backend.ArapSteps((V - V.mean(axis=0)) / size, F)
        while count < options.max_iter and stop is Stop.MAX_ITER:
            count += 1
            after = step(uv / size) * size
            after -= after.mean(axis=0)
            if displacement(uv, after) <= options.tol * size:
                stop = Stop.CONVERGED
            uv = after
            if count % RECORD == 0 or stop is Stop.CONVERGED or count == options.max_iter:
                history.record(uv, arap_energy(V, F, uv))
    except BackendError as err:
        raise FlatteningError(f"arap: {err}") from err
    flips = flip_count(uv, F)
    note = f"libigl's ARAP flipped {flips} triangles: it has no safeguard" if flips else ""
    return finish(problem, uv, "arap", stop, count, history, note)
