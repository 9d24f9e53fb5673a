"""Estimate folded blocks from folded samples in the unfolded space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError, check_number
from geounfold.estimation.axes import AxisInBody, axes_in_body
from geounfold.estimation.declustering import Declustering, decluster
from geounfold.estimation.fit import FittedVariogram, fit_variogram
from geounfold.estimation.flat_samples import FlatSamples, flat_samples, in_body
from geounfold.estimation.kriging import (
    FLAGS,
    OUTSIDE,
    OUTSIDE_BODY,
    Estimates,
    Method,
    cross_validate,
    gathered,
    krige,
)
from geounfold.estimation.neighbourhood import LIMITS, Neighbourhood, least_factor
from geounfold.estimation.position_error import with_position_error
from geounfold.estimation.scores import Conservation, conservation
from geounfold.estimation.support import BlockSupport, discretised
from geounfold.estimation.variogram import Triple, Variogram
from geounfold.geometry.mesh import Floats
from geounfold.io.grade_values import GradeRules, grade_rules
from geounfold.io.result_columns import frame_points
from geounfold.io.selection import read_where
from geounfold.io.tables.points import chosen_rows
from geounfold.mapping.carried import Carried, checked_points

_REACH = 2.0
"""Search radii in variogram ranges, if the user gives none and all blocks find their samples."""

_CLEAR = 1.001  # radii over the distance of the last sample that is needed


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
        ordinary, simple, inverse_distance or nearest.
    variogram : Variogram or None
        Model in the unfolded space; None for inverse distance.
    fitted : FittedVariogram or None
        Result of the fit; None if the user gave the variogram.
    neighbourhood : Neighbourhood
        Search neighbourhood in the unfolded space.
    declustering : Declustering or None
        Weights of the samples; None if the user asked for none.
    body_known : bool
        Whether the map holds the body's own blocks. Without them, blocks and samples inside the
        control mesh between bottom and top count as the body's.
    widened : (float, int) or None
        Factor by which the search radii exceed twice the variogram's ranges, and the number of
        blocks that need it; None if no block does, or the user gave the radii.
    position_error : (float, float) or None
        Standard deviations of a place along and across the layers, with which the variogram was
        blurred for kriging; None if places count as exact.
    support : BlockSupport or None
        Blocks that are estimated as means; None for points at their centroids.
    others : mapping of Estimates
        Estimates by other methods from the same samples, by method.
    realisations : (m, k) float or None
        Conditional simulations (`realisations.with_realisations`); NaN as the estimates.
    """

    grade: str
    blocks: Estimates
    carried: Carried
    samples: FlatSamples
    method: str
    variogram: Variogram | None
    fitted: FittedVariogram | None
    neighbourhood: Neighbourhood
    declustering: Declustering | None = None
    body_known: bool = True
    widened: tuple[float, int] | None = None
    position_error: tuple[float, float] | None = None
    support: BlockSupport | None = None
    others: Mapping[str, Estimates] = field(default_factory=dict)
    realisations: Floats | None = None

    @property
    def columns(self) -> dict[str, Any]:
        """The results by column name: the grade with _estimate ... _flag, and location."""
        b, grade = self.blocks, self.grade
        more = {"efficiency": b.efficiency, "slope": b.slope}
        return {
            f"{grade}_estimate": b.estimate,
            f"{grade}_variance": b.variance,
            **{f"{grade}_{n}": values for n, values in more.items() if values is not None},
            **{f"{grade}_{method}": found.estimate for method, found in self.others.items()},
            **{
                f"{grade}_r{k}": values
                for k, values in enumerate(
                    () if self.realisations is None else self.realisations.T, 1
                )
            },
            f"{grade}_samples": b.samples,
            f"{grade}_flag": b.flag,
            "location": self.carried.location,
        }

    @property
    def frame(self) -> pd.DataFrame:
        """The results as a table, one row per block."""
        return pd.DataFrame(self.columns)

    def cross_validation(self, method: str | None = None) -> Estimates:
        """Return every sample estimated by the same rules from the other holes only.

        Samples are points, also if blocks are estimated.

        Parameters
        ----------
        method : str, optional
            Another method than the estimates'.

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
            s.points, s.grades, s.holes, self._kriged_with, self.neighbourhood,
            method=method or self.method,
        )  # fmt: skip

    @property
    def axes(self) -> tuple[AxisInBody, ...]:
        """The variogram's axes in the layer, with their directions in the body."""
        if self.variogram is None:
            return ()
        return axes_in_body(self.variogram, self.samples.points, self.samples.folded)

    @property
    def _kriged_with(self) -> Variogram | None:
        return _blurred(self.variogram, self.position_error)

    def conservation(self, volumes: Floats, volume_ratio: Floats) -> Conservation:
        """Return the metal of the estimates in both spaces, as `scores.conservation`."""
        return conservation(self.blocks.estimate, volumes, volume_ratio)

    def warnings(self) -> list[str]:
        """Return one line for each group of samples left out or blocks not estimated."""
        counts = self.blocks.counts()
        lines = self.samples.warnings(self.grade)
        if self.fitted is not None:
            lines += self.fitted.warnings()
        if self.widened is not None and self.widened[1]:
            few, radii = self.neighbourhood.min_samples, self.neighbourhood.radii
            lines.append(
                f"{self.widened[1]} of {len(self.blocks.flag)} blocks have fewer than {few} "
                f"samples within twice the variogram's ranges: the search radii are "
                f"{', '.join(f'{r:.4g}' for r in radii)} so that none stays empty; --radii sets "
                "others"
            )
        more = {OUTSIDE_BODY: "; --all-blocks estimates them too"}
        lines += [
            f"{counts[flag]} of {len(self.blocks.flag)} blocks are not estimated: {flag}"
            f"{more.get(flag, '')}"
            for flag in FLAGS[1:]
            if counts[flag]
        ]
        if self.support is not None and self.support.plain:
            lines.append(
                f"{self.support.plain} of {len(self.blocks.flag)} blocks reach out of the map on "
                "both sides: their support keeps the folded axes"
            )
        if not self.body_known and (counts[OUTSIDE_BODY] or self.samples.wall_rock):
            lines.append(
                "the map does not hold the body's blocks: what lies inside its control mesh, "
                "between bottom and top, counts as the body's, some of it beyond the rim; unfold "
                "again with --map"
            )
        return lines

    def summary(self) -> dict[str, Any]:
        """Return everything except the values per block, as a dict for JSON."""
        near, v = self.neighbourhood, self.blocks.estimate
        known = v[np.isfinite(v)]
        return {
            "grade": self.grade,
            "method": self.method,
            "support": "points at the blocks' centroids"
            if self.support is None
            else {
                "block_size": list(self.support.sizes),
                "discretised": list(self.support.numbers),
            },
            "variogram": None if self.variogram is None else self.variogram.facts(),
            "variogram_axes": [axis.row() for axis in self.axes],
            "position_error": self.position_error,
            "variogram_fitted": self.fitted is not None,
            "variogram_fit": None if self.fitted is None else self.fitted.facts(),
            "variogram_misfit": None if self.fitted is None else self.fitted.misfit,
            "neighbourhood": {
                "radii": list(near.radii),
                "rotation": list(near.rotation),
                "min_samples": near.min_samples,
                "max_samples": near.max_samples,
                "max_per_hole": near.max_per_hole,
                "max_per_octant": near.max_per_octant,
                "min_holes": near.min_holes,
                "min_octants": near.min_octants,
                "widened": None if self.widened is None else self.widened[0],
            },
            "samples": self.samples.facts(),
            "blocks": {"given": len(v), **self.blocks.counts()},
            "mean_of_samples": float(self.samples.grades.mean()),
            "declustered": None if self.declustering is None else self.declustering.facts(),
            "mean_of_blocks": float(known.mean()) if len(known) else None,
            "other_methods": {m: _mean(found.estimate) for m, found in self.others.items()},
            "kriging_efficiency": _mean(self.blocks.efficiency),
            "regression_slope": _mean(self.blocks.slope),
            "warnings": self.warnings(),
        }


def _mean(values: Floats | None) -> float | None:
    known = np.zeros(0) if values is None else values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def estimate(  # 21 arguments: a public name; seventeen of them are choices by keyword
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
    where: str | None = None,
    samples_where: str | None = None,
    values: GradeRules | Mapping[str, Any] | None = None,
    soft_boundary: float = 0.0,
    all_blocks: bool = False,
    cells: Any = None,
    block_size: Triple | None = None,
    discretise: tuple[int, int, int] = (3, 3, 3),
    also: Sequence[Method] = (),
    position_error: tuple[float, float] | None = None,
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
    method : {"ordinary", "simple", "inverse_distance", "nearest"}
        Ordinary kriging, simple kriging, inverse distance or the nearest sample.
    neighbourhood : Neighbourhood or mapping, optional
        The search neighbourhood, or a mapping of some of its parameters. Without radii, the
        radii are twice the variogram's ranges, along its axes, or as much more as blocks and
        cross-validation need to find `min_samples`.
    mean : float, optional
        Mean of simple kriging; the default is the mean of the samples.
    power : float
        Power of inverse distance.
    workers : int
        Number of processes at a time.
    where, samples_where : str, optional
        Choose rows of `blocks` and `samples`, such as ``"ROCK=ORE"``. The answer has the rows
        chosen alone.
    values : GradeRules or mapping, optional
        How the grade's values are read: ``missing`` codes, ``below_detection``, ``cap``.
    soft_boundary : float
        Largest distance from the body, in blocks, of samples that are used. The default leaves
        out samples in wall rock.
    all_blocks : bool
        Whether blocks outside the body are estimated too, as far as the map reaches.
    cells : (float, float, float) or "auto", optional
        Sides of the cells that weigh clustered samples, in the unfolded space (`decluster`). The
        weights are for statistics, and for the mean of simple kriging.
    block_size : (float, float, float), optional
        Sides of the blocks along the folded x, y and z: kriging then estimates means of blocks,
        with kriging efficiency and slope of regression. The default is points at the centroids.
    discretise : (int, int, int)
        Points along each side of a block, each in its own part of it, carried to the unfolded space
        by the map's stretch at the block.
    also : methods
        Other methods that estimate the same blocks from the same samples, side by side.
    position_error : (float, float), optional
        Standard deviations of a place along and across the layers, in the points' unit, by which
        the variogram is blurred (`with_position_error`). The default is that of an Unfolding with
        uncertainty, and none of others.

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
    check_number("soft_boundary", soft_boundary, 0)
    flat = flat_samples(
        carrier, _rows(samples, samples_where, "the samples"),
        grade=grade, hole=hole, rules=grade_rules(values), soft_boundary=soft_boundary,
        source=str(samples.attrs.get("source", "the samples")),
    )  # fmt: skip
    weighed = None if cells is None else decluster(flat.points, flat.grades, cells)
    if blocks is None:
        carried = getattr(unfolding, "carried", None)
        if carried is None:
            raise InputError("a map holds no blocks: give their centroids")
    else:
        centres = _points(_rows(blocks, where, "the blocks"))
        carried = carrier.carry(centres)
    reached = np.isfinite(carried.points).all(axis=1)
    if not reached.any():
        raise InputError(
            f"the map reaches none of the {len(reached)} blocks: are they in the coordinates of "
            "the body that was unfolded?"
        )
    own = np.ones(len(carried.points), dtype=bool)
    if blocks is not None and not all_blocks:
        own = in_body(carrier, centres, carried)
    if weighed is not None and mean is None and "simple" in (method, *also):
        mean = weighed.mean
    fitted, kriged = None, not {"ordinary", "simple"}.isdisjoint((method, *also))
    if variogram is None and (kriged or _needs_radii(neighbourhood)):
        fitted = fit_variogram(flat.points, flat.grades, holes=flat.holes)
        variogram = fitted.model
    if position_error is None and getattr(unfolding, "uncertainty", None) is not None:
        position_error = unfolding.uncertainty.mean
    targets = np.where(own[:, None], carried.points, np.nan)
    near, widened = _neighbourhood(neighbourhood, variogram, flat, targets)
    support = None
    if block_size is not None:
        folded = unfolding.folded if blocks is None else centres
        support = BlockSupport.of(carrier, folded, block_size, discretise)
    rules = _Rules(
        flat, targets, _blurred(variogram, position_error), near, mean, power, workers, support
    )
    found: dict[str, Estimates] = {m: rules.krige(m) for m in dict.fromkeys((method, *also))}
    outside = reached & ~own
    for each, e in found.items():
        found[each] = replace(e, flag=np.where(outside, OUTSIDE_BODY, e.flag))
    if not kriged:
        variogram = fitted = None
    known = getattr(carrier, "body", None) is not None
    main = found.pop(method)
    return Estimation(
        grade, main, carried, flat, method, variogram, fitted, near, weighed, known, widened,
        position_error, support, found,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Rules:
    """What the methods of one run have in common."""

    flat: FlatSamples
    targets: Floats
    variogram: Variogram | None
    near: Neighbourhood
    mean: float | None
    power: float
    workers: int
    support: BlockSupport | None

    def krige(self, method: Method) -> Estimates:
        """Return the estimates of a method."""
        s, flat, blocks = self.support, self.flat, None
        if s is not None and method in ("ordinary", "simple"):
            blocks = discretised(np.array(s.sizes), s.numbers), s.axes
        return krige(
            flat.points, flat.grades, self.targets, self.variogram, self.near,
            method=method, holes=flat.holes, mean=self.mean, power=self.power,
            workers=self.workers, blocks=blocks,
        )  # fmt: skip


def _blurred(
    variogram: Variogram | None, position_error: tuple[float, float] | None
) -> Variogram | None:
    """Return the variogram to krige with: that of values at places with an error."""
    if variogram is None or position_error is None:
        return variogram
    return with_position_error(variogram, *position_error)


def _rows(given: Any, where: str | None, source: str) -> Any:
    """Return the rows of a DataFrame that an expression chooses."""
    if where is None:
        return given
    if not isinstance(given, pd.DataFrame):
        raise InputError(f"where chooses rows by columns: give {source} as a DataFrame")
    return given.loc[chosen_rows(read_where(where), given, source)]


def _points(blocks: pd.DataFrame | Floats) -> Floats:
    P = frame_points(blocks) if isinstance(blocks, pd.DataFrame) else blocks
    return checked_points(P)


def _needs_radii(given: Neighbourhood | Mapping[str, Any] | None) -> bool:
    return not isinstance(given, Neighbourhood) and "radii" not in (given or {})


def _neighbourhood(
    given: Neighbourhood | Mapping[str, Any] | None,
    variogram: Variogram | None,
    flat: FlatSamples,
    targets: Floats,
) -> tuple[Neighbourhood, tuple[float, int] | None]:
    """Return the neighbourhood given, with radii from variogram and spacing if it has none.

    With it come the factor and the number of blocks of `Estimation.widened`.
    """
    if isinstance(given, Neighbourhood):
        return given, None
    words = dict(given or {})
    unknown = set(words) - set(LIMITS) - {"radii", "rotation"}
    if unknown:
        raise OptionError(f"a neighbourhood has no parameter {sorted(unknown)[0]!r}")
    if "radii" in words:
        return Neighbourhood(**words), None
    words["radii"] = _radii(variogram, flat.points)
    words["rotation"] = (0.0, 0.0, 0.0) if variogram is None else variogram.rotation
    near = Neighbourhood(**words)
    samples = gathered(flat.points, flat.grades, flat.holes)
    if flat.holes is None and near.max_per_hole is not None:
        return near, None  # refused by `krige`
    needed = least_factor(near, samples.points, samples.holes, targets)
    most = [float(np.nanmax(needed, initial=0.0))]
    if samples.holes is not None:
        left_out = least_factor(near, samples.points, samples.holes, samples.points, samples.holes)
        most.append(float(np.nanmax(left_out, initial=0.0)))
    if max(most) <= 1:
        return near, None
    factor = _CLEAR * max(most)
    a, b, c = (factor * r for r in near.radii)
    return replace(near, radii=(a, b, c)), (factor, int(np.count_nonzero(needed > 1)))


def _radii(variogram: Variogram | None, points: Floats) -> Triple:
    """Return twice the ranges; for a pure nugget, the diagonal of the samples' extent."""
    if variogram is None or not variogram.structures:
        extent = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        return extent, extent, extent
    a, b, c = (_REACH * r for r in variogram.reach)
    return a, b, c


__all__ = ["OUTSIDE", "Estimation", "FlatSamples", "estimate", "flat_samples"]
