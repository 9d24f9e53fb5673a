"""The lattice behind centroids: known ones are found, clouds without one give None."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from geounfold.body.lattice import (
    distinct,
    lattice_indices,
    measure_lattice,
    point_spacing,
    proper_permutations,
)
from geounfold.errors import InputError
from tests.places import acceptance

UTM = np.array([5e5, 1e7, 300.0])


def blocks(shape=(20, 14, 6), bend=3.0):
    """Whole cells of a gently folded body."""
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    cells[:, 2] += np.rint(bend * np.sin(cells[:, 0] / 5 + cells[:, 1] / 20)).astype(int)
    return cells


def rotation(seed):
    return Rotation.random(random_state=seed).as_matrix()


def test_steps_and_axes_of_an_axis_aligned_model_are_exact():
    lattice = measure_lattice(UTM + blocks() * [20, 20, 5.0])
    assert_array_equal(lattice.steps, [20, 20, 5])
    assert_array_equal(lattice.axes, np.eye(3))
    assert lattice.share == 1.0


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    steps=st.sampled_from([(10, 10, 10), (20, 20, 5), (25, 25, 2.5), (5, 12, 3)]),
    unit=st.sampled_from([1.0, 0.3048, 1e3]),
)
def test_a_turned_model_keeps_its_steps(seed, steps, unit):
    R, cells = rotation(seed), blocks(bend=2.0)
    lattice = measure_lattice((cells * np.array(steps) * unit) @ R.T + UTM)
    # Offsets of 1e7 round to 1e-9; over 100 m and 1,700 points steps come out to 1e-11.
    assert_allclose(np.sort(lattice.steps), np.sort(steps) * unit, rtol=1e-9)
    assert_allclose(np.linalg.det(lattice.axes), 1)
    turn = lattice.axes @ R  # the model's axes, renamed: entries are 0 or 1 but for rounding
    assert_allclose(turn * turn, np.rint(turn * turn), atol=1e-9)
    assert_allclose((turn * turn) @ (np.array(steps) * unit), lattice.steps, rtol=1e-9)


@pytest.mark.parametrize(("decimals", "rtol"), [(2, 1e-5), (1, 1e-4)])
def test_rounded_coordinates_keep_their_lattice(decimals, rtol):
    # Rounding to 0.1 m is 0.04 steps of 2.5 m at most along one axis, 0.012 rms.
    cells = blocks((30, 20, 8), bend=2.0)
    points = np.round((cells * [25, 25, 2.5]) @ rotation(1).T + UTM, decimals)
    lattice = measure_lattice(points)
    assert_allclose(np.sort(lattice.steps), [2.5, 25, 25], rtol=rtol)


def test_row_order_and_duplicates_change_nothing():
    points = (blocks() * [20.0, 20, 5]) @ rotation(2).T
    mixed = np.random.default_rng(0).permutation(np.concatenate([points, points[:500]]))
    a, b = measure_lattice(points), measure_lattice(mixed)
    assert_array_equal(a.steps, b.steps)
    assert_allclose(a.axes, b.axes, atol=1e-12)


def test_missing_blocks_do_not_hide_the_lattice():
    kept = np.random.default_rng(3).random(20 * 14 * 6) < 0.4
    lattice = measure_lattice((blocks()[kept] * [10.0, 10, 5]) @ rotation(3).T)
    assert_allclose(np.sort(lattice.steps), [5, 10, 10], rtol=1e-9)


def test_sub_blocks_refine_the_lattice_once_they_are_many():
    parents = blocks() * 10.0
    corners = np.array(np.meshgrid(*[[-2.5, 2.5]] * 3)).reshape(3, -1).T
    split = np.random.default_rng(4).random(len(parents)) < 0.3
    fine = (parents[split][:, None] + corners).reshape(-1, 3)
    lattice = measure_lattice(np.concatenate([parents[~split], fine]))
    assert_array_equal(lattice.steps, [2.5] * 3)
    few = measure_lattice(np.concatenate([parents, fine[:8]]))
    assert_array_equal(few.steps, [10.0] * 3)
    assert few.share == pytest.approx(1 - 8 / (len(parents) + 8))


def test_points_off_the_lattice_are_borne_up_to_three_per_cent():
    points = blocks() * 10.0
    box = np.ptp(points, axis=0)
    stray = np.random.default_rng(5).random((100, 3)) * box
    assert measure_lattice(np.concatenate([points, stray[:40]])) is not None
    assert measure_lattice(np.concatenate([points, stray])) is None  # 5.6 %


@pytest.mark.parametrize("noise", [0.05, 0.12, 0.3])
def test_noise_leaves_no_lattice(noise):
    points = blocks() + np.random.default_rng(6).normal(size=(1680, 3)) * noise
    assert measure_lattice(points * 10) is None


def test_scattered_folded_and_few_points_have_none():
    rng = np.random.default_rng(7)
    assert measure_lattice(rng.random((5000, 3)) * 100) is None
    grid = blocks(bend=0) * 10.0
    grid[:, 2] += 20 * np.sin(grid[:, 0] / 40)  # sheared: whole along x and y, not along z
    assert measure_lattice(grid) is None
    assert measure_lattice(grid[:5]) is None
    assert measure_lattice(np.ones((100, 3))) is None
    assert measure_lattice(grid[grid[:, 0] == 0] * [1, 0, 0]) is None


CASES = {
    "corbieres_sedim5": [15, 15, 15],
    "flat_blocks": [20, 20, 5],
    "noisy": None,
    "plunging": [10, 10, 10],
    "sim_case_1": None,
    "sim_case_2": None,
    "thin": [10, 10, 10],
    "unfolding_jl": [2, 2, 2],
}


@pytest.mark.parametrize("name", CASES)
def test_lattices_of_the_acceptance_bodies(name):
    table = pd.read_csv(acceptance(name))
    columns = ["XC", "YC", "ZC"] if "XC" in table else [f"centroid_{a}" for a in "xyz"]
    lattice = measure_lattice(table[columns].to_numpy(float))
    if CASES[name] is None:
        assert lattice is None
    else:
        assert_array_equal(lattice.steps, CASES[name])
        assert lattice.share == 1.0


def test_indices_are_the_cells_up_to_a_shift():
    cells = blocks()
    points = UTM + cells * [20, 20, 5.0]
    lattice = measure_lattice(points)
    found = lattice_indices(points, lattice)
    assert found.dtype == np.int64
    assert np.unique(found - cells, axis=0).shape == (1, 3)
    assert_array_equal(lattice_indices(points, lattice, points[0]), cells - cells[0])


def test_spacing_is_that_of_a_grid_and_follows_the_unit():
    points = np.stack(np.meshgrid(*[np.arange(12.0)] * 3), -1).reshape(-1, 3)
    assert point_spacing(points) == 1.0
    assert point_spacing(np.concatenate([points, points])) == 1.0
    moved = (points * 0.3048) @ rotation(8).T + UTM
    assert point_spacing(moved) == pytest.approx(0.3048, rel=1e-8)  # 1e-9 m of 0.3 m


def test_spacing_of_many_points_is_measured_on_a_part():
    points = np.stack(np.meshgrid(*[np.arange(60.0)] * 3), -1).reshape(-1, 3)
    assert len(points) > 200_000
    assert point_spacing(points) == 1.0


def test_one_place_has_no_spacing():
    with pytest.raises(InputError, match="all are at one place"):
        point_spacing(np.ones((4, 3)))


def test_distinct_points_and_the_turns_of_the_axes():
    assert distinct(np.array([[1.0, 0, 0], [0, 0, 0], [1, 0, 0]])).tolist() == [
        [0, 0, 0],
        [1, 0, 0],
    ]
    turns = proper_permutations()
    assert len(np.unique(turns, axis=0)) == 24
    assert_array_equal(turns[0], np.eye(3))
