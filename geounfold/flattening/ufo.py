"""One reference surface by energy release, as the thesis describes U-Fo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import FlatteningError, check_number
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import History, Problem, displacement, finish, flip_count
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import plan
from geounfold.flattening.spring_dynamic import ROUNDING, WINDOW, Motion, SpringDynamicOptions
from geounfold.geometry.mesh import Floats

#: Relative rise of the energy in the first step from rest above which it is not rounding: the time
#: step is too large for the springs.
RISE = 1e-9


@dataclass(frozen=True, kw_only=True)
class UfoOptions(IterationOptions):
    """Options of ``ufo``.

    Parameters
    ----------
    time_step : float or None
        Time step, in the unit of ``spring_dynamic``; None for its default with the thesis's stop
        rule.
    tol : float
        Iteration stops if over 50 steps the energy changes by at most this share of itself and no
        vertex moves by more than this share of the surface's size.
    max_iter : int
        Largest number of time steps.
    """

    time_step: float | None = None
    tol: float = 1e-5
    max_iter: int = 5_000

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("flattener_options.time_step", self.time_step, 0, low_open=True, none=True)


def ufo(problem: Problem, start: Floats | None, options: UfoOptions) -> Flattening:
    """Flatten by releasing the springs' energy from the surface's projection on a plane.

    U-Fo's code is not public.  According to the thesis (sections 1.1, 2.3.2, 4.1) one reference
    surface is flattened by a conservative spring model, taken over from Wang: springs along the
    edges with the folded lengths as rest lengths; masses without damping; the integrator of section
    2.2.4; a planar start.  So this is ``spring_dynamic`` with its thesis options, with two
    differences:

    * Each release ends when the springs' energy rises; the next one starts there at rest, until no
      vertex moves.  The kinetic energy removed is the energy released; without damping the motion
      would never end.  The thesis ends with the first release.
    * The area error may rise; the thesis also stops when it does.

    Unlike ``spring`` it has no rigid steps first, no second derivatives and no barrier.  If the
    projection on the plane overlaps, as for an overturned fold, the springs relax with triangles
    folded over and stay so; the note counts them.

    Parameters
    ----------
    problem : Problem
        The checked surface.
    start : (n, 2) float or None
        Flat positions to start from; None for the projection on the best-fit plane.
    options : UfoOptions
        Time step and conditions to stop.

    Raises
    ------
    FlatteningError
        The time step is too large for the springs.
    """
    motion = Motion(
        problem,
        SpringDynamicOptions(time_step=options.time_step, stop_rule="thesis"),
        "ufo",
    )
    history = History.empty(problem)
    with np.errstate(over="ignore", invalid="ignore"):  # divergence is detected and raised
        begin = plan(problem) if start is None else start
        uv, count, stop = _release(motion, begin, options, history)
    flips = flip_count(uv, problem.mesh.F)
    note = f"{flips} triangles are folded over: nothing prevents it" if flips else ""
    return finish(problem, uv, "ufo", stop, count, history, note)


def _release(
    motion: Motion, uv: Floats, options: UfoOptions, history: History
) -> tuple[Floats, int, Stop]:
    """Step until energy and positions no longer change; velocity is set to 0 when energy rises."""
    p, tol = motion.problem, options.tol
    scale = float((p.rest**2).sum()) / 2
    energy = motion.energy(uv)
    history.record(uv, energy)
    anchor, before = uv, energy
    fallen = 0
    for count in range(1, options.max_iter + 1):
        after = motion.step(uv)
        value = motion.energy(after)
        if value <= energy + ROUNDING**2 * scale:
            uv, energy, fallen = after, value, fallen + 1
        elif fallen:
            motion.still()
            fallen = 0
        elif value > energy * (1 + RISE):
            raise FlatteningError(
                "ufo: the energy rises in the first step from rest; take a smaller time step"
            )
        else:  # at rest, to rounding
            history.record(uv, energy)
            return uv, count, Stop.CONVERGED
        if count % WINDOW:
            continue
        history.record(uv, energy)
        quiet = before - energy <= tol * (energy + tol**2 * scale)
        if quiet and displacement(anchor, uv) <= tol * p.size:
            return uv, count, Stop.CONVERGED
        anchor, before = uv, energy
    history.record(uv, energy)
    return uv, options.max_iter, Stop.MAX_ITER
