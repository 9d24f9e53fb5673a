"""Two interval tables of the same holes as one: assays cut where the logged code changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geounfold.drillholes.checks import Intervals
from geounfold.drillholes.holes import DrillHoles
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.messages import listing, shown

_ROUNDING = 1e-9  # share of the deepest hole below which two depths are one


def joined(assays: DrillHoles, logged: DrillHoles, columns: Sequence[str]) -> DrillHoles:
    """Return assays with columns of another interval table, cut at the ends of its intervals.

    Parameters
    ----------
    assays : DrillHoles
        Holes with grades.
    logged : DrillHoles
        The same holes with codes, such as the rock.
    columns : sequence of str
        Columns to take from `logged`. An assay beside all of its intervals has empty text, or no
        number.

    Raises
    ------
    OptionError
        `logged` has no such column, or `assays` has one of this name.
    InputError
        No assay lies in a logged hole.
    """
    own = {**logged.words, **logged.grades}
    for name in columns:
        if name not in own:
            raise OptionError(
                f"{logged.sources['assay']}: no column '{shown(name)}'; columns: {listing(own)}"
            )
        if name in assays.words or name in assays.grades:
            raise OptionError(
                f"{assays.sources['assay']}: has a column '{name}' too; rename one of them"
            )
    a, b = assays.intervals, logged.intervals
    hole = assays.collars.find(logged.collars.names)[b.hole]
    kept = hole >= 0
    if not np.isin(a.hole, hole[kept]).any():
        raise InputError(
            f"{assays.sources['assay']}: no assay is in a hole of {logged.sources['assay']}"
        )
    source = np.flatnonzero(kept)
    order = np.lexsort((b.start[kept], hole[kept]))
    source = source[order]
    # One line for all holes: each begins beyond the end of the one before.
    far = 2.0 * max(float(a.end.max()), float(b.end.max())) + 1.0
    first, last = a.hole * far + a.start, a.hole * far + a.end
    upper, lower = hole[source] * far + b.start[source], hole[source] * far + b.end[source]
    start, end = _pieces(np.concatenate([first, last, upper, lower]), far)
    middle = 0.5 * (start + end)
    assay, log = _at(middle, first, last), _at(middle, upper, lower)
    some = assay >= 0
    start, end, assay, log = start[some], end[some], assay[some], log[some]
    row = np.where(log >= 0, source[log], -1)
    base = a.hole[assay] * far
    cut = Intervals(a.hole[assay], start - base, end - base, a.position[assay])
    words = {name: values[assay] for name, values in assays.words.items()}
    grades = {name: values[assay] for name, values in assays.grades.items()}
    for name in columns:
        if name in logged.words:
            words[name] = np.where(row >= 0, logged.words[name][row], "")
        else:
            grades[name] = np.where(row >= 0, logged.grades[name][row], np.nan)
    return replace(assays, intervals=cut, grades=grades, words=words)


def _pieces(ends: Floats, far: float) -> tuple[Floats, Floats]:
    """Return start and end of all pieces between ends that differ by more than rounding."""
    places = np.unique(ends)
    places = places[np.r_[True, np.diff(places) > _ROUNDING * far]]
    return places[:-1], places[1:]


def _at(middle: Floats, first: Floats, last: Floats) -> Ints:
    """Return the interval that each middle lies in; -1 for none."""
    k = np.searchsorted(first, middle, side="right") - 1
    return np.asarray(np.where((k >= 0) & (middle < last[np.maximum(k, 0)]), k, -1))
