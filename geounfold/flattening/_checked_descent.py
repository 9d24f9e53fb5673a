"""Descents that must stay one-to-one: each step is checked, and the last sound one is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from geounfold.errors import BackendError
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import History, Problem, displacement
from geounfold.flattening._result import Stop
from geounfold.flattening.measures import symmetric_dirichlet
from geounfold.geometry.mesh import Floats

#: Symmetric Dirichlet energy of an isometry.
ISOMETRY = 4.0

#: A descent ends if a step lowers the energy by no more than this share of its excess over an
#: isometry's.
ENERGY_TOL = 1e-4


@dataclass(frozen=True, eq=False)
class Run:
    """A descent: last sound positions, number of steps, reason to stop, history and note."""

    uv: Floats
    steps: int
    stop: Stop
    history: History
    note: str = ""


def descend(
    problem: Problem,
    uv: Floats,
    step: Callable[[], Floats],
    options: IterationOptions,
    sound: Callable[[Floats], bool],
    energy_tol: float = ENERGY_TOL,
) -> Run:
    """Step until no vertex moves; stop before the first step that fails or is not sound.

    Parameters
    ----------
    problem : Problem
        The checked surface.
    uv : (n, 2) float
        Start; must be sound.
    step : callable
        Returns the next positions, (n, 2); BackendError if it fails.
    options : IterationOptions
        Conditions to stop.
    sound : callable
        ``sound(uv)`` returns whether positions may be kept.
    energy_tol : float
        Stop if a step lowers the energy by no more than this share of its excess over an
        isometry's.
    """
    V, F = problem.mesh.V, problem.mesh.F
    history = History.empty(problem)
    energy = symmetric_dirichlet(V, F, uv)
    history.record(uv, energy)
    for count in range(1, options.max_iter + 1):
        try:
            after = step()
        except BackendError as err:
            return Run(uv, count - 1, Stop.STALLED, history, f"stopped before step {count}: {err}")
        if not sound(after):
            note = f"stopped before step {count}, which is not one-to-one"
            return Run(uv, count - 1, Stop.STALLED, history, note)
        after = after - after.mean(axis=0)
        moved = displacement(uv, after)
        uv, before, energy = after, energy, symmetric_dirichlet(V, F, after)
        history.record(uv, energy)
        quiet = 0 <= before - energy <= energy_tol * (energy - ISOMETRY)
        if quiet or moved <= options.tol * problem.size:
            return Run(uv, count, Stop.CONVERGED, history)
    return Run(uv, options.max_iter, Stop.MAX_ITER, history)
