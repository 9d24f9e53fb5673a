"""Fixtures that several test files of this folder share."""

from __future__ import annotations

import pytest

from geounfold.synthetic import (
    Body,
    simulate,
)
from tests.synthetic.recipes import SMALL


@pytest.fixture(scope="module")
def bodies() -> dict[str, Body]:
    return {name: simulate(name) for name in SMALL}
