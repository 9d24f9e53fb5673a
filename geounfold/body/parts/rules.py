"""The rules by which regions that meet are one sheet or two, each with its measured thresholds.

Lengths are measured by the thicknesses of the regions that meet. The thresholds were set on 81
sound bodies, which must stay one sheet, and on branches, partings, thrusts and faults with a known
truth; the tests name the bodies that hold them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.parts.meetings import Meeting
from geounfold.body.parts.regions import Regions
from geounfold.geometry.mesh import Floats, Ints

_ALONG = 0.77
"""Least cosine between the normals of sheets that run along each other: 40 degrees."""

_HALF = 0.42
"""Height in thicknesses up to which two mid surfaces are one, beside half a cell.

Half a thickness leaves faults of .8 thicknesses that dip 50 degrees as one sheet: the halves meet
where their mid surfaces are nearer than the throw.
"""


@dataclass(frozen=True)
class Rod:
    """A region whose medial points lie along a line: a pipe or a pillar, no sheet.

    Attributes
    ----------
    covered : float
        Largest share of its area that the cells of its medial points cover. Sheets cover 0.8 to
        1.2, rods less than 0.2.
    """

    name: str = "rod"
    covered: float = 0.3

    def holds(self, found: Regions, region: int) -> bool:
        """Return whether a region is a rod."""
        middle = found.rays.middle[found.label == region]
        cells = len(np.unique(np.rint(middle).astype(np.int64), axis=0))
        return bool(cells < self.covered * found.area[region])


@dataclass(frozen=True)
class Zone:
    """A region in which two sheets lie upon each other.

    Attributes
    ----------
    region : int
        The doubled region.
    plies : (int, int)
        The regions that run on along its lower and its upper side.
    thickness : (float, float, float)
        Thickness of the lower and the upper ply, and of the zone. Those of the plies are their
        regions' medians: the share of the lower ply is then within 0.012 of the truth on 23
        doubled zones, and within 0.049 with the thickness beside the meeting, as ramps are
        thinner across.
    meetings : (Meeting, Meeting)
        Those of the zone with each ply.
    """

    region: int
    plies: tuple[int, int]
    thickness: tuple[float, float, float]
    meetings: tuple[Meeting, Meeting]

    @property
    def share(self) -> float:
        """Share of the zone's thickness that the lower ply takes."""
        return self.thickness[0] / (self.thickness[0] + self.thickness[1])


@dataclass(frozen=True)
class Doubled:
    """One neighbour runs on along the bottom of a region, another along its top.

    Attributes
    ----------
    thinner : float
        Largest thickness of a neighbour, in the region's thicknesses, beside the meeting and in
        the mean: a sheet is also thicker where a branch leaves it.
    place : float
        Largest error of a neighbour's height, in the region's thicknesses: the half of what the
        thicknesses differ by is expected.
    bend : float
        What this error may grow by, per unit of distance to the meeting: sheets are curved.
    aside : float
        Least height of a neighbour, in the region's thicknesses; the limbs of a thickened hinge
        meet it in the middle.
    total : float
        Largest error of the neighbours' thicknesses together, in the region's thicknesses.
    wide : float
        Least width of the region, in its thicknesses; a thickened hinge is narrower.
    area, share : float
        Least area of both neighbours: thicknesses squared, share of all sheets.
    """

    name: str = "doubled"
    thinner: float = 0.85
    place: float = 0.25
    bend: float = 0.2
    aside: float = 0.08
    total: float = 0.25
    wide: float = 0.8
    area: float = 2.0
    share: float = 0.02

    def found(
        self, regions: Regions, region: int, meetings: Sequence[Meeting], area: Floats
    ) -> Zone | None:
        """Return the region as a zone of two plies; None if it is none.

        ``area`` (r,) is that of each region with those that continue it on the side away from
        this one.
        """
        low: list[Meeting] = []
        top: list[Meeting] = []
        for meeting in meetings:
            if region not in meeting.regions or meeting.cosine < _ALONG:
                continue
            _, height, own, whole = meeting.seen_from(region)
            error = abs(abs(height) - (whole - own) / 2)
            aside = abs(height) > self.aside * whole
            if own > self.thinner * min(whole, regions.thickness[region]) or not aside:
                continue
            if error < self.place * whole + self.bend * meeting.lateral:
                (top if height > 0 else low).append(meeting)
        zones = [z for a in low for b in top if (z := self._zone(regions, region, a, b, area))]
        return max(zones, key=lambda z: min(regions.area[list(z.plies)]), default=None)

    def _zone(
        self, regions: Regions, region: int, low: Meeting, top: Meeting, area: Floats
    ) -> Zone | None:
        a, _, thick_a, whole_a = low.seen_from(region)
        b, _, thick_b, whole_b = top.seen_from(region)
        whole = (whole_a + whole_b) / 2
        if a == b or abs(thick_a + thick_b - whole) > self.total * whole:
            return None
        thickest = max(thick_a, thick_b)
        least = max(self.share * regions.total, self.area * thickest**2)
        if min(area[[a, b]]) < least or self._width(regions, region) < self.wide * whole:
            return None
        plies = [float(np.median(regions.rays.thickness[regions.rows(p)])) for p in (a, b)]
        return Zone(region, (a, b), (plies[0], plies[1], whole), (low, top))

    def _width(self, regions: Regions, region: int) -> float:
        """Return the smaller of a region's two widths along its sheet."""
        middle = regions.rays.middle[regions.label == region]
        spread = np.linalg.svd(middle - middle.mean(axis=0), compute_uv=False)
        return float(spread[1] * np.sqrt(12 / len(middle)))


def _within(meeting: Meeting) -> float:
    """Return the height up to which two mid surfaces are one."""
    thick, thin = max(meeting.thickness), min(meeting.thickness)
    return _HALF * max(thin, 0.5 * thick) + 0.5 * meeting.cell


@dataclass(frozen=True)
class Continuation:
    """Two mid surfaces that run into each other are one sheet.

    Attributes
    ----------
    within : float
        Share of the thinner sheet that may lie beyond the thicker one's faces: steps of the
        thickness on one side.
    """

    name: str = "continuation"
    within: float = 0.25

    def holds(self, meeting: Meeting) -> bool:
        """Return whether both regions are one sheet."""
        thick, thin = max(meeting.thickness), min(meeting.thickness)
        limit = max(_within(meeting), 0.5 * (thick - thin) + self.within * thin)
        return meeting.cosine > _ALONG and meeting.height < limit


@dataclass(frozen=True)
class Step:
    """Two sheets end against each other, one higher than the other: a fault without drag.

    Attributes
    ----------
    most : float
        Largest height in mean thicknesses; higher ones lie over each other.
    share : float
        Least area of both regions, as a share of all.
    """

    name: str = "step"
    most: float = 0.95
    share: float = 0.02

    def holds(self, meeting: Meeting, regions: Regions) -> bool:
        """Return whether the regions are the two sides of a step."""
        high = (
            self.beyond(meeting, regions)
            and meeting.height < self.most * sum(meeting.thickness) / 2
        )
        return bool(high)

    def beyond(self, meeting: Meeting, regions: Regions) -> bool:
        """Return whether the regions run along each other, too far apart to be one sheet."""
        area = min(regions.area[list(meeting.regions)])
        far = meeting.height > _within(meeting)
        return bool(meeting.cosine > _ALONG and far and area > self.share * regions.total)


@dataclass(frozen=True)
class Stack:
    """Two sheets one above the other, joined by a plug: never joined through a short region.

    Attributes
    ----------
    plug : float
        Area in thicknesses squared below which a region is a plug, no hinge.
    """

    name: str = "stack"
    plug: float = 1.0

    def holds(self, meeting: Meeting, regions: Regions) -> bool:
        """Return whether the regions lie over each other."""
        step = Step()
        return step.beyond(meeting, regions) and not step.holds(meeting, regions)


@dataclass(frozen=True)
class Hinge:
    """A mid surface turns sharply, and neither side goes on beyond the meeting: one sheet.

    Attributes
    ----------
    beyond : float
        How far beyond the meeting a sheet is looked for, in its thicknesses.
    near : float
        Distance from the continued plane within which it is found, in its thicknesses.
    found : float
        Share of the meeting's points from which it goes on: then it is a branch.
    aside : float
        Share of the way to the other sheet that runs along this one, below which the other comes
        from the side: then it is a branch too.
    """

    name: str = "hinge"
    beyond: float = 1.0
    near: float = 0.6
    found: float = 0.4
    aside: float = 0.4

    def holds(self, meeting: Meeting, regions: Regions, group: Ints) -> bool:
        """Return whether both regions are one sheet; ``group`` joins regions known to be one."""
        if meeting.cosine > _ALONG:
            return False
        return not any(self._goes_on(meeting, regions, group, side) for side in (0, 1))

    def _goes_on(self, meeting: Meeting, regions: Regions, group: Ints, side: int) -> bool:
        """Return whether the sheet of one side continues beyond the meeting."""
        own, other = meeting.points[side], meeting.points[1 - side]
        normal, middle = meeting.normals[side], regions.rays.middle
        way = middle[other] - middle[own]
        whole = np.linalg.norm(way, axis=1)
        way = way - (way * normal).sum(axis=1)[:, None] * normal
        size = np.linalg.norm(way, axis=1)
        if np.median(size / np.maximum(whole, 1e-9)) < self.aside:
            return True
        ok = size > 1e-6
        thickness = regions.rays.thickness[own][ok]
        there: Floats = (
            middle[own][ok]
            + way[ok] / size[ok, None] * (size[ok] + self.beyond * thickness)[:, None]
        )
        inside = np.flatnonzero(regions.label >= 0)
        mine = inside[group[regions.label[inside]] == group[meeting.regions[side]]]
        far, near = cKDTree(middle[mine]).query(there)
        flat = np.abs((regions.rays.normal[mine[near]] * normal[ok]).sum(axis=1)) > _ALONG
        return bool(((far < self.near * thickness) & flat).mean() > self.found)
