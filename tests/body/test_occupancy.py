"""Occupied cells of a lattice give what the rows give: frame, merged blocks, surface."""

from __future__ import annotations

import numpy as np
import pytest

import geounfold as gu
from geounfold.body import occupancy as module
from geounfold.body import streamed as streamed_module
from geounfold.body.lattice import lattice_indices, measure_lattice
from geounfold.body.merged_blocks import area_and_thickness, merge_blocks, merge_sizes
from geounfold.body.occupancy import HollowBody, OccupancyBuilder
from geounfold.body.prepare import prepare
from geounfold.body.streamed import prepare_streamed
from geounfold.body.working_frame import frame_of_sums, working_frame
from geounfold.errors import StreamError
from geounfold.methods.sheet.sharpening.lattice_sites import surface_sites


@pytest.fixture(scope="module")
def blocks():
    """Blocks of a body on a turned lattice, in no order."""
    folded = gu.simulate("plunging", width=150.0, steps=(14.0, 18.0, 8.0)).folded
    return np.random.default_rng(3).permutation(folded)


@pytest.fixture(autouse=True)
def _hollow(monkeypatch):
    """Bodies of few blocks are hollow too."""
    monkeypatch.setattr(streamed_module, "HELD", 0)


def built(cells, size=1000):
    """The occupancy of cells that come in batches."""
    builder = OccupancyBuilder()
    for start in range(0, len(cells), size):
        builder.add(cells[start : start + size])
    return builder.made()


def streamed(points, size=1000, **more):
    """The body of points that come in batches."""

    def batches():
        return (points[i : i + size] for i in range(0, len(points), size))

    return prepare_streamed(batches, points[:3000], **{"parts": True} | more)


def test_a_box_that_grows_holds_the_cells_whatever_their_order():
    cells = np.random.default_rng(0).integers(-40, 25, (5000, 3))
    for order in (cells, cells[np.lexsort(cells.T)]):
        found = built(order, 70)
        assert found.count == len(np.unique(cells, axis=0))
        assert (found.low == cells.min(axis=0)).all()
        assert (found.shape == np.ptp(cells, axis=0) + 1).all()
        assert found.holds(cells).all()
        assert not found.holds(cells + 200).any()


def test_a_box_of_too_many_cells_is_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_CELLS", 1000)
    with pytest.raises(StreamError, match="more than 1,000 cells"):
        built(np.array([[0, 0, 0], [9, 9, 10]]))


def test_the_frame_is_that_of_the_rows(blocks):
    lattice = measure_lattice(blocks)
    found = built(lattice_indices(blocks, lattice))
    expected = working_frame(blocks, lattice)
    scale = float(np.cbrt(lattice.steps.prod()))
    frame = frame_of_sums(found.sums(lattice.steps / scale), lattice)
    np.testing.assert_array_equal(frame.rotation, expected.rotation)
    np.testing.assert_array_equal(frame.origin, expected.origin)
    np.testing.assert_array_equal(frame.steps, expected.steps)
    turned = found.turned(lattice, frame)
    cells = frame.nearest_cells(frame.to_work(blocks))
    assert turned.holds(cells).all()
    assert turned.count == len(blocks)


@pytest.mark.parametrize("merge", [2, 3, 5])
def test_merged_blocks_and_sites_are_those_of_all_rows(blocks, merge):
    body = streamed(blocks)
    frame, skin = body.prepared.frame, body.body.hollow.skin
    work = frame.snap(frame.to_work(blocks))
    expected = merge_blocks(work[np.lexsort(work.T[::-1])], frame.steps, merge)
    found = body.body.hollow.merged(merge)
    np.testing.assert_allclose(found.points, expected.points, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.share, expected.share)
    cells = frame.nearest_cells(work)
    all_sites = surface_sites(cells, frame.steps)
    sites = surface_sites(skin.cells, frame.steps, skin.surface)
    np.testing.assert_array_equal(sites.points, all_sites.points)
    np.testing.assert_array_equal(sites.occupied, all_sites.occupied)


def test_area_thickness_and_sizes_are_those_of_all_rows(blocks):
    body = streamed(blocks)
    frame, hollow = body.prepared.frame, body.body.hollow
    work = frame.snap(frame.to_work(blocks))
    np.testing.assert_allclose(
        hollow.cells.area_and_thickness(frame.steps), area_and_thickness(work, frame.steps)
    )
    assert hollow.merge_sizes(0) == merge_sizes(work, frame.steps, 0)
    assert hollow.merge_sizes(len(blocks)) == ()


def test_specks_and_mended_cells_are_as_in_memory(blocks):
    """A speck 20 blocks away is left out; a cavity of four blocks inside is filled."""
    lattice = measure_lattice(blocks)
    cells = lattice_indices(blocks, lattice)
    solid = built(cells)
    deep = cells[np.all([solid.holds(cells + np.array(d)) for d in np.ndindex(4, 4, 3)], axis=0)]
    hole = deep[0] + [[1, 1, 1], [2, 1, 1], [1, 2, 1], [2, 2, 1]]
    kept = blocks[~(cells[:, None] == hole).all(axis=2).any(axis=1)]
    speck = blocks.max(axis=0) + 20 * lattice.steps.max() * np.ones((1, 3))
    at = lattice_indices(speck, lattice)
    speck = lattice.origin + (at * lattice.steps) @ lattice.axes
    points = np.concatenate([kept, speck])
    body = streamed(points)
    assert body.prepared.mended.filled == 4
    assert body.body.hollow.cells.count == len(prepare(points, parts=True)[1][0].fitted)
    np.testing.assert_allclose(body.apart, speck)
    assert body.own.count == len(kept)
    assert body.rows == len(points)


def test_bodies_that_need_their_rows_are_refused(blocks):
    with pytest.raises(StreamError, match="2 separate bodies"):
        streamed(np.concatenate([blocks, blocks + np.array([0, 0, 4000.0])]))
    noisy = blocks + np.random.default_rng(1).normal(0, 1.0, blocks.shape)
    with pytest.raises(StreamError, match="one lattice"):
        streamed(noisy)
    with pytest.raises(StreamError, match="27 blocks are too few"):
        streamed(np.stack(np.meshgrid(*[np.arange(3.0)] * 3), -1).reshape(-1, 3))
    k = np.stack(np.meshgrid(*[np.arange(24)] * 3, indexing="ij"), -1).reshape(-1, 3) * 1.0
    parents = k[(k % 2 == 0).all(axis=1)]  # every other cell: blocks of twice the side
    with pytest.raises(StreamError, match="several sides"):
        streamed(np.concatenate([k[:4000], parents]))


def test_many_blocks_are_fitted_as_cells_of_two_a_side(blocks, monkeypatch):
    """Cells of eight blocks, at least half filled, in a frame whose unit is theirs."""
    monkeypatch.setattr(streamed_module, "MOST_FITTED", len(blocks) / 7)
    body = streamed(blocks)
    fine, coarse = body.frame, body.prepared.frame
    assert coarse.scale == 2 * fine.scale
    low = body.given.low // 2
    where = np.argwhere(body.given.filled) + body.given.low
    cells, count = np.unique(where // 2, axis=0, return_counts=True)
    own = body.body.hollow.cells
    assert own.holds(cells[count >= 4]).all()
    assert own.count == (count >= 4).sum()
    # A cell's middle is that of its eight blocks; coordinates are some 1e6 m.
    eight = fine.middles(2 * low + np.array(list(np.ndindex(2, 2, 2))))
    np.testing.assert_allclose(coarse.middles(low[None])[0], eight.mean(axis=0), atol=1e-8)
    # All blocks at the surface are held by the mesh, in units of the coarse frame.
    np.testing.assert_allclose(coarse.to_world(body.body.blocks), body.prepared.points, atol=1e-8)
    assert len(body.body.blocks) == body.own.skin().surface.sum()


def test_duplicates_are_counted(blocks):
    assert streamed(np.concatenate([blocks, blocks[:7]])).duplicates == 7


def test_a_hollow_body_is_of_all_blocks():
    cells = built(np.stack(np.meshgrid(*[np.arange(8)] * 3), -1).reshape(-1, 3))
    skin = cells.skin()
    assert len(skin.cells) == 8**3 - 4**3  # without the inner 4 x 4 x 4
    assert skin.surface.sum() == 8**3 - 6**3
    merged = HollowBody(cells, skin, np.ones(3)).merged(4)
    assert merged.share.tolist() == [1.0] * 8
