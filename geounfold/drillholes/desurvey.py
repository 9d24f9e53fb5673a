r"""Paths of holes by minimum curvature.

Between two survey stations a hole is the circular arc that has the measured directions at its
ends. With unit tangents t1 and t2, their angle (dogleg) beta and the length L along the hole
between them, the displacement is

    d = L/2 RF (t1 + t2),    RF = tan(beta/2) / (beta/2)

(Taylor and Mason 1972, *A systematic approach to well surveying calculations*, SPE Journal 12(6),
474-488; Sawaryn and Thorogood 2005, *A compendium of directional calculations based on the
minimum curvature method*, SPE Drilling & Completion 20(1), 24-36, equations 1 to 4). It is exact
if the hole is a circular arc or straight. The tangent at the share f of the arc's length is

    t(f) = (sin((1 - f) beta) t1 + sin(f beta) t2) / sin(beta)

(ibid., interpolation). A part of an arc is an arc, so the first equation gives the position there
too.

Above the first station and below the last one the path is extended straight, and such positions
are marked. No library is used, because only the equations above would be needed of it: wellpathpy
computes one well at a time, from inclinations and without tables or checks (its positions and
these agree to 1e-12 over a sharply turning 4,100 m); welleng brings a planning suite, baselode
geopandas and plotly; drillholes is at version 0.0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry.mesh import Bools, Floats, Ints

_SMALL = 1e-4  # radians; below it a series is used, whose next term is below 1e-27


def directions(azimuth: Floats, dip: Floats) -> Floats:
    """Return unit vectors along holes, (n, 3): x east, y north, z up.

    Parameters
    ----------
    azimuth : (n,) float
        Degrees clockwise from y (north).
    dip : (n,) float
        Degrees below the horizontal: 90 is straight down.

    Examples
    --------
    >>> directions(np.array([90.0]), np.array([30.0])).round(6).tolist()
    [[0.866025, 0.0, -0.5]]
    >>> directions(np.array([0.0]), np.array([90.0]))[0, 2].item()
    -1.0
    """
    a, d = np.radians(azimuth), np.radians(dip)
    return np.column_stack([np.cos(d) * np.sin(a), np.cos(d) * np.cos(a), -np.sin(d)])


def dogleg(before: Floats, after: Floats) -> Floats:
    """Return the angle between unit vectors (n, 3), radians; accurate at 0 and at pi."""
    apart = np.linalg.norm(after - before, axis=1)
    along = np.linalg.norm(after + before, axis=1)
    return np.asarray(2.0 * np.arctan2(apart, along))


def ratio_factor(beta: Floats) -> Floats:
    """Return RF = tan(beta/2) / (beta/2), (n,).

    Examples
    --------
    >>> ratio_factor(np.array([0.0, np.pi / 2])).round(6).tolist()
    [1.0, 1.27324]
    """
    half = np.where(beta < _SMALL, 1.0, beta / 2.0)
    return np.where(beta < _SMALL, 1.0 + beta**2 / 12.0 + beta**4 / 120.0, np.tan(half) / half)


def arc(length: Floats, before: Floats, after: Floats) -> Floats:
    """Return the displacement (n, 3) along arcs of lengths (n,) between tangents (n, 3)."""
    factor = 0.5 * length * ratio_factor(dogleg(before, after))
    return np.asarray(factor[:, None] * (before + after))


def tangent_within(share: Floats, before: Floats, after: Floats) -> Floats:
    """Return unit tangents (n, 3) at shares (n,) of arcs' lengths."""
    beta = dogleg(before, after)
    straight = beta < _SMALL  # normalised linear weights are off by less than beta^3 / 20
    sine = np.where(straight, 1.0, np.sin(beta))
    a = np.where(straight, 1.0 - share, np.sin((1.0 - share) * beta) / sine)
    b = np.where(straight, share, np.sin(share * beta) / sine)
    t = a[:, None] * before + b[:, None] * after
    return np.asarray(t / np.linalg.norm(t, axis=1)[:, None])


@dataclass(frozen=True, eq=False)
class Paths:
    """The paths of holes.

    Attributes
    ----------
    collars : (h, 3) float
        Coordinates of the collars.
    first : (h + 1,) int
        The stations of hole k are ``first[k]`` to ``first[k + 1] - 1``; each has one or more.
    depth : (s,) float
        Length along the hole, increasing within each hole.
    tangent : (s, 3) float
        Unit vectors down the hole.
    offset : (s, 3) float
        Position relative to the collar.
    """

    collars: Floats
    first: Ints
    depth: Floats
    tangent: Floats
    offset: Floats

    def at(self, hole: Ints, depth: Floats) -> tuple[Floats, Bools]:
        """Return positions (n, 3) at depths along holes, and whether each is surveyed (n,).

        Parameters
        ----------
        hole : (n,) int
            Index of the hole.
        depth : (n,) float
            Length along the hole from the collar.
        """
        nearest = self._above(hole, depth)
        above = nearest >= self.first[hole]
        station = np.where(above, nearest, self.first[hole])
        following = np.minimum(station + 1, self.first[hole + 1] - 1)
        inside = above & (following > station)
        before, after = self.tangent[station], self.tangent[following]
        along = depth - self.depth[station]
        span = np.where(inside, self.depth[following] - self.depth[station], 1.0)
        share = np.where(inside, along / span, 0.0)
        # Beyond the ends the share is 0: the tangent is constant and the length may be negative.
        moved = arc(along, before, tangent_within(share, before, after))
        enclosed = inside | (along == 0.0)
        return self.collars[hole] + (self.offset[station] + moved), enclosed

    def _above(self, hole: Ints, depth: Floats) -> Ints:
        """Return the last station at or above each depth; if none, the hole's first less one."""
        count = len(self.depth)
        owner = np.repeat(np.arange(len(self.collars)), np.diff(self.first))
        asked = np.repeat([0, 1], [count, len(depth)])
        order = np.lexsort((asked, np.r_[self.depth, depth], np.r_[owner, hole]))
        passed = np.cumsum(asked[order] == 0) - 1
        found = np.empty(len(order), dtype=np.int64)
        found[order] = passed
        return np.asarray(np.maximum(found[count:], self.first[hole] - 1))


def desurvey(collars: Floats, hole: Ints, depth: Floats, tangent: Floats) -> Paths:
    """Return holes' paths by minimum curvature.

    Parameters
    ----------
    collars : (h, 3) float
        Collars of all holes.
    hole : (s,) int
        Index of the hole of each station, increasing; every hole has a station.
    depth : (s,) float
        Length along the hole, increasing within each hole.
    tangent : (s, 3) float
        Unit vectors down the hole, no two in succession opposite.
    """
    first = np.searchsorted(hole, np.arange(len(collars) + 1))
    offset = np.empty_like(tangent)
    offset[first[:-1]] = depth[first[:-1], None] * tangent[first[:-1]]
    step = arc(np.diff(depth), tangent[:-1], tangent[1:]) if len(depth) > 1 else tangent[:0]
    # Station by station over all holes at once, so that a hole's sum does not depend on others.
    for rank in range(1, int(np.diff(first).max(initial=1))):
        now = first[:-1][np.diff(first) > rank] + rank
        offset[now] = offset[now - 1] + step[now - 1]
    return Paths(collars, np.asarray(first, dtype=np.int64), depth, tangent, offset)
