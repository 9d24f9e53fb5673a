"""Search neighbourhood: the samples that estimate each target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.estimation.variogram import Triple, numbers
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.geometry.rotations import rotation_from_angles as turned

LIMITS = (
    *("min_samples", "max_samples", "max_per_hole"),
    *("max_per_octant", "min_holes", "min_octants"),
)
"""Names of the limits on samples."""

_ROWS = 65_536  # targets searched at a time


@dataclass(frozen=True, kw_only=True)
class Neighbourhood:
    """A moving search neighbourhood.

    Parameters
    ----------
    radii : (float, float, float)
        Radii of the search ellipsoid along its axes, in the points' unit.
    rotation : (float, float, float)
        Bearing, plunge and dip of the axes, degrees, as in `Variogram`.
    min_samples : int
        Fewest samples; targets with fewer are not estimated.
    max_samples : int
        Most samples; the nearest are used, by distance in units of the radii.
    max_per_hole : int, optional
        Most samples of one hole; the nearest are used. The default is no limit.
    max_per_octant : int, optional
        Most samples of one octant of the ellipsoid; the nearest are used.
    min_holes : int
        Fewest holes; targets whose samples come from fewer are not estimated.
    min_octants : int
        Fewest octants with samples; targets with fewer are not estimated.

    Raises
    ------
    OptionError
        A value is outside its valid range.
    """

    radii: Triple
    rotation: Triple = (0.0, 0.0, 0.0)
    min_samples: int = 4
    max_samples: int = 24
    max_per_hole: int | None = None
    max_per_octant: int | None = None
    min_holes: int = 1
    min_octants: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "radii", numbers("the search radii", self.radii, 3))
        object.__setattr__(self, "rotation", numbers("the rotation", self.rotation, 3))
        if not min(self.radii) > 0:
            raise OptionError(f"the search radii must be above 0, but are {self.radii}")
        for name in LIMITS:
            value = getattr(self, name)
            if name in ("max_per_hole", "max_per_octant") and value is None:
                continue
            if not isinstance(value, int | np.integer) or value < 1:
                raise OptionError(f"{name} must be a whole number of 1 or more, not {value!r}")
        if self.min_samples > self.max_samples:
            raise OptionError(
                f"min_samples ({self.min_samples}) must not exceed max_samples ({self.max_samples})"
            )
        if self.min_octants > 8:
            raise OptionError(f"min_octants must be 8 or less, not {self.min_octants}")

    @property
    def axes(self) -> Floats:
        """The axes as rows, (3, 3)."""
        return turned(*self.rotation)

    def measured(self, points: Floats) -> Floats:
        """Return points (n, 3) in units of the radii along the axes."""
        out: Floats = points @ self.axes.T / self.radii
        return out


@dataclass(frozen=True, eq=False)
class Found:
    """The samples of each target, nearest first.

    Attributes
    ----------
    rows : (m, k) int
        Rows of the samples; 0 beyond the count.
    counts : (m,) int
        Number of samples of each target.
    """

    rows: Ints
    counts: Ints


class Search:
    """Finds the samples of targets.

    Parameters
    ----------
    points : (n, 3) float
        Samples, sorted by place. Among samples at the same distance the tree chooses by row, so
        sorted rows make the choice independent of the order of the input.
    holes : (n,) int or None
        Number of each sample's hole.
    near : Neighbourhood
        Radii and limits of the search.
    """

    def __init__(self, points: Floats, holes: Ints | None, near: Neighbourhood) -> None:
        self._near = near
        self._places = near.measured(points)
        self._tree = cKDTree(self._places)
        self._holes = holes

    def find(self, targets: Floats, own: Ints | None = None) -> Found:
        """Return the samples of targets (m, 3).

        Parameters
        ----------
        targets : (m, 3) float
            Points to estimate.
        own : (m,) int, optional
            Hole whose samples are left out in cross-validation; -1 for none.
        """
        near, places = self._near, self._near.measured(targets)
        m, most = len(targets), min(near.max_samples, self._tree.n)
        rows, counts = np.zeros((m, most), dtype=np.int64), np.zeros(m, dtype=np.int64)
        left = np.arange(m)
        simple = near.max_per_hole is None and near.max_per_octant is None and own is None
        asked = most if simple else min(2 * most, self._tree.n)
        while len(left):
            found = self._tree.query(places[left], k=asked, distance_upper_bound=1.0)[1]
            found = found.reshape(len(left), asked)
            keep = self._allowed(found, None if own is None else own[left], places[left])
            keep &= np.cumsum(keep, axis=1) <= most
            count = keep.sum(axis=1)
            # A row whose last candidate lies within reach may have more samples: search it again.
            short = (count < most) & (found[:, -1] < self._tree.n) & (asked < self._tree.n)
            done = np.flatnonzero(~short)
            rows[left[done]] = _packed(found[done], keep[done], most)
            counts[left[done]] = count[done]
            left = left[short]
            asked = min(4 * asked, self._tree.n)
        if near.min_holes > 1 or near.min_octants > 1:
            counts[self._scarce(rows, counts, places)] = 0
        return Found(rows, counts)

    def _octants(self, rows: Ints, places: Floats) -> Ints:
        """Return the octant, 0 to 7, of samples (m, k) seen from targets (m, 3)."""
        gaps = self._places[rows] - places[:, None]
        out: Ints = (gaps >= 0).astype(np.int64) @ np.array([1, 2, 4])
        return out

    def _scarce(self, rows: Ints, counts: Ints, places: Floats) -> Bools:
        """Return which targets have samples of too few holes or octants."""
        used = np.arange(rows.shape[1]) < counts[:, None]
        out = np.zeros(len(rows), dtype=bool)
        if self._near.min_holes > 1 and self._holes is not None:
            hole = np.where(used, self._holes[rows], -1)
            first = used & (turn_of(hole) == 0)
            out |= first.sum(axis=1) < self._near.min_holes
        if self._near.min_octants > 1:
            octant = np.where(used, self._octants(rows, places), -1)
            first = used & (turn_of(octant) == 0)
            out |= first.sum(axis=1) < self._near.min_octants
        return out

    def _allowed(self, found: Ints, own: Ints | None, places: Floats) -> Bools:
        """Return which of the samples found, (m, k) nearest first, may be used."""
        keep: Bools = found < self._tree.n
        most = self._near.max_per_octant
        if most is not None:
            rows = np.where(keep, found, 0)
            holes = None if self._holes is None else self._holes[rows]
            if own is not None and holes is not None:
                keep &= holes != own[:, None]
            per_hole = self._near.max_per_hole if holes is not None else None
            return _taken(keep, self._octants(rows, places), most, holes, per_hole)
        if self._holes is None:
            return keep
        hole = self._holes[np.where(keep, found, 0)]
        if own is not None:
            keep &= hole != own[:, None]
        if self._near.max_per_hole is not None:
            hole = np.where(keep, hole, -1)
            keep &= turn_of(hole) < self._near.max_per_hole
        return keep


def _taken(
    free: Bools, octant: Ints, per_octant: int, hole: Ints | None, per_hole: int | None
) -> Bools:
    """Return which samples are taken, (m, k), one after the other: a limit counts those taken."""
    keep = np.zeros_like(free)
    for j in range(free.shape[1]):
        before = keep[:, :j]
        take = (before & (octant[:, :j] == octant[:, j : j + 1])).sum(axis=1) < per_octant
        if hole is not None and per_hole is not None:
            take &= (before & (hole[:, :j] == hole[:, j : j + 1])).sum(axis=1) < per_hole
        keep[:, j] = free[:, j] & take
    return keep


def least_factor(
    near: Neighbourhood,
    points: Floats,
    holes: Ints | None,
    targets: Floats,
    own: Ints | None = None,
) -> Floats:
    """Return the factor of the radii at which each target has its fewest samples, (m,).

    Parameters
    ----------
    near : Neighbourhood
        Radii, fewest samples and most samples of a hole.
    points, holes
        Samples, as `Search` takes them.
    targets : (m, 3) float
        Targets.
    own : (m,) int, optional
        The hole that is left out for each target.

    Returns
    -------
    factor : (m,) float
        NaN for a target that has too few samples at any distance, and for rows of NaN.
    """
    there = np.flatnonzero(np.isfinite(targets).all(axis=1))
    out = np.full(len(targets), np.nan)
    everything = np.concatenate([points, targets[there]])
    wide = 2 * float(np.linalg.norm(np.ptp(near.measured(everything), axis=0))) + 1.0
    a, b, c = (wide * r for r in near.radii)
    wider = Neighbourhood(
        radii=(a, b, c), rotation=near.rotation, min_samples=near.min_samples,
        max_samples=near.min_samples, max_per_hole=near.max_per_hole,
        max_per_octant=near.max_per_octant,
    )  # fmt: skip
    search = Search(points, holes, wider)
    for start in range(0, len(there), _ROWS):
        rows = there[start : start + _ROWS]
        found = search.find(targets[rows], None if own is None else own[rows])
        last = points[found.rows[:, -1]] - targets[rows]
        enough = found.counts >= near.min_samples
        out[rows] = np.where(enough, np.linalg.norm(near.measured(last), axis=1), np.nan)
    return out


def turn_of(groups: Ints) -> Ints:
    """Return for each entry the number of equal entries before it in its row."""
    order = np.argsort(groups, axis=1, kind="stable")
    ordered = np.take_along_axis(groups, order, axis=1)
    place = np.broadcast_to(np.arange(groups.shape[1]), groups.shape)
    first = np.ones(groups.shape, dtype=bool)
    first[:, 1:] = ordered[:, 1:] != ordered[:, :-1]
    start = np.maximum.accumulate(np.where(first, place, 0), axis=1)
    out = np.empty_like(groups)
    np.put_along_axis(out, order, place - start, axis=1)
    return out


def _packed(found: Ints, keep: Bools, most: int) -> Ints:
    """Return the kept entries of each row moved to its front, (m, most), followed by zeros."""
    order = np.argsort(~keep, axis=1, kind="stable")[:, :most]
    kept = np.take_along_axis(keep, order, axis=1)
    out: Ints = np.where(kept, np.take_along_axis(found, order, axis=1), 0)
    return out
