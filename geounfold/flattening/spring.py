"""Wang's spring energy minimised by Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from geounfold.backends.slim_scaf import SlimSteps
from geounfold.errors import BackendError, FlatteningError
from geounfold.flattening._flip_barrier import FoldGuard
from geounfold.flattening._iteration import IterationOptions
from geounfold.flattening._linear import PinnedSolver, edge_laplacian, factor, preconditioned_solve
from geounfold.flattening._problem import History, Problem, displacement, finish, flip_count
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._springs import BlockPattern, spring_blocks, spring_energy, spring_forces
from geounfold.flattening._start import plan, tutte
from geounfold.flattening._warm_start import RigidSteps, relax
from geounfold.geometry.measures import lengths
from geounfold.geometry.mesh import Floats, Ints

#: Least share of the predicted decrease that a step must bring (Armijo).
ARMIJO = 1e-4

#: Halvings of a step before the search gives up.
HALVINGS = 30

#: Newton steps after which folded triangles end a run that has no barrier.
PATIENCE = 12

#: Edge strain (root mean square) up to which the projection on a plane is the start: about that of
#: Tutte's embedding of a sheet.
PLANAR = 0.25

#: Edge strain (root mean square) of a given start above which rigid steps come first.
NEAR = 0.05

#: Steps of SLIM before the barrier is added, if the start is far from its rest lengths.
NEARER = 10

#: Residual of a Newton step's equations, as a share of their load: finest and roughest.
RESIDUAL = (1e-5, 1e-2)

#: Residual of the first Newton step's equations if the rigid steps' Laplacian replaces the
#: Hessian's factors, and most conjugate gradient steps for that: the factors cost as much as about
#: twice as many on 100,000 triangles.
ROUGH, ROUGH_STEPS = 1e-2, 25

#: Isotropic stiffness added to the convex Hessian, in units of C: a safeguard for a vertex on one
#: line with its neighbours.
RIDGE = 1e-8


@dataclass(frozen=True, kw_only=True)
class SpringOptions(IterationOptions):
    """Options of ``spring``.

    Parameters
    ----------
    tol : float
        Iteration stops if a step moves no vertex by more than this share of the surface's size and
        lowers the energy by no more than this share of itself.
    max_iter : int
        Largest number of Newton steps.
    """

    tol: float = 1e-7
    max_iter: int = 60


def spring(problem: Problem, start: Floats | None, options: SpringOptions) -> Flattening:
    """Flatten by minimising ``E = sum (|P_i P_j| - d_j)^2 / 2`` (thesis section 2.2.4, C = 1).

    The default start, or one far from its rest lengths, is first relaxed by a few rigid (ARAP)
    steps.  Newton's method then minimises the springs' energy, with the exact Hessian if that gives
    a descent, else without the negative parts of shortened springs.  At its minimum the springs'
    energy alone may fold a surface over, most often a doubly curved one.  Then a few steps of SLIM
    bring the last start without flips near its rest lengths, and the springs relax again with a
    barrier against folding, with a note.

    Parameters
    ----------
    problem : Problem
        The checked surface.
    start : (n, 2) float or None
        Flat positions to start from.  None: the projection on the best-fit plane if no triangle is
        folded over there and lengths are not too far off, else Tutte's embedding.
    options : SpringOptions
        Conditions to stop.

    Returns
    -------
    Flattening
        ``energy`` is that of the start, of the relaxed start (if there was one) and of each Newton
        step; it includes the barrier's energy if there is a barrier.
    """
    first = _own_start(problem) if start is None else start
    near = 0.0 if start is None else NEAR
    warm, unfolded, rigid, solver = _warm_start(problem, first, near)
    place = solver.place
    system = _System(problem, place, rough=solver.solve if rigid else None)
    history = History.empty(problem)
    history.record(first, system.energy(first))
    uv, steps, stop = _descend(system, warm, options, history, PATIENCE)
    if not np.isfinite(uv).all():
        raise FlatteningError("spring: the flat positions are not finite")
    flips = flip_count(uv, problem.mesh.F)
    if flips == 0:
        note = f"{rigid} rigid steps first" if rigid else ""
        return finish(problem, uv, "spring", stop, rigid + steps, history, note)
    return _guarded(problem, place, unfolded, flips, rigid + steps, options)


def _guarded(
    problem: Problem,
    place: Ints,
    unfolded: Floats | None,
    flips: int,
    before: int,
    options: SpringOptions,
) -> Flattening:
    """Return the flattening with the barrier, from a start without flips."""
    if unfolded is None:
        unfolded = tutte(problem)
        if flip_count(unfolded, problem.mesh.F):
            raise FlatteningError(
                f"spring: the springs fold {flips} triangles over, and Tutte's embedding has "
                "triangles too small to tell from folded ones: remesh the surface"
            )
        unfolded = _warm_start(problem, unfolded, NEAR)[1]
        if unfolded is None:  # Tutte's embedding itself has no flips
            raise FlatteningError("spring: no start without flipped triangles was found")
    unfolded = _nearer(problem, unfolded)
    history = History.empty(problem)
    system = _System(problem, place, FoldGuard(problem.mesh.F, problem.areas))
    uv, steps, stop = _descend(system, unfolded, options, history, options.max_iter)
    note = f"the springs alone fold {flips} triangles over: redone with a barrier against folding"
    return finish(problem, uv, "spring", stop, before + steps, history, note)


def _own_start(problem: Problem) -> Floats:
    """Return the projection on a plane if that is a sound start, else Tutte's embedding."""
    flat = plan(problem)
    sound = _strain(problem, flat) <= PLANAR and not flip_count(flat, problem.mesh.F)
    return flat if sound else tutte(problem)


def _strain(problem: Problem, uv: Floats) -> float:
    """Return the root mean square edge strain."""
    strain = lengths(uv, problem.edges) / problem.rest - 1
    return float(np.sqrt(np.mean(strain * strain)))


def _nearer(problem: Problem, uv: Floats) -> Floats:
    """Return a start without flips brought near its rest lengths by a few steps of SLIM.

    From a start far from its rest lengths, the barrier slows Newton's method down to tiny steps.
    """
    if not problem.own or _strain(problem, uv) <= NEAR:
        return uv
    try:
        step, after = SlimSteps(problem.mesh.V, problem.mesh.F, uv), uv
        for _ in range(NEARER):
            after = step()
    except BackendError:  # SLIM failed: the start is used unchanged
        return uv
    return uv if flip_count(after, problem.mesh.F) else after


def _warm_start(
    problem: Problem, start: Floats, near: float
) -> tuple[Floats, Floats | None, int, PinnedSolver]:
    """Return the relaxed start, the last one without flips, the steps taken and a Laplacian.

    A start with an edge strain up to ``near`` is not changed.
    """
    F, n = problem.mesh.F, len(problem.mesh.V)
    unfolded = None if flip_count(start, F) else start
    if _strain(problem, start) <= near:
        graph = edge_laplacian(problem.edges, np.ones(len(problem.edges)), n)
        return start, unfolded, 0, PinnedSolver(graph)
    rigid = RigidSteps(problem)
    uv, flat, steps = relax(rigid, start, problem)
    return uv, flat, steps, rigid.laplacian


class _System:
    """The springs (C = 1), with or without the barrier, as a function to minimise.

    ``rough`` solves a Laplacian system with vertex 0 held, (n, 2) to (n, 2).  It preconditions the
    first Newton step, which need not be exact.  So the Hessian is first factored near the minimum,
    and these factors can be used until the end.
    """

    def __init__(
        self,
        problem: Problem,
        place: Ints,
        guard: FoldGuard | None = None,
        rough: Callable[[Floats], Floats] | None = None,
    ) -> None:
        self.problem, self.guard, self._rough = problem, guard, rough
        self._pattern = BlockPattern(problem.edges, place)
        self._key = problem.edges[:, 0] * len(place) + problem.edges[:, 1]
        self._factors: spl.SuperLU | None = None
        self._far: int | None = None
        self._first_load = 0.0

    def energy(self, uv: Floats) -> float:
        """Return the energy; infinite if the barrier is broken."""
        value = spring_energy(uv, self.problem.edges, self.problem.rest)
        return value if self.guard is None else value + self.guard.energy(uv)

    def forces(self, uv: Floats) -> Floats:
        """Return minus the energy's gradient, (n, 2)."""
        force = spring_forces(uv, self.problem.edges, self.problem.rest)
        if self.guard is None:
            return force
        F, slope, _, gradient = self.guard.near(uv)
        push = (-slope[:, None, None] * gradient).reshape(-1, 2)
        for k in range(2):
            force[:, k] += np.bincount(F.ravel(), push[:, k], len(uv))
        return force

    def newton_step(self, uv: Floats, force: Floats, convex: bool) -> Floats | None:
        """Return the solution of ``H s = force``, (n, 2); None if H cannot be factored."""
        matrix, load = self._hessian(uv, convex), self._pattern.scatter(force)
        self._first_load = self._first_load or float(np.linalg.norm(load))
        if self._rough is not None:
            step = self._rough_step(matrix, load)
            if step is not None:
                return step
        if self._factors is not None and not convex:
            step = preconditioned_solve(matrix, load, self._factors.solve, self._accuracy(load))
            if step is not None:
                return self._pattern.gather(step)
        try:
            self._factors = factor(matrix, ordered=True)
        except RuntimeError:  # exactly singular: the caller uses the convex Hessian
            self._factors = None
            return None
        return self._pattern.gather(self._factors.solve(load))

    def _rough_step(self, matrix: sp.csc_array, load: Floats) -> Floats | None:
        """Return the first step solved roughly, (n, 2), or None if preconditioning fails.

        Vertex 0 stays, as with the pins of the Hessian.
        """
        rough, self._rough, pattern = self._rough, None, self._pattern
        assert rough is not None

        def precondition(x: Floats) -> Floats:
            return pattern.scatter(rough(pattern.gather(x)))

        step = preconditioned_solve(matrix, load, precondition, ROUGH, ROUGH_STEPS)
        return None if step is None else pattern.gather(step)

    def _accuracy(self, load: Floats) -> float:
        """Return the residual to solve a step to: rough at first, finer as the forces decrease.

        If the residual's share of the load decreases with the load, Newton's method still converges
        quadratically (Dembo, Eisenstat and Steihaug 1982).
        """
        share = float(np.linalg.norm(load)) / self._first_load
        return min(max(share, RESIDUAL[0]), RESIDUAL[1])

    def _hessian(self, uv: Floats, convex: bool) -> sp.csc_array:
        """Return the second derivatives, with the rigid motions held."""
        blocks = spring_blocks(uv, self.problem.edges, self.problem.rest, convex)
        vertex, edge = self._pattern.stiffness(blocks)
        if self.guard is not None:
            self._add_barrier(uv, vertex, edge)
        if convex:
            vertex[:, [0, 1], [0, 1]] += RIDGE
        if self._far is None:
            self._far = int(np.argmax(((uv - uv[0]) ** 2).sum(axis=1)))
        _pin(uv, vertex, self._far)
        return self._pattern.matrix(vertex, edge)

    def _add_barrier(self, uv: Floats, vertex: Floats, edge: Floats) -> None:
        """Add the barrier's (Gauss-Newton) second derivatives to the blocks."""
        assert self.guard is not None
        F, _, curvature, gradient = self.guard.near(uv)
        n = len(uv)
        for p in range(3):
            outer = gradient[:, p, :, None] * gradient[:, p, None, :]
            np.add.at(vertex, F[:, p], curvature[:, None, None] * outer)
            q = (p + 1) % 3
            outer = curvature[:, None, None] * gradient[:, p, :, None] * gradient[:, q, None, :]
            swapped = F[:, p] > F[:, q]
            outer[swapped] = outer[swapped].transpose(0, 2, 1)
            low, high = np.minimum(F[:, p], F[:, q]), np.maximum(F[:, p], F[:, q])
            np.add.at(edge, np.searchsorted(self._key, low * n + high), outer)


def _pin(uv: Floats, vertex: Floats, far: int) -> None:
    """Hold the three rigid motions by springs on vertices 0 and far; they carry no load."""
    across = np.array([-1.0, 1.0]) * (uv[far] - uv[0])[::-1]
    across /= max(float(np.linalg.norm(across)), np.finfo(float).tiny)
    vertex[0] += np.eye(2)
    vertex[far] += np.outer(across, across)


def _descend(
    system: _System, uv: Floats, options: SpringOptions, history: History, patience: int
) -> tuple[Floats, int, Stop]:
    """Return the minimiser, the number of steps and the reason to stop; each step is recorded.

    Folded triangles end it after ``patience`` steps, because a crumpled surface converges slowly.
    """
    tol, size = options.tol, system.problem.size
    # Energy of a strain of tol everywhere; below it a surface counts as exactly developable.
    floor = tol**2 * float((system.problem.rest**2).sum()) / 2
    energy = system.energy(uv)
    history.record(uv, energy)
    for count in range(1, options.max_iter + 1):
        after, lower, predicted = _one_step(system, uv, energy)
        moved = displacement(uv, after)
        small = tol * (lower + floor)
        quiet = energy - lower <= small and (lower < energy or predicted <= small)
        uv, energy = after, lower
        history.record(uv, energy)
        if quiet and moved <= tol * size:
            return uv, count, Stop.CONVERGED
        if moved == 0 or (count >= patience and flip_count(uv, system.problem.mesh.F)):
            return uv, count, Stop.MAX_ITER
    return uv, options.max_iter, Stop.MAX_ITER


def _one_step(system: _System, uv: Floats, energy: float) -> tuple[Floats, float, float]:
    """Return positions and energy after one step, and the decrease predicted by its model.

    The positions are unchanged if no decrease was found.
    """
    force = system.forces(uv)
    predicted = 0.0
    for convex in (False, True):
        step = system.newton_step(uv, force, convex)
        slope = 0.0 if step is None else float((force * step).sum())
        if step is None or not slope > 0:
            continue
        predicted = slope / 2
        length = 1.0 if system.guard is None else system.guard.longest_step(uv, step)
        for _ in range(HALVINGS):
            after = uv + length * step
            lower = system.energy(after)
            if lower <= energy - ARMIJO * length * slope:
                return after - after.mean(axis=0), lower, predicted
            length /= 2
    return uv, energy, predicted
