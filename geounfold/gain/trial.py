"""Kriging in some coordinates, with a variogram fitted in the same way everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geounfold.estimation import (
    FittedVariogram,
    Neighbourhood,
    Variogram,
    fit_variogram,
    krige,
)
from geounfold.gain.arms import (
    Places,
    best_planes,
    limbs_of,
    rotation_of,
    thickness_of,
)
from geounfold.geometry.mesh import Floats, Ints

NEAREST, PER_HOLE = 24, 6
"""Samples of an estimate: the nearest in units of the ranges, and the most of one hole."""

_FEWEST = 60  # samples of a limb that has a variogram of its own
_LEAST = 20  # and of any variogram


@dataclass(frozen=True, eq=False)
class Tried:
    """Estimates in some coordinates.

    Attributes
    ----------
    found : (m,) float
        At the targets.
    back : (c,) float
        At the samples that are checked, from the other holes only.
    model : Variogram
        As fitted; of limbs, that of the largest.
    value : float
        The fit's `FittedVariogram.value`: the smaller, the likelier are the samples.
    """

    found: Floats
    back: Floats
    model: Variogram
    value: float = float("nan")


@dataclass(frozen=True, eq=False)
class Trial:
    """Samples with their grades, which several arms estimate alike.

    Attributes
    ----------
    values : (n,) float
        Grades.
    holes : (n,) int
        Hole of each sample.
    fitted : (f,) int
        Rows to which variograms are fitted.
    checked : (c,) int
        Rows that are estimated from the other holes.
    kinds : tuple of str
        Structures that the fit tries.
    """

    values: Floats
    holes: Ints
    fitted: Ints
    checked: Ints
    kinds: tuple[str, ...] = ("spherical", "exponential")

    def error(self, tried: Tried) -> float:
        """Return the root mean square error at the checked samples."""
        off = tried.back - self.values[self.checked]
        return float(np.sqrt(np.nanmean(off**2)))

    def run(self, points: Floats, targets: Floats, **how: Any) -> Tried:
        """Return the estimates in one kind of coordinates.

        Parameters
        ----------
        points, targets : (n, 3), (m, 3) float
            Places of the samples and of the targets; those of NaN are left out.
        **how
            Arguments of `fit_variogram`: the anisotropy and the rotation.
        """
        good = np.asarray(np.isfinite(points).all(axis=1))
        rows = self.fitted[good[self.fitted]]
        fitted = self._fit(points, rows, **how)
        own = np.flatnonzero(good)
        found, back = self._kriged(points, own, targets, self.checked, fitted.model)
        return Tried(found, back, fitted.model, fitted.value)

    def _fit(self, points: Floats, rows: Ints, **how: Any) -> FittedVariogram:
        """Return the variogram of some rows: nugget and one structure."""
        return fit_variogram(
            points[rows], self.values[rows],
            holes=self.holes[rows], structures=1, kinds=self.kinds, **how,
        )  # fmt: skip

    def plane(self, own: Places, targets: Places, spacing: float) -> Tried:
        """Return the estimates with one plane of anisotropy, which the samples choose.

        Of the mean plane of their places and the two along which grades are most alike, the one
        of the likeliest variogram.
        """
        return min(self.planes(own, targets, spacing), key=lambda tried: tried.value)

    def planes(self, own: Places, targets: Places, spacing: float) -> list[Tried]:
        """Return the estimates with each plane that is tried."""
        middle = own.folded - own.folded.mean(axis=0)
        flattest = np.linalg.svd(middle, full_matrices=False)[2][2]
        normals = [flattest, *best_planes(own.folded, self.values, spacing)]
        return [self.turned(own, targets, normal) for normal in normals]

    def turned(self, own: Places, targets: Places, normal: Floats) -> Tried:
        """Return the estimates with a plane of anisotropy of some normal (3,)."""
        rotation = rotation_of(normal)
        return self.run(own.folded, targets.folded, anisotropy="transverse", rotation=rotation)

    def limbs(self, own: Places, targets: Places) -> Tried:
        """Return the estimates by domains of like dip, none of which uses another's samples."""
        limbs = limbs_of(own.normal)
        of, at = limbs.of(own.normal), limbs.of(targets.normal)
        checked = of[self.checked]
        found, back = np.full(len(targets), np.nan), np.full(len(self.checked), np.nan)
        model, first = None, None
        for k in np.argsort(-np.bincount(of, minlength=len(limbs.axes)), kind="stable"):
            mine, rotation = np.flatnonzero(of == k), rotation_of(limbs.axes[k])
            if not len(mine):
                continue
            rows = self.fitted[of[self.fitted] == k]
            if model is None or len(rows) >= _FEWEST:
                rows = rows if len(rows) >= _LEAST else mine
                how: dict[str, Any] = {"anisotropy": "transverse", "rotation": rotation}
                model = self._fit(own.folded, rows, **how).model
            first = model if first is None else first
            some, check = at == k, checked == k
            found[some], back[check] = self._kriged(
                own.folded, mine, targets.folded[some], self.checked[check],
                replace(model, rotation=rotation),
            )  # fmt: skip
        assert first is not None
        return Tried(found, back, first)

    def arms(self, own: Places, targets: Places, spacing: float) -> Mapping[str, Tried]:
        """Return the estimates of every arm, see `ARMS`."""
        thickness = thickness_of(own)
        level = own.stratigraphic(thickness), targets.stratigraphic(thickness)
        return {
            "isotropic": self.run(own.folded, targets.folded, anisotropy="isotropic"),
            "plane": self.plane(own, targets, spacing),
            "limbs": self.limbs(own, targets),
            "stratigraphic": self.run(*level, anisotropy="transverse"),
            "unfolded": self.run(own.flat, targets.flat, anisotropy="transverse"),
        }

    def _kriged(
        self, points: Floats, own: Ints, targets: Floats, checked: Ints, model: Variogram
    ) -> tuple[Floats, Floats]:
        """Return estimates at targets, and at checked rows, from some rows of samples."""
        near = _neighbourhood(model, points[own])
        P, v, holes = points[own], self.values[own], self.holes[own]
        found = np.empty(0)
        if len(targets):
            found = krige(P, v, targets, model, near, holes=holes).estimate
        back = np.full(len(checked), np.nan)
        there = np.isfinite(points[checked]).all(axis=1)
        if there.any():
            at = checked[there]
            back[there] = krige(
                P, v, points[at], model, near, holes=holes, leave_out=self.holes[at]
            ).estimate
        return found, back


def whole_holes(holes: Ints, most: int, seed: int) -> Ints:
    """Return rows of whole holes, drawn until there would be more than so many."""
    order = np.random.default_rng(seed).permutation(np.unique(holes))
    count = np.cumsum(np.bincount(holes)[order])
    chosen = order[: max(2, int(np.searchsorted(count, most, side="right")))]
    return np.flatnonzero(np.isin(holes, chosen))


def _neighbourhood(model: Variogram, points: Floats) -> Neighbourhood:
    """Return the search: everything within reach, the nearest in units of the ranges first."""
    ranges = np.array(model.ranges) if model.structures else np.ones(3)
    extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    a, b, c = (2 * extent * ranges / ranges.min()).tolist()
    return Neighbourhood(
        radii=(a, b, c),
        rotation=model.rotation,
        min_samples=1,
        max_samples=NEAREST,
        max_per_hole=PER_HOLE,
    )
