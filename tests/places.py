"""Folders that tests read: the checkout, its own data, and the shared data beside it."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests"
SHARED = Path(os.environ.get("GEOUNFOLD_SHARED") or ROOT.parent / "shared")


def shared(*parts: str) -> Path:
    """Return a file or folder of the shared data; skip the test if it is absent.

    The data lie in ../shared, or in the folder that GEOUNFOLD_SHARED names.
    """
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"the shared data are absent (GEOUNFOLD_SHARED): {'/'.join(parts)}")
    return path


def acceptance(name: str) -> Path:
    """Return the table of an acceptance body; skip the test if it is absent."""
    return shared("acceptance", "cases", f"{name}.csv")
