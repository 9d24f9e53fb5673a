"""Desurveying: circles, a published course, seams, rows in any order."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.drillholes import read_drillholes
from geounfold.drillholes.desurvey import desurvey, directions, dogleg, ratio_factor
from geounfold.errors import InputError, OptionError
from tests.drillholes.holes import one_hole, random_tables


def test_a_circular_hole_is_exact() -> None:
    # A hole along a circle of radius 200 in the plane of azimuth 30: its inclination is s / 200,
    # so it lies at 200 (1 - cos) sideways and 200 sin down.  Stations 40, 110 and 90 apart.
    radius, azimuth = 200.0, np.radians(30.0)
    depth = np.array([0.0, 40.0, 150.0, 240.0])
    tangent = directions(np.full(4, 30.0), 90.0 - np.degrees(depth / radius))
    collar = np.array([[5e5, 6e6, 300.0]])
    paths = desurvey(collar, np.zeros(4, dtype=np.int64), depth, tangent)
    asked = np.linspace(0.0, 240.0, 49)
    position, surveyed = paths.at(np.zeros(49, dtype=np.int64), asked)
    sideways = radius * (1 - np.cos(asked / radius))
    truth = collar + np.column_stack(
        [sideways * np.sin(azimuth), sideways * np.cos(azimuth), -radius * np.sin(asked / radius)]
    )
    # Neighbouring doubles lie 9.3e-10 apart at 6e6; three roundings are the rest.
    np.testing.assert_allclose(position, truth, rtol=0, atol=3e-9)
    assert surveyed.all()


def test_a_published_course() -> None:
    # 3500 ft at 15 degrees from the vertical, azimuth 20, to 3600 ft at 25, 45: the textbooks'
    # example of minimum curvature has north 27.22, east 19.45 and depth 94.01 ft.
    tangent = directions(np.array([20.0, 45.0]), np.array([75.0, 65.0]))
    paths = desurvey(
        np.zeros((1, 3)), np.zeros(2, dtype=np.int64), np.array([3500.0, 3600.0]), tangent
    )
    np.testing.assert_allclose(np.diff(paths.offset, axis=0)[0], [19.45, 27.22, -94.01], atol=5e-3)


def test_ratio_factor_has_no_seam() -> None:
    # Both forms of the factor agree where one takes over (1e-4): a step there would be 1e-9.
    beta = np.array([0.99999e-4, 1.00001e-4])
    assert np.diff(ratio_factor(beta))[0] == pytest.approx(2e-9 * 1e-4 / 6, abs=5e-16)
    assert ratio_factor(np.array([0.0]))[0] == 1.0


def test_dogleg_is_accurate_at_its_ends() -> None:
    # arccos of the product would round 1e-9 to 0.
    t = np.array([[0.0, 0.0, -1.0]])
    small = np.array([[np.sin(1e-9), 0.0, -np.cos(1e-9)]])
    assert dogleg(t, small)[0] == pytest.approx(1e-9, rel=1e-9)
    assert dogleg(t, -t)[0] == pytest.approx(np.pi, rel=1e-15)


def test_a_station_read_off_the_path_changes_nothing() -> None:
    tangent = directions(np.array([10.0, 80.0]), np.array([80.0, 30.0]))
    hole = np.zeros(2, dtype=np.int64)
    coarse = desurvey(np.zeros((1, 3)), hole, np.array([0.0, 100.0]), tangent)
    ahead, _ = coarse.at(np.array([0, 0]), np.array([40.0 - 1e-3, 40.0 + 1e-3]))
    middle = np.diff(ahead, axis=0) / np.linalg.norm(np.diff(ahead, axis=0))
    fine = desurvey(
        np.zeros((1, 3)),
        np.zeros(3, dtype=np.int64),
        np.array([0.0, 40.0, 100.0]),
        np.concatenate([tangent[:1], middle, tangent[1:]]),
    )
    asked = np.linspace(0.0, 120.0, 25)
    whole = np.zeros(25, dtype=np.int64)
    # The middle direction comes from a difference over 2e-3: 1e-10 over 100.
    np.testing.assert_allclose(fine.at(whole, asked)[0], coarse.at(whole, asked)[0], atol=1e-8)


def test_beyond_the_surveys_straight_on_and_marked() -> None:
    # First station at 10, dipping 45 degrees east all along: x is depth over the root of two.
    tables = one_hole(
        survey=[("A", 10.0, 90.0, 45.0), ("A", 20.0, 90.0, 45.0)],
        assay=[("A", 0.0, 4.0, 1.0), ("A", 14.0, 16.0, 1.0), ("A", 38.0, 42.0, 1.0)],
    )
    samples = read_drillholes(*tables, dip_positive_down=True).samples()
    np.testing.assert_allclose(samples["x"], np.array([2.0, 15.0, 40.0]) / np.sqrt(2), rtol=1e-14)
    assert samples["position"].tolist() == ["extrapolated", "surveyed", "extrapolated"]
    notes = [f for f in read_drillholes(*tables).findings if f.check.startswith("hole runs below")]
    assert [(f.hole, f.row, f.detail) for f in notes] == [("A", 2, "20 to 42")]


def test_rows_in_another_order_give_the_same_bits() -> None:
    tables = random_tables()
    mixed = [t.sample(frac=1.0, random_state=4) for t in tables]
    mixed[0] = tables[0]  # holes come in the collar table's order
    for length in (None, 10.0):
        pd.testing.assert_frame_equal(
            read_drillholes(*tables).samples(length),
            read_drillholes(*mixed).samples(length),
            check_exact=True,
        )


def test_other_holes_change_no_bit_of_a_hole() -> None:
    tables = random_tables()
    alone = read_drillholes(*(t[t["BHID"] == "H4"] for t in tables)).samples()
    every = read_drillholes(*tables).samples()
    pd.testing.assert_frame_equal(
        alone, every[every["hole"] == "H4"].reset_index(drop=True), check_exact=True
    )


def test_turned_by_azimuth_and_scaled() -> None:
    # 25 degrees more on every azimuth turns the field clockwise by 25 degrees about z.
    collar, survey, assay = random_tables()
    plain = read_drillholes(collar, survey, assay).samples()[["x", "y", "z"]].to_numpy()
    c, s = np.cos(np.radians(25.0)), np.sin(np.radians(25.0))
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    xyz = collar[["X", "Y", "Z"]].to_numpy() @ turn.T * 3.0
    collar = collar.assign(X=xyz[:, 0], Y=xyz[:, 1], Z=xyz[:, 2])
    survey = survey.assign(AZ=(survey["AZ"] + 25.0) % 360.0, AT=survey["AT"] * 3.0)
    assay = assay.assign(FROM=assay["FROM"] * 3.0, TO=assay["TO"] * 3.0)
    moved = read_drillholes(collar, survey, assay).samples()[["x", "y", "z"]].to_numpy()
    # 3000 across: 1e-12 of it.
    np.testing.assert_allclose(moved, 3.0 * plain @ turn.T, rtol=0, atol=3e-9)


def test_traces_have_every_station_and_the_end() -> None:
    tables = one_hole(survey=[("A", 0.0, 90.0, 60.0), ("A", 11.0, 90.0, 50.0)])
    holes = read_drillholes(*tables)
    traces = holes.traces(10.0)
    assert traces["depth"].tolist() == [0.0, 10.0, 11.0, 20.0, 30.0]
    assert traces["position"].tolist() == ["surveyed"] * 3 + ["extrapolated"] * 2
    np.testing.assert_array_equal(traces[["x", "y", "z"]], holes.at("A", traces["depth"]))
    with pytest.raises(OptionError, match="step along traces"):
        holes.traces(0.0)
    with pytest.raises(InputError, match="no hole 'B'"):
        holes.at("B", np.zeros(1))
