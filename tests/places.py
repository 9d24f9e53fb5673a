"""Folders that tests read: the checkout, its own data, and the shared data beside it."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests"
SHARED = ROOT.parent / "shared"
ACCEPTANCE = SHARED / "acceptance" / "cases"
SHARED_DATA = SHARED / "data"
