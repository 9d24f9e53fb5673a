"""The report of an unfolding as the library has it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.errors import OptionError
from geounfold.io.outputs import replacing
from geounfold.io.result_columns import UNFOLDED, result_columns
from geounfold.report.faults import carried_faults
from geounfold.report.page import write_report
from geounfold.report.payload import CarriedHoles, CarriedPoints

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.unfolding.result import Unfolding


def report(
    unfolding: Unfolding,
    path: str | Path,
    *,
    samples: pd.DataFrame | None = None,
    unit: str = "",
    overwrite: bool = False,
) -> None:
    """Write the report of an unfolding: one page with pictures, verdict and figures.

    Parameters
    ----------
    unfolding : Unfolding
        As `unfold` returns it.
    path : path
        A file that ends in .html or .htm; it appears whole or not at all.
    samples : DataFrame, optional
        Other points to show in both spaces: coordinate columns as `unfold` finds them, a column
        ``hole`` if they belong to holes, any others to colour by.
    unit : str, optional
        Unit of the coordinates, such as ``m``.
    overwrite : bool
        Whether an existing file is replaced.

    Raises
    ------
    OptionError
        The file does not end in .html, or exists.
    InputError
        Samples without coordinates.
    MissingDependencyError
        A library for drawing is missing.
    """
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise OptionError(f"a report ends in .html, but {target} does not")
    if target.exists() and not overwrite:
        raise OptionError(f"{target} exists; give overwrite=True to replace it")
    summary: dict[str, Any] = unfolding.summary()
    if unit:
        summary["input"] = {"unit": unit}
    table = unfolding.table if unfolding.chosen is None else unfolding.table[unfolding.chosen]
    columns: dict[str, Any] = {str(name): table[name].to_numpy() for name in table}
    columns |= result_columns(UNFOLDED, unfolding.carried) | unfolding.columns
    with replacing(target) as part:
        write_report(
            part,
            summary,
            unfolding.folded,
            unfolding.points,
            columns,
            holes=None if samples is None else _carried(unfolding, samples),
            faults=carried_faults(unfolding),
            horizons=unfolding.surfaces,
        )


def _carried(unfolding: Unfolding, samples: pd.DataFrame) -> CarriedHoles:
    """Return samples in both spaces, with their columns."""
    from geounfold.io.result_columns import frame_points

    folded = frame_points(samples)
    carried = unfolding.map.carry(folded)
    hole = samples["hole"].astype(str).to_numpy() if "hole" in samples else None
    known = {str(name): np.asarray(samples[name]) for name in samples if name != "hole"}
    return CarriedHoles(samples=CarriedPoints(hole, folded, carried.points, known))
