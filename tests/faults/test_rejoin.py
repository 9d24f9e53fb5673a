"""Faults taken out of a level and of a folded slab whose slip is known."""

from __future__ import annotations

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import InputError, OptionError


def faulted_slab(slip=(3.0, 0.0, -3.0), size=(30, 16, 5)):
    """Return a slab cut by a plane that dips 45 degrees along x, its truth, fault and blocks.

    The hanging wall (x beyond the plane) moved by ``slip``, whole blocks down the dip.
    """
    cells = np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), -1).reshape(-1, 3)
    W = cells - np.array([s // 2 for s in size]) + 0.0
    hanging = W[:, 0] + W[:, 2] > 0.25
    X = W + np.where(hanging[:, None], slip, 0.0)
    a, b = np.meshgrid(np.linspace(-14, 14, 15), np.linspace(-12, 12, 13), indexing="ij")
    V = np.stack([a.ravel() + 0.25, b.ravel(), -a.ravel()], axis=1)
    k = np.arange(15 * 13).reshape(15, 13)
    p, q, r, s = (c.ravel() for c in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return X, W, hanging, (V, np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, s], 1)]))


@pytest.fixture(scope="module")
def slab():
    X, W, hanging, surface = faulted_slab()
    return X, W, hanging, gu.unfold(X, faults={"F1": surface})


def test_fault_blocks_are_those_of_the_cut(slab):
    _, _, hanging, u = slab
    assert u.fault_block.max() == 1
    assert len(np.unique(u.fault_block[hanging])) == 1
    assert len(np.unique(u.fault_block[~hanging])) == 1


def test_flat_space_is_the_slab_before_the_fault(slab):
    _, W, _, u = slab
    # Dip slip of whole blocks down a plane: the flat space is W up to a rigid motion. 0.3 blocks
    # is twice the error of the parts, 0.15; left in, the fault moves one part by 4.2 blocks.
    assert gu.aligned_rms(u.points, W) < 0.3
    assert u.injective


def test_slip_is_that_of_the_hanging_wall(slab):
    *_, u = slab
    row = u.faults.iloc[0]
    # Half a block is what the blocks resolve; the true throw and heave are 3 blocks.
    assert row["throw"] == pytest.approx(3.0, abs=0.5)
    assert row["heave"] == pytest.approx(3.0, abs=0.5)
    assert row["rake"] == pytest.approx(-90, abs=20)  # Aki and Richards: normal


def test_points_return_exactly_both_ways(slab):
    *_, u = slab
    assert u.round_trip_max < 1e-9  # rounding of 30 blocks: 1e-14


def test_points_beside_the_fault_are_carried_by_their_side(slab):
    *_, u = slab
    on = np.array([[0.25 - z, 0.0, z] for z in np.linspace(-1.5, 0.5, 5)])
    off = 0.05 * np.array([1.0, 0.0, 1.0])
    foot, hanging = u.to_flat(on - off), u.to_flat(on + off)
    # The two walls are 4.2 blocks of slip apart in the flat space, the points 0.14 apart folded.
    assert (np.linalg.norm(hanging - foot, axis=1) > 3).all()
    for flat, folded in ((foot, on - off), (hanging, on + off)):
        block = u.map.block_of(folded)
        assert (block == block[0]).all()
        np.testing.assert_allclose(u.to_folded(flat, block), folded, atol=1e-9)


def test_saved_map_carries_points_by_their_side(slab, tmp_path):
    X, _, _, u = slab
    u.save(tmp_path / "m.npz")
    m = gu.load(tmp_path / "m.npz")
    P = X[::7] + 0.3
    np.testing.assert_array_equal(m.to_flat(P), u.to_flat(P))
    np.testing.assert_array_equal(m.to_folded(u.points[::7]), u.to_folded(u.points[::7]))


def test_row_order_permutes_the_answer(slab):
    X, _, _, u = slab
    order = np.random.default_rng(0).permutation(len(X))
    surface = faulted_slab()[3]
    again = gu.unfold(X[order], faults={"F1": surface})
    np.testing.assert_array_equal(again.points, u.points[order])


def test_a_surface_that_misses_the_body_is_refused():
    X, *_, (V, F) = faulted_slab()
    with pytest.raises(InputError, match=r"fault F1 misses the body: .* blocks away"):
        gu.unfold(X, faults={"F1": (V + np.array([0, 0, 500.0]), F)})


def test_a_surface_that_cuts_nothing_is_refused():
    X, *_, (V, F) = faulted_slab()
    with pytest.raises(InputError, match="fault F1 cut"):
        gu.unfold(X, faults={"F1": (V + np.array([17.5, 0, 0]), F)})


def test_options_are_checked():
    X, *_, surface = faulted_slab()
    with pytest.raises(OptionError, match="outline must be ore or model"):
        gu.unfold(X, faults={"F1": surface}, outline="rim")
    with pytest.raises(OptionError, match="there is no fault 'F2'; given: F1"):
        gu.unfold(X, faults={"F1": surface}, slip_direction={"F2": (90, 45)})
    with pytest.raises(OptionError, match="plunge must be -90 to 90"):
        gu.unfold(X, faults={"F1": surface}, slip_direction={"F1": (90, 145)})
    with pytest.raises(OptionError, match="two faults are called 'F1'"):
        gu.unfold(X, faults=[("F1", *surface), ("F1", *surface)])


def test_fault_blocks_alone_give_surface_and_slip():
    body = gu.simulate_faulted("normal_3T")
    u = gu.unfold(body.folded, fault_blocks=body.fault_block)
    # Blocks of 10 m. Half a block; 0.26 measured, the fault left in moves one part by 16.
    assert gu.aligned_rms(u.points, body.truth) < 0.5 * 10
    assert u.faults["slip"][0] == pytest.approx(160, abs=10)  # one block; 161 in the truth


def test_small_fault_blocks_join_a_neighbour():
    X, _, hanging, _ = faulted_slab()
    ids = np.where(hanging, 1, 0)
    ids[:60] = 2  # fewer than 200 blocks at one end
    u = gu.unfold(X, faults={"F1": faulted_slab()[3]}, fault_blocks=ids)
    assert u.fault_block.max() == 1
    assert any("fault block of 60 blocks" in warning for warning in u.summary()["warnings"])


def test_fault_blocks_are_checked():
    X, *_ = faulted_slab()
    with pytest.raises(InputError, match=r"one value per point, \(2400,\), but has \(5,\)"):
        gu.unfold(X, fault_blocks=np.zeros(5))
    with pytest.raises(InputError, match="400 points have no fault block, the first is row 1"):
        gu.unfold(X, fault_blocks=np.where(np.arange(len(X)) < 400, np.nan, 1.0))
    with pytest.raises(InputError, match="there is one fault block"):
        gu.unfold(X, fault_blocks=np.zeros(len(X)))
    with pytest.raises(InputError, match="at most 50 fault blocks: is it the right column"):
        gu.unfold(X, fault_blocks=np.arange(len(X)))
    with pytest.raises(InputError, match="there is no column 'ids'"):
        gu.unfold(X, fault_blocks="ids")


def test_strike_slip_that_nothing_marks_is_told(slab):
    *_, u = slab
    # The slab's ends lie in one plane on both sides of the fault, as those of a cropped model do.
    assert not u.faults["slip_known"][0]
    assert any("nothing marks the slip along strike" in r.what for r in u.trust.reasons)
    assert u.trust.word in ("fair", "poor")


def test_a_given_direction_settles_the_slip():
    X, *_, surface = faulted_slab()
    u = gu.unfold(X, faults={"F1": surface}, slip_direction={"F1": (90, 45)})
    assert u.faults["resolved_by"][0] == "given"
    assert u.faults["slip_known"][0]


def test_a_surface_a_block_off_is_moved_onto_the_blocks():
    body = gu.simulate_faulted("crossing")
    shifted = {}
    for name, (V, F) in body.surfaces.items():
        n = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]).sum(axis=0)
        shifted[name] = (V + 10 * n / np.linalg.norm(n), F)  # one block of 10 m
    u = gu.unfold(body.folded, faults=shifted)
    assert any("were moved onto the blocks" in w for w in u.summary()["warnings"])
    # Half a block; 0.18 measured, 1.0 if the surfaces stay where they were given.
    assert gu.aligned_rms(u.points, body.truth) < 0.5 * 10
