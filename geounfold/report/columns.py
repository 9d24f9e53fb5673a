"""Columns of a report's blocks and samples: their kind, meaning, and limits of colour.

A column is kept in one of three ways: numbers as float32 (16 bits if there are many columns), texts
as categories if few of them differ, and a column with one value as that value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Floats, Ints
from geounfold.report.arrays import encoded, quantised
from geounfold.report.plots.figures import colour_limits, ratio_limits

MOST_CATEGORIES = 250
"""Different texts that a column may hold; a column with more is left out."""

DISTRIBUTED = ("nmd_error", "volume_ratio", "shear", "stretch_max", "stretch_min")
"""Columns of the result of which the report shows the distribution."""

_EXACT = 2**24  # float32 holds whole numbers up to this exactly

MEANINGS = {
    "stratigraphic": (
        "height in the layer",
        "0 at the bottom surface, 1 at the top surface",
        "viridis",
    ),
    "nmd_error": (
        "change of neighbour distances",
        "relative change of the mean distance to the neighbouring blocks, folded to unfolded",
        "cividis",
    ),
    "volume_ratio": ("volume ratio", "unfolded over folded volume at the block", "diverging"),
    "shear": ("shear", "layer-parallel shear, the slip between layers", "cividis"),
    "stretch_max": ("largest stretch", "largest principal stretch at the block", "diverging"),
    "stretch_min": ("smallest stretch", "smallest principal stretch at the block", "diverging"),
    "mesh_distance": (
        "distance from the map's cells",
        "0 for a block inside; in the input's unit",
        "cividis",
    ),
    "sd_along": (
        "error along the layers",
        "standard deviation of the place along each axis of the layers, in the input's unit",
        "viridis",
    ),
    "sd_across": (
        "error across the layers",
        "standard deviation of the height over the layers, in the input's unit",
        "viridis",
    ),
    "fault_block": ("fault block", "the block between faults that was unfolded by itself", ""),
    "location": ("location", "inside the map's cells, or extrapolated around them", ""),
    "nmd_folded": (
        "neighbour distance, folded",
        "mean distance to the neighbours, in the input's unit",
        "cividis",
    ),
    "nmd_unfolded": (
        "neighbour distance, unfolded",
        "mean distance to the folded body's neighbours, in the input's unit",
        "cividis",
    ),
}
"""Known columns: label, meaning, colour map."""

_KINDS = ("fault_block",)
"""Columns whose numbers are names of kinds, not amounts."""


@dataclass(frozen=True, eq=False)
class Column:
    """One value per block or sample.

    Attributes
    ----------
    name : str
        Name in the table.
    label, meaning : str
        Name in words, and what the values mean; empty if unknown.
    group : str
        Heading under which the column is listed.
    colours : str
        Colour map: ``viridis``, ``cividis``, ``diverging``, or empty for categories.
    values : (n,) float or int
        Numbers (NaN if missing), or codes of categories (-1 if missing).
    categories : tuple of str
        Text of each code; empty for numbers.
    """

    name: str
    label: str
    meaning: str
    group: str
    colours: str
    values: Floats | Ints
    categories: tuple[str, ...] = ()

    def taken(self, rows: Ints) -> Column:
        """Return the column of some rows."""
        return replace(self, values=self.values[rows])

    def packed(self, *, short: bool) -> dict[str, Any]:
        """Return the column for JSON.

        Parameters
        ----------
        short : bool
            Whether numbers are kept in 16 bits, in steps of 1/65534 of the column's range.
        """
        facts: dict[str, Any] = {
            "name": self.name,
            "label": self.label,
            "meaning": self.meaning,
            "group": self.group,
        }
        if self.categories:
            return facts | {
                "kind": "category",
                "categories": list(self.categories),
                **encoded(np.where(self.values < 0, 255, self.values), "u1"),
            }
        v = np.asarray(self.values, dtype=np.float64)
        known = v[np.isfinite(v)]
        facts |= {"missing": len(v) - len(known)}
        if not len(known):
            return facts | {"kind": "empty"}
        low, high = float(known.min()), float(known.max())
        facts |= {"kind": "number", "colours": self.colours, "range": [low, high]}
        if low == high:
            return facts | {"limits": [low, high], "form": "constant"}
        return facts | {"limits": list(self._limits(known)), **_numbers(v, low, high, short)}

    def _limits(self, known: Floats) -> tuple[float, float]:
        """Return the values of the first and last colour."""
        if self.colours == "diverging":
            return ratio_limits(known)
        if self.name == "stratigraphic":
            return 0.0, 1.0
        return colour_limits(known)


def _numbers(v: Floats, low: float, high: float, short: bool) -> dict[str, Any]:
    """Return values in the smallest form that keeps their precision."""
    if short:
        return quantised(v, low, (high - low) / 65534)
    offset = low if abs(low) > 100 * (high - low) else 0.0
    whole = max(abs(low - offset), abs(high - offset)) > _EXACT and bool(
        (np.mod(v[np.isfinite(v)], 1) == 0).all()
    )
    return {"offset": offset, **encoded(v - offset, "f8" if whole else "f4")}


def read_columns(
    columns: Mapping[str, ArrayLike], count: int, group: str, known: str = ""
) -> tuple[list[Column], list[str]]:
    """Return the columns that a report can hold, and the names of those it cannot.

    Parameters
    ----------
    columns : mapping of str to (n,)
        Numbers or texts.  Texts count as numbers if all that are not blank can be read so.
    count : int
        Number of values; a column with another number is left out.
    group : str
        Heading under which the columns are listed.
    known : str, optional
        Heading for the columns in MEANINGS; if empty, MEANINGS is not used.

    Examples
    --------
    >>> kept, left = read_columns({"cu": ["0.1", "", "0.3"]}, 3, "Input")
    >>> kept[0].values
    array([0.1, nan, 0.3])
    """
    kept, left = [], []
    for name, values in columns.items():
        column = _read(str(name), values, group, known)
        if column is None or len(column.values) != count:
            left.append(str(name))
        else:
            kept.append(column)
    return kept, left


def _read(name: str, values: ArrayLike, group: str, known: str) -> Column | None:
    """Return a column of numbers or categories; None if too many texts differ, or all are blank."""
    label, meaning, colours = MEANINGS.get(name, ("", "", "viridis")) if known else ("", "", "")
    group = known if known and name in MEANINGS else group
    series = pd.Series(np.asarray(values).ravel() if not isinstance(values, pd.Series) else values)
    numbers = _as_numbers(series)
    if numbers is not None and name not in _KINDS:
        return Column(name, label, meaning, group, colours or "viridis", numbers)
    texts = series.astype(object).where(series.notna(), "").astype(str).str.strip()
    names = sorted(set(texts) - {""}, key=by_number)
    if len(names) > MOST_CATEGORIES or not names:
        return None
    codes = pd.Index(names).get_indexer(pd.Index(texts))
    return Column(name, label, meaning, group, "", codes.astype(np.int64), tuple(names))


def by_number(name: str) -> tuple[float, str]:
    """Order whole numbers by value, after all other texts."""
    return (float(name), name) if name.isdigit() else (-1.0, name)


def _as_numbers(series: pd.Series[Any]) -> Floats | None:
    """Return a column as floats, NaN if blank or infinite; None if it holds other texts."""
    if series.dtype.kind in "mMc":
        return None
    if series.dtype.kind in "biuf":
        values = series.to_numpy(dtype=np.float64)
    else:
        blank = series.isna() | (series.astype(str).str.strip() == "")
        values = pd.to_numeric(series.mask(blank), errors="coerce").to_numpy(dtype=np.float64)
        if np.isnan(values[~blank.to_numpy(dtype=bool)]).any():
            return None
    out: Floats = np.where(np.isfinite(values), values, np.nan)
    return out
