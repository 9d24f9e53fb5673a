"""Descents that must stay one-to-one: each step is checked, and the last sound one is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geounfold.errors import BackendError, OptionError
from geounfold.flattening._problem import History, Problem, displacement
from geounfold.flattening._result import Stop
from geounfold.flattening.measures import symmetric_dirichlet
from geounfold.geometry.mesh import Floats

#: Symmetric Dirichlet energy of an isometry.
ISOMETRY = 4.0


@dataclass(frozen=True, kw_only=True)
class InjectiveOptions:
    """Options of ``slim`` and ``scaf``.

    Parameters
    ----------
    tol : float
        Stop where a step moves no vertex by more than this share of the surface's size.
    energy_tol : float
        Stop where a step lowers the energy by no more than this share of its excess over an
        isometry's, 4.
    max_iter : int
        Largest number of steps.
    """

    tol: float = 1e-6
    energy_tol: float = 1e-4
    max_iter: int = 200

    def __post_init__(self) -> None:
        name = type(self).__name__
        for key in ("tol", "energy_tol"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise OptionError(f"{name}: {key} must be positive, but is {value}")
        if self.max_iter < 1:
            raise OptionError(f"{name}: max_iter must be at least 1, but is {self.max_iter}")


@dataclass(frozen=True, eq=False)
class Run:
    """A descent: its last sound positions, its steps, why it stopped and what it had to do."""

    uv: Floats
    steps: int
    stop: Stop
    history: History
    note: str = ""


def descend(
    problem: Problem,
    uv: Floats,
    step: Callable[[], Floats],
    options: InjectiveOptions,
    sound: Callable[[Floats], bool],
) -> Run:
    """Step until nothing moves; stop before the first step that fails or is not sound.

    Parameters
    ----------
    problem : Problem
        The checked surface.
    uv : (n, 2) float
        The start: sound.
    step : callable
        Returns the next positions, (n, 2); BackendError where it fails.
    options : InjectiveOptions
        When to stop.
    sound : callable
        Whether positions may be kept.
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
        quiet = 0 <= before - energy <= options.energy_tol * (energy - ISOMETRY)
        if quiet or moved <= options.tol * problem.size:
            return Run(uv, count, Stop.CONVERGED, history)
    return Run(uv, options.max_iter, Stop.MAX_ITER, history)
