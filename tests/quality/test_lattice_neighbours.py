"""Neighbours counted on the lattice are those that a tree finds."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.backends import threads
from geounfold.errors import InputError
from geounfold.quality import lattice_neighbours
from geounfold.quality.lattice_neighbours import lattice_nmd, offsets_by_length
from geounfold.quality.neighbour_distances import epsilon, lattice_epsilon, neighbours, nmd


def ragged(shape=(14, 12, 9), share=0.7):
    """Cells of a box with holes, in random order."""
    rng = np.random.default_rng(4)
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return rng.permutation(cells[rng.random(len(cells)) < share]) - 5


@pytest.mark.parametrize("sides", [(1.0, 1.0, 1.0), (1.6, 1.6, 0.4), (1.1, 0.7, 1.3)])
@pytest.mark.parametrize("k", [1, 6, 26, 40])
def test_mean_distance_is_that_of_the_nearest(sides, k):
    # The k smallest distances are the same whichever of equally near blocks a tree takes.
    cells, sides = ragged(), np.array(sides)
    points = 1e5 + cells * sides
    (got,) = lattice_nmd(cells, sides, (points,), k)
    np.testing.assert_allclose(got, nmd(points, neighbours(points, k)), rtol=1e-9)


def test_in_another_space_it_is_the_mean_over_all_ways_to_break_ties():
    # A row of three blocks: the middle one has two neighbours at distance 1 and room for one.
    cells = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    moved = np.array([[0.0, 0, 0], [1, 0, 0], [4, 0, 0]])
    (_, got) = lattice_nmd(cells, np.ones(3), (cells.astype(float), moved), 1)
    assert got.tolist() == [1.0, 2.0, 3.0]  # the middle: (1 + 3) / 2


@pytest.mark.parametrize("shape", [(30, 20, 1), (400, 1, 1), (12, 12, 12)])
def test_sheets_and_rows_of_one_block(shape):
    # In a row the 26 nearest reach 13 blocks away, farther than the offsets do across it.
    cells = ragged(shape, share=1.0)
    points = cells * 2.0
    folded = points + np.sin(points[:, [1, 2, 0]] / 7)
    got = lattice_epsilon(points, folded, cells, np.ones(3), 26)
    # A tree returns any of equally near blocks; measured: 0.06 off in the cube, half of whose
    # blocks lie at its surface.
    assert got.mean() == pytest.approx(epsilon(points, folded).mean(), rel=0.1)
    assert np.isfinite(got).all()


def test_neither_rows_nor_slices_nor_threads_change_a_bit(monkeypatch):
    rng = np.random.default_rng(4)
    cells, sides = ragged(), np.array([1.0, 1.0, 0.5])
    A = cells * sides
    B = A + np.sin(A[:, ::-1])
    whole = lattice_epsilon(A, B, cells, sides, 26)
    order = rng.permutation(len(A))
    monkeypatch.setattr(lattice_neighbours, "_SLICE", 100)
    for count in (1, 3):
        monkeypatch.setattr(threads, "cores", lambda count=count: count)
        turned = lattice_epsilon(A[order], B[order], cells[order], sides, 26)
        np.testing.assert_array_equal(turned, whole[order])


def test_blocks_in_one_cell_or_far_apart_go_to_the_tree():
    cells = ragged((6, 6, 6), share=1.0)
    A = cells.astype(float)
    twice = np.concatenate([cells, cells[:1]])
    B = np.concatenate([A, A[:1] + 0.1])
    assert lattice_nmd(twice, np.ones(3), (B,), 26) is None
    np.testing.assert_array_equal(
        lattice_epsilon(B, 2 * B, twice, np.ones(3), 26), epsilon(B, 2 * B)
    )
    sparse = np.concatenate([cells, cells + 10**9])  # a table of 1e9 x 1e9 cells
    assert lattice_nmd(sparse, np.ones(3), (sparse.astype(float),), 26) is None


def test_too_few_blocks_are_an_error():
    cells = ragged((2, 2, 2), share=1.0)
    with pytest.raises(InputError, match="26 neighbours need more than 26 points"):
        lattice_epsilon(cells * 1.0, cells * 1.0, cells, np.ones(3), 26)


def test_offsets_are_sorted_and_whole_shells():
    shells = offsets_by_length(np.array([2.0, 2.0, 1.0]))
    lengths = [np.linalg.norm(shell * [2.0, 2.0, 1.0], axis=1) for shell in shells]
    assert all(np.ptp(length) < 1e-6 for length in lengths)
    assert (np.diff([length[0] for length in lengths]) > 0).all()
    # A ball of radius r holds 4/3 pi r^3 / 4 cells of volume 4, less the middle one.
    count, radius = sum(map(len, shells)), lengths[-1][0]
    assert count + 1 == pytest.approx(4 / 3 * np.pi * radius**3 / 4, rel=0.1)


def test_an_unfolding_is_measured_by_its_lattice():
    body = gu.simulate("plunging", width=200.0)
    u = gu.unfold(body.folded)
    tree = epsilon(u.folded, u.points)
    # They differ if a tree breaks ties; measured: 0.3 % in the mean.
    assert u.quality.nmd.mean == pytest.approx(tree.mean(), rel=0.02)
    deep = np.abs(u.columns["nmd_error"] - tree) < 1e-9  # all 26 around are there: no ties
    assert deep.mean() > 0.3
    figures = u.quality.summary()["nmd"]
    assert (figures["sample"], figures["standard_error"]) == (len(u.points), 0.0)
