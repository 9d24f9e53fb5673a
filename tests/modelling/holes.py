"""Holes through simulated bodies, with waste around them."""

from __future__ import annotations

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.synthetic import Body, DrilledTables, GradeField, drill

FIELD = GradeField("spherical", (200.0, 200.0, 25.0), seed=1, mean=1.0, deviation=0.3)


def drilled(name: str, spacing: float, pattern: str = "vertical") -> tuple[Body, DrilledTables]:
    body = gu.simulate(name)
    return body, drill(body, FIELD, spacing, pattern=pattern, seed=3, waste=True)  # type: ignore[arg-type]


def shares(body: Body, made: gu.HolesBody) -> tuple[float, float, float]:
    """Return the error of volume, the share of blocks in the true body, and of it that is met."""
    truth, there = body.sheet.unfold(made.points)
    right = there & body.sheet.inside(truth)
    cells = set(map(tuple, np.floor(made.points / made.block_size).astype(np.int64).tolist()))
    own = np.floor(body.folded / made.block_size).astype(np.int64).tolist()
    met = np.mean([tuple(cell) in cells for cell in own])
    true = float(len(body.folded) * np.prod(body.steps))
    return made.volume / true - 1, float(right.mean()), float(met)


def plate(
    count: int = 4, *, dip: float = 0.0, ore: tuple[float, float] = (20.0, 40.0)
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Return holes on a grid of 50, straight down to 100, through a plate that dips to +x."""
    k = np.arange(count) * 50.0
    x, y = (g.ravel() for g in np.meshgrid(k, k, indexing="ij"))
    names = [f"H{i:02d}" for i in range(len(x))]
    deeper = x * np.tan(np.radians(dip))
    collar = pd.DataFrame({"hole": names, "x": x, "y": y, "z": 0.0, "depth": 400.0})
    survey = pd.DataFrame({"hole": names, "at": 0.0, "azimuth": 0.0, "dip": 90.0})
    top, low = ore[0] + deeper, ore[1] + deeper
    rows = [
        pd.DataFrame({"hole": names, "from": a, "to": b, "lith": code, "CU": grade})
        for a, b, code, grade in (
            (np.zeros(len(x)), top, "WASTE", 0.1),
            (top, low, "ORE", 1.0),
            (low, np.full(len(x), 400.0), "WASTE", 0.1),
        )
    ]
    return collar, survey, pd.concat(rows, ignore_index=True)
