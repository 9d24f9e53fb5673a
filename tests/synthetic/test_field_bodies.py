"""The field suite's bodies: lattice, connection, levels, parts, seeds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.ndimage as ndi
from numpy.testing import assert_allclose, assert_array_equal

from geounfold.errors import OptionError
from geounfold.synthetic.field_bodies import FIELD_BODIES, FieldBlocks

IN_BITS = {"shell_bits", "lens_shell_rough", "indicator_07", "stray_1", "stray_12", "bits"}
PARTS = {"branch": {2, 3}, "split": {2}, "repeat": {2}, "fault": {2, 3}}
NAMES = list(FIELD_BODIES)


@pytest.fixture(scope="module")
def drawn() -> dict[str, FieldBlocks]:
    return {name: body.blocks(1) for name, body in FIELD_BODIES.items()}


def grid_of(cells: np.ndarray) -> np.ndarray:
    low = cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) - low + 1, bool)
    grid[tuple((cells - low).T)] = True
    return grid


def components(cells: np.ndarray) -> int:
    return int(ndi.label(grid_of(cells))[1])


def test_suite_has_the_families_of_the_field() -> None:
    families = {body.family for body in FIELD_BODIES.values()}
    assert families == {
        "branch", "split", "repeat", "fault", "uneven", "unconformity", "strip", "rim", "fold",
        "recumbent", "hairpin", "small", "shell", "indicator", "waste", "pipe", "stray",
    }  # fmt: skip
    assert len(FIELD_BODIES) >= 60
    assert all(name == body.name for name, body in FIELD_BODIES.items())
    assert {body.expects for body in FIELD_BODIES.values()} == {"right", "told"}


@pytest.mark.parametrize("name", NAMES)
def test_blocks_lie_on_a_lattice_and_touch(drawn: dict[str, FieldBlocks], name: str) -> None:
    body = drawn[name]
    n = len(body.points)
    assert 4_000 <= n <= 150_000
    assert body.points.shape == body.cells.shape == (n, 3)
    assert len(np.unique(body.cells, axis=0)) == n
    # Lengths between blocks are those between their cells, whatever the lattice's orientation.
    some = np.random.default_rng(0).integers(n, size=(2, 50))
    apart = np.diff(body.cells[some], axis=0)[0] * body.steps
    assert_allclose(
        np.linalg.norm(np.diff(body.points[some], axis=0)[0], axis=1),
        np.linalg.norm(apart, axis=1),
        atol=1e-6,
    )
    assert (components(body.cells) == 1) == (name not in IN_BITS)


@pytest.mark.parametrize("name", NAMES)
def test_levels_and_parts_are_true(drawn: dict[str, FieldBlocks], name: str) -> None:
    body, family = drawn[name], FIELD_BODIES[name].family
    n = len(body.points)
    assert body.level.shape == body.part.shape == (n,)
    known = np.isfinite(body.level)
    if name.startswith("shell"):
        assert not known.any()
        return
    for level in (body.level, *body.others):
        assert level.shape == (n,)
        assert level[known].min() >= 0
        assert level[known].max() <= 1
    assert known.mean() > 0.7
    assert (body.part[known] >= 0).all()
    count = int(body.part.max()) + 1
    expected = 1 if name not in ("neck_2", "neck_3") else int(name[-1])
    assert count in PARTS.get(family, {expected})
    for part in range(count):
        cells = body.cells[body.part == part]
        assert len(cells) > 0.08 * n
        # The sheet that another one crosses is in two halves.
        least = 0.4 if name == "x_crossing" else 0.9
        labels = ndi.label(grid_of(cells))[0]
        assert np.bincount(labels.ravel())[1:].max() > least * len(cells)


@pytest.mark.parametrize("name", ["y_30", "thrust_thick", "fault_08", "split_12_12"])
def test_level_rises_in_a_part_and_parts_touch(drawn: dict[str, FieldBlocks], name: str) -> None:
    body = drawn[name]
    cells = {tuple(c): i for i, c in enumerate(body.cells.tolist())}
    touching = 0
    for axis in range(3):
        beside = body.cells + np.eye(3, dtype=int)[axis]
        to = np.array([cells.get(tuple(c), -1) for c in beside.tolist()])
        near = to >= 0
        same = near & (body.part == body.part[to]) & (body.part == 0)
        if axis == 2:
            assert (body.level[to[same]] > body.level[same]).all()
        touching += int((near & (body.part != body.part[to])).sum())
    assert touching > 20  # faces; a single row of blocks along the strike has 30


def test_the_parting_is_taken_out_of_the_whole_seam() -> None:
    body = FIELD_BODIES["split_12_12"].blocks(2)
    whole, mixed = body.others
    assert whole[body.part == 0].max() <= 0.5 <= whole[body.part == 1].min()
    joined = mixed != body.level
    assert 0.2 < joined.mean() < 0.7
    assert_allclose(mixed[joined], whole[joined], atol=0.5 / 24)


@pytest.mark.parametrize("family", sorted({body.family for body in FIELD_BODIES.values()}))
def test_equal_seeds_give_equal_bodies_and_others_differ(family: str) -> None:
    body = next(body for body in FIELD_BODIES.values() if body.family == family)
    one, two, other = (body.blocks(seed) for seed in (3, 3, 4))
    assert_array_equal(one.points, two.points)
    assert_array_equal(one.level, two.level)
    assert_array_equal(one.part, two.part)
    assert not np.array_equal(one.points, other.points) or not np.array_equal(
        one.level, other.level, equal_nan=True
    )


def test_waste_pits_and_strays_are_what_they_say() -> None:
    holes = {}
    for name in ("waste_1", "waste_5", "waste_30", "dome"):
        grid = grid_of(FIELD_BODIES[name].blocks(1).cells)
        holes[name] = int((ndi.binary_fill_holes(grid) & ~grid).sum())
    assert holes["dome"] == 0
    assert 0 < holes["waste_1"] < holes["waste_5"] < holes["waste_30"]
    stray = FIELD_BODIES["stray_12"].blocks(1)
    assert (stray.part == -1).sum() == 12
    assert components(stray.cells) == 13
    assert (FIELD_BODIES["bridges"].blocks(1).part == -1).sum() > 0


def test_seeds_that_are_none_are_refused() -> None:
    with pytest.raises(OptionError, match="seed must be a whole number from 0 up"):
        FIELD_BODIES["dome"].blocks(-1)
