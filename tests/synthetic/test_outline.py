"""Outlines and oblique cuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geounfold.synthetic import (
    CASES,
    Ellipse,
    Embayment,
    Gap,
    Hole,
    Neck,
    ObliqueCut,
    simulate,
)

GOOD = CASES["slab"]


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
