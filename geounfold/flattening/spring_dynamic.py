"""Wang's spring-mass model stepped through time, as described in the thesis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import FlatteningError, check_number, check_one_of
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._problem import (
    History,
    Problem,
    displacement,
    finish,
    flip_count,
    relative_area_error,
)
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._springs import spring_energy, spring_forces
from geounfold.flattening._start import plan, tutte
from geounfold.flattening._warm_start import RigidSteps, relax
from geounfold.geometry.measures import vertex_sum
from geounfold.geometry.mesh import Floats

#: Steps between two checks of energy and displacement (and entries of the history).
WINDOW = 50

#: Relative change below which a rise is rounding, not a rebound.
ROUNDING = 1e-12

#: Valid values of ``stop_rule``.
STOP_RULES = ("converged", "thesis")

#: Share of the velocity lost in each step, by stop rule: the thesis's equations have no damping.
DAMPING = {"converged": 0.01, "thesis": 0.0}

#: ``time_step^2 w^2`` for a bound ``w`` on the fastest oscillation, by stop rule.  The thesis's
#: integrator gains energy by a quarter of this value per step; the default damping removes more
#: than 0.01.  The thesis states no time step; with 0.05 its rule ends in 8 to 20 steps, as in its
#: figures.
STEP = {"converged": 0.01, "thesis": 0.05}


@dataclass(frozen=True, kw_only=True)
class SpringDynamicOptions(IterationOptions):
    """Options of ``spring_dynamic``.

    Parameters
    ----------
    stop_rule : str
        ``converged``: by ``tol``.  ``thesis``: at the first step that raises the energy or the area
        error; the positions before it are kept.
    damping : float or None
        Share of the velocity lost in each step; None for 0.01, or 0 with the thesis's stop rule.
    time_step : float or None
        Time step, in units of the square root of the mass of a square unit over the spring
        constant; the thesis's C, density and time step matter only in this combination.  None for
        ``(time_step w)^2 = 0.01``, or 0.05 with the thesis's stop rule, with a bound ``w`` on the
        fastest oscillation.
    tol : float
        Iteration stops if over 50 steps the energy changes by at most this share of itself and no
        vertex moves by more than this share of the surface's size.
    max_iter : int
        Largest number of time steps.
    """

    stop_rule: str = "converged"
    damping: float | None = None
    time_step: float | None = None
    tol: float = 1e-5
    max_iter: int = 5_000

    def __post_init__(self) -> None:
        super().__post_init__()
        name = "flattener_options."
        check_one_of(f"{name}stop_rule", self.stop_rule, STOP_RULES)
        check_number(f"{name}damping", self.damping, 0, 1, high_open=True, none=True)
        check_number(f"{name}time_step", self.time_step, 0, low_open=True, none=True)


def spring_dynamic(
    problem: Problem, start: Floats | None, options: SpringDynamicOptions
) -> Flattening:
    """Flatten by the motion of point masses joined by springs (thesis section 2.2.4).

    With the force ``f_i = sum_j (|P_i P_j| - d_j) n_ij`` and the mass m_i of a third of the
    surface around each vertex,

    ``a = f / m``, ``v(t + dt) = (1 - damping) (v(t) + dt a)``,
    ``q(t + dt) = q(t) + dt v(t) + dt^2 / 2 a``.

    The thesis's ``stop_rule`` is kept with its defects.  It ends after a few steps, as soon as the
    energy rebounds, with the surface hardly flattened.  On a surface that is already flat nothing
    ever rises, so only ``max_iter`` ends it.

    Parameters
    ----------
    problem : Problem
        The checked surface.
    start : (n, 2) float or None
        Flat positions to start from.  None: Tutte's embedding after a few rigid (ARAP) steps, or,
        with the thesis's stop rule, the projection on the best-fit plane.
    options : SpringDynamicOptions
        Stop rule, time step and damping.
    """
    thesis = options.stop_rule == "thesis"
    uv = _initial(problem, options) if start is None else start
    motion = Motion(problem, options)
    history = History.empty(problem)
    run = _run_thesis if thesis else _run
    with np.errstate(over="ignore", invalid="ignore"):  # divergence is detected and raised
        uv, count, stop = run(motion, uv, options, history)
    flips = flip_count(uv, problem.mesh.F)
    note = f"{flips} triangles are folded over: the springs do not prevent it" if flips else ""
    return finish(problem, uv, "spring_dynamic", stop, count, history, note)


def _initial(problem: Problem, options: SpringDynamicOptions) -> Floats:
    """Return the projection on a plane, as in the thesis, or Tutte's embedding relaxed.

    Without the relaxation the springs often fold over.
    """
    if options.stop_rule == "thesis":
        return plan(problem)
    return relax(RigidSteps(problem), tutte(problem), problem)[0]


class Motion:
    """The masses, their velocity and the time step.

    Parameters
    ----------
    problem : Problem
        The surface.
    options : SpringDynamicOptions
        Damping and time step.
    method : str
        Name of the method, for error messages.
    """

    def __init__(
        self, problem: Problem, options: SpringDynamicOptions, method: str = "spring_dynamic"
    ) -> None:
        self.problem, self._method = problem, method
        n = len(problem.mesh.V)
        self._mass = vertex_sum(problem.areas, problem.mesh.F, n) / 3
        # Gershgorin: no oscillation is faster than w^2 = max 2 degree / m.
        degree = np.bincount(problem.edges.ravel(), minlength=n)
        fastest = float((2 * degree / self._mass).max())
        self._dt = options.time_step or float(np.sqrt(STEP[options.stop_rule] / fastest))
        default = DAMPING[options.stop_rule]
        self._keep = 1 - (default if options.damping is None else options.damping)
        self._velocity = np.zeros((n, 2))

    def step(self, uv: Floats) -> Floats:
        """Return the positions one time step later."""
        p, dt = self.problem, self._dt
        force = spring_forces(uv, p.edges, p.rest)
        acceleration = force / self._mass[:, None]
        after: Floats = uv + dt * self._velocity + dt * dt / 2 * acceleration
        self._velocity = self._keep * (self._velocity + dt * acceleration)
        return after

    def still(self) -> None:
        """Set the velocity to zero."""
        self._velocity = np.zeros_like(self._velocity)

    def energy(self, uv: Floats) -> float:
        """Return the springs' energy, or FlatteningError if the motion has diverged."""
        value = spring_energy(uv, self.problem.edges, self.problem.rest)
        if not np.isfinite(value):
            raise FlatteningError(
                f"{self._method}: the motion diverged; take a smaller time step or more damping"
            )
        return value


def _run(
    motion: Motion, uv: Floats, options: SpringDynamicOptions, history: History
) -> tuple[Floats, int, Stop]:
    """Step until energy and positions no longer change."""
    p = motion.problem
    floor = options.tol**2 * float((p.rest**2).sum()) / 2
    energy = motion.energy(uv)
    history.record(uv, energy)
    anchor = uv
    for count in range(1, options.max_iter + 1):
        uv = motion.step(uv)
        if count % WINDOW and count != options.max_iter:
            continue
        before, energy = energy, motion.energy(uv)
        history.record(uv, energy)
        moved = displacement(anchor, uv)
        anchor = uv
        quiet = np.abs(before - energy) <= options.tol * (energy + floor)
        if quiet and moved <= options.tol * p.size and count % WINDOW == 0:
            return uv, count, Stop.CONVERGED
    return uv, options.max_iter, Stop.MAX_ITER


def _run_thesis(
    motion: Motion, uv: Floats, options: SpringDynamicOptions, history: History
) -> tuple[Floats, int, Stop]:
    """Step until the energy or the area error rises; the positions before that step are kept."""
    p = motion.problem
    energy = motion.energy(uv)
    area = relative_area_error(uv, p.mesh.F, p.areas)
    scale = float((p.rest**2).sum()) / 2
    history.record(uv, energy)
    for count in range(1, options.max_iter + 1):
        after = motion.step(uv)
        before, energy = energy, motion.energy(after)
        area_before, area = area, relative_area_error(after, p.mesh.F, p.areas)
        if energy > before + ROUNDING**2 * scale or area > area_before + ROUNDING:
            return uv, count, Stop.THESIS_RULE
        uv = after
        history.record(uv, energy)
    return uv, options.max_iter, Stop.MAX_ITER
