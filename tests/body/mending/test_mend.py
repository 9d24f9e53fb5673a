"""Bodies mended on their lattice: waste filled, bridges cut, handles closed, the rest untouched."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

import geounfold as gu
from geounfold.body.mending import MendingRecord, mend
from geounfold.body.mending import voxels as voxels_module
from geounfold.body.mending.euler import euler_number
from geounfold.body.mending.mend import Mended
from geounfold.body.mending.record import MendedPlace, places_of
from geounfold.body.prepare import prepare
from geounfold.errors import NoSheetError
from geounfold.synthetic import CASES

SOUND = [name for name in CASES if name not in ("large", "thin_wide", "incomplete")]
"""Bodies without waste or gaps; `incomplete` lacks blocks, and its gaps are rightly filled."""


def box(shape, at=(0, 0, 0)):
    """Return the cells of a box, (n, 3)."""
    return np.argwhere(np.ones(shape, dtype=bool)) + at


def without(cells, other):
    """Return cells (n, 3) that are not among others."""
    gone = {tuple(c) for c in other.tolist()}
    return np.array([c for c in cells.tolist() if tuple(c) not in gone])


def mended_body(cells, mended):
    """Return the voxels of the mended body, empty cells around them."""
    kept = np.concatenate([cells[mended.fate == 0], mended.filled])
    full = np.zeros(kept.max(axis=0) - kept.min(axis=0) + 3, dtype=bool)
    full[tuple((kept - kept.min(axis=0) + 1).T)] = True
    return full


LAYER = box((30, 24, 8))


def test_cavity_is_filled_exactly():
    lens = box((6, 5, 2), at=(10, 9, 3))
    found = mend(without(LAYER, lens))
    assert {tuple(c) for c in found.filled} == {tuple(c) for c in lens}
    assert not found.fate.any()
    assert (found.handles_closed, found.handles_left) == (0, 0)


def test_lens_with_a_mouth_is_filled():
    # A lens of waste that reaches the layer's side: three of its four rims are closed.
    lens = box((6, 4, 2), at=(24, 9, 3))
    waste = without(LAYER, lens)
    found = mend(waste)
    filled = {tuple(c) for c in found.filled}
    assert filled <= {tuple(c) for c in lens}
    assert len(filled) > 0.8 * len(lens)


def test_gap_between_limbs_stays():
    # Two limbs two cells apart, joined at one end only: a fold, not waste.
    gap = box((26, 24, 2), at=(4, 0, 3))
    found = mend(without(LAYER, gap))
    assert not found.changed


def test_small_hole_is_closed():
    hole = box((3, 3, 8), at=(12, 10, 0))
    cells = without(LAYER, hole)
    found = mend(cells)
    assert (found.handles_closed, found.handles_left) == (1, 0)
    assert {tuple(c) for c in found.filled} <= {tuple(c) for c in hole}
    assert euler_number(mended_body(cells, found)) == 1  # a ball


def test_large_hole_stays():
    cells = without(LAYER, box((12, 12, 8), at=(9, 6, 0)))
    found = mend(cells)
    assert not found.changed
    assert (found.handles_closed, found.handles_left) == (0, 1)


def test_bridge_is_cut():
    # A layer folded back on itself, its limbs eight cells apart, and one column of blocks across.
    fold = without(box((30, 24, 24)), box((22, 24, 8), at=(8, 0, 8)))
    bridge = box((1, 1, 8), at=(20, 12, 8))
    cells = np.concatenate([fold, bridge])
    found = mend(cells)
    assert (found.handles_closed, found.handles_left) == (1, 0)
    assert found.count("cut") > 0
    assert {tuple(c) for c in cells[found.fate > 0]} <= {tuple(c) for c in bridge}
    assert euler_number(mended_body(cells, found)) == 1


def test_neck_is_no_bridge():
    # Without it the body would be in two pieces: Euler's number rises too, but no handle goes.
    cells = np.concatenate(
        [box((12, 12, 8)), box((2, 1, 1), at=(12, 6, 4)), box((12, 12, 8), at=(14, 0, 0))]
    )
    assert not mend(cells).fate.any()


def test_many_small_defects_become_a_ball():
    rng = np.random.default_rng(7)
    layer = np.ones((60, 50, 8), dtype=bool)
    for i, j in rng.integers(4, 44, (30, 2)):
        layer[i : i + 2, j : j + 2, :] = False  # holes through it
    for i, j in rng.integers(4, 40, (20, 2)):
        layer[i : i + 4, j : j + 4, 3:5] = False  # lenses in it
    cells = np.argwhere(layer)
    found = mend(cells)
    assert found.handles_closed > 5
    assert found.handles_left == 0
    assert euler_number(mended_body(cells, found)) == 1


def crude(width, seed=3, shape=(70, 60, 24)):
    """Return a body full of handles: where a random field, even over a width, is positive."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), width)
    return np.argwhere(field > 0)


def test_crude_body_is_smoothed_as_a_whole():
    found = mend(crude(1.0))
    assert found.handles_closed > 100
    assert found.count("smoothed") > 0


def test_sheet_of_one_block_is_not_judged():
    # Its holes are as large as its blocks: on such a lattice nothing can be told.
    i, j = np.meshgrid(np.arange(40), np.arange(40), indexing="ij")
    sheet = np.stack([i, j, np.rint(4 * np.sin(i / 6))], axis=-1).reshape(-1, 3).astype(np.int64)
    assert not mend(without(sheet, sheet[820:821])).changed


def test_box_too_large_is_left(monkeypatch):
    monkeypatch.setattr(voxels_module, "LARGEST", 1000)
    assert not mend(without(LAYER, box((2, 2, 2), at=(10, 9, 3)))).changed


def test_repeated_cells_and_order_do_no_harm():
    cells = without(LAYER, box((3, 3, 8), at=(12, 10, 0)))
    twice = np.random.default_rng(0).permutation(np.concatenate([cells, cells[:50]]))
    assert np.array_equal(mend(twice).filled, mend(cells).filled)


@pytest.mark.parametrize("name", SOUND)
def test_sound_bodies_are_untouched(name):
    prepared, bodies = prepare(gu.simulate(name).folded)
    assert not prepared.mended.changed
    assert prepared.mended.sentence() == ""
    assert not prepared.mended.column.astype(bool).any()
    assert all(body.mended is None or not body.mended.changed for body in bodies)


def test_gaps_of_an_incomplete_body_are_filled_and_told():
    prepared, _ = prepare(gu.simulate("incomplete").folded)
    assert 40 < prepared.mended.filled < 80
    assert prepared.mended.cut == prepared.mended.dropped == prepared.mended.smoothed == 0
    assert "cells inside the body were filled for the hull, most around (" in (
        prepared.mended.sentence()
    )


def record(**counts):
    """Return the record of a body of 100 blocks."""
    return MendingRecord(np.zeros(100, np.int64), blocks=100, **counts)


def test_body_with_many_handles_left_is_refused():
    record(handles_closed=30, handles_left=5).check()
    record(handles_closed=2, handles_left=9).check()  # a split seam is not crude
    record(cut=2, smoothed=3).check()
    points = crude(2.0) * 5.0
    prepared, bodies = prepare(points, body=0)
    with pytest.raises(NoSheetError, match=r"crude shell: \d+ handles left .* smoother boundary"):
        bodies[0].mended.check()
    with pytest.raises(NoSheetError, match="crude shell"):
        gu.unfold(points, body=0)
    assert prepared.mended.changed


def test_places_are_in_the_datas_coordinates():
    lens = box((6, 5, 2), at=(10, 9, 3))
    moved = np.array([5e5, 6e6, -200.0])
    steps = np.array([10.0, 10.0, 5.0])
    prepared, bodies = prepare(without(LAYER, lens) * steps + moved)
    place = prepared.mended.places[0]
    assert (place.what, place.cells) == ("filled", 60)
    assert np.abs((np.array(place.at) - moved) / steps - lens.mean(axis=0)).max() <= 1
    assert len(bodies[0].fitted) == len(bodies[0].blocks) + 60
    summary = prepared.mended.summary()
    assert (summary["filled"], summary["places"][0]["cells"]) == (60, 60)


def test_column_has_a_word_for_every_block_left_out():
    fold = without(box((30, 24, 24)), box((22, 24, 8), at=(8, 0, 8)))
    points = np.concatenate([fold, box((1, 1, 8), at=(20, 12, 8))]) * 2.0
    prepared, bodies = prepare(points)
    column = prepared.mended.column
    assert set(column) == {"", "cut"}
    assert (column[: len(fold)] == "").all()
    assert (column == "cut").sum() == prepared.mended.cut
    assert len(bodies[0].blocks) == len(points)


def test_records_of_bodies_are_joined():
    first = MendingRecord(np.array([0, 1, 0]), cut=1, handles_closed=1)
    second = MendingRecord(np.array([0, 0, 2]), dropped=1, filled=4)
    both = first.joined(second)
    assert both.column.tolist() == ["", "cut", "dropped"]
    assert (both.filled, both.cut, both.dropped, both.handles_closed) == (4, 1, 1, 1)


def test_mended_of_nothing():
    nothing = Mended(np.zeros((0, 3), np.int64), np.zeros(5, np.int64), 0, 0)
    assert not nothing.changed


def test_body_of_which_much_is_left_out_is_refused():
    place = MendedPlace("smoothed", 4, (10.0, 20.0, 30.0))
    found = record(filled=3, cut=3, smoothed=4, places=(place,))
    with pytest.raises(NoSheetError, match=r"7 of 100 blocks left out, most around \(10, 20, 30\)"):
        found.check()


def test_share_left_out_is_of_the_bodys_own_blocks():
    layer = box((12, 10, 3))
    mended = Mended(np.zeros((0, 3), np.int64), np.r_[np.full(40, 3), np.zeros(320, int)], 0, 0)
    rows = np.r_[np.arange(360), np.full(5000, -1)]  # another body of 5,000 blocks beside it
    place = places_of("smoothed", layer[:40], layer[:40] * 1.0)
    found = MendingRecord.of(mended, rows, place)
    assert found.blocks == 360
    with pytest.raises(NoSheetError, match="40 of 360 blocks left out"):
        found.check()
