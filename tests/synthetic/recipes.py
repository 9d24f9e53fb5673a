"""Recipes of simulated bodies that several test files share."""

from __future__ import annotations

from geounfold.synthetic import (
    CASES,
)

SMALL = [name for name in CASES if name not in ("large", "thin_wide")]

NOISELESS = [name for name in SMALL if not CASES[name].noise]
