"""Drill-holes through simulated bodies: collar, survey and assay tables of a field of grades."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import pandas as pd

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats
from geounfold.synthetic.body import Body
from geounfold.synthetic.grades import GradeField
from geounfold.synthetic.profile import require_finite, require_positive

Pattern = Literal["vertical", "inclined", "fanned"]
PATTERNS: tuple[str, ...] = get_args(Pattern)

_FAN = (-30.0, -15.0, 0.0, 15.0, 30.0)  # degrees off the vertical of a fan's holes
_ABOVE = 20.0  # collars above the body, in its blocks' longest sides


@dataclass(frozen=True, eq=False)
class DrilledTables:
    """Three tables as `geounfold.read_drillholes` takes them; unpacks as collar, survey, assay.

    Attributes
    ----------
    collar : DataFrame
        Columns hole, x, y, z, depth.
    survey : DataFrame
        Columns hole, at, azimuth, dip (degrees, positive down).
    assay : DataFrame
        Columns hole, from, to, grade: the intervals whose midpoints lie in the body; with waste
        those outside too, and a column code.
    """

    collar: pd.DataFrame
    survey: pd.DataFrame
    assay: pd.DataFrame

    def __iter__(self) -> Iterator[pd.DataFrame]:
        """Unpack as collar, survey, assay."""
        return iter((self.collar, self.survey, self.assay))


def drill(  # 9 arguments: a public name; six of them are choices by keyword
    body: Body,
    field: GradeField,
    spacing: float,
    *,
    pattern: Pattern = "vertical",
    interval: float = 2.0,
    bearing: float = 90.0,
    dip: float = 60.0,
    seed: int = 0,
    waste: bool = False,
) -> DrilledTables:
    """Drill straight holes through a folded body.

    Parameters
    ----------
    body : Body
        The body to drill.
    field : GradeField
        Its grades.
    spacing : float
        Distance between collars on a square grid, in the body's unit; between the collars of fans
        it is twice that.
    pattern : {"vertical", "inclined", "fanned"}
        Direction of the holes. A fan has five holes from one collar, in the vertical plane of the
        bearing, up to 30 degrees off the vertical.
    interval : float
        Length of the assayed intervals, in the body's unit; each has the grade at its midpoint.
    bearing : float
        Direction of inclined holes and of fans, degrees clockwise from +y.
    dip : float
        Inclination of inclined holes, degrees below the horizontal, 10 to 90.
    seed : int
        Seed of the grid's offset and of the collars' scatter (a tenth of the spacing).
    waste : bool
        Whether the tables have the holes that miss the body too, and all intervals near it, with a
        column code: ORE or WASTE. Waste has no grade.

    Returns
    -------
    DrilledTables
        The holes that hit the body; with `waste` all holes whose collars lie over it.

    Raises
    ------
    OptionError
        A value is outside its valid ones, or all holes miss the body.
    """
    require_positive("spacing", spacing)
    require_positive("interval", interval)
    require_finite("bearing", bearing)
    if pattern not in PATTERNS:
        raise OptionError(f"pattern {pattern!r} is not one of: {', '.join(PATTERNS)}")
    if not 10 <= dip <= 90:
        raise OptionError(f"the dip must lie from 10 to 90 degrees, not at {dip!r}")
    start, azimuth, angle = _holes(body, spacing, pattern, bearing, dip, seed)
    if not len(start):
        raise OptionError("all holes miss the body; take a closer spacing")
    low = body.folded.min(axis=0)
    top = float(start[0, 2])
    depth = (top - low[2] + 2 * body.steps.max()) / np.sin(np.radians(angle))
    hole, begin, truth, inside = _intervals(body, start, azimuth, angle, depth, interval)
    if not inside.any():
        raise OptionError("all holes miss the body; take a closer spacing")
    grade = np.full(len(hole), np.nan)
    truth = truth[inside]
    low_w, high_w = body.sheet.heights(truth[:, 0], truth[:, 1])
    grade[inside] = field.at(truth, (truth[:, 2] - low_w) / np.maximum(high_w - low_w, 1e-300))
    kept = inside | waste
    hole, begin, grade, inside = hole[kept], begin[kept], grade[kept], inside[kept]
    hit = np.unique(hole)
    names = np.array([f"{pattern[0].upper()}{k:04d}" for k in range(len(start))], dtype=object)
    collar = pd.DataFrame(
        {"hole": names[hit], **dict(zip("xyz", start[hit].T, strict=True)), "depth": depth[hit]}
    )
    stations = np.repeat(hit, 2)
    survey = pd.DataFrame(
        {
            "hole": names[stations],
            "at": np.where(np.arange(len(stations)) % 2, depth[stations], 0.0),
            "azimuth": azimuth[stations] % 360,
            "dip": angle[stations],
        }
    )
    assay = pd.DataFrame(
        {"hole": names[hole], "from": begin, "to": begin + interval, "grade": grade}
    )
    if waste:
        assay["code"] = np.where(inside, "ORE", "WASTE")
    return DrilledTables(collar, survey, assay)


def _holes(
    body: Body, spacing: float, pattern: str, bearing: float, dip: float, seed: int
) -> tuple[Floats, Floats, Floats]:
    """Return collars (h, 3), azimuths and dips of all holes that might hit."""
    rng = np.random.default_rng(seed)
    low, high = body.folded.min(axis=0), body.folded.max(axis=0)
    top = float(high[2] + _ABOVE * body.steps.max())
    step = 2 * spacing if pattern == "fanned" else spacing
    fall = top - low[2]
    lean = {"vertical": 0.0, "fanned": np.tan(np.radians(30.0)) * fall}
    margin = lean.get(pattern, fall / np.tan(np.radians(dip)))
    sides = [
        np.arange(a - margin + step * rng.random(), b + margin, step)
        for a, b in zip(low[:2], high[:2], strict=True)
    ]
    x, y = (g.ravel() for g in np.meshgrid(*sides, indexing="ij"))
    x = x + 0.1 * spacing * rng.uniform(-1, 1, len(x))
    y = y + 0.1 * spacing * rng.uniform(-1, 1, len(y))
    collars = np.column_stack([x, y, np.full(len(x), top)])
    if pattern != "fanned":
        angle = 90.0 if pattern == "vertical" else dip
        n = len(collars)
        return collars, np.full(n, bearing), np.full(n, angle)
    fan = np.tile(_FAN, len(collars))
    return (
        np.repeat(collars, len(_FAN), axis=0),
        np.where(fan < 0, bearing + 180.0, bearing),
        90.0 - np.abs(fan),
    )


def _intervals(
    body: Body, start: Floats, azimuth: Floats, dip: Floats, depth: Floats, interval: float
) -> tuple[np.ndarray, Floats, Floats, np.ndarray]:
    """Return hole, start, truth coordinates of all intervals, and which lie in the body."""
    a, d = np.radians(azimuth), np.radians(dip)
    way = np.column_stack([np.sin(a) * np.cos(d), np.cos(a) * np.cos(d), -np.sin(d)])
    count = np.floor(depth / interval).astype(np.int64)
    hole = np.repeat(np.arange(len(start)), count)
    number = np.arange(len(hole)) - np.repeat(np.cumsum(count) - count, count)
    begin = interval * number.astype(np.float64)
    middle = start[hole] + (begin + 0.5 * interval)[:, None] * way[hole]
    low, high = body.folded.min(axis=0) - body.steps, body.folded.max(axis=0) + body.steps
    near = ((middle >= low) & (middle <= high)).all(axis=1)
    hole, begin, middle = hole[near], begin[near], middle[near]
    truth, reached = body.sheet.unfold(middle)
    return hole, begin, truth, reached & body.sheet.inside(truth)
