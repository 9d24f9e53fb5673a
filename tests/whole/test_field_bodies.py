"""The eleven shared field bodies: each as its EXPECT.txt states.

Where the true level is known (column ``strat``, 0 at the bottom and 1 at the top), ``error`` is the
mean distance of the level found from it; parts are turned over one by one.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from tests.places import shared

pytestmark = pytest.mark.slow


def blocks(name: str) -> pd.DataFrame:
    return pd.read_csv(shared("field", "bodies", name, "blocks.csv.gz"))


def unfolded(table: pd.DataFrame) -> gu.Unfolding:
    return gu.unfold(table[["x", "y", "z"]].to_numpy())


def error(found: gu.Unfolding, table: pd.DataFrame) -> float:
    """Return the mean error of the level, each part the way round that fits."""
    level, truth = found.stratigraphic, table.strat.to_numpy()
    part = np.zeros(len(table), int) if found.body_part is None else found.body_part
    off = np.full(len(table), np.nan)
    for one in np.unique(part):
        of = (part == one) & np.isfinite(level)
        if not of.any():
            continue
        ways = [np.abs(x - truth)[of] for x in (level, 1 - level)]
        off[of] = min(ways, key=np.nanmean)
    return float(np.nanmean(off))


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("fault_nodrag_08", 0.05),
        ("thick_hinge", 0.06),
        ("uneven_x5", 0.05),
        ("waste_lenses", 0.05),
        ("y_vein", 0.05),
        ("thrust_repeat", 0.05),
        ("false_tube_fold", 0.05),
    ],
)
def test_the_level_is_right(name: str, most: float) -> None:
    # The limits are those of EXPECT.txt, 0.05 where it states none.
    table = blocks(name)
    found = unfolded(table)
    assert found.certificate.injective
    assert np.isfinite(found.stratigraphic).mean() >= 0.99
    assert error(found, table) <= most


def test_a_recumbent_fold_with_a_thick_hinge_is_certified() -> None:
    # EXPECT.txt: certified; every second block alone gives an error of 0.083.  It is told as poor.
    table = blocks("recumbent_thick")
    found = unfolded(table)
    assert found.certificate.injective
    assert error(found, table) < 0.083
    assert found.trust.word == "poor"
    assert "lengths change" in found.trust.sentence()


def test_a_split_seam_is_divided_into_its_plies() -> None:
    # Column strat is the fraction of both plies together: the level of each ply is linear in it.
    table = blocks("split_seam")
    found = unfolded(table)
    assert found.certificate.injective
    assert found.body_part is not None
    for part in np.unique(found.body_part):
        of = found.body_part == part
        assert abs(np.corrcoef(found.stratigraphic[of], table.strat[of])[0, 1]) > 0.9


def test_a_few_blocks_out_of_reach_are_left_empty_with_a_warning() -> None:
    found = unfolded(blocks("one_block_outside"))
    assert any("left empty" in warning for warning in found.summary()["warnings"])
    empty = ~np.isfinite(found.points).all(axis=1)
    assert found.certificate.injective
    assert 0 < empty.sum() <= 20  # at most 0.1 % or 20 blocks


def test_a_crude_indicator_is_refused_with_the_place_and_the_way_out() -> None:
    with pytest.raises(gu.InputError, match=r"crude shell.*most around \(.*leave out the blocks"):
        unfolded(blocks("crude_indicator"))
