"""Bodies that cannot have a top and a bottom are refused; separate bodies are separated."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from geounfold.body.check import MIN_POINTS, check_points, count_duplicates
from geounfold.body.lattice import measure_lattice
from geounfold.body.separate import describe_bodies, select_body, separate_bodies
from geounfold.body.working_frame import Frame, working_frame
from geounfold.errors import InputError, OptionError
from tests.places import acceptance
from tests.shapes import grid_cells

PLAIN = Frame(np.zeros(3), np.eye(3), 1.0, None)
UTM = np.array([5e5, 1e7, 300.0])


def shifted(points, by):
    return points + np.array(by)


def sheet(thickness, amplitude, steps=(1, 1, 1)):
    """Blocks of a folded sheet of a true thickness in blocks, wave length 50."""
    cells = grid_cells(80, 30, 2 * (amplitude + 2 * thickness) + 1) * 1.0
    cells[:, 2] -= amplitude + 2 * thickness
    phase = 2 * np.pi * cells[:, 0] / 50
    slope = amplitude * 2 * np.pi / 50 * np.cos(phase)
    off = (cells[:, 2] - amplitude * np.sin(phase) - 0.13) / np.hypot(1, slope)
    return cells[(off < thickness / 2) & (off > -thickness / 2)] * np.array(steps)


def grid(layers, noise=0.0, steps=(1.0, 1.0, 1.0)):
    """A grid folded after gridding: scattered points."""
    u, v, w = np.meshgrid(
        np.arange(60), np.arange(30), np.arange(layers) - (layers - 1) / 2, indexing="ij"
    )
    u, v, w = u * steps[0], v * steps[1], w * steps[2]
    theta = 0.9 * np.cos(2 * np.pi * u / (50 * steps[0]))
    x = np.cumsum(np.cos(theta) * steps[0], 0) - np.sin(theta) * w
    z = np.cumsum(np.sin(theta) * steps[0], 0) + np.cos(theta) * w
    points = np.stack([x, v, z], -1).reshape(-1, 3)
    return points + np.random.default_rng(0).normal(size=points.shape) * noise * np.array(steps)


def sizes(points, lattice=True):
    found = measure_lattice(points) if lattice else None
    frame = working_frame(points, found)
    return np.bincount(separate_bodies(frame.to_work(points), frame)).tolist()


TURN = Rotation.from_euler("zyx", [37, 12, 5], degrees=True).as_matrix()


@pytest.mark.parametrize("count", [0, 1, MIN_POINTS - 1])
def test_too_few_points(count):
    with pytest.raises(InputError, match=f"only {count} distinct points.*at least {MIN_POINTS}"):
        check_points(grid_cells(10, 10, 2)[:count])


def test_duplicates_count_once():
    points = np.repeat(grid_cells(4, 4, 2), 3, axis=0)
    assert count_duplicates(points) == 64
    with pytest.raises(InputError, match=r"only 32 distinct points \(96 rows with duplicates\)"):
        check_points(points)
    check_points(np.repeat(grid_cells(6, 6, 2), 3, axis=0))


def test_one_column_names_it():
    with pytest.raises(InputError, match=r"in one column \(x = 500001 and y = 10000002\)"):
        check_points(grid_cells(1, 1, 60) + np.array([1, 2, 0]) + UTM)


@pytest.mark.parametrize("decimals", [2, 12])
def test_a_line(decimals):
    with pytest.raises(InputError, match="on one line"):
        check_points(np.round((grid_cells(60, 1, 1) * 10) @ TURN.T + UTM, decimals))


@pytest.mark.parametrize("turn", [np.eye(3), TURN])
@pytest.mark.parametrize("points", [grid_cells(20, 20, 1) * [20, 20, 5.0], grid(1) * [1, 1, 0]])
def test_a_plane(points, turn):
    with pytest.raises(InputError, match="in one plane"):
        check_points(np.round(points @ turn.T + UTM, 3))


@pytest.mark.parametrize("amplitude", [1, 3, 8, 16])  # steepest dips 7, 21, 45 and 64 degrees
@pytest.mark.parametrize("turn", [np.eye(3), TURN])
def test_a_folded_sheet_of_blocks_passes_however_thin(amplitude, turn):
    for thickness in (1, 2, 3):  # blocks; a block on a lattice has a top and a bottom
        check_points(sheet(thickness, amplitude) @ turn.T + UTM)


def test_one_layer_of_blocks_without_their_lattice_is_refused():
    # The same sheet with centroids off by a fifth of a block: the block's size is unknown.
    blocks = sheet(1, 3)
    moved = blocks + np.random.default_rng(3).normal(0, 0.2, blocks.shape) * [1, 1, 0]
    assert measure_lattice(moved) is None
    with pytest.raises(InputError, match="whose thickness the points do not show"):
        check_points(moved @ TURN.T + UTM)


@pytest.mark.parametrize("steps", [(1.0, 1.0, 1.0), (20.0, 20.0, 5.0), (25.0, 25.0, 2.5)])
@pytest.mark.parametrize("noise", [0.0, 0.12])
def test_a_folded_grid_of_one_layer_is_refused_and_of_two_passes(steps, noise):
    with pytest.raises(InputError, match="one block thick"):
        check_points(grid(1, noise, steps))
    for layers in (2, 3, 12):  # passes for 20 of 20 seeds; two layers of the thinnest for 19
        check_points(grid(layers, noise, steps))


def test_narrow_strips_flat_slabs_and_sub_blocks_pass():
    check_points(grid_cells(30, 3, 2))
    check_points(grid_cells(20, 20, 2) * [25, 25, 2.5])
    parents = grid_cells(12, 12, 4) * 10
    corners = np.array(np.meshgrid(*[[-2.5, 2.5]] * 3)).reshape(3, -1).T
    split = np.random.default_rng(4).random(len(parents)) < 0.3
    mixed = np.concatenate([parents[~split], (parents[split][:, None] + corners).reshape(-1, 3)])
    check_points(mixed)
    assert sizes(mixed) == [len(mixed)]


@pytest.mark.parametrize(
    "name", ["thin", "lens", "flat_blocks", "noisy", "sim_case_1", "unfolding_jl"]
)
def test_acceptance_bodies_pass_and_are_one_body(name):
    table = pd.read_csv(acceptance(name))
    columns = ["XC", "YC", "ZC"] if "XC" in table else [f"centroid_{a}" for a in "xyz"]
    points = table[columns].to_numpy(float)
    check_points(points)
    assert sizes(points) == [len(points)]


@pytest.mark.parametrize("turn", [np.eye(3), TURN])
def test_blocks_connect_over_one_missing_block_only(turn):
    slab = grid_cells(20, 10, 3)
    for shift, parts in (
        ((21, 0, 0), 1),  # one missing block
        ((22, 0, 0), 2),  # two
        ((21, 11, 4), 1),  # corner to corner, one missing
        ((21, 12, 4), 2),
    ):
        pair = np.concatenate([slab, slab[: len(slab) // 2] + shift]) * [20, 20, 5]
        assert len(sizes(pair @ turn.T + UTM)) == parts


def test_labels_are_ordered_by_size_whatever_the_row_order():
    a, b, c = (
        grid_cells(20, 10, 3),
        shifted(grid_cells(10, 10, 3), [40, 0, 0]),
        shifted(grid_cells(10, 10, 3), [60, 0, 0]),
    )
    points = np.concatenate([c, b, a, [[100.0, 0, 0]]])
    expected = np.repeat([2, 1, 0, 3], [300, 300, 600, 1])
    frame = Frame(np.zeros(3), np.eye(3), 1.0, np.ones(3))
    assert_array_equal(separate_bodies(points, frame), expected)
    order = np.random.default_rng(0).permutation(len(points))
    assert_array_equal(separate_bodies(points[order], frame), expected[order])
    assert_array_equal(separate_bodies(points[order], PLAIN), expected[order])


@pytest.mark.parametrize("noise", [0.0, 0.2])
@pytest.mark.parametrize("layers", [2, 4, 8])
def test_scattered_bodies_connect_over_one_missing_point_not_over_three(layers, noise):
    body = grid(layers, noise)
    one = np.concatenate([body, shifted(body, [0, 31, 0])])
    # With this noise three missing points still connect for 15 of 20 seeds (two layers), 3 (four)
    # and 2 (eight); four missing points connect for none of 20.
    more = np.concatenate([body, shifted(body, [0, 33 if noise == 0 else 34, 0])])
    assert sizes(one, lattice=False) == [len(one)]
    assert sizes(more, lattice=False) == [len(body), len(body)]


@pytest.mark.parametrize("layers", [2, 3, 6])
def test_density_may_vary_fivefold(layers):
    x = np.cumsum(np.linspace(1, 5, 40))
    points = np.stack(np.meshgrid(x, np.arange(30.0), np.arange(layers), indexing="ij"), -1)
    points = points.reshape(-1, 3)
    points = points + np.random.default_rng(0).normal(size=points.shape) * 0.2
    assert sizes(points, lattice=False) == [len(points)]


@pytest.mark.parametrize("steps", [(20.0, 20.0, 5.0), (25.0, 25.0, 2.5)])
def test_flat_cells_folded_after_gridding_hold_together(steps):
    assert sizes(grid(12, 0.1, steps), lattice=False) == [60 * 30 * 12]


def two_bodies():
    points = (
        np.concatenate(
            [grid_cells(10, 10, 3), shifted(grid_cells(20, 10, 3), [30, 0, 0]), [[70.0, 0, 0]]]
        )
        * 10
    )
    labels = separate_bodies(points / 10, Frame(np.zeros(3), np.eye(3), 1.0, np.ones(3)))
    return points + UTM, labels


def test_bodies_are_described_in_world_coordinates():
    points, labels = two_bodies()
    largest, second, speck = describe_bodies(points, labels)
    assert (largest.size, second.size, speck.size) == (600, 300, 1)
    assert largest.centre == pytest.approx(shifted(UTM, [395, 45, 10]))
    assert (largest.speck, second.speck, speck.speck) == (False, False, True)


def test_several_bodies_need_a_choice_that_names_them():
    points, labels = two_bodies()
    with pytest.raises(InputError, match=r"3 separate bodies.*--body N") as caught:
        select_body(points, labels)
    text = str(caught.value)
    assert "0 (600 blocks around 500395, 10000045, 310)" in text
    assert "1 (300 blocks around 500045, 10000045, 310)" in text
    assert "2 (1 blocks around 500700, 10000000, 300, a speck)" in text
    assert "\n" not in text


def test_choices():
    points, labels = two_bodies()
    for choice, expected in ((0, [600]), ("1", [300]), (2, [1]), ("all", [600, 300])):
        rows = select_body(points, labels, choice)
        assert [len(r) for r in rows] == expected
    assert_array_equal(select_body(points, labels, 1)[0], np.arange(300))


@pytest.mark.parametrize("choice", [3, -1, "both", "1.5", ""])
def test_unknown_choices_list_the_valid_ones(choice):
    points, labels = two_bodies()
    with pytest.raises(OptionError, match="must be all or 0 to 2, but is"):
        select_body(points, labels, choice)


def test_a_speck_beside_one_body_needs_no_choice():
    points, labels = two_bodies()
    kept = labels != 1
    rows = select_body(points[kept], np.where(labels[kept] == 2, 1, 0))
    assert [len(r) for r in rows] == [600]


def test_many_bodies_are_named_in_one_short_line():
    labels = np.repeat(np.arange(30), 20)
    with pytest.raises(InputError, match=r"and 20 smaller ones \(400 blocks in all\)"):
        select_body(np.random.default_rng(0).random((600, 3)), labels)
