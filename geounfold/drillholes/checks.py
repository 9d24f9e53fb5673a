"""Checks of the tables' rows: each unusable row becomes a finding with the action taken.

No value is guessed. Each check states whether it leaves rows out or cuts them. A hole that has
assays and cannot be placed is an error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from geounfold.drillholes.desurvey import directions, dogleg
from geounfold.drillholes.findings import ERROR, NOTE, WARNING, Log, Severity
from geounfold.drillholes.tables import HoleTable
from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.coordinate_columns import coded
from geounfold.io.selection import nearest_name

LEFT_OUT = "left out"

_FAR = 3.0  # deepest assays of a hole; a survey below that and below all assays is left out
_SLACK = 1.05  # depths of the collar table; a survey below that is left out
_ROUNDING = 1e-6  # differences below this share of a depth are ignored as rounding
_SHARP = 90.0  # degrees between two stations; no drill turns by more
_REVERSED = 179.0  # degrees between two stations; beyond it the arc is undefined


@dataclass(frozen=True, eq=False)
class Collars:
    """Collars of the holes, one row per hole.

    Attributes
    ----------
    source : str
        Name of the collar table.
    names : (h,) object
        Names of the holes.
    points : (h, 3) float
        Coordinates of the collars, in the table's unit.
    depth : (h,) float
        Length of the hole; NaN if not given.
    azimuth, dip : (h,) float
        Direction at the collar, degrees as in the table; NaN if not given.
    row : (h,) int
        Data row of the collar table, from 1.
    """

    source: str
    names: np.ndarray
    points: Floats
    depth: Floats
    azimuth: Floats
    dip: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.names)

    def find(self, names: np.ndarray) -> Ints:
        """Return the index of the hole of each name, (n,); -1 if no hole has the name."""
        return np.asarray(pd.Index(self.names).get_indexer(pd.Index(names)), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Stations:
    """Survey stations, sorted by hole and depth.

    Attributes
    ----------
    hole : (s,) int
        Index of the hole among the collars.
    depth : (s,) float
        Length along the hole.
    azimuth, dip : (s,) float
        Degrees; dip as in the table.
    row : (s,) int
        Data row of the survey table, from 1; 0 if the direction is that of the collar table.
    """

    hole: Ints
    depth: Floats
    azimuth: Floats
    dip: Floats
    row: Ints

    def kept(self, keep: Bools) -> Stations:
        """Return the stations to keep."""
        return Stations(
            self.hole[keep], self.depth[keep], self.azimuth[keep], self.dip[keep], self.row[keep]
        )


@dataclass(frozen=True, eq=False)
class Intervals:
    """Assayed intervals, sorted by hole and depth, that do not overlap.

    Attributes
    ----------
    hole : (n,) int
        Index of the hole among the collars.
    start, end : (n,) float
        Lengths along the hole.
    position : (n,) int
        Index of each interval in the table as read, from 0.
    """

    hole: Ints
    start: Floats
    end: Floats
    position: Ints

    def kept(self, keep: Bools) -> Intervals:
        """Return the intervals to keep."""
        return Intervals(self.hole[keep], self.start[keep], self.end[keep], self.position[keep])


def checked_collars(table: HoleTable, assayed: set[str], log: Log) -> Collars:
    """Return one collar for each hole that has coordinates.

    If a name is repeated with the same coordinates, its first row is kept. If the coordinates
    differ, the hole's position is unknown and none of its rows is kept.
    """
    points = np.column_stack([table.numbers[axis] for axis in "xyz"])
    whole = np.isfinite(points).all(axis=1)
    for i in np.flatnonzero(~whole):
        _add(log, table, i, "collar without coordinates", _grave(table.hole[i], assayed))
    for axis, values in zip("xyz", points.T, strict=True):
        for i in np.flatnonzero(coded(values)):
            what = f"{axis} of the collar far from all others, perhaps a code for a missing value"
            _add(log, table, i, what, WARNING, "kept", f"{values[i]:g}")
    frame = pd.DataFrame(points, columns=list("xyz")).assign(hole=table.hole)[whole]
    again = frame["hole"].duplicated()
    places = frame.drop_duplicates().groupby("hole", sort=False)["x"].size()
    moved = frame["hole"].isin(places.index[places > 1])
    for i in frame.index[again & ~moved]:
        _add(log, table, i, "duplicate collar with the same coordinates", WARNING)
    for i in frame.index[again & moved]:
        grave = _grave(table.hole[i], assayed)
        _add(log, table, i, "duplicate collar with other coordinates", grave, "hole left out")
    at = frame.index[~again & ~moved].to_numpy()
    if not len(at):
        raise InputError(f"{table.source}: no hole has one collar with coordinates")
    for i in at[frame.loc[at, ["x", "y", "z"]].duplicated().to_numpy()]:
        _add(log, table, i, "collar in the same place as another hole's", NOTE, "both kept")
    missing = np.full(len(table), np.nan)
    depth = table.numbers.get("depth", missing)[at].copy()
    for i in at[depth <= 0]:
        text = f"{table.numbers['depth'][i]:g}"
        _add(log, table, i, "hole of no depth", WARNING, "depth taken as missing", text)
    depth[depth <= 0] = np.nan
    azimuth, dip = (table.numbers.get(n, missing)[at] for n in ("azimuth", "dip"))
    return Collars(table.source, table.hole[at], points[at], depth, azimuth, dip, table.row[at])


def checked_intervals(table: HoleTable, log: Log) -> tuple[Bools, np.ndarray]:
    """Return which intervals have a length, and the names of the holes with such intervals."""
    start, end = table.numbers["from"], table.numbers["to"]
    good = np.ones(len(table), dtype=bool)
    for check, bad in (
        ("interval without from or to", ~(np.isfinite(start) & np.isfinite(end))),
        ("interval above the collar", start < 0),
        ("reversed interval", start > end),
        ("interval of no length", start == end),
    ):
        for i in np.flatnonzero(bad & good):
            _add(log, table, i, check, WARNING, detail=f"{start[i]:g} to {end[i]:g}")
        good &= ~bad
    if not good.any():
        raise InputError(f"{table.source}: no row is an interval with a length")
    return good, np.unique(table.hole[good].astype(str)).astype(object)


def placed_intervals(table: HoleTable, good: Bools, collars: Collars, log: Log) -> Intervals:
    """Return the intervals of holes with a collar, cut so that none overlaps another.

    Of two intervals that begin at the same depth the shorter is kept; of equal ones, the first
    row. An interval that overlaps the next is cut at the start of the next. An interval that
    runs below the hole's depth in the collar table is cut at that depth.
    """
    hole = collars.find(table.hole)
    named = dict.fromkeys(table.hole[good & (hole < 0)])
    for name in named:
        rows = np.flatnonzero(good & (table.hole == name))
        log.add(
            table.source, "assays of a hole without a usable collar", ERROR, "hole left out",
            hole=str(name), row=int(table.row[rows[0]]),
            detail=f"{len(rows)} intervals{_nearest(str(name), collars)}",
        )  # fmt: skip
    at = np.flatnonzero(good & (hole >= 0))
    start, end = table.numbers["from"], table.numbers["to"]
    at = at[np.lexsort((at, end[at], start[at], hole[at]))]
    below = start[at] >= collars.depth[hole[at]] * (1 - _ROUNDING)
    for i in at[below]:
        text = f"{start[i]:g} to {end[i]:g}, hole {collars.depth[hole[i]]:g}"
        _add(log, table, i, "interval below the hole's depth", WARNING, detail=text)
    at = at[~below]
    if not len(at):
        return Intervals(at, start[at], end[at], at)
    same = np.r_[False, (hole[at[1:]] == hole[at[:-1]]) & (start[at[1:]] == start[at[:-1]])]
    for i, kept in zip(at[same], at[np.flatnonzero(same) - 1], strict=True):
        text = f"{start[i]:g} to {end[i]:g}, as data row {table.row[kept]}"
        _add(log, table, i, "interval that begins where another does", WARNING, detail=text)
    at = at[~same]
    cut = end[at].copy()
    following = np.r_[np.where(hole[at[1:]] == hole[at[:-1]], start[at[1:]], np.inf), np.inf]
    for check, limit, action in (
        ("overlapping intervals", following, "cut where the next begins"),
        ("interval below the hole's depth", collars.depth[hole[at]], "cut there"),
    ):
        over = cut > limit
        for k in np.flatnonzero(cut > limit + _ROUNDING * np.abs(cut)):
            text = f"{start[at[k]]:g} to {end[at[k]]:g}, next at {limit[k]:g}"
            if limit is not following:
                text = f"{start[at[k]]:g} to {end[at[k]]:g}, hole {limit[k]:g}"
            _add(log, table, at[k], check, WARNING, action, text)
        cut = np.where(over, limit, cut)
    return Intervals(hole[at], start[at], cut, at)


def _nearest(name: str, collars: Collars) -> str:
    """Return words for the collar's name most like another; empty if none is alike."""
    near = nearest_name(name, collars.names)
    return "" if near is None else f"; the nearest collar is '{near}'"


def checked_stations(
    table: HoleTable, collars: Collars, intervals: Intervals, assayed: set[str], log: Log
) -> Stations:
    """Return the stations that can be used, with the collar table's directions where needed.

    A station is left out if a value is missing or not a valid angle, or if its depth is negative,
    far below the hole or repeated. Far below the hole means beyond 1.05 times the collar table's
    depth. If that depth is not given, it means beyond 3 times the hole's deepest assay and
    beyond every assay of all holes. Of two stations at one depth the first row is kept.
    """
    hole = collars.find(table.hole)
    depth, azimuth, dip = (table.numbers[n].copy() for n in ("at", "azimuth", "dip"))
    azimuth[np.isnan(azimuth) & (np.abs(dip) == 90.0)] = 0.0  # a vertical hole needs no azimuth
    good = np.ones(len(table), dtype=bool)
    reach = _reach(hole, collars, intervals)
    missing = ~(np.isfinite(depth) & np.isfinite(azimuth) & np.isfinite(dip))
    for check, bad, values, unit in (
        ("survey of a hole without a usable collar", hole < 0, depth, ""),
        ("survey without depth, azimuth or dip", missing, depth, ""),
        ("survey above the collar", depth < 0, depth, ""),
        ("survey far below the hole", depth > reach, depth, ""),
        ("dip beyond 90 degrees", (dip > 90) | (dip < -90), dip, " degrees"),
        ("azimuth beyond 360 degrees", (azimuth > 360) | (azimuth < -360), azimuth, " degrees"),
    ):
        for i in np.flatnonzero(bad & good):
            _add(log, table, i, check, WARNING, detail=f"{values[i]:g}{unit}")
        good &= ~bad
    at = np.flatnonzero(good)
    at = at[np.lexsort((at, depth[at], hole[at]))]
    twice = np.zeros(len(at), dtype=bool)
    twice[1:] = (hole[at[1:]] == hole[at[:-1]]) & (depth[at[1:]] == depth[at[:-1]])
    for i in at[twice]:
        _add(log, table, i, "two surveys at one depth", WARNING, detail=f"{depth[i]:g}")
    at = at[~twice]
    stations = Stations(hole[at], depth[at], azimuth[at], dip[at], table.row[at])
    return _with_collar_directions(stations, collars, assayed, log)


def _reach(hole: Ints, collars: Collars, intervals: Intervals) -> Floats:
    """Return for each survey row the greatest depth that its hole can have."""
    if not len(intervals.hole):
        return np.full(len(hole), np.inf)
    deepest = np.zeros(len(collars))
    np.maximum.at(deepest, intervals.hole, intervals.end)
    everywhere = deepest.max()
    own = np.where(deepest > 0, np.maximum(_FAR * deepest, everywhere), _FAR * everywhere)
    limit = np.where(np.isfinite(collars.depth), _SLACK * collars.depth, own)
    return np.where(hole >= 0, limit[hole], np.inf)


def _with_collar_directions(
    stations: Stations, collars: Collars, assayed: set[str], log: Log
) -> Stations:
    """Return the stations, plus the collar table's direction for holes without a survey.

    A hole without either cannot be placed and becomes a finding.
    """
    bare = np.setdiff1d(np.arange(len(collars)), stations.hole)
    azimuth = np.where(np.abs(collars.dip) == 90.0, 0.0, collars.azimuth)
    turned = np.abs(azimuth) > 360.0
    known = np.isfinite(azimuth) & ~turned & (np.abs(collars.dip) <= 90.0)
    for k in bare:
        given = bool(known[k])
        if turned[k]:
            log.add(
                collars.source, "azimuth beyond 360 degrees", WARNING, "taken as missing",
                hole=str(collars.names[k]), row=int(collars.row[k]),
                detail=f"{azimuth[k]:g} degrees",
            )  # fmt: skip
        log.add(
            collars.source,
            "unsurveyed hole",
            WARNING if given else _grave(collars.names[k], assayed),
            "the collar table's direction used along the whole hole" if given else "hole left out",
            hole=str(collars.names[k]),
            row=int(collars.row[k]),
        )
    taken = bare[known[bare]]
    hole = np.r_[stations.hole, taken]
    depth = np.r_[stations.depth, np.zeros(len(taken))]
    order = np.lexsort((depth, hole))
    return Stations(
        hole[order],
        depth[order],
        np.r_[stations.azimuth, azimuth[taken]][order],
        np.r_[stations.dip, collars.dip[taken]][order],
        np.r_[stations.row, np.zeros(len(taken), dtype=np.int64)][order],
    )


def dip_positive_down(dip: Floats, stated: bool | None, source: str, log: Log) -> bool:
    """Return whether positive dips point down, as stated or from the signs of the dips.

    Most holes are drilled downwards, so dips of one sign imply the convention. Dips of both signs
    do not.

    Parameters
    ----------
    dip : (s,) float
        Degrees, as in the tables.
    stated : bool, optional
        Convention that the user states.
    source : str
        Name of the survey table.
    log : Log
        Collects the findings.

    Raises
    ------
    InputError
        The dips have both signs and the user states no convention.
    """
    up, down = int(np.count_nonzero(dip < 0)), int(np.count_nonzero(dip > 0))
    low, high = (f"{d:g}" for d in (dip.min(), dip.max())) if len(dip) else ("", "")
    spread = f"{low if low == high else f'{low} to {high}'} degrees" if len(dip) else "none"
    if stated is not None:
        if (down if not stated else up) and not (up if not stated else down):
            log.add(
                source, "every hole goes up by the dip convention stated", WARNING,
                "kept as stated", detail=spread,
            )  # fmt: skip
        return stated
    if up and down:
        raise InputError(
            f"{source}: dips have both signs ({down} positive, {up} negative), so the "
            "convention is unknown: state --dip-positive-down or --no-dip-positive-down"
        )
    positive = not up
    log.add(
        source,
        f"no dip is {'negative' if positive else 'positive'}, so positive dips seem to point "
        f"{'down' if positive else 'up'}",
        NOTE,
        f"assumed; state it by --{'' if positive else 'no-'}dip-positive-down",
        detail=spread,
    )
    return positive


def checked_turns(stations: Stations, collars: Collars, source: str, log: Log) -> Stations:
    """Return the stations without those that turn a hole back on itself; report sharp turns.

    Dips must be positive down.
    """
    while True:
        t = directions(stations.azimuth, stations.dip)
        turn = np.zeros(len(t))
        same = stations.hole[1:] == stations.hole[:-1]
        turn[1:] = np.where(same, np.degrees(dogleg(t[:-1], t[1:])), 0.0)
        back = turn > _REVERSED
        back[1:] &= ~back[:-1]  # one at a time: leaving out a station changes the next turn
        check, action = "direction turned back on itself", LEFT_OUT
        chosen = back if back.any() else turn > _SHARP
        if not back.any():
            check, action = "hole turned by more than a right angle", "kept unchanged"
        for i in np.flatnonzero(chosen):
            log.add(
                source, check, WARNING, action, hole=str(collars.names[stations.hole[i]]),
                row=int(stations.row[i]), detail=f"{turn[i]:.0f} degrees",
            )  # fmt: skip
        if not back.any():
            return stations
        stations = stations.kept(~back)


def extrapolated(stations: Stations, ends: Floats, collars: Collars, source: str, log: Log) -> None:
    """Report the holes extended straight above their first station or below their last."""
    count = np.bincount(stations.hole, minlength=len(collars))
    last = np.cumsum(count) - 1
    for k in np.flatnonzero(count):
        top, bottom = stations.depth[last[k] - count[k] + 1], stations.depth[last[k]]
        name, row = str(collars.names[k]), int(stations.row[last[k]])
        if ends[k] > bottom * (1 + _ROUNDING):
            log.add(
                source, "hole runs below its last survey", NOTE, "extended straight and marked",
                hole=name, row=row, detail=f"{bottom:g} to {ends[k]:g}",
            )  # fmt: skip
        if top > 0:
            row = int(stations.row[last[k] - count[k] + 1])
            log.add(
                source, "no survey at the collar", NOTE, "extended straight and marked",
                hole=name, row=row, detail=f"first at {top:g}",
            )  # fmt: skip


def without_holes(collars: Collars, keep: Bools) -> Collars:
    """Return the collars to keep."""
    return replace(
        collars,
        names=collars.names[keep],
        points=collars.points[keep],
        depth=collars.depth[keep],
        azimuth=collars.azimuth[keep],
        dip=collars.dip[keep],
        row=collars.row[keep],
    )


def _grave(hole: object, assayed: set[str]) -> Severity:
    """Return the severity of a hole that cannot be placed: an error if it has assays."""
    return ERROR if str(hole) in assayed else WARNING


def _add(
    log: Log,
    table: HoleTable,
    i: int | np.integer,
    check: str,
    severity: Severity,
    action: str = LEFT_OUT,
    detail: str = "",
) -> None:
    """Add a finding about a row of a table."""
    log.add(
        table.source, check, severity, action, hole=str(table.hole[i]), row=int(table.row[i]),
        detail=detail,
    )  # fmt: skip
