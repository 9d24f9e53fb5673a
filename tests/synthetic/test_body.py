"""Simulated bodies: the truth is exact, and maps are inverse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from geounfold.geometry.measures import lengths, triangle_areas, unique_edges
from geounfold.synthetic import (
    CASES,
    Body,
    Profile,
    Sinusoid,
    simulate,
)
from tests.synthetic.recipes import NOISELESS, SMALL


@pytest.mark.parametrize("name", NOISELESS)
def test_truth_and_folded_agree(name: str, bodies: dict[str, Body]) -> None:
    body = bodies[name]
    assert len(body.folded) == len(body.truth) > 10_000
    assert_allclose(body.sheet.fold(body.truth), body.folded, rtol=1e-13, atol=1e-9)
    back, found = body.sheet.unfold(body.folded)
    assert found.all()
    # World coordinates of 7.4e6 carry 1e-9 each (measured 5e-10); local ones measure 5e-13.
    assert_allclose(back, body.truth, atol=1e-8 if body.folded.max() > 1e5 else 1e-9)
    assert body.sheet.inside(body.truth).all()
    assert 0 <= body.stratigraphic.min() <= body.stratigraphic.max() <= 1


@pytest.mark.parametrize("name", SMALL)
def test_maps_preserve_volume_and_never_mirror(name: str, bodies: dict[str, Body]) -> None:
    body = bodies[name]
    rng = np.random.default_rng(0)
    truth = body.truth[rng.choice(len(body.truth), 400, replace=False)]
    e = 1e-2
    columns = []
    for k in range(3):
        shift = e * np.eye(3)[k]
        columns.append((body.sheet.fold(truth + shift) - body.sheet.fold(truth - shift)) / (2 * e))
    det = np.linalg.det(np.stack(columns, axis=2))
    # Measured 7.2e-8 at most (UTM coordinates' rounding), 5.9e-8 in the tight hinge; a mirrored
    # map would give -1, one without slip be off by up to 0.8 (there).
    assert_allclose(det, 1, atol=1e-6)


def test_bodies_are_deterministic() -> None:
    for name in ("noisy", "incomplete", "ragged", "rotated_lattice", "scattered", "sub_blocked"):
        one, two = simulate(name), simulate(name)
        assert_array_equal(one.folded, two.folded)
        assert_array_equal(one.truth, two.truth)


def test_frame_tells_the_sizes_of_blocks_that_differ() -> None:
    body = simulate("sub_blocked", width=80)
    table = body.frame()
    assert list(table)[-3:] == ["dim_x", "dim_y", "dim_z"]
    assert_array_equal(table[["dim_x", "dim_y", "dim_z"]], body.sizes)
    assert set(table["dim_z"]) == {5.0, 10.0, 20.0, 40.0}


def test_closed_tube_is_a_trapezoid_before_folding() -> None:
    body = simulate("cylinder")
    x, z = body.folded[:, 0], body.folded[:, 2]
    # The section starts at the foot of a circle of radius 150, heading 180, and goes clockwise.
    foot = body.sheet.slip.points(np.array([0.0]))[0]
    x, z = x - foot[0], z - foot[1] - 150
    radius = np.hypot(x, z)
    assert_allclose(body.truth[:, 2], radius - 150, atol=1e-9)
    # Whole all around: a sector of 5 degrees is 13 wide at the middle, more than a block.
    assert len(np.unique(np.floor(np.degrees(np.arctan2(z, x)) / 5))) == 72
    # A layer at radius r is 2 pi r long, which the truth keeps.
    for low in (-25, 15):
        layer = np.abs(body.truth[:, 2] - low) < 5
        extent = np.ptp(body.truth[layer, 0])
        # The cut's edge leans by pi over the 10 of the slab; blocks are 10 wide.
        assert extent == pytest.approx(2 * np.pi * (150 + low), abs=2 * (5 * np.pi + 10))
    mesh, truth = body.horizon("top", 20.0)
    assert_allclose(body.sheet.fold(truth), mesh.V, atol=1e-9)
    assert np.ptp(truth[:, 0]) == pytest.approx(2 * np.pi * 180, rel=1e-12)


def test_limbs_of_the_touching_body_are_as_near_as_said() -> None:
    sheet = simulate("touching").sheet
    truth = sheet.boundary(400, 2)
    inner = truth[(truth[:, 2] < 0) & (truth[:, 1] == 0)]
    folded = sheet.fold(inner)
    half = len(folded) // 2
    apart = np.linalg.norm(folded[:half, None] - folded[None, half + 100 :], axis=2).min()
    assert apart == pytest.approx(16, abs=0.3)


def test_world_placement_is_rigid() -> None:
    plain = simulate("sim_case_2")
    turned = simulate(
        "sim_case_2", azimuth=130, plunge=25, tilt=-70, offset=(350_000.0, 7.4e6, 900.0)
    )
    assert_array_equal(plain.truth, turned.truth)
    axes = turned.sheet.axes
    assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert_allclose((turned.folded - turned.sheet.spec.offset) @ axes.T, plain.folded, atol=1e-8)


def test_heights_are_those_of_the_blocks() -> None:
    body = simulate("bulge")
    assert_allclose(body.bottom, -35)
    assert body.top.min() >= 35
    assert body.top.max() == pytest.approx(75, abs=0.5)
    assert ((body.truth[:, 2] >= body.bottom) & (body.truth[:, 2] <= body.top)).all()


def test_refolded_and_closed_bodies_are_not_developable_and_others_are() -> None:
    assert not simulate("refolded").developable
    assert [name for name, spec in CASES.items() if not spec.developable] == [
        "refolded", "refolded_tight", "cylinder",
    ]  # fmt: skip
    once = replace(CASES["slab"], refold=Profile(elements=(Sinusoid(amplitude=9, wavelength=900),)))
    assert once.developable


def test_frame_names_and_rounds() -> None:
    table = simulate("sim_case_1").frame(4)
    assert list(table) == [f"{a}_{b}" for a in ("centroid", "true") for b in "xyz"]
    assert table.shape == (21_600, 6)
    assert "-0.0" not in table.head(500).to_csv()


def test_body_unpacks_into_folded_and_truth() -> None:
    body = simulate("slab", missing=0.5)
    X, W = body
    assert X is body.folded
    assert W is body.truth


@pytest.mark.parametrize("side", ["top", "bottom"])
def test_horizon_lies_on_the_surface(side: str) -> None:
    body = simulate("hole")
    mesh, truth = body.horizon(side, 12.0)
    assert_allclose(truth[:, 2], 50 if side == "top" else -50)
    assert_allclose(body.sheet.unfold(mesh.V)[0], truth, atol=1e-9)
    areas = triangle_areas(truth[:, :2], mesh.F)
    assert areas.min() > 0
    hole = np.pi * 0.12 * 0.18 * 820 * 540
    assert areas.sum() == pytest.approx(820 * 540 - hole, rel=0.01)
    E = unique_edges(mesh.F)
    # Chords of 12 on radii of 70 upwards: 12^2 / (24 70^2) = 1.2e-3 short at most.
    assert_allclose(lengths(mesh.V, E), lengths(truth, E), rtol=2e-3)
