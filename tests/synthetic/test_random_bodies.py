"""Random bodies of every family."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.synthetic import (
    FAMILIES,
    random_body,
    random_family,
)
from geounfold.synthetic.random_families import BLOCKS


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
