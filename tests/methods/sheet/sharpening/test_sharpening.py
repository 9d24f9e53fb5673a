"""Sharpening by lattice sites and by layers."""

from itertools import product

import numpy as np
import pytest

import geounfold as gu
from geounfold.methods.sheet import attempts
from geounfold.methods.sheet.attempts import HOLDS
from geounfold.methods.sheet.mid_surface import parallel_surface, surface
from geounfold.methods.sheet.mid_surface.spline import SplineGrid
from geounfold.methods.sheet.mid_surface.surface import MidSurface
from geounfold.methods.sheet.sharpening import by_layers, lattice_sites
from geounfold.methods.sheet.sharpening.by_lattice_sites import sharpen
from geounfold.methods.sheet.sharpening.by_layers import layer_heights, sharpen_layers
from geounfold.methods.sheet.sharpening.displace import displacement_basis, node_normals
from geounfold.methods.sheet.sharpening.lattice_sites import scatter, surface_sites
from geounfold.methods.sheet.sharpening.site_rules import SiteRules
from geounfold.synthetic import simulate


def test_sites_of_a_cube_of_27_blocks():
    cells = np.add(list(product(range(3), repeat=3)), [5, -7, 0])
    steps = np.array([2.0, 1.0, 0.5])
    sites = surface_sites(cells, steps)
    # 27 - 1 blocks have an empty neighbour; the shell around 3^3 is 5^3 - 3^3 sites.
    assert sites.occupied.sum() == 26
    assert (~sites.occupied).sum() == 98
    found = np.rint(sites.points[sites.occupied] / steps).astype(int)
    assert {tuple(c) for c in found} == {tuple(c) for c in cells} - {(6, -6, 1)}
    assert np.array_equal(np.unique(sites.points, axis=0).shape, sites.points.shape)


def test_sites_do_not_know_the_rows_order():
    rng = np.random.default_rng(11)
    cells = np.unique(rng.integers(0, 6, (150, 3)), axis=0)
    mixed = cells[rng.permutation(len(cells))]
    first, second = (surface_sites(c, np.ones(3)) for c in (cells, mixed))
    assert np.array_equal(first.points, second.points)


def flat_sheet():
    """A plane z = 0 over 24 x 24 blocks."""
    low, high = np.full(2, -12.0), np.full(2, 12.0)
    grid = SplineGrid.over(low, high, 3.5)
    C = np.column_stack([grid.nodes, np.zeros(grid.size)])
    return MidSurface(grid, C, low, high)


def test_moving_all_coefficients_moves_the_surface_as_much():
    rng = np.random.default_rng(11)
    sheet = flat_sheet()
    nodes = node_normals(sheet)
    assert np.allclose(nodes, [0, 0, 1])
    U = rng.uniform(-10, 10, (50, 2))
    A = displacement_basis(sheet, nodes, U, np.tile([0.0, 0.0, 1.0], (50, 1)))
    assert np.allclose(A.sum(axis=1), 1)
    energy = sheet.grid.energy(3)
    assert abs(energy.between(nodes).sparse() - energy.sparse()).max() < 1e-12


def test_layers_are_counted():
    rng = np.random.default_rng(11)
    level = (2 * rng.integers(0, 5, 400) + 1 - 5) / 5
    half = rng.uniform(2.3, 2.7, 400)
    found = layer_heights(half * level + rng.normal(0, 0.05, 400), half, 0.5)
    assert found == pytest.approx(level)


def test_points_in_no_layers_are_seen_as_such():
    rng = np.random.default_rng(11)
    half = np.full(2000, 4.0)
    assert layer_heights(rng.uniform(-4, 4, 2000), half, 0.5) is None


def test_scatter_is_even():
    rng = np.random.default_rng(11)
    # A quarter of many points each, within four standard deviations of sqrt(4000 * 3) / 4.
    share = np.histogram(scatter(rng.uniform(-40, 40, (4000, 3))), 4, (0, 1))[0]
    assert np.abs(share - 1000).max() < 110


@pytest.fixture(scope="module")
def lattice_fit():
    """A lattice body, its truth and its sheet before and after."""
    body = simulate("plunging", blocks=12000)
    with pytest.MonkeyPatch.context() as patch:  # no attempt holds, and none is a closer fit
        patch.setattr(attempts, "HOLDS", -1.0)
        patch.setattr(attempts, "ATTEMPTS", attempts.ATTEMPTS[:2])
        before = gu.unfold(body.folded)
    return body, before, gu.unfold(body.folded)


def test_sites_bring_the_sheet_nearer_to_the_truth(lattice_fit):
    body, before, after = lattice_fit
    assert before.fits[0].notes["sharpened"] == ""
    assert after.fits[0].notes["sharpened"] == "sites"
    off = [gu.aligned_rms(u.points, body.truth) / u.frame.scale for u in (before, after)]
    # Measured 0.086 before and 0.051 after.
    assert off[1] < 0.75 * off[0]


def test_sites_that_no_sheet_separates_are_refused(lattice_fit):
    rng = np.random.default_rng(11)
    _, _, after = lattice_fit
    fitted = after.fits[0].sheet.fitted
    points = after.frame.snap(after.frame.to_work(after.folded))
    steps = after.frame.steps
    sites = surface_sites(np.rint(points / steps).astype(np.int64), steps)
    assert sharpen(fitted, sites, SiteRules()).depth < HOLDS
    mixed = type(sites)(sites.points, rng.permutation(sites.occupied))
    assert sharpen(fitted, mixed, SiteRules()).depth > 10 * HOLDS


def test_layers_bring_a_folded_grid_nearer_to_the_truth():
    body = simulate("sim_case_2")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(by_layers, "CLEAR", 2.0)  # never met
        before = gu.unfold(body.folded)
    after = gu.unfold(body.folded)
    assert (before.fits[0].notes["sharpened"], after.fits[0].notes["sharpened"]) == ("", "layers")
    off = [gu.aligned_rms(u.points, body.truth) / u.frame.scale for u in (before, after)]
    # Measured 0.075 before and 0.009 after.
    assert off[1] < off[0] / 3


def test_more_points_than_asked_for_are_thinned_evenly():
    u = gu.unfold(simulate("sim_case_1").folded)
    fitted, work = u.fits[0].sheet.fitted, u.frame.to_work(u.folded)
    all_, some = (sharpen_layers(fitted, work, most) for most in (10**6, 8000))
    U = fitted.near
    # Both fits go through the same layers: measured 0.00003 blocks apart.
    assert np.abs(all_.sheet.at(U) - some.sheet.at(U)).max() < 0.001


def test_layers_follow_the_side_that_does_not_bulge():
    body = simulate("bulge", blocks=15000)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parallel_surface, "_CLEARLY_LESS", 0.0)  # the mid surface stays
        middle = gu.unfold(body.folded)
    chosen = gu.unfold(body.folded)
    flat = "bottom" if np.ptp(body.bottom) < np.ptp(body.top) else "top"
    assert (middle.fits[0].notes["layers_follow"], chosen.fits[0].notes["layers_follow"]) == (
        "mid",
        flat,
    )
    off = [gu.aligned_rms(u.points, body.truth) / u.frame.scale for u in (middle, chosen)]
    # Measured 0.75 blocks with the mid surface, 0.12 with the bottom.
    assert off[1] < off[0] / 2
    down = gu.unfold(body.folded, up=(0.0, 0.0, -1.0))
    other = {"top": "bottom", "bottom": "top"}
    assert down.fits[0].notes["layers_follow"] == other[flat]


def test_layers_follow_the_middle_of_a_swell():
    u = gu.unfold(simulate("swelling", blocks=16000).folded)
    assert u.fits[0].notes["layers_follow"] == "mid"


def test_sites_are_the_same_by_a_table_and_by_a_list(monkeypatch: pytest.MonkeyPatch) -> None:
    cells, steps = np.argwhere(np.random.default_rng(7).random((9, 8, 7)) < 0.8), np.ones(3)
    by_table = surface_sites(cells, steps)
    monkeypatch.setattr(lattice_sites, "_EMPTY", 0)
    by_list = surface_sites(cells, steps)
    assert 100 < len(by_table.points) == len(by_list.points)
    assert (by_table.points == by_list.points).all()
    assert (by_table.occupied == by_list.occupied).all()


def test_feet_do_not_depend_on_how_the_points_are_sliced(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = SplineGrid.over(np.zeros(2), np.full(2, 30.0), 3.5)
    C = np.concatenate([grid.nodes, np.sin(grid.nodes[:, :1] / 9)], axis=1)
    sheet = MidSurface(grid, C, np.zeros(2), np.full(2, 30.0), 1.5)
    points = np.random.default_rng(3).uniform(0, 30, (500, 3)) * [1, 1, 0.1]
    whole = sheet.search().feet(points)
    monkeypatch.setattr(surface, "SLICE", 64)
    for one, other in zip(whole, sheet.search().feet(points), strict=True):
        assert (one == other).all()
