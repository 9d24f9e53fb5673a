"""Conversion between tables and points with values: column types, and codes for text."""

from __future__ import annotations

import numpy as np
import pandas as pd

from geounfold.errors import OutputError
from geounfold.geometry.mesh import Floats
from geounfold.io.column_values import objects, unique_names
from geounfold.io.formats.registry import Meta, Points
from geounfold.io.messages import shown

_AXES = ("x", "y", "z")
_MOST_CODES = 100


def to_frame(points: Points) -> pd.DataFrame:
    """Return points as a table with columns x, y, z and the points' values.

    A value with the name of a coordinate (in any letter case) gets the suffix ``_value``, so that
    it is not read as one.
    """
    columns: dict[str, np.ndarray] = dict(zip(_AXES, points.xyz.T, strict=True))
    for name, values in points.data.items():
        unique = name
        while unique.lower() in {c.lower() for c in columns}:
            unique += "_value"
        columns[unique] = values
    return pd.DataFrame(columns)


def to_points(frame: pd.DataFrame, xyz: Floats, columns: tuple[str, ...], meta: Meta) -> Points:
    """Return a table's rows as points; `columns` are the names of the coordinates `xyz`."""
    others = [i for i, name in enumerate(frame.columns) if str(name) not in columns]
    names = unique_names(frame.columns[i] for i in others)
    values = {name: typed_values(frame.iloc[:, i]) for name, i in zip(names, others, strict=True)}
    return Points(np.asarray(xyz, dtype=np.float64), values, meta)


def typed_values(column: pd.Series) -> np.ndarray:
    """Return a column as float64, int64 (bools as 0 and 1) or text."""
    kind = column.dtype
    missing = column.isna().to_numpy(dtype=bool)
    if pd.api.types.is_bool_dtype(kind) and not missing.any():
        return column.to_numpy(dtype=np.int64)
    if pd.api.types.is_integer_dtype(kind) and not missing.any():
        return column.to_numpy(dtype=np.int64)
    if pd.api.types.is_numeric_dtype(kind):
        return column.to_numpy(dtype=np.float64, na_value=np.nan)
    return np.array([str(v) for v in objects(column)], dtype=object)


def flattened(name: str, values: np.ndarray, rows: int) -> dict[str, np.ndarray]:
    """Return an array of a file as columns; a vector becomes several, numbered from 0."""
    if values.ndim == 1 or values.size == rows:
        return {name: _plain(values.reshape(rows))}
    wide = values.reshape(rows, -1)
    return {f"{name}_{j}": _plain(wide[:, j]) for j in range(wide.shape[1])}


def _plain(values: np.ndarray) -> np.ndarray:
    if values.dtype.kind in "iub":
        return values.astype(np.int64)
    if values.dtype.kind == "f":
        return values.astype(np.float64)
    return np.array([str(v) for v in values], dtype=object)


def coded(name: str, values: np.ndarray, what: str) -> tuple[np.ndarray, str]:
    """Return values as numbers, and a legend of the codes; the legend is empty for numbers.

    Raises
    ------
    OutputError
        There are more than 100 different texts, which are names and not classes.
    """
    if values.dtype.kind in "if":
        return values, ""
    texts, codes = np.unique(values.astype(str), return_inverse=True)
    if len(texts) > _MOST_CODES:
        raise OutputError(
            f"{what} files hold numbers only, but column '{shown(name)}' has {len(texts)} "
            "different texts; write .csv, .parquet, .vtu or .omf instead"
        )
    legend = " ".join(
        f"{code}={text.replace(' ', '_') or '(blank)'}" for code, text in enumerate(texts)
    )
    return codes.astype(np.int64), f"{name}: {legend}"


def missing_code(columns: list[np.ndarray]) -> float | None:
    """Return a code for missing values that no column holds; None if no value is missing.

    Examples
    --------
    >>> missing_code([np.array([1.0, np.nan]), np.array([-999.0, 2.0])])
    -9999.0
    """
    if not any(np.isnan(c).any() for c in columns if c.dtype.kind == "f"):
        return None
    codes = (-999.0, -9999.0, -99999.0, -1e21, -1e30)
    return next((c for c in codes if not any((v == c).any() for v in columns)), -1e300)
