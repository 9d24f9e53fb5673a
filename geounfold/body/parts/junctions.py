"""Junctions of sheets: kind, place and thicknesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.body.parts.meetings import Meeting
from geounfold.body.parts.result import Junction
from geounfold.body.parts.rules import Zone
from geounfold.body.parts.sheets import Sheets
from geounfold.body.parts.voxels import Voxels
from geounfold.geometry.mesh import Floats, Ints


@dataclass(frozen=True, eq=False)
class _Places:
    """The occupied cells of a body with their parts, to which places are moved."""

    cells: Ints
    part: Ints
    body: Voxels
    sheet: Ints

    def snapped(self, place: Floats) -> tuple[float, float, float]:
        """Return the occupied cell nearest to a place, as a place on the lattice."""
        near = self.cells[self._far(place, slice(None)).argmin()]
        x, y, z = ((near + self.body.low) * self.body.steps).tolist()
        return x, y, z

    def part_of(self, sheet: int, place: Floats) -> int:
        """Return the part of a sheet that is nearest to a place."""
        parts = np.flatnonzero(self.sheet == sheet)
        if len(parts) == 1:
            return int(parts[0])
        rows = np.flatnonzero(np.isin(self.part, parts))
        return int(self.part[rows[self._far(place, rows).argmin()]])

    def _far(self, place: Floats, rows: Ints | slice) -> Floats:
        out: Floats = ((self.cells[rows] * self.body.steps - place) ** 2).sum(axis=1)
        return out


def find_junctions(table: Ints, body: Voxels, sheets: Sheets, sheet: Ints) -> tuple[Junction, ...]:
    """Return one junction for every two parts that meet, and one for every rod.

    Two parts that meet in several ways get their doubled zone, if there is one, or else the
    meeting of their largest regions.

    Parameters
    ----------
    table : (a, b, c) int
        Part of each cell of the box, or -1.
    body : Voxels
        The body's cells.
    sheets : Sheets
        Its sheets.
    sheet : (k,) int
        The sheet that each part is of.
    """
    cells = np.argwhere(body.occupied)
    places = _Places(cells, table[tuple(cells.T)], body, sheet)
    zones = sorted(sheets.zones, key=lambda z: -sheets.regions.area[z.region])
    found = [_of_zone(places, sheets, zone) for zone in zones]
    area = sheets.regions.area
    for contact in sorted(sheets.contacts, key=lambda c: -min(area[list(c.regions)])):
        place = _middle(sheets, contact.meeting)
        pair = sheets.sheet[list(contact.regions)]
        found.append(_made(places, pair, contact.kind, place, contact.meeting.thickness))
    kept: dict[tuple[int, int], Junction] = {}
    for junction in found:
        if junction.parts[0] != junction.parts[1]:
            kept.setdefault(junction.parts, junction)
    rods = [_of_rod(places, sheets, int(region)) for region in np.flatnonzero(sheets.rod)]
    return (*kept.values(), *rods)


def _of_rod(places: _Places, sheets: Sheets, region: int) -> Junction:
    """Return the junction of a rod with the sheet nearest to it."""
    rays = sheets.regions.rays
    mine = sheets.regions.rows(region)
    centre = np.median(rays.middle[mine], axis=0)
    known = np.where(sheets.regions.label >= 0, sheets.sheet[sheets.regions.label], -1)
    others = np.flatnonzero(known >= 0)
    far = np.linalg.norm(rays.middle[others] - centre, axis=1)
    sheet = int(known[others[far.argmin()]])
    part = places.part_of(sheet, centre)
    wide = (float(sheets.thickness[sheet]), float(np.median(rays.thickness[mine])))
    return Junction((part, part), "pipe", places.snapped(centre), wide)


def _of_zone(places: _Places, sheets: Sheets, zone: Zone) -> Junction:
    """Return the junction of a doubled zone.

    Plies that leave it on one side are a split, whose place is where they part; on opposite sides
    they are a repeat, whose place is in the middle of the zone.
    """
    middle = sheets.regions.rays.middle
    centre = middle[sheets.regions.rows(zone.region)].mean(axis=0)
    ends = [_middle(sheets, meeting) for meeting in zone.meetings]
    way = [end - centre for end in ends]
    kind = "split" if float(way[0] @ way[1]) > 0 else "repeat"
    place = (ends[0] + ends[1]) / 2 if kind == "split" else centre
    return _made(places, sheets.sheet[list(zone.plies)], kind, place, zone.thickness)


def _made(
    places: _Places, pair: Ints, kind: str, place: Floats, sizes: tuple[float, ...]
) -> Junction:
    """Return the junction of two sheets at a place, the larger part first."""
    first, second = (places.part_of(int(sheet), place) for sheet in pair)
    if second < first:
        first, second = second, first
        sizes = (sizes[1], sizes[0], *sizes[2:])
    return Junction((first, second), kind, places.snapped(place), sizes)


def _middle(sheets: Sheets, meeting: Meeting) -> Floats:
    """Return the median of the places where two regions meet, (3,)."""
    middle = sheets.regions.rays.middle
    out: Floats = np.median((middle[meeting.points[0]] + middle[meeting.points[1]]) / 2, axis=0)
    return out
