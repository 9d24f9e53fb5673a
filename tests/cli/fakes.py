"""What stands in for the pipeline in tests of the command line."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geounfold.methods import METHODS

assert METHODS  # loaded before a test puts a fake in the place of a module that METHODS needs

SHIFT = np.array([1000.0, 0.0, -5.0])

PLACE = ["unfolded_x", "unfolded_y", "unfolded_z", "stratigraphic"]

RESULTS = [*PLACE, "location", "mesh_distance"]


class FakeMap:
    """A map that shifts points; those with x < 0 lie outside."""

    def carry(self, points: np.ndarray, *, inverse: bool = False) -> SimpleNamespace:
        location = np.where(points[:, 0] < 0, "extrapolated", "inside")
        image = points - SHIFT if inverse else points + SHIFT
        carried = SimpleNamespace(
            points=image,
            stratigraphic=points[:, 2] / 10,
            location=location,
            placed=np.ones(len(points), dtype=bool),
            distance=np.maximum(-points[:, 0], 0),
            unsolved=0,
        )
        carried.part = lambda rows: SimpleNamespace(
            **{k: v[rows] for k, v in vars(carried).items() if isinstance(v, np.ndarray)}
        )
        return carried


class Given(dict[str, Any]):
    """Options as they were given, of the default method."""

    method = "sheet"


class FakeUnfolding(FakeMap):
    """What the pipeline returns, as far as the command line looks at it."""

    def __init__(self, points: np.ndarray, warnings: tuple[str, ...] = ()) -> None:
        carried = self.carry(points)
        self.map, self.carried = self, carried
        self.points, self.location = carried.points, carried.location
        self.stratigraphic = carried.stratigraphic
        self.columns = {"volume_ratio": np.ones(len(points))}
        self.warnings, self.junctions = warnings, ()

    surfaces: dict[str, Any] = {}  # noqa: RUF012 - a fake has none
    uncertainty: Any = None

    def summary(self) -> dict[str, Any]:
        return {"points": len(self.points), "nmd": np.nan, "warnings": list(self.warnings)}

    def save(self, path: Path) -> None:
        np.savez(path, shift=SHIFT)


def replace_module(monkeypatch: pytest.MonkeyPatch, name: str, **members: Any) -> None:
    home, _, leaf = name.rpartition(".")
    parent = import_module(f"geounfold.{home}".rstrip("."))
    fake = SimpleNamespace(**members)
    monkeypatch.setitem(sys.modules, f"geounfold.{name}", fake)
    monkeypatch.setattr(parent, leaf, fake, raising=False)
