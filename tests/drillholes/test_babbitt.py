"""The Babbitt drill holes, read, placed and composited."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from geounfold.drillholes import CompositeOptions, DrillHoles, read_drillholes
from geounfold.drillholes.composite import composite
from geounfold.drillholes.desurvey import directions
from tests.drillholes.holes import found
from tests.places import shared


@pytest.fixture(scope="module")
def babbitt() -> DrillHoles:
    folder = shared("data", "babbitt")
    return read_drillholes(
        *(folder / f"{kind}_BABBITT.csv" for kind in ("collar", "survey", "assay"))
    )


def test_babbitt_desurveys_with_its_bad_rows_named(babbitt: DrillHoles) -> None:
    # What is wrong with the survey table by another reading of it: depths of 90000, in 70 rows.
    with shared("data", "babbitt", "survey_BABBITT.csv").open() as stream:
        survey = list(csv.DictReader(stream))
    bad = {(r["BHID"], k + 1) for k, r in enumerate(survey) if float(r["AT"]) == 90000}
    assert len(bad) == 70
    assert found(babbitt) == {("survey far below the hole", *row) for row in bad}
    # SOURCE.md: 399 holes, 35,616 intervals.
    assert len(babbitt) == 399
    samples = babbitt.samples()
    assert len(samples) == 35616
    assert np.isfinite(samples[["x", "y", "z"]]).all(axis=None)
    assert babbitt.positive_down
    assert babbitt.facts()["dip_convention"] == "detected"


def test_babbitt_lies_where_it_was_drilled(babbitt: DrillHoles) -> None:
    samples, collars = babbitt.samples(), babbitt.collars
    # Straight down at 34873, and a straight hole at 60 degrees towards 327 at B1-001.
    for name, azimuth, dip in (("34873", 0.0, 90.0), ("B1-001", 327.0, 60.0)):
        of_hole = samples[samples["hole"] == name]
        middle = 0.5 * (of_hole["from"] + of_hole["to"]).to_numpy()
        straight = directions(np.array([azimuth]), np.array([dip]))
        collar = collars.points[babbitt.names.index(name)]
        truth = collar + middle[:, None] * straight
        np.testing.assert_allclose(of_hole[["x", "y", "z"]], truth, rtol=0, atol=1e-8)
    # No chord of a path is longer than the way along it.
    traces = babbitt.traces(25.0)
    same = traces["hole"].to_numpy()[1:] == traces["hole"].to_numpy()[:-1]
    chord = np.linalg.norm(np.diff(traces[["x", "y", "z"]].to_numpy(), axis=0), axis=1)[same]
    way = np.diff(traces["depth"])[same]
    assert (chord <= way * (1 + 1e-6) + 1e-9).all()  # coordinates of 2e6 round at 5e-10
    assert (chord >= 0.98 * way).all()  # a hole that drills do: 40 degrees in 25 ft are 0.98


def test_babbitt_composites_keep_the_metal(babbitt: DrillHoles) -> None:
    plain, made = babbitt.samples(), babbitt.samples(20.0, min_coverage=0.0)
    metal = np.nansum((plain["to"] - plain["from"]) * plain["CU"])
    # Of partly assayed composites the mean is over the assayed part, so only whole ones compare.
    options = CompositeOptions(length=20.0, min_coverage=0.0)
    assayed = ~np.isnan(babbitt.grades["CU"])
    iv = babbitt.intervals.kept(assayed)
    part = composite(
        iv.hole,
        iv.start,
        iv.end,
        babbitt.grades["CU"][assayed, None],
        np.empty((assayed.sum(), 0), dtype=object),
        options,
    )
    assert (part.covered * part.grades[:, 0]).sum() == pytest.approx(metal, rel=1e-12)
    assert made["CU"].max() <= plain["CU"].max()
