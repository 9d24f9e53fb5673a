"""The springs: their forces, their least energy, the guard against folding over."""

from __future__ import annotations

import re
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.flattening import (
    SpringOptions,
    Stop,
    flatten,
    tutte,
)
from geounfold.flattening._springs import spring_blocks, spring_energy, spring_forces
from geounfold.geometry.measures import lengths, unique_edges
from tests.flattening.meshes import annulus, cap, cylinder, edge_errors, nearly_closed


def test_cylinder_develops_by_its_chords():
    V, F, chords, _ = cylinder()
    edges = unique_edges(F)
    # The mesh itself agrees with its development to rounding, so only the solver can err.
    assert_allclose(lengths(V, edges), lengths(chords, edges), rtol=1e-13)
    assert_allclose(lengths(flatten((V, F)).uv, edges), lengths(chords, edges), rtol=1e-12)


def test_chords_approach_arcs_at_second_order():
    steps, errors = [], []
    for n in (9, 17, 33):
        V, F, _, arcs = cylinder(n=n, m=5)
        uv = flatten((V, F)).uv
        ends = [0, (n - 1) * 5]  # along the arc
        error = np.linalg.norm(uv[ends[1]] - uv[ends[0]]) - np.linalg.norm(
            arcs[ends[1]] - arcs[ends[0]]
        )
        steps.append(1 / (n - 1))
        errors.append(-error)
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2, abs=0.02)  # measured 1.9995; first order would be 1


def test_spring_reaches_the_least_energy_of_the_cap():
    from scipy.optimize import least_squares

    V, F = cap(n=9)
    flat = flatten((V, F))
    edges = unique_edges(F)
    rest = lengths(V, edges)

    def stretch(x):
        return lengths(x.reshape(-1, 2), edges) - rest

    best = least_squares(stretch, V[:, :2].ravel(), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert flat.energy[-1] == pytest.approx(best.cost, rel=1e-9)


def test_force_is_minus_the_gradient():
    V, F = cap(n=5)
    edges, rng = unique_edges(F), np.random.default_rng(3)
    rest = lengths(V, edges)
    uv = V[:, :2] + 0.03 * rng.normal(size=(len(V), 2))
    force, step = spring_forces(uv, edges, rest), 1e-6
    for k in rng.choice(uv.size, 12, replace=False):
        d = np.zeros(uv.size)
        d[k] = step
        d = d.reshape(-1, 2)
        slope = (spring_energy(uv + d, edges, rest) - spring_energy(uv - d, edges, rest)) / (
            2 * step
        )
        assert -force.ravel()[k] == pytest.approx(slope, abs=1e-8)  # forces are about 0.1


def test_hessian_is_the_derivative_of_the_force():
    rest, step = np.array([1.3]), 1e-6
    edges, uv = np.array([[0, 1]]), np.array([[0.0, 0.0], [0.6, 0.7]])
    block = spring_blocks(uv, edges, rest, convex=False)[0]
    for k in range(2):
        d = np.zeros((2, 2))
        d[1, k] = step
        column = (spring_forces(uv - d, edges, rest) - spring_forces(uv + d, edges, rest))[1] / (
            2 * step
        )
        assert_allclose(block[:, k], column, atol=1e-8)
    assert np.linalg.eigvalsh(block)[0] < 0  # this spring is shortened
    convex = spring_blocks(uv, edges, rest, convex=True)[0]
    assert np.linalg.eigvalsh(convex)[0] > -1e-15


def test_spring_energy_never_rises_and_it_reports_convergence():
    flat = flatten(cap())
    assert flat.stop is Stop.CONVERGED
    assert (np.diff(flat.energy) <= 0).all()
    assert flat.area_error[-1] < flat.area_error[0]
    assert flat.edge_error[-1] < flat.edge_error[0]


def test_spring_converges_in_few_steps_from_a_good_start():
    V, F, chords, _ = cylinder(30, 30)
    flat = flatten((V, F), start=chords + 1e-3 * np.sin(np.arange(chords.size)).reshape(-1, 2))
    assert flat.stop is Stop.CONVERGED
    assert flat.iterations <= 4  # measured 3
    assert np.abs(edge_errors((V, F), flat.uv)).max() < 1e-12


def test_a_rough_first_step_changes_nothing_but_the_time(monkeypatch):
    # A single step of conjugate gradients is never enough, so the Hessian is factored at once.
    rough = flatten(cap())
    monkeypatch.setattr(sys.modules[SpringOptions.__module__], "ROUGH_STEPS", 1)
    exact = flatten(cap())
    assert not np.array_equal(rough.energy[2], exact.energy[2])  # the first step differs
    assert rough.stop is exact.stop is Stop.CONVERGED
    assert rough.energy[-1] == pytest.approx(exact.energy[-1], rel=1e-12)
    assert_allclose(rough.uv, exact.uv, atol=1e-9)  # the cap is 1.3 wide


def test_springs_come_to_the_same_rest_from_the_plan_and_from_tuttes_embedding():
    for mesh in (cap(), cylinder()[:2], annulus()):
        own, given = flatten(mesh), flatten(mesh, start=tutte(mesh))
        assert own.edge_error[0] < given.edge_error[0]  # the plan is nearer
        assert own.energy[-1] == pytest.approx(given.energy[-1], rel=1e-10, abs=1e-24)
        edges = unique_edges(mesh[1])
        assert_allclose(lengths(own.uv, edges), lengths(given.uv, edges), rtol=1e-8)


def test_springs_start_from_tuttes_embedding_where_the_plan_overlaps():
    mesh = cylinder(n=31, m=5, angle=4.4)[:2]
    own, given = flatten(mesh), flatten(mesh, start=tutte(mesh))
    assert own.edge_error[0] == pytest.approx(given.edge_error[0], rel=1e-9)
    assert own.flips == 0


def test_crumpling_springs_are_held_by_the_barrier():
    flat = flatten(nearly_closed())
    assert flat.flips == 0
    assert re.search(r"the springs alone fold [1-9]\d* triangles over: .* barrier", flat.note)


def test_a_guarded_start_far_from_its_lengths_is_brought_near_first(monkeypatch):
    mesh = nearly_closed()
    near = flatten(mesh)
    # The package's name `spring` is the function.
    monkeypatch.setattr(sys.modules[SpringOptions.__module__], "NEARER", 0)
    far = flatten(mesh)
    assert near.flips == far.flips == 0
    assert near.energy[0] < far.energy[0]  # measured 4.48 and 5.57
    assert near.energy[-1] < far.energy[-1]  # measured 3.398 and 3.422, neither at rest
