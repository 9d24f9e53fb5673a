"""Fixtures that several test files of this folder share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.fakes import FakeMap, FakeUnfolding, Given, replace_module


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Replace the pipeline by a shift; return what it is called with."""
    made: list[dict[str, Any]] = []

    def unfold(points: np.ndarray, options: Any, *, progress: Any, **surfaces: Any) -> Any:
        progress("hull")
        made.append({"points": points, "options": options, **surfaces})
        return FakeUnfolding(points, ("8 blocks lie outside",))

    replace_module(monkeypatch, "unfolding.run", unfold=unfold)
    replace_module(monkeypatch, "unfolding.options", UnfoldOptions=Given)
    replace_module(monkeypatch, "mapping.mesh_map", load=lambda _: FakeMap())
    return made


@pytest.fixture
def points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "p.csv"
    path.write_text("id,XC,YC,ZC,location\n007,1.50,2,3,pit\n,-4,5,6,\n9,7,8,9,face\n")
    return path
