"""What tests of whole processes share, on every system."""

from __future__ import annotations

import os
from pathlib import Path

from tests.places import ROOT

IMITATION = ROOT / "tests" / "imitation"

LONG = 120.0  # seconds after which a test gives up on a process; nothing is timed


def with_fault(script: Path | None = None, **more: str) -> dict[str, str]:
    """Return an environment in which each new Python runs a script first."""
    if script is not None:
        more["GEOUNFOLD_FAULT"] = str(script)
    path = [str(IMITATION), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path), **more}


def state_of(folder: Path) -> dict[str, bytes | None]:
    """Return the content of every file under a folder, and None for each folder."""
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None
        for p in folder.rglob("*")
    }
