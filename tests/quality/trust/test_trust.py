"""Trust: bodies with a fault, a repeat, a branch or a bulge, and sound ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import OptionError, TrustError
from geounfold.geometry.mesh import Floats
from geounfold.quality.trust import Trust, grade, judge, measure_signs, score
from geounfold.quality.trust.judge import CRITERIA, NEVER, Criterion
from geounfold.quality.trust.signs import Signs
from geounfold.synthetic.field_bodies import FIELD_BODIES
from tests.shapes import box, turned

THICKNESS = 6.0


def _grid(low: tuple[float, float, float], high: tuple[float, float, float]) -> Floats:
    axes = [np.arange(a, b) + 0.5 for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _layer(height: Floats, thickness: Floats | float) -> Floats:
    return (height > 0) & (height < thickness)


def faulted(throw: float) -> Floats:
    """Return a gently bent layer, cut by a fault of 60 degrees through the origin, not dragged."""
    P = _grid((-36, -10, -18), (36, 10, 18))
    x, _, z = P.T
    moved = np.where(x + z / np.tan(np.radians(60)) > 0, -throw, 0.0)
    return P[_layer(z - 4 * np.sin(x / 24) - moved, THICKNESS)]


def repeated() -> Floats:
    """Return a layer thrust over itself: both sheets in contact between x = -15 and 15."""
    P = _grid((-44, -10, 0), (44, 10, 14))
    x, _, z = P.T
    lift = THICKNESS * np.clip((30 - x) / 15, 0, 1)
    over = _layer(z - lift, THICKNESS) & (x > -15)
    return P[over | (_layer(z, THICKNESS) & (x < 15))]


def branched() -> Floats:
    """Return a layer and a thinner one that leaves it upwards at 45 degrees."""
    P = _grid((-40, -10, -4), (40, 10, 28))
    x, _, z = P.T
    branch = (np.abs(x - z) < 3.5) & (z > 0)
    return P[(np.abs(z) < 3) | branch]


def swelling() -> tuple[Floats, Floats]:
    """Return a layer whose thickness grows fivefold within ten blocks, and its levels."""
    P = _grid((-28, -18, -8), (28, 18, 8))
    x, _, z = P.T
    half = 1.25 * (1 + 2 * (1 + np.tanh((np.abs(x) - 10) / 4)))
    inside = np.abs(z) < half
    return P[inside], ((z + half) / (2 * half))[inside]


@pytest.mark.parametrize("name", ["sim_case_1", "wedge"])
def test_sound_bodies_are_good(name: str) -> None:
    assert gu.unfold(gu.simulate(name).folded).trust == Trust("good")


@pytest.mark.parametrize("datum", ["mid", "top", "bottom", "proportional"])
def test_fault_is_poor_with_every_datum(datum: str) -> None:
    trust = gu.unfold(faulted(0.8 * THICKNESS), datum=datum, parts="one").trust
    assert trust is not None
    assert trust.word == "poor"
    assert "step" in {c.name for c in CRITERIA for r in trust.reasons if r.do == c.do}


def test_repeat_is_poor_at_the_end_of_one_of_its_sheets() -> None:
    trust = gu.unfold(repeated(), parts="one").trust
    assert trust is not None
    assert trust.word == "poor"
    x = [r.where[0] for r in trust.reasons if r.where is not None]
    # Both sheets end at 15 from the origin, on either side; a block and a half of slip and hull.
    assert any(abs(abs(c) - 15) < 5 for c in x), x
    assert all(r.blocks > 0 for r in trust.reasons if r.where is not None)


@pytest.mark.slow
def test_branch_is_poor_or_refused() -> None:
    try:
        u = gu.unfold(branched(), parts="one")
    except gu.GeounfoldError:
        return
    assert u.trust is not None
    assert u.trust.word == "poor"
    assert any("trust is poor" in warning for warning in u.summary()["warnings"])


def test_bulge_is_right_because_a_second_finish_is_tried() -> None:
    points, level = swelling()
    u = gu.unfold(points)
    rows = u.summary()["method"]["finishes"]
    assert [row["horizons"] for row in rows] == ["close", "bold"]
    assert [row["blocks_lost"] for row in rows] == [0, 0]
    assert rows[0]["word"] == "poor"
    assert u.trust is not None
    assert u.trust.word != "poor"
    # Mean error over both directions of up; 0.022 to 0.03 on bodies of this kind, 0.4 before.
    off = min(np.abs(u.stratigraphic - side).mean() for side in (level, 1 - level))
    assert off < 0.05


# A noisy grade shell: levels are 0.09 off, as the hull that is taken wraps around its bumps.
def test_a_ragged_body_is_poor() -> None:
    trust = gu.unfold(FIELD_BODIES["lens_shell_rough"].blocks(1).points).trust
    assert trust is not None
    assert trust.word == "poor"
    assert trust.reasons[0].what.startswith("the body is ragged: 3.1% of its blocks")


# A noisy indicator of a folded layer: levels are 0.073 off the smooth layer's, its hull's 0.06.
@pytest.mark.slow
def test_rough_top_and_bottom_are_poor() -> None:
    trust = gu.unfold(FIELD_BODIES["indicator_04"].blocks(0).points).trust
    assert trust is not None
    assert trust.word == "poor"
    assert trust.reasons[0].what.startswith("top and bottom are rough")


def test_motion_and_order_of_rows_leave_the_word_and_move_the_place() -> None:
    points = faulted(0.8 * THICKNESS)
    order = np.random.default_rng(3).permutation(len(points))
    shift = np.array([448_000.0, 6_900_000.0, 250.0])
    first = gu.unfold(points, parts="one").trust
    assert first is not None
    for other, offset in ((points[order], np.zeros(3)), (points + shift, shift)):
        trust = gu.unfold(other, parts="one").trust
        assert trust is not None
        assert trust.word == first.word
        for a, b in zip(first.reasons, trust.reasons, strict=True):
            assert (a.what, a.blocks, a.do) == (b.what, b.blocks, b.do)
            assert a.where is not None
            assert b.where is not None
            assert np.allclose(np.array(b.where) - offset, a.where, atol=1e-6)
    other = gu.unfold(turned(points), parts="one").trust
    assert other is not None
    assert other.word == first.word


def test_strict_raises_and_default_warns() -> None:
    points = faulted(0.8 * THICKNESS)
    with pytest.raises(TrustError, match=r"trust is poor: .* around \(.*; leave out --strict"):
        gu.unfold(points, strict=True, parts="one")
    assert TrustError.exit_status == 2
    with pytest.raises(OptionError, match="strict"):
        gu.unfold(points, strict="yes")


def test_strict_on_the_command_line_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points, out = tmp_path / "p.csv", tmp_path / "o.csv"
    columns = pd.DataFrame(faulted(0.8 * THICKNESS), columns=["x", "y", "z"])
    columns.to_csv(points, index=False)
    words = ["unfold", str(points), "-o", str(out), "--parts", "one", "--quiet"]
    assert main([*words, "--strict"]) == 2
    assert capsys.readouterr().err.startswith("geounfold: error: trust is poor: ")
    assert not out.exists()
    assert main(words) == 0
    assert out.exists()


def test_methods_without_a_control_mesh_are_not_judged() -> None:
    u = gu.unfold(box(24, 20, 5), method="stratigraphic", allow_uncertified=True)
    assert u.trust is None
    assert u.summary()["trust"] is None


def test_thesis_is_judged_by_its_own_map() -> None:
    u = gu.unfold(box(24, 20, 5), method="thesis")  # flat: vertical pairs are right
    assert u.trust == Trust("good")


def _signs(**changes: float) -> Signs:
    sound = Signs(
        off=0.0,
        length=0.0,
        ends=0.0,
        level=0.0,
        step=0.0,
        breadth=8.0,
        rough=0.0,
        thickness=5.0,
        lost=0.0,
        places={},
    )
    return replace(sound, **changes)


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_every_criterion_is_fair_and_poor_past_its_limits(criterion: Criterion) -> None:
    step = -1e-6 if criterion.below else 1e-6
    assert grade(_signs(**{criterion.name: criterion.fair})) == "good"
    if criterion.fair != criterion.poor:
        assert grade(_signs(**{criterion.name: criterion.fair + step})) == "fair"
    if criterion.poor != NEVER:
        worse = _signs(**{criterion.name: criterion.poor + step})
        assert grade(worse) == "poor"
        assert score(worse) > score(_signs())


def test_a_sign_that_was_not_measured_speaks_against_nothing() -> None:
    unknown = _signs(level=float("nan"), step=float("nan"))
    assert grade(unknown) == "good"
    assert unknown.figures()["level"] is None


def test_few_blocks_out_of_reach_are_left_empty_and_told() -> None:
    points = gu.simulate("sim_case_1").folded
    body = gu.unfold(points)
    empty = body.carried.without(np.array([3, 7]))
    assert np.isnan(empty.points[[3, 7]]).all()
    assert np.isnan(empty.stratigraphic[[3, 7]]).all()
    assert np.flatnonzero(~empty.placed).tolist() == [3, 7]
    assert body.carried.placed.all()  # the original stays as it was


def test_a_hull_that_the_map_does_not_carry_is_poor() -> None:
    u = gu.unfold(box(24, 20, 5))
    hull = u.fits[0].split.mesh
    signs = measure_signs(hull.with_vertices(hull.V + 1e3), u.map, 1.0)
    assert (signs.lost, grade(signs)) == (1.0, "poor")
    assert signs.figures()["breadth"] is None


def test_reasons_name_the_part_and_come_worst_first() -> None:
    frame = gu.unfold(box(24, 20, 5)).frame
    level, points = np.array([0.2, 0.8, 1.4]), np.arange(9.0).reshape(3, 3)
    trust = judge(
        [_signs(off=0.02), _signs(length=0.5)], ["part 0", "part 1"], frame, points, level
    )
    assert trust.word == "poor"
    assert [r.word for r in trust.reasons] == ["poor", "poor", "fair"]
    # A third of the blocks lies beyond: 11 times the poor limit; the lengths 4 times theirs.
    assert trust.reasons[0].what.startswith("33.3% of the blocks")
    assert (trust.reasons[0].where, trust.reasons[0].blocks) == ((6.0, 7.0, 8.0), 1)
    assert trust.reasons[1].what.startswith("part 1: lengths change")
    assert trust.reasons[2].what.startswith("part 0: 2.0% of the body's top")
