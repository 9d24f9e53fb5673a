"""The report's faults: cut-off lines, slip table, flat map, throws, what the viewer is given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import geounfold as gu
from geounfold.errors import InputError
from geounfold.report import CarriedFaults, carried_faults
from geounfold.report.body import report_body
from geounfold.report.columns import read_columns
from geounfold.report.faults import (
    SLIP_COLUMNS,
    _closed,
    cutoff_lines,
    faults_section,
    joined_surfaces,
)
from geounfold.report.payload import CATEGORIES
from geounfold.report.pictures import pictures
from geounfold.report.plots.style import ViewOptions
from geounfold.synthetic.faulted import simulate_faulted
from tests.report.test_page import needs_rendering
from tests.report.test_payload import decoded, lattice, packed

PLACES = np.array([0.0, 1, 2, 3, 8, 9])  # along strike; 3 and 8 are no neighbours
SQUARE = (
    np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)


def slips(fault: str = "f1", level: float = 0.5, gap: float = 0.2, **more: Any) -> pd.DataFrame:
    """Return a fault along y at x = 0, down by 5, in an order that is not that along strike."""
    y = PLACES[[3, 0, 5, 1, 4, 2]]
    out = pd.DataFrame({"fault": fault, "footwall_block": 0, "hanging_wall_block": 1,
                        "stratigraphic": level}, index=range(6))  # fmt: skip
    for wall, down, apart in (("foot", 0.0, 0.0), ("hanging", 5.0, gap)):
        for space, z in (("", -down), ("unfolded_", level)):
            out[f"{wall}_{space}x"] = apart
            out[f"{wall}_{space}y"] = y
            out[f"{wall}_{space}z"] = z
    return out.assign(**({"throw": 5.0 + y, "strike_slip": 0.0, "gap": gap} | more))


def carried(*tables: pd.DataFrame) -> CarriedFaults:
    return CarriedFaults({"f1": SQUARE}, pd.concat(tables, ignore_index=True))


ROW = {
    "fault": "f1<b>", "footwall_block": 0, "hanging_wall_block": 1, "throw": 5.0,
    "throw_p10": 4.0, "throw_p90": 6.0, "heave": None, "resolved_by": "shape", "slip_known": True,
}  # fmt: skip
BLOCKS = lattice(10, 10, 3)
COLUMNS = {"fault_block": np.where(BLOCKS[:, 0] < 5, 0, 1), "stratigraphic": BLOCKS[:, 2] / 2}


def section_of(faults: CarriedFaults | None, *rows: dict[str, Any]) -> str:
    summary = {"faults": list(rows), "input": {"unit": "m"}}
    return faults_section(summary, faults, BLOCKS, COLUMNS, CATEGORIES)


def test_cutoffs_are_lines_along_strike_that_end_at_a_gap() -> None:
    faults = carried(slips(level=0.5), slips(level=0.1))
    lines = cutoff_lines(faults, "folded")
    # Two walls at two heights: 0-1, 1-2, 2-3 and 8-9, never 3-8.
    assert lines.shape == (2 * 2 * 4, 2, 3)
    assert_allclose(lines[:4, 0, 1], [0, 1, 2, 8])
    assert_allclose(lines[:4, 1, 1], [1, 2, 3, 9])
    assert_allclose(np.abs(np.diff(lines[:, :, 1], axis=1)), 1.0)
    assert set(lines[:, :, 2].ravel().tolist()) == {0.0, -5.0}
    flat = cutoff_lines(faults, "unfolded")
    assert set(flat[:, :, 2].ravel().tolist()) == {0.5, 0.1}


def test_two_faults_and_two_pairs_of_blocks_are_not_joined() -> None:
    other = slips().assign(hanging_wall_block=2)
    assert len(cutoff_lines(carried(slips(), slips("f2"), other), "folded")) == 3 * 2 * 4


def test_a_table_that_lacks_a_column_is_refused() -> None:
    with pytest.raises(InputError, match="the slips lack the columns gap"):
        CarriedFaults({}, slips().drop(columns="gap"))
    assert set(SLIP_COLUMNS) <= set(slips().columns)


def test_the_section_has_table_map_and_throws() -> None:
    page = section_of(carried(slips()), ROW)
    assert "f1&lt;b&gt;" in page
    assert "<b>" not in page
    assert "5 (4 to 6)" in page
    assert "Median throw 7.5 m" in page  # 5 + y: y is 2 or 3 in the middle
    assert page.count("<h4>") == 1
    assert page.count('class="cutoff') == 2
    assert section_of(None) == ""
    assert "<svg" not in section_of(None, ROW)


@pytest.mark.parametrize(("gap", "kind", "other"), [(0.2, "gap", "overlap"),
                                                    (-0.2, "overlap", "gap")])  # fmt: skip
def test_the_map_tells_gaps_from_overlaps(gap: float, kind: str, other: str) -> None:
    page = section_of(carried(slips(gap=gap)), ROW)
    assert f'class="{kind}"' in page
    assert f'class="{other}"' not in page


def test_the_map_shows_every_fault_block_of_the_middle_layer_without_holes() -> None:
    page = section_of(carried(slips()), ROW)
    areas = [p.split('d="')[1].split('"')[0] for p in page.split("<path fill=")[1:]]
    assert len(areas) == 2
    for area in areas:  # a run for each row of cells, none in two pieces
        starts = [run.split("h")[0].split(" ")[1] for run in area.split("M")[1:]]
        assert len(starts) == len(set(starts)) >= 5


def test_throws_of_many_faults_are_cut_short_and_it_says_so() -> None:
    many = [slips(f"f{k}") for k in range(30)]
    page = section_of(carried(*many), ROW)
    assert page.count("<h4>") == 24
    assert "6 more pairs of blocks are not drawn" in page


def test_fault_blocks_are_kinds_in_the_order_of_their_numbers() -> None:
    kept, _ = read_columns({"fault_block": np.array([0, 2, 10, 1])}, 4, "Input", "Results")
    assert kept[0].categories == ("0", "1", "2", "10")
    assert kept[0].values.tolist() == [0, 2, 3, 1]


def test_the_viewer_starts_with_fault_blocks_and_has_surfaces_near_the_body() -> None:
    far = (SQUARE[0] + [500.0, 0, 0], SQUARE[1])
    faults = CarriedFaults({"f1": SQUARE, "f2": far}, slips())
    content = packed(BLOCKS, BLOCKS, COLUMNS, faults=faults).content
    assert content["start"] == "fault_block"
    assert len(decoded(content["faults"]["triangles"])) == 6  # two triangles of f1, none of f2
    assert_allclose(decoded(content["faults"]["vertices"]), SQUARE[0])
    assert len(decoded(content["faults"]["folded"])) == 2 * 2 * 4
    one = {"fault_block": np.zeros(len(BLOCKS), int), "stratigraphic": BLOCKS[:, 2] / 2}
    plain = packed(BLOCKS, BLOCKS, one).content
    assert plain["start"] == "stratigraphic"
    assert plain["faults"] == {}


def test_surfaces_of_several_faults_keep_their_triangles() -> None:
    other = (SQUARE[0] + [0, 0, 1.0], SQUARE[1])
    V, F = joined_surfaces(CarriedFaults({"a": SQUARE, "b": other}, slips()), BLOCKS, 2.0)
    assert (len(V), len(F)) == (8, 4)
    assert_allclose(V[F].mean(axis=1)[:, 2], [0, 0, 1, 1])


def test_neighbours_of_a_block_lie_in_its_own_fault_block() -> None:
    moved = BLOCKS + np.where(COLUMNS["fault_block"][:, None] == 1, [0, 1.5, 0], 0)
    body = report_body(moved, BLOCKS, COLUMNS)
    assert body.neighbours is not None
    own = COLUMNS["fault_block"]
    assert (own[body.neighbours] == own[:, None]).all()
    # Each half moved as a rigid body: its own distances stay, to rounding.
    assert body.results["nmd_error"].max() < 1e-12
    across = report_body(moved, BLOCKS, {"stratigraphic": COLUMNS["stratigraphic"]})
    assert across.results["nmd_error"].max() > 0.1
    few = {"fault_block": np.where(np.arange(len(BLOCKS)) < 3, 1, 0)}
    assert report_body(moved, BLOCKS, few).neighbours is not None


def test_faults_of_an_unfolding_are_carried_by_their_own_blocks() -> None:
    body = simulate_faulted("normal_1T", steps=(20.0, 20.0, 10.0))
    u = gu.unfold(body.folded, faults=body.surfaces)
    found = carried_faults(u)
    assert found is not None
    # The surface may have other vertices, on the same plane.
    off = body.spec.faults[0].coordinates(found.surfaces["f1"][0])[:, 2]
    assert_allclose(off, 0, atol=1e-6)
    foot, hanging = found.places("foot", "unfolded"), found.places("hanging", "unfolded")
    # Both walls meet in flat space: gaps are distances across the fault, no longer than the whole.
    # Places between the surface's vertices are carried with 0.03 blocks of 15.9 of difference.
    apart = np.linalg.norm((hanging - foot)[:, :2], axis=1)
    assert (apart >= np.abs(found.slips["gap"]) - 0.05 * body.step).mean() > 0.99
    assert np.median(apart) < body.step
    moved = found.places("hanging", "folded") - found.places("foot", "folded")
    assert np.median(np.linalg.norm(moved, axis=1)) > 2.5 * body.step  # 50 of blocks of 15.9
    assert carried_faults(gu.unfold(gu.simulate("sim_case_1").folded)) is None


def test_holes_of_one_cell_are_closed_and_the_outline_stays() -> None:
    x, y = np.nonzero(np.ones((6, 5), bool))
    cells = np.stack([x, y], axis=1)[(x != 3) | (y < 1)]  # a slit that reaches the outline
    found, block = _closed(cells, (cells[:, 0] > 3).astype(int))
    assert len(found) == 30
    assert (*found.min(axis=0), *found.max(axis=0)) == (0, 0, 5, 4)
    assert block[(found[:, 0] == 3) & (found[:, 1] > 0)].tolist() == [0] * 4
    wide = cells[cells[:, 0] != 2]  # two cells wide, above the lowest row
    assert len(_closed(wide, np.zeros(len(wide), int))[0]) == len(wide) + 1


@needs_rendering
def test_a_still_picture_shows_the_fault_blocks() -> None:
    body = report_body(BLOCKS, BLOCKS, COLUMNS)
    found = list(pictures(body, ViewOptions(size=(80, 60))))
    assert "Fault blocks: each was unfolded by itself" in found[0]
    one = report_body(BLOCKS, BLOCKS, {"fault_block": np.zeros(len(BLOCKS), int)})
    assert not any("Fault blocks" in p for p in pictures(one, ViewOptions(size=(80, 60))))
