"""The values of a column as labels, such as the names of domains."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
import pandas as pd

from geounfold.geometry.mesh import Ints
from geounfold.io.column_values import objects
from geounfold.io.coordinate_columns import MISSING

_POINT_ZERO = re.compile(r"[+-]?\d+\.0*")


def label(value: object) -> str:
    """Return a value as a label: without blanks around it, 3.0 as 3; empty if it is missing.

    Examples
    --------
    >>> label(" LODE 1 "), label(3.0), label("nan")
    ('LODE 1', '3', '')
    """
    text = str(value).strip()
    if text.casefold() in MISSING:
        return ""
    return text.split(".")[0] if _POINT_ZERO.fullmatch(text) else text


def codes_of(columns: Iterable[pd.Series]) -> tuple[Ints, list[str]]:
    """Return a column, given in parts, as labels.

    Returns
    -------
    codes : (n,) int
        Index of each row's label; -1 if the value is missing.
    names : list of str
        The labels, sorted: numbers by their value, before text.
    """
    known: dict[str, int] = {"": -1}
    parts = [np.zeros(0, np.int64)]
    for column in columns:
        codes, values = pd.factorize(objects(column))
        own = np.array([known.setdefault(label(v), len(known) - 1) for v in values], np.int64)
        parts.append(own[codes] if len(own) else np.zeros(0, np.int64))
    names = list(known)[1:]
    order = sorted(range(len(names)), key=lambda k: _sorting(names[k]))
    rank = np.empty(len(names) + 1, np.int64)
    rank[order], rank[-1] = np.arange(len(names)), -1
    return rank[np.concatenate(parts)], [names[k] for k in order]


def _sorting(name: str) -> tuple[int, float, str]:
    try:
        return 0, float(name), name
    except ValueError:
        return 1, 0.0, name
