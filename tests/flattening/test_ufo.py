"""UFO: the springs released from a projection."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.errors import FlatteningError
from geounfold.flattening import (
    SpringDynamicOptions,
    Stop,
    UfoOptions,
    flatten,
    measures,
)
from tests.flattening.meshes import cap, cylinder


def test_ufo_goes_on_where_the_thesis_ends():
    V, F, _, _ = cylinder(angle=1.6)
    thesis = flatten((V, F), "spring_dynamic", options=SpringDynamicOptions(stop_rule="thesis"))
    # The energy first rises in ufo's 19th step; the thesis's rule ends at the 18th, whose area
    # error rises.
    first = flatten((V, F), "ufo", options=UfoOptions(max_iter=thesis.iterations))
    assert_allclose(first.energy[-1], thesis.energy[-1], rtol=0.1)
    rested = flatten((V, F), "ufo")
    assert rested.stop is Stop.CONVERGED
    assert rested.edge_error[-1] < 1e-6 < 1e-2 < thesis.edge_error[-1]


def test_ufo_reaches_the_minimum_of_spring_where_its_start_is_not_folded():
    slow, fast = flatten(cap(n=9), "ufo"), flatten(cap(n=9))
    assert slow.stop is Stop.CONVERGED
    assert slow.energy[-1] == pytest.approx(fast.energy[-1], rel=1e-4)
    assert slow.energy[-1] >= fast.energy[-1] * (1 - 1e-12)
    assert (np.diff(slow.energy) <= 0).all()  # what is released does not come back


def test_ufo_stays_folded_where_its_projection_is_and_is_mended_or_says_so():
    # An arc of 250 degrees: both ends lie beneath the middle, and the projection overlaps.
    mesh = cylinder(n=31, m=5, angle=4.4)[:2]
    flat = flatten(mesh, "ufo", repair=False)
    assert flat.flips > 0
    assert "folded over: nothing prevents it" in flat.note
    assert measures.edge_strain(*mesh, flatten(mesh).uv) < 1e-12 < 1e-3 < flat.edge_error[-1]
    mended = flatten(mesh, "ufo")
    assert mended.one_to_one
    assert "SLIM from Tutte's embedding instead" in mended.note


@pytest.mark.parametrize(("step", "message"), [(2.0, "rises in the first step"), (1e200, "div")])
def test_too_large_a_time_step_of_ufo_is_an_error(step, message):
    with pytest.raises(FlatteningError, match=f"ufo: .*{message}.*smaller time step"):
        flatten(cap(n=9), "ufo", options=UfoOptions(time_step=step))
