"""Estimate folded blocks from folded samples in the unfolded space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pandas as pd

from geounfold.drillholes.tables import ALIASES
from geounfold.errors import InputError, OptionError
from geounfold.estimation.fit import FittedVariogram, fit_variogram
from geounfold.estimation.kriging import (
    FLAGS,
    OUTSIDE,
    Estimates,
    Method,
    cross_validate,
    hole_numbers,
    krige,
)
from geounfold.estimation.neighbourhood import Neighbourhood
from geounfold.estimation.scores import Conservation, conservation
from geounfold.estimation.variogram import Triple, Variogram
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.coordinate_columns import numbers
from geounfold.io.packages.names import plain_name
from geounfold.io.result_columns import frame_points
from geounfold.mapping.carried import Carried, checked_points

_REACH = 2.0  # search radii in variogram ranges, if the user gives none
_PLAIN = {"min_samples", "max_samples", "max_per_hole"}


class Carries(Protocol):
    """An object that carries points to the unfolded space, such as an UnfoldingMap."""

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Return the images of the points."""
        ...


@dataclass(frozen=True, eq=False)
class FlatSamples:
    """Samples that have a grade and an image in the unfolded space.

    Attributes
    ----------
    points : (n, 3) float
        Unfolded coordinates, in the map's unit.
    folded : (n, 3) float
        Folded coordinates, as given.
    grades : (n,) float
        Values of the grade, in its column's unit.
    holes : (n,) int or None
        Number of each sample's hole; None if the holes are not known.
    stratigraphic : (n,) float
        Stratigraphic height: 0 at the bottom, 1 at the top.
    rows : (n,) int
        Row of each sample in the table given, from 0.
    given : int
        Number of samples given.
    without_grade : int
        Number left out because the grade or a coordinate is missing.
    outside : int
        Number left out because they lie outside the map.
    """

    points: Floats
    folded: Floats
    grades: Floats
    holes: Ints | None
    stratigraphic: Floats
    rows: Ints
    given: int
    without_grade: int
    outside: int

    def facts(self) -> dict[str, int]:
        """Return the counts of samples given, used and left out, for a summary."""
        return {
            "given": self.given,
            "used": len(self.grades),
            "without_grade": self.without_grade,
            "outside_map": self.outside,
        }


@dataclass(frozen=True, eq=False)
class Estimation:
    """Estimates on the folded blocks, with the samples, model and rules that gave them.

    Attributes
    ----------
    grade : str
        Column of the samples that was estimated.
    blocks : Estimates
        One estimate per block, in the blocks' order.
    carried : Carried
        The blocks in the unfolded space.
    samples : FlatSamples
        The samples used.
    method : str
        ordinary, simple or inverse_distance.
    variogram : Variogram or None
        Model in the unfolded space; None for inverse distance.
    fitted : FittedVariogram or None
        Result of the fit; None if the user gave the variogram.
    neighbourhood : Neighbourhood
        Search neighbourhood in the unfolded space.
    """

    grade: str
    blocks: Estimates
    carried: Carried
    samples: FlatSamples
    method: str
    variogram: Variogram | None
    fitted: FittedVariogram | None
    neighbourhood: Neighbourhood

    @property
    def columns(self) -> dict[str, Any]:
        """The results by column name: the grade with _estimate, _variance, _samples or _flag."""
        b = self.blocks
        return {
            f"{self.grade}_estimate": b.estimate,
            f"{self.grade}_variance": b.variance,
            f"{self.grade}_samples": b.samples,
            f"{self.grade}_flag": b.flag,
        }

    @property
    def frame(self) -> pd.DataFrame:
        """The results as a table, one row per block."""
        return pd.DataFrame(self.columns)

    def cross_validation(self) -> Estimates:
        """Return every sample estimated by the same rules from the other holes only.

        Raises
        ------
        InputError
            The holes of the samples are not known.
        """
        s = self.samples
        if s.holes is None:
            raise InputError(
                "cross-validation leaves out whole holes: give the name of the samples' hole column"
            )
        return cross_validate(
            s.points, s.grades, s.holes, self.variogram, self.neighbourhood, method=self.method
        )

    def conservation(self, volumes: Floats, volume_ratio: Floats) -> Conservation:
        """Return the metal of the estimates in both spaces, as `scores.conservation`."""
        return conservation(self.blocks.estimate, volumes, volume_ratio)

    def warnings(self) -> list[str]:
        """Return one line for each group of samples left out or blocks not estimated."""
        s, counts = self.samples, self.blocks.counts()
        lines = []
        if s.without_grade:
            lines.append(f"{s.without_grade} of {s.given} samples have no {self.grade}: left out")
        if s.outside:
            lines.append(f"{s.outside} of {s.given} samples lie outside the map: left out")
        lines += [
            f"{counts[flag]} of {len(self.blocks.flag)} blocks are not estimated: {flag}"
            for flag in FLAGS[1:]
            if counts[flag]
        ]
        return lines

    def summary(self) -> dict[str, Any]:
        """Return everything except the values per block, as a dict for JSON."""
        near, v = self.neighbourhood, self.blocks.estimate
        known = v[np.isfinite(v)]
        return {
            "grade": self.grade,
            "method": self.method,
            "support": "points at the blocks' centroids",
            "variogram": None if self.variogram is None else self.variogram.facts(),
            "variogram_fitted": self.fitted is not None,
            "variogram_misfit": None if self.fitted is None else self.fitted.misfit,
            "neighbourhood": {
                "radii": list(near.radii),
                "rotation": list(near.rotation),
                "min_samples": near.min_samples,
                "max_samples": near.max_samples,
                "max_per_hole": near.max_per_hole,
            },
            "samples": self.samples.facts(),
            "blocks": {"given": len(v), **self.blocks.counts()},
            "mean_of_samples": float(self.samples.grades.mean()),
            "mean_of_blocks": float(known.mean()) if len(known) else None,
            "warnings": self.warnings(),
        }


def estimate(  # 11 arguments: a public name; seven of them are choices by keyword
    unfolding: Any,
    samples: pd.DataFrame,
    blocks: pd.DataFrame | Floats | None = None,
    variogram: Variogram | None = None,
    *,
    grade: str,
    hole: str | None = None,
    method: Method = "ordinary",
    neighbourhood: Neighbourhood | Mapping[str, Any] | None = None,
    mean: float | None = None,
    power: float = 2.0,
    workers: int = 1,
) -> Estimation:
    """Estimate a grade on folded blocks from folded samples, in the unfolded space.

    Parameters
    ----------
    unfolding : Unfolding or UnfoldingMap
        The map from the folded to the unfolded space.
    samples : DataFrame
        Folded coordinates (columns found by name), the grade and, if known, the hole.
    blocks : DataFrame or (m, 3) array, optional
        Folded centroids. The default is the blocks of the Unfolding; a map holds none.
    variogram : Variogram, optional
        Model in the unfolded space. Without rotation its first two axes lie in the layer and the
        third points across it. The default is a model fitted to the samples (`fit_variogram`).
    grade : str
        Column of the samples to estimate. Rows without a value are left out and counted.
    hole : str, optional
        Column of the hole's name. The default is the one column with a usual name, if any.
    method : {"ordinary", "simple", "inverse_distance"}
        Ordinary kriging, simple kriging or inverse distance.
    neighbourhood : Neighbourhood or mapping, optional
        The search neighbourhood, or a mapping of some of its parameters. Without radii, the
        radii are twice the variogram's ranges, along its axes.
    mean : float, optional
        Mean of simple kriging; the default is the mean of the samples.
    power : float
        Power of inverse distance.
    workers : int
        Number of processes at a time.

    Returns
    -------
    Estimation
        In the blocks' order.

    Raises
    ------
    InputError
        A column is missing or has no usable value, no sample lies in the map, or no blocks are
        given.
    OptionError
        A value is outside its valid range.
    MissingDependencyError
        gstlearn is not installed (extra ``geostat``).
    """
    carrier = getattr(unfolding, "map", unfolding)
    flat = flat_samples(carrier, samples, grade=grade, hole=hole)
    if blocks is None:
        carried = getattr(unfolding, "carried", None)
        if carried is None:
            raise InputError("a map holds no blocks: give their centroids")
    else:
        carried = carrier.carry(_points(blocks))
    fitted = None
    if variogram is None and (method != "inverse_distance" or _needs_radii(neighbourhood)):
        fitted = fit_variogram(flat.points, flat.grades)
        variogram = fitted.model
    near = _neighbourhood(neighbourhood, variogram, flat.points)
    found = krige(
        flat.points, flat.grades, carried.points, variogram, near,
        method=method, holes=flat.holes, mean=mean, power=power, workers=workers,
    )  # fmt: skip
    if method == "inverse_distance":
        variogram = fitted = None
    return Estimation(grade, found, carried, flat, method, variogram, fitted, near)


def flat_samples(
    carrier: Carries, samples: pd.DataFrame, *, grade: str, hole: str | None = None
) -> FlatSamples:
    """Return the samples that have a grade and an image, in the unfolded space.

    Raises
    ------
    InputError
        The column is missing, its values are not numbers, or no sample is left.
    """
    P = frame_points(samples)
    values = numbers(_column(samples, grade))
    graded: Bools = np.isfinite(values)
    holes = _holes(samples, hole)
    there = graded & np.isfinite(P).all(axis=1)
    rows = np.flatnonzero(there)
    if not len(rows):
        raise InputError(f"no sample has a value of '{grade}' and coordinates")
    carried = carrier.carry(checked_points(P[rows]))
    inside = np.isfinite(carried.points).all(axis=1)
    if not inside.any():
        raise InputError(
            f"none of the {len(rows)} samples lies within the map's reach: check that samples and "
            "blocks have the same coordinates and unit"
        )
    kept = rows[inside]
    return FlatSamples(
        points=carried.points[inside],
        folded=P[kept],
        grades=values[kept],
        holes=None if holes is None else holes[kept],
        stratigraphic=carried.stratigraphic[inside],
        rows=kept,
        given=len(samples),
        without_grade=int(len(samples) - len(rows)),
        outside=int(np.count_nonzero(~inside)),
    )


def _points(blocks: pd.DataFrame | Floats) -> Floats:
    P = frame_points(blocks) if isinstance(blocks, pd.DataFrame) else blocks
    return checked_points(P)


def _column(frame: pd.DataFrame, name: str) -> pd.Series:
    where = [k for k, column in enumerate(frame.columns) if str(column) == name]
    if len(where) != 1:
        what = "no" if not where else "more than one"
        words = ", ".join(str(c) for c in frame.columns[:20])
        raise InputError(f"the samples have {what} column '{name}'; columns: {words}")
    return frame.iloc[:, where[0]]


def _holes(frame: pd.DataFrame, name: str | None) -> Ints | None:
    """Return the number of each sample's hole; None if no single column names the hole."""
    if name is None:
        aliases = ALIASES["assay"]["hole"]
        found = [str(column) for column in frame.columns if plain_name(column) in aliases]
        if len(found) != 1:
            return None
        name = found[0]
    return hole_numbers(_column(frame, name).to_numpy(dtype=object))


def _needs_radii(given: Neighbourhood | Mapping[str, Any] | None) -> bool:
    return not isinstance(given, Neighbourhood) and "radii" not in (given or {})


def _neighbourhood(
    given: Neighbourhood | Mapping[str, Any] | None, variogram: Variogram | None, points: Floats
) -> Neighbourhood:
    """Return the neighbourhood given, with radii from the variogram if it has none."""
    if isinstance(given, Neighbourhood):
        return given
    words = dict(given or {})
    unknown = set(words) - _PLAIN - {"radii", "rotation"}
    if unknown:
        raise OptionError(f"a neighbourhood has no parameter {sorted(unknown)[0]!r}")
    if "radii" not in words:
        extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        ranges = (0.0, 0.0, 0.0) if variogram is None else variogram.ranges
        words["radii"] = _radii(ranges, extent)
        words["rotation"] = (0.0, 0.0, 0.0) if variogram is None else variogram.rotation
    return Neighbourhood(**words)


def _radii(ranges: Triple, extent: float) -> Triple:
    """Return twice the ranges; for a pure nugget, the diagonal of the samples' extent."""
    if not min(ranges) > 0:
        return extent, extent, extent
    a, b, c = (_REACH * r for r in ranges)
    return a, b, c


__all__ = ["OUTSIDE", "Estimation", "FlatSamples", "estimate", "flat_samples"]
