"""Faulted bodies: truth both ways, volumes, fault blocks, slips, lattices, drawn surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.geometry.measures import face_normals
from geounfold.synthetic import Profile, Sinusoid
from geounfold.synthetic.faulted import (
    FAULTED_CASES,
    VARIANTS,
    FaultedBody,
    FaultedSpec,
    FoldEvent,
    ListricFault,
    PlanarFault,
    ScissorFault,
    TipFault,
    drawn_otherwise,
    random_faulted,
    simulate_faulted,
)

NAMES = list(FAULTED_CASES)
EVERY = [*NAMES, *(f"plain{seed}" for seed in range(6)), *(f"wide{seed}" for seed in range(8))]
# Fault blocks by design: one more than the faults, or one for each combination that exists.
BLOCKS = {"graben": 3, "horst": 3, "branch": 3, "crossing": 4, "domino": 5, "network": 15}
PARTED = {"normal_3T", "thrust_5T"}  # slips that leave no block beside another
PLANE = PlanarFault(name="f1", point=(200, 150, 0), strike=0, dip=60, dip_slip=50)


@pytest.fixture(scope="module")
def bodies() -> dict[str, FaultedBody]:
    drawn = {f"plain{seed}": random_faulted(seed) for seed in range(6)}
    drawn |= {f"wide{seed}": random_faulted(seed, "wide") for seed in range(8)}
    return {name: simulate_faulted(name) for name in NAMES} | drawn


@pytest.mark.parametrize("name", EVERY)
def test_truth_folds_and_faults_back_to_the_blocks(
    bodies: dict[str, FaultedBody], name: str
) -> None:
    body = bodies[name]
    n = len(body.folded)
    assert body.folded.shape == body.truth.shape == body.sizes.shape == (n, 3)
    again, _ = body.spec.forward(body.truth)
    # Coordinates of some 1,000 m, or 7e6 m with the national grid, times the rounding error.
    assert_allclose(again + body.spec.offset, body.folded, rtol=0, atol=2e-8)
    assert body.level.min() >= 0
    assert body.level.max() <= 1
    assert len(np.unique(body.folded, axis=0)) == n


@pytest.mark.parametrize("name", EVERY)
def test_folds_and_faults_keep_the_volume(bodies: dict[str, FaultedBody], name: str) -> None:
    body = bodies[name]
    spec = body.spec
    u, v = (g.ravel() for g in np.meshgrid(np.linspace(-60, spec.length + 60, 800),
                                           np.linspace(-60, spec.width + 60, 600)))  # fmt: skip
    area = (spec.length + 120) * (spec.width + 120) / len(u)
    flat = 2 * float(spec.half_thickness(u, v)[spec.in_outline(u, v)].sum()) * area
    blocks = float(np.prod(body.sizes, axis=1).sum())
    if spec.crop is not None:  # the crop takes a third of the width off
        assert 0.6 * flat < blocks < 0.72 * flat
        return
    # Blocks counted by their middles: 27 bodies differ by at most 2.1 %. A gap or an overlap
    # along a fault, one block wide, would be 2.5 % each and grow with the slip.
    assert blocks == pytest.approx(flat, rel=0.03)


@pytest.mark.parametrize("name", NAMES)
def test_fault_blocks_are_what_the_surfaces_part(bodies: dict[str, FaultedBody], name: str) -> None:
    body = bodies[name]
    count = np.bincount(body.fault_block)
    assert len(count) == BLOCKS.get(name, 2)
    assert (count > 500).all()
    assert (np.diff(count) <= 0).all()
    # Neighbours in two fault blocks have a surface between them, save past a tip.
    pairs = cKDTree(body.folded).query_pairs(1.05 * max(body.spec.steps), output_type="ndarray")
    apart = pairs[body.fault_block[pairs[:, 0]] != body.fault_block[pairs[:, 1]]]
    assert (len(apart) == 0) == (name in PARTED)
    if name in PARTED:
        return
    middles = body.folded[apart].mean(axis=1)
    if name == "tip":
        fault = body.spec.faults[0]
        assert isinstance(fault, TipFault)
        middles = middles[fault.coordinates(middles)[:, 0] < fault.tip - 10]
    V = np.concatenate([V for V, _ in body.surfaces.values()])
    # Half a link, half a triangle's diagonal, half a block of bent triangles.
    assert cKDTree(V).query(middles)[0].max() < 1.6 * max(body.spec.steps)


@pytest.mark.parametrize(
    ("name", "dip", "strike"),
    [
        ("normal_1T", 50, 0),
        ("reverse_1T", -60, 0),
        ("thrust_5T", -250, 0),
        ("strike_slip", 4, 90),
        ("swell", 40, 60),
        ("oblique_reverse", -45, 45),
        ("drag_normal", 40, 0),
    ],
)
def test_slip_of_a_plane_is_the_designed_one(
    bodies: dict[str, FaultedBody], name: str, dip: float, strike: float
) -> None:
    body = bodies[name]
    fault = body.spec.faults[0]
    slip = body.slips["f1"]
    assert len(slip.flat) > 200
    designed = np.array([strike, dip, 0.0])
    assert_allclose(slip.vectors @ fault.axes.T, np.tile(designed, (len(slip.flat), 1)), atol=1e-9)
    assert_allclose(slip.throw, dip * np.sin(np.radians(fault.dip)), atol=1e-9)


def test_strike_is_right_handed_and_positive_throw_is_normal(
    bodies: dict[str, FaultedBody],
) -> None:
    body = bodies["normal_1T"]  # strike 8 degrees: the fault dips to +x, its hanging wall is there
    hanging = body.spec.faults[0].hanging(body.folded)
    assert body.folded[hanging, 0].mean() > body.folded[~hanging, 0].mean() + 100
    assert (body.slips["f1"].throw > 0).all()
    assert (bodies["reverse_1T"].slips["f1"].throw < 0).all()


def test_slip_varies_as_its_kind_says(bodies: dict[str, FaultedBody]) -> None:
    scissor = bodies["scissor"].slips["f1"]
    assert scissor.throw.min() < -5
    assert scissor.throw.max() > 20
    tip = bodies["tip"]
    place = tip.spec.faults[0].coordinates(tip.slips["f1"].footwall)[:, 0]
    throw = tip.slips["f1"].throw
    assert abs(throw[place > 65]).max() < 0.2  # 3 (5 / 200)^2 of 45 m
    assert throw[place < -125].min() > 36  # sin 65 of 45 m, nearly whole
    listric = bodies["listric"]
    fault = listric.spec.faults[0]
    assert isinstance(fault, ListricFault)
    size = np.linalg.norm(listric.slips["f1"].vectors, axis=1)
    assert_allclose(size, 2 * fault.radius * np.sin(np.radians(fault.angle / 2)), rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_walls_of_a_slip_are_one_rock(bodies: dict[str, FaultedBody], name: str) -> None:
    body = bodies[name]
    for k, fault in body.spec.faults_by_index.items():
        slip = body.slips[fault.name]
        assert len(slip.flat) > 100
        assert body.spec.holds(slip.flat).all()
        for wall, undo in ((slip.footwall, False), (slip.hanging_wall, True)):
            P, reached, _ = body.spec.back(wall - body.spec.offset, stop=k + 1)
            assert reached.all()
            assert_allclose(fault.coordinates(P)[:, 2], 0.0, atol=1e-6)
            flat, _, _ = body.spec.before(fault.back(P) if undo else P, k, 0)
            # Older faults tear rock on their own surfaces: a vertex may lie within rounding of one.
            near = np.abs(flat - slip.flat).max(axis=1) < 1e-6
            assert near.mean() > 0.99
        assert slip.blocks.min() >= 0
        # Blocks of a wall's own fault block lie beside it, more than half of them within a block.
        for column, wall in enumerate((slip.footwall, slip.hanging_wall)):
            off = np.full(len(wall), np.inf)
            for block in np.unique(slip.blocks[:, column]):
                rows = slip.blocks[:, column] == block
                tree = cKDTree(body.folded[body.fault_block == block])
                off[rows] = tree.query(wall[rows])[0]
            assert np.median(off) < max(body.spec.steps)
            assert off.max() < 3 * max(body.spec.steps)


def test_a_network_has_a_block_for_each_combination(bodies: dict[str, FaultedBody]) -> None:
    assert int(bodies["network"].fault_block.max()) == 14  # (4 + 1) x (2 + 1) blocks


def test_lattices_sub_blocks_and_points(bodies: dict[str, FaultedBody]) -> None:
    flat = bodies["flat_blocks"]
    cells = (flat.folded - flat.spec.offset) @ flat.spec.lattice_axes.T / flat.spec.steps - 0.5
    assert_allclose(cells, np.rint(cells), atol=1e-6)
    small = bodies["sub_blocked"]
    assert sorted(set(small.sizes[:, 0].tolist())) == [5.0, 10.0]
    whole = bodies["normal_1T"].spec
    assert small.spec.sub_blocks == 2
    assert whole.sub_blocks == 1
    side = small.sizes[:, :1]
    place = small.folded / side - 0.5  # every block lies on the lattice of its own size
    assert_allclose(place, np.rint(place), atol=1e-6)
    points = bodies["scattered"]
    low = np.round(points.folded / 10 - 0.5, 3)
    assert (low != np.rint(low)).any(axis=1).mean() > 0.9


def test_offset_and_bearing_do_not_change_the_rock() -> None:
    plain = simulate_faulted("normal_1T")
    moved = simulate_faulted("normal_1T", offset=(5e5, 7e6, 100.0))
    assert_array_equal(moved.truth, plain.truth)
    assert_allclose(moved.folded - plain.folded, np.tile((5e5, 7e6, 100.0), (len(plain.truth), 1)))
    V, _ = plain.surfaces["f1"]
    assert_allclose(moved.surfaces["f1"][0] - V, np.tile((5e5, 7e6, 100.0), (len(V), 1)))
    assert_allclose(moved.slips["f1"].vectors, plain.slips["f1"].vectors, atol=1e-8)
    turned = simulate_faulted("normal_1T", bearing=30.0)
    assert len(turned.truth) == pytest.approx(len(plain.truth), rel=0.02)
    assert not np.array_equal(turned.truth[:100], plain.truth[:100])


def test_equal_recipes_give_equal_bodies() -> None:
    one, two = random_faulted(3), random_faulted(3)
    assert_array_equal(one.folded, two.folded)
    assert_array_equal(one.truth, two.truth)
    assert_array_equal(one.surfaces["f1"][0], two.surfaces["f1"][0])
    assert not np.array_equal(one.truth[:50], random_faulted(4).truth[:50])


# ---------------------------------------------------------------- surfaces drawn otherwise


@pytest.mark.parametrize("variant", list(VARIANTS))
@pytest.mark.parametrize("name", ["normal_1T", "crossing", "listric"])
def test_variants_keep_the_truth_and_are_surfaces(
    bodies: dict[str, FaultedBody], name: str, variant: str
) -> None:
    body = bodies[name]
    other = drawn_otherwise(body, variant)
    assert other.truth is body.truth
    assert list(other.surfaces) == list(body.surfaces)
    for key, (V, F) in other.surfaces.items():
        assert len(F) > 50
        assert np.isfinite(V).all()
        assert F.min() == 0
        assert F.max() == len(V) - 1
        assert not np.array_equal(V, body.surfaces[key][0])


def test_variants_are_off_by_what_they_say(bodies: dict[str, FaultedBody]) -> None:
    body = bodies["normal_1T"]
    fault, h = body.spec.faults[0], body.step
    off = {
        name: fault.coordinates(drawn_otherwise(body, name).surfaces["f1"][0])[:, 2]
        for name in VARIANTS
    }
    assert_allclose(off["off_half"], 0.5 * h, atol=1e-9)
    assert_allclose(off["off_one"], 1.0 * h, atol=1e-9)
    assert off["rough"].std() == pytest.approx(0.3 * h, rel=0.05)  # of some 4,000 vertices
    for name in ("far", "short", "parts", "coarse"):
        assert_allclose(off[name], 0.0, atol=1e-9)
    place = {
        name: fault.coordinates(drawn_otherwise(body, name).surfaces["f1"][0])
        for name in ("far", "short")
    }
    exact = fault.coordinates(body.surfaces["f1"][0])
    for axis in (0, 1):
        assert np.ptp(place["far"][:, axis]) > np.ptp(exact[:, axis]) + 40 * h
    blocks = fault.coordinates(body.folded[np.abs(fault.coordinates(body.folded)[:, 2]) < h])[:, 0]
    assert blocks.min() + h < place["short"][:, 0].min()
    assert place["short"][:, 0].max() < blocks.max() - h


def test_parts_overlap_leave_a_gap_and_one_is_turned_over(
    bodies: dict[str, FaultedBody],
) -> None:
    body = bodies["normal_1T"]
    V, F = drawn_otherwise(body, "parts").surfaces["f1"]
    up = face_normals(V, F) @ body.spec.faults[0].axes[2] > 0
    assert 0.1 < (~up).mean() < 0.5
    along = body.spec.faults[0].coordinates(V[F].mean(axis=1))[:, 0]
    ends = [along[~up].min(), along[~up].max()]
    first, last = along[up & (along < np.mean(ends))], along[up & (along > np.mean(ends))]
    assert first.max() - ends[0] == pytest.approx(2 * body.step, abs=body.step)
    assert last.min() - ends[1] == pytest.approx(body.step, abs=body.step)


# ---------------------------------------------------------------- what is refused

FOLD = FoldEvent(profile=Profile(elements=(Sinusoid(amplitude=9, wavelength=300),)),
                 length=700, reach=60)  # fmt: skip
POINT = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: simulate_faulted("no_such"), "no faulted body is named 'no_such'; valid: normal"),
        (lambda: simulate_faulted("tip", steps=(1e4, 1e4, 1e4)), "no block of tip lies in"),
        (lambda: simulate_faulted("tip", colour=1), "no option 'colour'; valid: events"),
        (lambda: random_faulted(1, "other"), "family 'other' is not one of: plain, wide"),
        (lambda: random_faulted(-1), "seed must be a whole number from 0 up"),
        (lambda: drawn_otherwise(simulate_faulted("tip"), "torn"), "no variant is named 'torn'"),
        (lambda: FaultedSpec(events=(FOLD,)), "needs a fault among its events"),
        (lambda: FaultedSpec(events=(PLANE, PLANE)), "two faults are named 'f1'"),
        (lambda: FaultedSpec(events=(PLANE,), swell=1.0), r"swell must lie in \[0, 1\)"),
        (lambda: FaultedSpec(events=(PLANE,), grid="before"), "grid 'before' is not one of"),
        (lambda: FaultedSpec(events=(PLANE,), sub_blocks=0), "sub_blocks must be a whole number"),
        (lambda: FaultedSpec(events=(PLANE,), seed=-1), "seed must be a whole number from 0"),
        (
            lambda: FaultedSpec(events=(PLANE,), grid="scattered", sub_blocks=2),
            "scattered points have no sub_blocks",
        ),
        (lambda: FaultedSpec(events=(PLANE,), thickness=0.0), "thickness"),
        (lambda: FaultedSpec(events=(PLANE,), steps=(10.0, 0.0, 10.0)), "steps"),
        (lambda: FaultedSpec(events=(PLANE,), bearing=np.nan), "bearing or offset"),
        (
            lambda: FaultedSpec(events=(
                PlanarFault(name="f2", point=POINT, strike=0, dip=60, dip_slip=5,
                            within=(("f1", True),)),
            )),
            "f2 is confined by 'f1', which is no earlier fault",
        ),
        (
            lambda: PlanarFault(name="f1", point=POINT, strike=0, dip=0, dip_slip=1),
            r"dip of fault f1 must lie in \(0, 90\]",
        ),
        (
            lambda: PlanarFault(name="f1", point=POINT, strike=0, dip=60),
            "fault f1 needs a dip_slip or a strike_slip",
        ),
        (
            lambda: PlanarFault(name="f1", point=POINT, strike=0, dip=60, dip_slip=1,
                                wavelength=0.0),
            "wavelength",
        ),
        (lambda: ListricFault(name="f1", point=POINT, strike=0, dip=60, radius=0.0), "radius"),
        (lambda: ScissorFault(name="f1", point=POINT, strike=0, dip=60, angle=np.inf), "angle"),
        (lambda: TipFault(name="f1", point=POINT, strike=0, dip=60, fade=0.0), "fade"),
        (lambda: FoldEvent(profile=Profile(), length=0.0, reach=60), "length"),
    ],
)  # fmt: skip
def test_values_that_make_no_body_are_refused(make: object, message: str) -> None:
    assert callable(make)
    with pytest.raises(OptionError, match=message):
        make()


def test_a_number_of_blocks_sets_their_size() -> None:
    body = simulate_faulted("swell", blocks=3000)
    # Four layers of blocks, counted by their middles.
    assert len(body.folded) == pytest.approx(3000, rel=0.05)
    assert len(body.surfaces["f1"][1]) > 1000
    with pytest.raises(OptionError, match="blocks must be at least 1"):
        simulate_faulted("swell", blocks=0)


def test_the_table_has_truth_and_sides(bodies: dict[str, FaultedBody]) -> None:
    table = bodies["sub_blocked"].frame(2)
    assert list(table) == [
        *(f"{what}_{axis}" for what in ("centroid", "true", "dim") for axis in "xyz"),
        "true_fault_block",
    ]
    assert table["true_fault_block"].dtype.kind == "i"
    assert "dim_x" not in bodies["tip"].frame()
