"""Checks of an estimation beside its samples: variograms, swaths, grade and tonnage, settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.estimation.estimate import Estimation
from geounfold.estimation.experimental import directional
from geounfold.estimation.exploration import swath_between
from geounfold.estimation.fit import FittedVariogram, fit_variogram
from geounfold.estimation.scores import grade_tonnage
from geounfold.estimation.variogram import Variogram

_SLICES, _CUTOFFS = 20, 25


@dataclass(frozen=True, eq=False)
class EstimationChecks:
    """Tables that stand beside an estimation in its report.

    Attributes
    ----------
    grade : str
        Column that was estimated.
    variograms : mapping of DataFrame
        Experimental variograms by space (folded, unfolded), along the axes of the models.
    models : mapping of Variogram
        The model used (unfolded) and one fitted in the same way to the folded places.
    swaths : mapping of DataFrame
        By axis (x, y, stratigraphic): columns low, high, count_samples, mean_samples, count_blocks,
        mean_blocks.
    tonnage : DataFrame
        Columns cutoff, and tonnage and grade of blocks and of samples above it. Samples have their
        declustering weights if there are any.
    settings : list of dict
        Rows of a setting and its value, as a competent person's report lists them.
    expected : tuple of str
        What unfolding is expected to gain here, one sentence each; none if it was not assessed.
    """

    grade: str
    variograms: Mapping[str, pd.DataFrame]
    models: Mapping[str, Variogram]
    swaths: Mapping[str, pd.DataFrame]
    tonnage: pd.DataFrame
    settings: list[dict[str, Any]]
    expected: tuple[str, ...] = ()


def estimation_checks(result: Estimation, summary: Mapping[str, Any]) -> EstimationChecks:
    """Return the checks of an estimation.

    Parameters
    ----------
    result : Estimation
        The estimation.
    summary : mapping
        Its summary, with cross-validation if there is one.
    """
    s, v = result.samples, result.samples.grades
    variograms, models = {}, {}
    try:
        given = result.variogram
        fitted: Variogram | FittedVariogram | None = given
        if given is None:
            fitted = fit_variogram(s.points, v, holes=s.holes)
        folded = fit_variogram(s.folded, v, holes=s.holes)
        for space, points, one in (("folded", s.folded, folded), ("unfolded", s.points, fitted)):
            model = one.model if isinstance(one, FittedVariogram) else one
            if model is not None:
                models[space] = model
                variograms[space] = directional(points, v, rotation=model.rotation)
    except InputError:  # too few samples, or equal ones: the checks have no variograms
        variograms, models = {}, {}
    known = np.isfinite(result.blocks.estimate)
    estimates = result.blocks.estimate[known]
    places = {
        "x": (s.points[:, 0], result.carried.points[known, 0]),
        "y": (s.points[:, 1], result.carried.points[known, 1]),
        "stratigraphic": (s.stratigraphic, result.carried.stratigraphic[known]),
    }
    swaths = {
        name: _beside(own, v, blocks, estimates)
        for name, (own, blocks) in places.items()
        if len(estimates)
    }
    return EstimationChecks(
        result.grade, variograms, models, swaths, _tonnage(result, estimates), settings(summary)
    )


def _beside(
    own: np.ndarray, values: np.ndarray, blocks: np.ndarray, estimates: np.ndarray
) -> pd.DataFrame:
    """Return the swath of samples beside that of blocks, in slices from the first sample on."""
    low, high = float(np.nanmin(own)), float(np.nanmax(own))
    edges = np.linspace(low, high, _SLICES + 1)
    there = (blocks >= low) & (blocks <= high)
    samples = swath_between(own, values, edges)
    found = swath_between(blocks[there], estimates[there], edges)
    return pd.DataFrame(
        {
            "low": samples["low"],
            "high": samples["high"],
            "count_samples": samples["count"],
            "mean_samples": samples["mean"],
            "count_blocks": found["count"],
            "mean_blocks": found["mean"],
        }
    )


def _tonnage(result: Estimation, estimates: np.ndarray) -> pd.DataFrame:
    values = result.samples.grades
    weights = None if result.declustering is None else result.declustering.weights
    cutoffs = np.quantile(values, np.linspace(0, 0.98, _CUTOFFS)).tolist()
    blocks = grade_tonnage(estimates, cutoffs)
    samples = grade_tonnage(values, cutoffs, weights)
    return pd.DataFrame(
        {
            "cutoff": blocks["cutoff"],
            "tonnage_blocks": blocks["tonnage"],
            "grade_blocks": blocks["grade"],
            "tonnage_samples": samples["tonnage"],
            "grade_samples": samples["grade"],
        }
    )


def settings(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a run's settings and figures as rows of item and value, from its summary."""
    near, counts, fit = summary["neighbourhood"], summary["samples"], summary["variogram_fit"]
    model, support = summary["variogram"], summary["support"]
    rows: list[tuple[str, Any]] = [
        ("grade", summary["grade"]),
        ("samples used", f"{counts['used']} of {counts['given']}"),
        ("samples without a grade", counts["without_grade"]),
        ("samples outside the map", counts["outside_map"]),
        ("samples outside the body (hard boundary)", counts["outside_body"]),
        ("mean of samples", summary["mean_of_samples"]),
    ]
    cap = counts["values"].get("cap") if isinstance(counts["values"], Mapping) else None
    if cap:
        rows.append(("top cut", ", ".join(f"{k} {_plain(x)}" for k, x in dict(cap).items())))
    if summary["declustered"] is not None:
        rows.append(("declustered mean of samples", summary["declustered"]["mean"]))
    rows.append(("method", summary["method"]))
    if isinstance(support, Mapping):
        sides, parts = support["block_size"], support["discretised"]
        rows.append(("support", f"blocks of {_list(sides)}, {_list(parts)} points"))
    else:
        rows.append(("support", support))
    if model is not None:
        origin = "given" if fit is None else f"fitted: {fit['weights']}, {fit['anisotropy']}"
        rows += [("variogram", origin), ("nugget", model["nugget"])]
        for k, s in enumerate(model["structures"], 1):
            words = f"{s['kind']}, sill {_plain(s['sill'])}, ranges {_list(s['ranges'])}"
            rows.append((f"structure {k}", words))
        rows.append(("bearing, plunge, dip of the axes", _list(model["rotation"])))
    rows += [
        ("search radii", _list(near["radii"])),
        ("samples of an estimate", f"{near['min_samples']} to {near['max_samples']}"),
        ("most samples of a hole, of an octant", f"{_no(near, 'hole')}, {_no(near, 'octant')}"),
        ("fewest holes, octants", f"{near['min_holes']}, {near['min_octants']}"),
        ("blocks estimated", f"{summary['blocks']['estimated']} of {summary['blocks']['given']}"),
        ("mean of blocks", summary["mean_of_blocks"]),
    ]
    rows += [(f"mean of blocks, {m}", value) for m, value in summary["other_methods"].items()]
    for name in ("kriging_efficiency", "regression_slope"):
        if summary[name] is not None:
            rows.append((f"mean {name.replace('_', ' ')}", summary[name]))
    left_out = summary.get("cross_validation")
    if left_out:
        rows += [(f"cross-validation: {n}", left_out[n]) for n in ("rmse", "bias", "slope")]
        rows += [
            (f"cross-validation: rmse, {m}", left_out[m]["rmse"]) for m in summary["other_methods"]
        ]
    return [{"item": name, "value": value} for name, value in rows if value is not None]


def _no(near: Mapping[str, Any], what: str) -> str:
    limit = near[f"max_per_{what}"]
    return "no limit" if limit is None else str(limit)


def _plain(value: Any) -> str:
    return f"{value + 0.0:.4g}" if isinstance(value, float) else str(value)  # no -0


def _list(values: Any) -> str:
    return ", ".join(_plain(value) for value in values)
