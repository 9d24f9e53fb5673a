"""The barrier that keeps triangles from folding over."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.flattening._flip_barrier import REACH, FoldGuard
from geounfold.flattening._problem import make_problem
from geounfold.flattening._start import check_disk
from geounfold.flattening.spring import _System
from geounfold.geometry.measures import triangle_areas
from geounfold.geometry.mesh import TriMesh
from tests.flattening.meshes import cap, slab


def test_guard_force_is_minus_the_gradient():
    V, F = cap(n=5)
    problem = make_problem(TriMesh(V, F), check_disk(TriMesh(V, F)), None)
    system = _System(problem, np.arange(len(V)), FoldGuard(F, problem.areas))
    rng = np.random.default_rng(5)
    uv = 0.6 * V[:, :2] + 0.01 * rng.normal(size=(len(V), 2))
    ratio = triangle_areas(uv, F) / problem.areas
    assert 0 < ratio.min() < REACH
    force, step = system.forces(uv), 1e-6
    for k in rng.choice(uv.size, 12, replace=False):
        d = np.zeros(uv.size)
        d[k] = step
        d = d.reshape(-1, 2)
        slope = (system.energy(uv + d) - system.energy(uv - d)) / (2 * step)
        assert -force.ravel()[k] == pytest.approx(slope, abs=1e-7)  # forces are about 1


def test_guard_is_infinite_where_folded_and_stops_steps_short_of_it():
    V, F = slab(3, 3)
    guard = FoldGuard(F, triangle_areas(V, F))
    uv = V[:, :2].copy()
    assert guard.energy(uv) == 0
    inside = uv.copy()
    inside[4] += [1.5, 0]  # the middle vertex passes the border
    assert guard.energy(inside) == np.inf
    longest = guard.longest_step(uv, inside - uv)
    assert 0 < longest < 1
    assert (triangle_areas(uv + longest * (inside - uv), F) > 0).all()
