"""From samples to blocks through the unfolded space."""

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
from geounfold.io.coordinate_columns import numbers, plain_name
from geounfold.io.result_columns import frame_points
from geounfold.mapping.carried import Carried, checked_points

_REACH = 2.0  # ranges: radii of the search where none are given
_PLAIN = {"min_samples", "max_samples", "max_per_hole"}


class Carries(Protocol):
    """What carries points to the flat space: an UnfoldingMap."""

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Return where points came to lie."""
        ...


@dataclass(frozen=True, eq=False)
class FlatSamples:
    """Samples carried to the unfolded space, those with a grade and an image.

    Attributes
    ----------
    points : (n, 3) float
        Unfolded.
    folded : (n, 3) float
    grades : (n,) float
    holes : (n,) int or None
        Numbers of the holes.
    stratigraphic : (n,) float
        0 at the bottom, 1 at the top.
    rows : (n,) int
        Rows of the samples given.
    given, without_grade, outside : int
        How many there were, and why some are not here.
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
        """Return the counts, for a summary."""
        return {
            "given": self.given,
            "used": len(self.grades),
            "without_grade": self.without_grade,
            "outside_map": self.outside,
        }


@dataclass(frozen=True, eq=False)
class Estimation:
    """Estimates on the folded blocks, and how they came about.

    Attributes
    ----------
    grade : str
        The column estimated.
    blocks : Estimates
        In the blocks' order.
    carried : Carried
        Where the blocks lie in the unfolded space.
    samples : FlatSamples
        What they were estimated from.
    method : str
    variogram : Variogram or None
        In the unfolded space; None for inverse distance.
    fitted : FittedVariogram or None
        Where the variogram was fitted.
    neighbourhood : Neighbourhood
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
        """The results by column name: the grade's, then _estimate, _variance, _samples, _flag."""
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
        """Return every sample estimated from the other holes alone, by the same rules.

        Raises
        ------
        InputError
            The samples' holes are not known.
        """
        s = self.samples
        if s.holes is None:
            raise InputError(
                "cross-validation leaves out whole holes: name the samples' hole column"
            )
        return cross_validate(
            s.points, s.grades, s.holes, self.variogram, self.neighbourhood, method=self.method
        )

    def conservation(self, volumes: Floats, volume_ratio: Floats) -> Conservation:
        """Return the metal of the estimates in both spaces (see `scores.conservation`)."""
        return conservation(self.blocks.estimate, volumes, volume_ratio)

    def warnings(self) -> list[str]:
        """Return one line for each thing that a user should know."""
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
        """Return everything but the blocks, as a dict for JSON."""
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
    samples : DataFrame
        Coordinates (found by name), the grade and the hole; where they were drilled.
    blocks : DataFrame or (m, 3) array, optional
        Folded centroids; of an Unfolding its own without.
    variogram : Variogram, optional
        In the unfolded space: the first two axes of no rotation lie in the layer, the third
        across it.  Fitted to the samples without (`fit_variogram`).
    grade : str
        The samples' column to estimate; rows without a value are left out and counted.
    hole : str, optional
        The column of the hole's name; found by name without, where there is one.
    method : {"ordinary", "simple", "inverse_distance"}
    neighbourhood : Neighbourhood or mapping, optional
        Or some of min_samples, max_samples, max_per_hole alone: radii then are twice the
        variogram's ranges, along its axes.
    mean, power, workers
        As `krige`.

    Returns
    -------
    Estimation

    Raises
    ------
    InputError
        Samples or blocks without what is needed.
    OptionError
        A value outside its valid ones.
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
    """Return samples in the unfolded space, those without a grade or an image left out.

    Raises
    ------
    InputError
        No such column, values that are no numbers, or no sample left.
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
            f"none of the {len(rows)} samples lies in the map's reach: are they in the blocks' "
            "coordinates and unit?"
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
    """Return the number of each sample's hole; None where no column names it."""
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
    """Return the neighbourhood given, its radii from the variogram where there are none."""
    if isinstance(given, Neighbourhood):
        return given
    words = dict(given or {})
    unknown = set(words) - _PLAIN - {"radii", "rotation"}
    if unknown:
        raise OptionError(f"a neighbourhood has no {sorted(unknown)[0]!r}")
    if "radii" not in words:
        extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        ranges = (0.0, 0.0, 0.0) if variogram is None else variogram.ranges
        words["radii"] = _radii(ranges, extent)
        words["rotation"] = (0.0, 0.0, 0.0) if variogram is None else variogram.rotation
    return Neighbourhood(**words)


def _radii(ranges: Triple, extent: float) -> Triple:
    """Return radii of twice the ranges; of a pure nugget, of the samples' extent."""
    if not min(ranges) > 0:
        return extent, extent, extent
    a, b, c = (_REACH * r for r in ranges)
    return a, b, c


__all__ = ["OUTSIDE", "Estimation", "FlatSamples", "estimate", "flat_samples"]
