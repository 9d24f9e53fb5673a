"""What the command line tells a report: every column of the table, and what was carried with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.io.column_values import unique_names
from geounfold.io.result_columns import UNFOLDED

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.cli.inputs.drillholes import HoleData
    from geounfold.io import PointTable
    from geounfold.io.tables.parted import PartedTable
    from geounfold.report import CarriedHoles, CarriedPoints

_XYZ = ("x", "y", "z")


def report_columns(table: PointTable | PartedTable, results: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a result and of the table, by name, but for the coordinates read."""
    given = _known(table.frame, table.columns)
    return {**results, **{n: v for n, v in given.items() if n not in results}}


def report_holes(
    holes: HoleData | None,
    traced: Mapping[str, Mapping[str, Any]],
    samples: PointTable | None,
    carried: Mapping[str, Any] | None,
) -> CarriedHoles | None:
    """Return the drill-holes, or loose samples, that were carried with a body; None of neither.

    Parameters
    ----------
    holes : HoleData, optional
        As read, and `traced` its results by ``samples`` and ``traces``.
    samples : PointTable, optional
        Loose samples, and `carried` their results.
    """
    points: dict[str, CarriedPoints] = {}
    if holes is not None:
        for name, frame in (("traces", holes.traces), ("samples", holes.samples)):
            if frame is not None:
                hole = frame["hole"].astype(str).to_numpy()
                points[name] = _points(frame, _XYZ, traced[name], hole)
    elif samples is not None and carried is not None:
        points["samples"] = _points(samples.frame, samples.columns, carried, None, samples)
    if not points:
        return None
    from geounfold.report import CarriedHoles

    return CarriedHoles(**points)


def _points(
    frame: pd.DataFrame,
    places: tuple[str, str, str],
    results: Mapping[str, Any],
    hole: Any,
    table: PointTable | None = None,
) -> CarriedPoints:
    from geounfold.report import CarriedPoints

    folded = frame[list(places)].to_numpy(dtype=np.float64) if table is None else table.points
    unfolded = np.column_stack([results[name] for name in UNFOLDED])
    known = _known(frame, (*places, "hole"))
    known |= {n: v for n, v in results.items() if n not in (*UNFOLDED, "mesh_distance")}
    return CarriedPoints(hole, folded, unfolded, known)


def _known(frame: pd.DataFrame, but: tuple[str, ...]) -> dict[str, Any]:
    """Return a frame's columns under names of their own, some left out."""
    names = unique_names(frame.columns)
    return {
        name: frame.iloc[:, k].to_numpy()
        for k, name in enumerate(names)
        if str(frame.columns[k]) not in but
    }
