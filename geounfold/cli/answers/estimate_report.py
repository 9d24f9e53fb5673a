"""The report of an estimation: grades on the blocks and at the samples, in both spaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.errors import InputError
from geounfold.io.result_columns import UNFOLDED, result_columns

if TYPE_CHECKING:
    from geounfold.estimation import Estimation
    from geounfold.io import PointTable
    from geounfold.io.tables.parted import PartedTable
    from geounfold.mapping.mesh_map import UnfoldingMap


def write_estimate_report(
    path: Path,
    summary: Mapping[str, Any],
    result: Estimation,
    saved: UnfoldingMap,
    blocks: PointTable | PartedTable,
    samples: PointTable,
) -> None:
    """Write the page of an estimation.

    Parameters
    ----------
    path : path
        The file.
    summary : mapping
        Of the estimation.
    result : Estimation
        The estimates, a row per block.
    saved : UnfoldingMap
        The map.
    blocks, samples : tables
        As they were read.
    """
    from geounfold.estimation.checks import estimation_checks
    from geounfold.report import CarriedHoles, CarriedPoints, write_report

    carried = saved.carry(samples.points)
    names = {name.casefold(): name for name in samples.names}
    column = next((names[n] for n in ("hole", "bhid", "holeid", "dhid") if n in names), None)
    hole = None if column is None else samples.frame[column].astype(str).to_numpy()
    known = {result.grade: samples.numbers(result.grade)} if _numeric(samples, result) else {}
    estimate, variance = f"{result.grade}_estimate", f"{result.grade}_variance"
    columns: dict[str, Any] = {
        name: np.where(np.isfinite(values), values, np.nan)
        for name, values in result.columns.items()
        if name in (estimate, variance) or name.endswith(("_efficiency", "_slope"))
    }
    columns |= {
        name: values
        for name, values in result_columns(UNFOLDED, result.carried).items()
        if name in ("stratigraphic", "location")
    }
    write_report(
        path,
        {"title": f"{result.grade} estimated on {Path(blocks.source).name}", **summary},
        blocks.points,
        result.carried.points,
        columns,
        holes=CarriedHoles(samples=CarriedPoints(hole, samples.points, carried.points, known)),
        estimation=replace(estimation_checks(result, summary), expected=_expected(result, saved)),
        start=estimate,
    )


def _expected(result: Estimation, saved: UnfoldingMap) -> tuple[str, ...]:
    """Return the verdict of `assess`, one sentence each; none without a variogram or holes."""
    from geounfold.gain.assessment import assess_samples

    if result.variogram is None or result.samples.holes is None:
        return ()
    try:
        return tuple(assess_samples(saved, result.samples, result.variogram).lines())
    except InputError as error:
        return (f"not assessed: {error}",)


def _numeric(samples: PointTable, result: Estimation) -> bool:
    """Return whether every grade is a number, so that samples can be coloured by it."""
    try:
        samples.numbers(result.grade)
    except InputError:
        return False
    return True
