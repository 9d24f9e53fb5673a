"""The sheet through the intercepts: walls over a reference surface, and how well they foretell."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.modelling.intercepts import Intercepts
from geounfold.modelling.reference import Reference
from geounfold.modelling.traced import Traced
from geounfold.modelling.walls import Walls, fit_walls

_NEAREST = 9  # intercepts that give the slope of the layer at one of them
_SMALL = 1e-3  # of an intercept: step from a contact into the body
_FOLDS = 10  # groups of holes, each left out once
_JUMP = 2.0  # steps; a larger change of height between two points of a hole is no crossing


@dataclass(frozen=True, eq=False)
class Sheet:
    """Walls over a reference surface.

    Attributes
    ----------
    reference : Reference
    walls : Walls
    places : (m, 2) float
        Where the intercepts cross the layer.
    """

    reference: Reference
    walls: Walls
    places: Floats


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts in the coordinates of a reference surface.

    Attributes
    ----------
    intercept : (c,) int
        Index of the intercept of each contact.
    places : (c, 2) float
    heights : (c,) float
    hanging : (c,) bool
    """

    intercept: Ints
    places: Floats
    heights: Floats
    hanging: Bools

    def of(self, chosen: Bools) -> Contacts:
        """Return the contacts of chosen intercepts (m,)."""
        keep = chosen[self.intercept]
        return Contacts(
            self.intercept[keep], self.places[keep], self.heights[keep], self.hanging[keep]
        )


def contacts_of(found: Intercepts, reference: Reference) -> tuple[Contacts, Floats]:
    """Return the contacts of intercepts, and the places (m, 2) where these cross the layer.

    A contact is with the hanging wall if the body lies below it, seen from the layer there: over a
    fold its reference surface, over a plane the plane through the middles of the nearest
    intercepts. A hole across a crest or along a steep limb may meet one wall twice.
    """
    upper, lower = reference.local(found.upper), reference.local(found.lower)
    middle = reference.local(0.5 * (found.upper + found.lower))
    chord = found.lower - found.upper
    small = _SMALL * chord
    down = (
        reference.local(found.upper + small) - upper,
        reference.local(found.lower - small) - lower,
    )
    slope = np.zeros((len(middle), 2)) if reference.follows else _slopes(middle)
    number = np.arange(len(found))
    parts = []
    for ends, into, there in zip(
        (upper, lower), down, (~found.open_above, ~found.open_below), strict=True
    ):
        fall = into[:, 2] - (slope * into[:, :2]).sum(axis=1)
        parts.append((number[there], ends[there, :2], ends[there, 2], fall[there] < 0))
    joined = [np.concatenate(part) for part in zip(*parts, strict=True)]
    return Contacts(*joined), middle[:, :2]


def _slopes(middle: Floats) -> Floats:
    """Return slopes (m, 2) of the layer at middles of intercepts (m, 3), by their neighbours."""
    near = np.asarray(cKDTree(middle[:, :2]).query(middle[:, :2], k=min(_NEAREST, len(middle)))[1])
    away = middle[near] - middle[near].mean(axis=1, keepdims=True)
    flat, height = away[..., :2], away[..., 2]
    product = np.einsum("nki,nkj->nij", flat, flat)
    # Neighbours on a line leave the slope across it open: it is taken as level.
    ridge = 1e-3 * np.trace(product, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    right = np.einsum("nki,nk->ni", flat, height)
    return np.asarray(
        np.linalg.solve(product + ridge + 1e-12 * np.eye(2), right[..., None])[..., 0]
    )


def fit_sheet(found: Intercepts, reference: Reference) -> Sheet:
    """Return the sheet through all intercepts."""
    contacts, places = contacts_of(found, reference)
    return Sheet(reference, fit_walls(contacts.places, contacts.heights, contacts.hanging), places)


def crossings(sheet: Sheet, trace: Traced) -> tuple[Floats, Ints, Floats]:
    """Return where holes cross the middle of the sheet: places (k, 2), holes and depths (k,)."""
    local = sheet.reference.local(trace.points)
    above = local[:, 2] - sheet.walls.at(local[:, :2])[0]
    same = trace.hole[1:] == trace.hole[:-1]
    near = np.abs(np.diff(above)) <= _JUMP * trace.step
    at = np.flatnonzero(same & near & ((above[1:] > 0) != (above[:-1] > 0)))
    share = np.abs(above[at]) / np.maximum(np.abs(above[at]) + np.abs(above[at + 1]), 1e-300)
    places = local[at, :2] + share[:, None] * (local[at + 1, :2] - local[at, :2])
    return places, trace.hole[at], trace.depth[at] + share * trace.step


def barren(found: Intercepts, holes: Ints, depths: Floats) -> Bools:
    """Return which crossings (k,) no intercept of the same hole is at, within its own length."""
    out = np.ones(len(holes), dtype=bool)
    first = np.searchsorted(found.hole, holes, side="left")
    last = np.searchsorted(found.hole, holes, side="right")
    for ahead in range(int((last - first).max(initial=0))):
        k = np.minimum(first + ahead, len(found) - 1)
        own = first + ahead < last
        slack = found.end[k] - found.start[k]
        at = (depths >= found.start[k] - slack) & (depths <= found.end[k] + slack)
        out &= ~(own & at)
    return out


def foretold(
    found: Intercepts, reference: Reference, trace: Traced, *, redrawn: bool = False
) -> float:
    """Return the length of wrongly foretold hole over the length of ore, holes left out in turn.

    Parameters
    ----------
    found : Intercepts
    reference : Reference
        Surface of all holes.
    trace : Traced
        Body and waste along the holes.
    redrawn : bool
        Whether the surface too is drawn without the group of holes that it foretells. If it cannot
        be drawn, it foretells no body there. The walls are always fitted without the group.

    Raises
    ------
    InputError
        The holes are too few.
    """
    hit = np.unique(found.hole)
    group = np.full(int(trace.hole.max()) + 1, -1)
    group[hit] = np.random.default_rng(0).permutation(len(hit)) % _FOLDS
    wrong = ore = 0
    for k in range(_FOLDS):
        own, rest = group[trace.hole] == k, group[found.hole] != k
        inside = _told_inside(found.kept(rest), reference, trace, own, redrawn)
        wrong += int(np.count_nonzero(inside != trace.ore[own]))
        ore += int(np.count_nonzero(trace.ore[own]))
    if not ore:
        raise InputError("no hole is long enough in the body")
    return wrong / ore


def _told_inside(
    rest: Intercepts, reference: Reference, trace: Traced, own: Bools, redrawn: bool
) -> Bools:
    """Return which points of the left-out holes lie between walls through the other intercepts."""
    if redrawn:
        try:
            reference = reference.redrawn(rest, trace.kept(~own))
        except InputError:
            return np.zeros(int(own.sum()), dtype=bool)
    contacts, _ = contacts_of(rest, reference)
    local = reference.local(trace.points[own])
    middle, half = fit_walls(contacts.places, contacts.heights, contacts.hanging).at(local[:, :2])
    return np.asarray(np.abs(local[:, 2] - middle) <= half)


def one_each_place(found: Intercepts, reference: Reference) -> tuple[Intercepts, tuple[str, ...]]:
    """Return intercepts of which no hole has two at one place of the layer.

    Two of one hole are at one place if they lie nearer along the layer than the longer is long.
    They join if the waste between them is shorter than the median intercept; else the longer stays.

    Returns
    -------
    Intercepts
    tuple of str
        What was joined and left out.
    """
    usual = float(np.median(found.end - found.start))
    places = contacts_of(found, reference)[1]
    joined = dropped = 0
    while True:
        length = found.end - found.start
        apart = np.linalg.norm(np.diff(places, axis=0), axis=1)
        same = (found.hole[1:] == found.hole[:-1]) & (apart < np.maximum(length[1:], length[:-1]))
        same[1:] &= ~same[:-1]  # pairs; the next round has those that are left
        at = np.flatnonzero(same)
        if not len(at):
            break
        near = found.start[at + 1] - found.end[at] <= usual
        keep = np.ones(len(found), dtype=bool)
        keep[at[near] + 1] = False
        far = at[~near]
        keep[np.where(length[far] >= length[far + 1], far + 1, far)] = False
        joined, dropped = joined + int(near.sum()), dropped + len(far)
        found = _joined(found, at[near]).kept(keep)
        places = contacts_of(found, reference)[1]
    told = []
    if joined:
        told.append(f"{joined} pairs of intercepts at one place were joined across waste")
    if dropped:
        told.append(
            f"{dropped} intercepts lie above or below a longer one of their hole: left out; they "
            "may be a second layer, or a fold (--shape fold)"
        )
    return found, tuple(told)


def _joined(found: Intercepts, first: Ints) -> Intercepts:
    """Return intercepts of which some have grown down to the end of the next."""
    end, lower = found.end.copy(), found.lower.copy()
    below, waste = found.open_below.copy(), found.waste.copy()
    gap = found.start[first + 1] - found.end[first]
    end[first], lower[first] = found.end[first + 1], found.lower[first + 1]
    below[first] = found.open_below[first + 1]
    waste[first] += gap + found.waste[first + 1]
    return replace(found, end=end, lower=lower, open_below=below, waste=waste)
