"""The grades of the assay table: its columns of numbers, by the one rule for values of grades."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from geounfold.drillholes.findings import WARNING, Log
from geounfold.drillholes.tables import HoleTable
from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats
from geounfold.io.column_values import objects
from geounfold.io.grade_values import Capped, GradeRules, GradeValues
from geounfold.io.messages import listing, shown


@dataclass(frozen=True, eq=False)
class AssayColumns:
    """The assay table's columns beside hole, from and to.

    Attributes
    ----------
    grades : dict of (n,) float
        Numbers by column; NaN if not assayed.
    words : dict of (n,) object
        The other columns, as text.
    counts : dict of dict
        By grade, how many values are declared missing, below detection, no numbers, negative.
    caps : tuple of Capped
        What the caps changed.
    """

    grades: Mapping[str, Floats]
    words: Mapping[str, np.ndarray]
    counts: Mapping[str, Mapping[str, int]]
    caps: tuple[Capped, ...]


def grade_columns(
    table: HoleTable, chosen: tuple[str, ...] | None, rules: GradeRules, log: Log
) -> AssayColumns:
    """Return the assay table's other columns: grades, and text.

    Parameters
    ----------
    table : HoleTable
        The assay table.
    chosen : names, optional
        Columns to read as grades; the default is every column that holds one
        (`GradeValues.is_grade`).
    rules : GradeRules
        Codes of missing values, values below detection, caps.
    log : Log
        Collects the findings.

    Raises
    ------
    OptionError
        A chosen or capped column does not exist.
    InputError
        Fewer than half of a grade's values are numbers.
    """
    names = [str(name) for name in table.rest.columns]
    for name in chosen or ():
        if name not in names:
            raise OptionError(
                f"{table.source}: no column '{shown(name)}' for grades; it has: {listing(names)}"
            )
    rules.check_columns(names, table.source)
    grades: dict[str, Floats] = {}
    words: dict[str, np.ndarray] = {}
    counts: dict[str, Mapping[str, int]] = {}
    caps = []
    for i, name in enumerate(names):
        column = table.rest.iloc[:, i]
        found = rules.read(column)
        if name not in chosen if chosen is not None else not found.is_grade(column):
            words[name] = np.array([str(v) for v in objects(column)], dtype=object)
            continue
        found.check(column, table.source, table.row)
        _log_grades(table, column, found, log)
        grades[name], capped = rules.capped(name, found.values)
        counts[name] = found.facts()
        if capped is not None:
            caps.append(capped)
    return AssayColumns(grades, words, counts, tuple(caps))


def _log_grades(table: HoleTable, column: pd.Series, found: GradeValues, log: Log) -> None:
    rule = found.rules.below_detection
    becomes = {"missing": "not assayed; see --below-detection", "half": "half of the limit"}
    for mask, what, action in (
        (found.below, "below detection", f"taken as {becomes.get(rule, rule)}"),
        (found.wrong, "not a number", "taken as not assayed; declare codes by --missing"),
        (found.negative, "negative, perhaps a code", "kept unchanged; see --missing"),
        (found.nines, "nines, perhaps a code", "kept unchanged; see --missing"),
    ):
        for i in np.flatnonzero(mask):
            log.add(
                table.source, f"{column.name} is {what}", WARNING, action,
                hole=str(table.hole[i]), row=int(table.row[i]), detail=f"'{shown(column.iloc[i])}'",
            )  # fmt: skip
