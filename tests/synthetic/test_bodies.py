"""Simulated bodies: the truth is exact, the maps are inverse, bad recipes are refused."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.geometry.measures import face_normals, lengths, triangle_areas, unique_edges
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic import (
    CASES,
    FAMILIES,
    AnalyticSurface,
    Bend,
    Body,
    Bulge,
    Bump,
    Ellipse,
    Embayment,
    Even,
    FlexuralSlip,
    Gap,
    Hole,
    Lens,
    Neck,
    ObliqueCut,
    Profile,
    Ragged,
    Sheet,
    Sinusoid,
    Swell,
    Wedge,
    cone,
    cylinder,
    random_body,
    random_family,
    simulate,
    slab,
    spherical_cap,
)
from geounfold.synthetic.random_families import BLOCKS
from tests.places import ACCEPTANCE, ROOT

DATA = ROOT / "data"
Map = Callable[[np.ndarray], np.ndarray]
SMALL = [name for name in CASES if name not in ("large", "thin_wide")]
NOISELESS = [name for name in SMALL if not CASES[name].noise]
PLAIN = [n for n in NOISELESS if CASES[n].grid != "scattered" and CASES[n].sub_blocks == 1]
PROFILES = {
    "sinusoid": Profile(elements=(Sinusoid(amplitude=100, wavelength=900),)),
    "smooth bend": Profile(start=60, elements=(Bend(at=300, change=-120, radius=45),)),
    "arc bend": Profile(start=60, elements=(Bend(at=300, change=-120, radius=45, shape="arc"),)),
    "bumps": Profile(
        start=10,
        elements=(Bump(at=150, amplitude=50, width=60), Bump(at=420, amplitude=-70, width=70)),
    ),
    "plane": Profile(start=30),
}


@pytest.fixture(scope="module")
def bodies() -> dict[str, Body]:
    return {name: simulate(name) for name in SMALL}


def section_points(seed: int = 0, n: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 600, n), rng.uniform(-40, 40, n)


# ---------------------------------------------------------------- the map of a section


@pytest.mark.parametrize("name", PROFILES)
def test_section_map_preserves_area(name: str) -> None:
    slip = FlexuralSlip(PROFILES[name], 600.0, 41.0)
    u, w = section_points()
    e = 1e-3
    du = (slip.fold(u + e, w) - slip.fold(u - e, w)) / (2 * e)
    dw = (slip.fold(u, w + e) - slip.fold(u, w - e)) / (2 * e)
    jacobian = du[:, 0] * dw[:, 1] - du[:, 1] * dw[:, 0]
    # Measured 2e-9 at most (central differences).  Without the slip term it would be off by
    # w theta': up to 0.43 to 0.89 on these profiles.
    assert np.abs(jacobian - 1).max() < 1e-7


@pytest.mark.parametrize("name", PROFILES)
def test_layers_keep_their_lengths_and_thickness(name: str) -> None:
    slip = FlexuralSlip(PROFILES[name], 600.0, 41.0)
    s = np.linspace(0, 600, 20_001)
    for t in (-40.0, 0.0, 25.0):
        # A layer is the parallel curve at one offset: its truth is a straight line of its length.
        arc = slip.arc_length(s, np.full(len(s), t))
        heading = slip.profile.heading(arc)
        assert_allclose(arc - t * (heading - slip.still), s, atol=1e-9)
        layer = slip.fold(s, np.full(len(s), t))
        folded = np.linalg.norm(np.diff(layer, axis=0), axis=1).sum()
        # Chords of 0.03 in a hinge of radius 5 at least: shorter by 1.5e-6 of the hinge's length.
        assert folded == pytest.approx(600, abs=1e-4)
        offset = (layer - slip.points(arc)) @ np.eye(2)
        normal = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        assert_allclose(offset, t * normal, atol=1e-10)


@pytest.mark.parametrize("name", PROFILES)
def test_section_map_and_back(name: str) -> None:
    slip = FlexuralSlip(PROFILES[name], 600.0, 41.0)
    u, w = section_points(1)
    back, found = slip.unfold(slip.fold(u, w))
    assert found.all()
    # Measured 2.3e-13 at most over all profiles; the promise is 1e-9.
    assert_allclose(back, np.stack([u, w], axis=1), atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    amplitude=st.floats(-100, 100),
    wavelength=st.floats(500, 3000),
    phase=st.floats(0, 360),
    start=st.floats(-180, 180),
)
def test_any_open_sinusoid_is_inverted(
    amplitude: float, wavelength: float, phase: float, start: float
) -> None:
    # A wavelength of 500 and 100 degrees have radius 45.6 at the hinge, above the offset of 40.
    wave = Sinusoid(amplitude=amplitude, wavelength=wavelength, phase=phase)
    slip = FlexuralSlip(Profile(elements=(wave,), start=start), 600.0, 41.0)
    u, w = section_points(2, 300)
    # Only near u: a sheet whose limbs cross is refused by Sheet, not here.
    back = slip.arc_length(u, w)
    assert_allclose(back - w * (slip.profile.heading(back) - slip.still), u, atol=1e-9)


def test_points_out_of_reach_are_marked() -> None:
    slip = FlexuralSlip(PROFILES["sinusoid"], 600.0, 41.0)
    far = np.array([[0.0, 1e5], [-900.0, 0.0], [1e4, -50.0]])
    back, found = slip.unfold(far)
    assert not found.any()
    assert_array_equal(back, 0)


def test_circular_hinge_against_the_circle() -> None:
    radius = 100.0
    arc = Bend(at=150, change=-90, radius=radius, shape="arc")
    start = 150 - arc.extent / 2
    slip = FlexuralSlip(Profile(elements=(arc,)), 300.0, 50.0, pin=0.0, origin=start)
    turn = np.linspace(0.01, 1.5, 50)
    circle = np.stack([radius * np.sin(turn), radius * (np.cos(turn) - 1)], axis=1)
    assert_allclose(slip.points(start + radius * turn), circle, atol=1e-10)
    centre = np.array([0, -radius])
    outer = slip.fold(start + (radius + 30) * turn, np.full(50, 30.0))  # pin 0: arc lengths at 30
    assert_allclose(outer - centre, (circle - centre) * 1.3, atol=1e-9)


def test_pin_is_a_constant_shear() -> None:
    profile = PROFILES["bumps"]
    mean, zero = FlexuralSlip(profile, 600.0, 40.0), FlexuralSlip(profile, 600.0, 40.0, pin=0.0)
    u, w = section_points(3)
    assert_allclose(zero.fold(u - w * mean.still, w), mean.fold(u, w), atol=1e-9)


def test_mean_heading_is_the_integral() -> None:
    # 50 sin(2 pi s / 480) over 600 is 1.25 periods: the mean is 50 * 480 / (2 pi 600) degrees.
    slip = FlexuralSlip(Profile(elements=(Sinusoid(amplitude=50, wavelength=480),)), 600.0, 30.0)
    assert np.degrees(slip.still) == pytest.approx(50 * 480 / (2 * np.pi * 600), rel=1e-13)


# ---------------------------------------------------------------- bodies


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


def test_bodies_are_deterministic() -> None:
    for name in ("noisy", "incomplete", "ragged", "rotated_lattice", "scattered", "sub_blocked"):
        one, two = simulate(name), simulate(name)
        assert_array_equal(one.folded, two.folded)
        assert_array_equal(one.truth, two.truth)


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


def test_frame_tells_the_sizes_of_blocks_that_differ() -> None:
    body = simulate("sub_blocked", width=80)
    table = body.frame()
    assert list(table)[-3:] == ["dim_x", "dim_y", "dim_z"]
    assert_array_equal(table[["dim_x", "dim_y", "dim_z"]], body.sizes)
    assert set(table["dim_z"]) == {5.0, 10.0, 20.0, 40.0}


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


@pytest.mark.parametrize("blocks", [9_000, 100_000])
@pytest.mark.parametrize("name", ["large", "sim_case_1", "box"])
def test_body_of_a_wanted_size(name: str, blocks: int) -> None:
    # Whole rows and columns: half a block on either side of both extents.
    assert len(simulate(name, blocks=blocks).folded) == pytest.approx(blocks, rel=0.05)


def test_thin_wide_body_has_the_size_of_the_benchmark() -> None:
    assert len(simulate("thin_wide").folded) == 175_825


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


# ---------------------------------------------------------------- the published files


@pytest.mark.parametrize("name", ["sim_case_1", "sim_case_2"])
def test_bodies_are_those_of_the_acceptance(name: str) -> None:
    path = ACCEPTANCE / f"{name}.csv"
    if not path.exists():
        pytest.skip("the acceptance bodies are not beside this checkout")
    theirs, body = pd.read_csv(path), simulate(name)
    X = theirs[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    assert_array_equal(theirs[["true_x", "true_y", "true_z"]].to_numpy(), body.truth)
    # Four decimals leave 5.0e-5; the rest is their linear interpolation in a table, 4.1e-6.
    assert_allclose(body.folded, X, rtol=0, atol=5.5e-5)
    assert np.mean(body.frame(4).iloc[:, :3].to_numpy() != X) < 0.02


@pytest.mark.parametrize("name", ["sim_case_1", "sim_case_2"])
def test_shipped_files_are_what_the_generator_writes(name: str) -> None:
    path = DATA / f"{name}.csv"
    assert hashlib.sha256(path.read_bytes()).hexdigest() in (DATA / "README.md").read_text()
    # Read back: another platform's sine may round a fifth decimal the other way.
    assert_allclose(pd.read_csv(path), simulate(name).frame(4), rtol=0, atol=1.01e-4)


# ---------------------------------------------------------------- analytic surfaces


@pytest.mark.parametrize("make", [slab, cylinder, cone])
def test_developable_surfaces_keep_their_chords(make: type) -> None:
    surface = make()
    E = unique_edges(surface.mesh.F)
    assert surface.developable
    assert_allclose(
        lengths(surface.chord_uv, E), lengths(surface.mesh.V, E), rtol=1e-12, atol=1e-12
    )
    areas = triangle_areas(surface.uv, surface.mesh.F)
    assert areas.min() > 0


@pytest.mark.parametrize("make", [cylinder, cone])
def test_arc_lengths_agree_at_second_order(make: type) -> None:
    worst = []
    for k in (16, 32, 64):
        surface = make(n=(k + 1, k + 1))
        E = unique_edges(surface.mesh.F)
        worst.append(np.ptp(lengths(surface.uv, E) / lengths(surface.mesh.V, E)))
    slopes = -np.diff(np.log2(worst))
    assert_allclose(slopes, 2, atol=0.05)


def test_cap_and_slab() -> None:
    cap = spherical_cap(radius=100, angle=40)
    assert not cap.developable
    assert_allclose(np.linalg.norm(cap.mesh.V, axis=1), 100)
    top = np.arccos(cap.mesh.V[:, 2] / 100) * 100
    assert_allclose(np.linalg.norm(cap.uv, axis=1), top, atol=1e-5)
    tilted = slab(dip=30)
    assert np.ptp(tilted.mesh.V[:, 2]) == pytest.approx(50)


@pytest.mark.parametrize(
    ("surface", "outwards"),
    [
        (cylinder(), lambda P: P * [1, 0, 1]),
        (cone(), lambda P: P * [1, 1, 0]),
        (spherical_cap(), lambda P: P),
        (slab(), lambda P: P * 0 + [0, 0, 1]),
    ],
    ids=["cylinder", "cone", "cap", "slab"],
)
def test_surfaces_face_outwards(surface: AnalyticSurface, outwards: Map) -> None:
    V, F = surface.mesh.V, surface.mesh.F
    assert (np.sum(face_normals(V, F) * outwards(V[F].mean(axis=1)), axis=1) > 0).all()


# ---------------------------------------------------------------- refusals

GOOD = CASES["slab"]
REFUSED = {
    "unknown case": (lambda: simulate("sim_case_3"), "sim_case_1, sim_case_2"),
    "unknown option": (lambda: simulate("slab", colour="red"), "colour.*valid: blocks, desc"),
    "blocks": (lambda: simulate("slab", blocks=0), "blocks must be a positive number"),
    "length": (lambda: simulate("slab", length=-1), "length must be a positive"),
    "text": (lambda: simulate("slab", width="wide"), "width must be a positive"),
    "offset nan": (lambda: simulate("slab", offset=(0, 0, np.nan)), "offset must be a finite"),
    "offset pair": (lambda: simulate("slab", offset=(0, 0)), "offset must be three numbers"),
    "steps": (lambda: simulate("slab", steps=(1, 0, 1)), "steps must be a positive"),
    "grid": (lambda: simulate("slab", grid="during"), "not one of: before, after"),
    "noise": (lambda: simulate("slab", noise=-0.1), "noise must not be negative"),
    "missing": (lambda: simulate("slab", missing=1.0), "missing is a share"),
    "seed": (lambda: simulate("slab", seed=-1), "seed must be a whole number"),
    "pin": (lambda: simulate("slab", pin=np.inf), "pin must be a finite"),
    "profile": (lambda: simulate("slab", profile=None), "profile must be a Profile"),
    "refold": (lambda: simulate("slab", refold=3), "refold must be a Profile"),
    "thickness": (lambda: simulate("slab", thickness="thick"), "thickness must be a positive"),
    "outline": (lambda: simulate("slab", outline=("ellipse",)), "outline must be a tuple"),
    "no block": (lambda: simulate("slab", thickness=5.0, offset=(0, 0, 0)), "no block of slab"),
    "no body": (lambda: simulate("slab", outline=(Gap("u", -1, 1e9),), blocks=9), "leaves nothing"),
    "sub-blocks": (lambda: simulate("slab", sub_blocks=3), "not one of: 1, 2, 4, 8"),
    "sub-blocks before": (lambda: simulate("sim_case_1", sub_blocks=2), "grid 'after'"),
    "density": (lambda: simulate("scattered", density=0.5), "must be 1 or more"),
    "density of a lattice": (lambda: simulate("slab", density=2), "grid 'scattered'"),
    "open tube": (lambda: simulate("cylinder", length=900.0), "must end where it starts"),
    "closed lens": (lambda: simulate("cylinder", thickness=Lens(60)), "evenly thick"),
    "nothing to scatter": (  # a sliver on which the volume's midpoint rule has a point
        lambda: simulate(
            "scattered", length=800, outline=(Gap("u", -1, 399 - 1e-7), Gap("u", 399 + 1e-7, 801))
        ),
        "too little",
    ),
    "tight hinge": (lambda: simulate("chevron", thickness=160), "arc length 35.* radius 70"),
    "overlap": (
        lambda: Sheet(replace(CASES["hairpin"], length=1600)),
        "covers itself",
    ),
    "refold hinge": (
        lambda: simulate(
            "refolded", refold=Profile(elements=(Sinusoid(amplitude=60, wavelength=300),))
        ),
        "hinge at arc length",
    ),
    "wavelength": (lambda: Sinusoid(amplitude=1, wavelength=0), "wavelength must be"),
    "bend shape": (lambda: Bend(at=0, change=1, radius=1, shape="square"), "smooth, arc"),
    "bump": (lambda: Bump(at=0, amplitude=1, width=-1), "width must be"),
    "even": (lambda: Even(0), "thickness must be"),
    "lens": (lambda: Lens(np.nan), "thickness must be"),
    "swell": (lambda: Swell(10, 1.0), "swell amplitude"),
    "wedge": (lambda: Wedge(10, 11), "wedge tip"),
    "bulge side": (lambda: Bulge(10, 5, side="left"), "top, bottom"),
    "bulge size": (lambda: Bulge(10, 5, size=(0, 1)), "bulge size"),
    "hole": (lambda: Hole(size=(0.1, 0)), "hole size"),
    "ragged": (lambda: Ragged(0, 1), "ragged depth"),
    "embayment side": (lambda: Embayment("w0"), "u0, u1, v0, v1"),
    "embayment depth": (lambda: Embayment(depth=1.5), "embayment depth"),
    "cut": (lambda: ObliqueCut(90), "cut angle"),
    "neck": (lambda: Neck(0.2, 0), "neck breadth"),
    "gap axis": (lambda: Gap("x", 0, 1), "u, v, w"),
    "gap": (lambda: Gap("u", 1, 1), "low < high"),
    "horizon side": (lambda: simulate("slab").horizon("left", 5), "top, bottom"),
    "horizon spacing": (lambda: simulate("slab").horizon("top", 0), "spacing must be"),
    "grid of vertices": (lambda: cylinder(n=(1, 5)), "two numbers from 2 up"),
    "opening": (lambda: cylinder(angle=360), "below 360"),
    "cone": (lambda: cone(inner=5, outer=5), "inner < outer"),
    "apex": (lambda: cone(half_apex=90), "half_apex"),
    "cap": (lambda: spherical_cap(angle=130), "below 127"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_recipes_are_refused(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(OptionError, match=message):
        call()


def test_outlines_keep_what_they_should() -> None:
    base = replace(GOOD, length=500, width=400)
    full = len(simulate(base).folded)
    for region, share in (
        (Ellipse(), np.pi / 4),
        (Hole(size=(0.2, 0.25)), 1 - np.pi * 0.05),
        (Embayment("v0", size=0.2, depth=0.5), 1 - np.pi * 0.1 / 2),
        (ObliqueCut(45, "u1", setback=30), 0.94),
        (Neck(0.3, 100), 0.7 + 0.3 * 0.25),
        (Gap("w", 0, 10), 5 / 6),
    ):
        got = len(simulate(replace(base, outline=(region,))).folded) / full
        assert got == pytest.approx(share, abs=0.01)


def test_oblique_cut_takes_from_the_top() -> None:
    body = simulate(replace(GOOD, outline=(ObliqueCut(60, "u1", setback=80),)))
    top, low = body.truth[:, 2] == 25, body.truth[:, 2] == -25
    reach = body.truth[low, 0].max() - body.truth[top, 0].max()
    assert reach == pytest.approx(50 * np.tan(np.radians(60)), abs=10)


# ---------------------------------------------------------------- random bodies


@pytest.mark.parametrize("family", FAMILIES)
def test_random_body_of_every_family(family: str) -> None:
    body = random_body(1, family)
    assert body.name == family
    assert body.description.startswith(family)
    assert "\n" not in body.description
    low, high = BLOCKS
    assert low <= len(body.folded) <= high
    assert body.sheet.inside(body.truth).all()
    if not body.sheet.spec.noise:
        # World coordinates of up to 9e6 carry 1e-9 each; bodies are up to 2e4 large.
        assert_allclose(body.sheet.fold(body.truth), body.folded, rtol=0, atol=1e-7)


def test_random_bodies_are_deterministic_and_differ() -> None:
    for seed in (3, 4):
        one, two = random_body(seed), random_body(seed)
        assert one.name == random_family(seed)
        assert one.description == two.description
        assert_array_equal(one.folded, two.folded)
        assert_array_equal(one.truth, two.truth)
    assert random_body(3, "open").folded.shape != random_body(4, "open").folded.shape


def test_seeds_draw_every_family() -> None:
    # Of 34 families and 300 seeds each is missed with a chance of 1.3e-4.
    assert {random_family(seed) for seed in range(300)} == set(FAMILIES)


def test_limbs_of_random_bodies_do_not_meet() -> None:
    body = random_body(2, "hairpin")
    side = float(body.steps.max())
    pairs = cKDTree(body.folded).query_pairs(1.7 * side, output_type="ndarray")
    u, thick = body.truth[:, 0], float((body.top - body.bottom).max())
    # Blocks nearer than 1.75 sides belong to one place of the sheet: along it they are at most
    # their distance and the slip over the thickness, 2 rad x half of it, apart.
    assert np.abs(np.diff(u[pairs], axis=1)).max() < 6 * side + 2 * thick


def test_random_bodies_that_cannot_be_drawn_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OptionError, match="not one of: flat, open"):
        random_body(0, "spiral")
    with pytest.raises(OptionError, match="whole number from 0 up"):
        random_body(-1)
    monkeypatch.setattr("geounfold.synthetic.random_bodies.BLOCKS", (1, 2))
    monkeypatch.setattr("geounfold.synthetic.random_bodies._DRAWS", 3)
    with pytest.raises(OptionError, match="no valid body of the family 'flat' in 3 drawings"):
        random_body(0, "flat")
