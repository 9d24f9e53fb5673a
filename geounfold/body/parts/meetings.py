"""Meetings of two regions: how their mid surfaces would run on into each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.parts.regions import Regions
from geounfold.geometry.mesh import Floats, Ints

_NEAR = (0.75, 3.0)
"""Regions meet within this distance: share of both thicknesses, and cells."""

_LEAST = 3
"""Least number of medial points that a meeting has."""

_MOST = 150
"""Number of points of a meeting that are looked at."""

_BACK = 80
"""Number of medial points behind the meeting whose plane is continued to it.

The points right at the meeting lie amid corners, which turn their normals.
"""


@dataclass(frozen=True, eq=False)
class Meeting:
    """A place where two regions come near each other.

    Attributes
    ----------
    regions : (int, int)
        The two regions.
    points : (Ints, Ints)
        Pairs of medial points that meet, (p,) each.
    normals : (Floats, Floats)
        Normals (p, 3) of the planes that continue each region to the meeting.
    offset : (float, float)
        Height of the other region's mid surface over the continued one, along its normals.
    thickness : (float, float)
        Thickness of each region behind the meeting.
    cosine : float
        Between the two planes' normals.
    lateral : float
        Distance from the points of the first plane to the meeting, along the plane.
    cell : float
        Longest side of a cell.
    """

    regions: tuple[int, int]
    points: tuple[Ints, Ints]
    normals: tuple[Floats, Floats]
    offset: tuple[float, float]
    thickness: tuple[float, float]
    cosine: float
    lateral: float
    cell: float

    def seen_from(self, region: int) -> tuple[int, float, float, float]:
        """Return the other region, its height over this one, and its and this one's thickness."""
        own = self.regions.index(region)
        other = 1 - own
        return self.regions[other], self.offset[own], self.thickness[other], self.thickness[own]

    @property
    def height(self) -> float:
        """The larger of the two heights, without its sign."""
        return max(abs(self.offset[0]), abs(self.offset[1]))


def find_meetings(found: Regions, ids: Sequence[int]) -> list[Meeting]:
    """Return the meetings among some of the regions."""
    middle = found.rays.middle
    rows = {r: found.rows(r) for r in ids}
    trees = {r: cKDTree(middle[rows[r]]) for r in ids}
    usual = {r: float(np.median(found.rays.thickness[rows[r]])) for r in ids}
    boxes = {r: (middle[rows[r]].min(axis=0), middle[rows[r]].max(axis=0)) for r in ids}
    out = []
    for k, a in enumerate(ids):
        for b in ids[k + 1 :]:
            reach = _NEAR[0] * (usual[a] + usual[b]) + _NEAR[1]
            apart = np.maximum(boxes[a][0] - boxes[b][1], boxes[b][0] - boxes[a][1])
            if (apart > reach).any():
                continue
            small, large = (a, b) if len(rows[a]) <= len(rows[b]) else (b, a)
            found_near = trees[large].query(middle[rows[small]], distance_upper_bound=reach)
            far, near = (np.asarray(values) for values in found_near)
            hit = np.flatnonzero(np.isfinite(far))
            if len(hit) < _LEAST:
                continue
            hit = hit[far[hit] <= np.quantile(far[hit], 0.3) + 1.0]
            hit = hit[:: -(-len(hit) // _MOST)]
            points = {small: rows[small][hit], large: rows[large][near[hit]]}
            known = (trees[a], trees[b]), (rows[a], rows[b])
            out.append(_meeting(found, (a, b), (points[a], points[b]), *known))
    return out


def _meeting(
    found: Regions,
    pair: tuple[int, int],
    points: tuple[Ints, Ints],
    trees: tuple[Any, Any],
    rows: tuple[Ints, Ints],
) -> Meeting:
    """Return the meeting of two regions at pairs of their points."""
    middle = found.rays.middle
    normals, places, thickness = [], [], []
    for tree, every, own in zip(trees, rows, points, strict=True):
        count = min(_BACK, len(every))
        near = every[tree.query(middle[own], k=count)[1].reshape(len(own), count)]
        normal = found.rays.normal[near].mean(axis=1)
        normals.append(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9))
        places.append(middle[near].mean(axis=1))
        thickness.append(float(np.median(found.rays.thickness[near])))
    way = (middle[points[1]] - places[0], middle[points[0]] - places[1])
    heights = [(w * n).sum(axis=1) for w, n in zip(way, normals, strict=True)]
    lateral = np.sqrt(np.maximum((way[0] ** 2).sum(axis=1) - heights[0] ** 2, 0.0))
    return Meeting(
        pair,
        points,
        (normals[0], normals[1]),
        (float(np.median(heights[0])), float(np.median(heights[1]))),
        (thickness[0], thickness[1]),
        float(np.median(np.abs((normals[0] * normals[1]).sum(axis=1)))),
        float(np.median(lateral)),
        found.cell,
    )
