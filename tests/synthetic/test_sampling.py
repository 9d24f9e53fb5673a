"""Blocks of a simulated body: their lattice, their parents, their density."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic import (
    CASES,
    Body,
    simulate,
)
from tests.synthetic.recipes import NOISELESS

PLAIN = [n for n in NOISELESS if CASES[n].grid != "scattered" and CASES[n].sub_blocks == 1]


@pytest.mark.parametrize("name", PLAIN)
def test_blocks_are_on_their_lattice(name: str, bodies: dict[str, Body]) -> None:
    body = bodies[name]
    spec = body.sheet.spec
    if spec.grid == "before":
        index = body.truth / body.steps
    else:
        index = (body.folded - spec.offset) @ body.sheet.lattice_axes.T / body.steps
    assert_allclose(index - np.floor(index), 0.5, atol=1e-8)
    whole = np.floor(index).astype(int)
    assert len(np.unique(whole, axis=0)) == len(whole)
    assert_array_equal(np.lexsort(whole.T[::-1]), np.arange(len(whole)))


@pytest.mark.parametrize("name", [n for n in NOISELESS if CASES[n].grid == "after"])
def test_every_block_of_the_lattice_is_there(name: str, bodies: dict[str, Body]) -> None:
    # The blocks' volume is the body's, but for the surface: each block face there is right by
    # chance.  Measured -2.0 % (chevron) to +1.2 % (cylinder); a lost layer of ten is 10 %.
    body = bodies[name]
    spec = body.sheet.spec
    a, b = ((g.ravel() + 0.5) / 300 for g in np.meshgrid(np.arange(300), np.arange(300)))
    low, high = body.sheet.heights(a * spec.length, b * spec.width)
    middle = np.stack([a * spec.length, b * spec.width, (low + high) / 2], axis=1)
    thick = np.where(body.sheet.inside(middle), high - low, 0).mean()
    volume = thick * spec.length * spec.width * (1 - spec.missing)
    assert body.sizes.prod(axis=1).sum() == pytest.approx(volume, rel=0.03)


def test_chunks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("sim_case_2", "lens", "rotated_lattice"):
        whole = simulate(name)
        with monkeypatch.context() as patch:
            patch.setattr("geounfold.synthetic.sampling._CHUNK", 20_000)
            parts = simulate(name)
        assert_array_equal(whole.folded, parts.folded)
        assert_allclose(whole.truth, parts.truth, atol=1e-9)


@pytest.mark.parametrize("most", [2, 4, 8])
def test_sub_blocks_fill_their_parents(most: int) -> None:
    body = simulate("sub_blocked", sub_blocks=most, width=160)
    finest = 40 / most
    assert sorted(set((body.sizes[:, 0] / finest).tolist())) == [
        k for k in (1, 2, 4, 8) if k <= most
    ]
    assert_array_equal(body.sizes, body.sizes[:, :1] * np.ones(3))
    # Each block stands where a halving of its parent puts it, and no smallest cell is in two.
    low = (body.folded - body.sizes / 2) / finest
    assert_allclose(low, np.rint(low), atol=1e-9)
    side = np.rint(body.sizes[:, 0] / finest).astype(int)
    assert not (np.rint(low).astype(int) % side[:, None]).any()
    cells = np.concatenate([
        (np.rint(low[side == k]).astype(int)[:, None] + np.indices((k, k, k)).reshape(3, -1).T)
        for k in np.unique(side)
    ], axis=None).reshape(-1, 3)  # fmt: skip
    # The smallest cells are exactly those of a model of the smallest blocks alone.
    plain = simulate("sub_blocked", sub_blocks=1, steps=(finest,) * 3, width=160)
    wanted = np.floor(plain.folded / finest).astype(int)
    assert_array_equal(cells[np.lexsort(cells.T)], wanted[np.lexsort(wanted.T)])
    # Not split further than needed: no eight brothers could be one block.
    for k in np.unique(side)[:-1]:
        parents = np.rint(low[side == k]).astype(int) // (2 * k)
        assert np.unique(parents, axis=0, return_counts=True)[1].max() < 8


def test_scattered_points_are_as_dense_as_said() -> None:
    body = simulate("scattered")
    spec = body.sheet.spec
    # One point for each block's volume: that of an even sheet is the product of its extents.
    assert len(body.truth) == 820 * 400 * 90 / 1000
    a, b = body.truth[:, 0] / spec.length, body.truth[:, 1] / spec.width
    dense = (np.abs(a - 0.25) < 0.05) & (b < 0.1)
    sparse = (np.abs(a - 0.75) < 0.05) & (b < 0.1)
    # About 600 and 120 points: a standard error of 10 %.  Over these boxes the mean density is
    # 0.98 of its largest and 1.03 of its smallest value.
    assert dense.sum() / sparse.sum() == pytest.approx(5 * 0.98 / 1.03, rel=0.3)
    # Through the thickness they are even: standard error of a mean of 29,520, 0.0017 of it.
    assert body.stratigraphic.mean() == pytest.approx(0.5, abs=0.007)
    even = simulate("scattered", density=1.0)
    assert np.mean(even.truth[:, 0] < 410) == pytest.approx(0.5, abs=0.012)


def test_lattice_turned_with_the_fold_gives_the_same_blocks() -> None:
    plain = simulate("chevron")
    turned = simulate(
        "chevron", azimuth=40, plunge=15, tilt=9, lattice_bearing=40, lattice_plunge=15,
        lattice_dip=9,
    )  # fmt: skip
    assert_allclose(turned.truth, plain.truth, atol=1e-9)


def test_rotation_is_that_of_block_models() -> None:
    x, y, _ = rotation_from_angles(0, 30, 0)
    assert_allclose(y, [0, np.cos(np.pi / 6), -0.5], atol=1e-15)
    assert_allclose(x, [1, 0, 0], atol=1e-15)
    x, y, _ = rotation_from_angles(90, 0, 20)
    assert_allclose(y, [1, 0, 0], atol=1e-15)
    assert_allclose(x, [0, -np.cos(np.pi / 9), -np.sin(np.pi / 9)], atol=1e-15)


def test_noise_and_missing_blocks() -> None:
    clean, noisy = simulate("noisy", noise=0.0), simulate("noisy")
    assert_array_equal(clean.truth, noisy.truth)
    spread = (noisy.folded - clean.folded) / clean.steps
    # Standard error of a deviation of 0.12 over 88,000 values: 0.0003.
    assert spread.std() == pytest.approx(0.12, abs=0.0015)
    full, holed = simulate("slab"), simulate("slab", missing=0.2, seed=4)
    assert len(holed.folded) == pytest.approx(0.8 * len(full.folded), rel=0.02)
