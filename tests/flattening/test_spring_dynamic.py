"""The springs in motion, and the thesis's rule to stop them."""

from __future__ import annotations

import pytest

from geounfold.errors import FlatteningError
from geounfold.flattening import (
    SpringDynamicOptions,
    Stop,
    flatten,
)
from tests.flattening.meshes import cap, cylinder, slab


def test_dynamic_reaches_the_minimum_of_spring():
    V, F = cap(n=9)
    slow = flatten((V, F), "spring_dynamic")
    fast = flatten((V, F), "spring")
    assert slow.stop is Stop.CONVERGED
    assert slow.energy[-1] == pytest.approx(fast.energy[-1], rel=1e-4)  # measured 1e-6
    assert slow.energy[-1] >= fast.energy[-1] * (1 - 1e-12)


def test_thesis_rule_ends_early_with_the_surface_hardly_flattened():
    V, F, _, _ = cylinder(angle=1.6)
    flat = flatten((V, F), "spring_dynamic", options=SpringDynamicOptions(stop_rule="thesis"))
    assert flat.stop is Stop.THESIS_RULE
    assert 8 <= flat.iterations <= 20  # what the thesis shows
    # From the projection's strain; the springs' minimum is zero here.
    assert 0.3 * flat.edge_error[0] < flat.edge_error[-1] < flat.edge_error[0]


def test_thesis_rule_never_ends_on_a_flat_surface():
    V, F = slab()
    options = SpringDynamicOptions(stop_rule="thesis", max_iter=300)
    flat = flatten((V, F), "spring_dynamic", start=V[:, :2], options=options)
    assert flat.stop is Stop.MAX_ITER
    assert flat.iterations == 300


def test_undamped_motion_that_diverges_is_an_error():
    options = SpringDynamicOptions(damping=0.0, time_step=1e3)
    with pytest.raises(FlatteningError, match="diverged"):
        flatten(cap(n=9), "spring_dynamic", options=options)
