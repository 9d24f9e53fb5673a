"""Intercepts: the parts of holes that lie in the body, with their contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from geounfold.drillholes import DrillHoles
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.messages import listing, shown
from geounfold.io.selection import nearest_name
from geounfold.io.selection.labels import codes_of
from geounfold.modelling.options import BodyOptions

_ROUNDING = 1e-6  # share of a depth below which two depths are one


@dataclass(frozen=True, eq=False)
class Intercepts:
    """Intercepts, sorted by hole and depth.

    Attributes
    ----------
    hole : (m,) int
        Index of the hole.
    start, end : (m,) float
        Lengths along the hole.
    upper, lower : (m, 3) float
        Positions of the two ends.
    open_above, open_below : (m,) bool
        Whether the end is that of the hole's record, and so no contact.
    waste : (m,) float
        Length of waste that the intercept includes.
    """

    hole: Ints
    start: Floats
    end: Floats
    upper: Floats
    lower: Floats
    open_above: Bools
    open_below: Bools
    waste: Floats

    def __len__(self) -> int:
        return len(self.hole)

    def kept(self, keep: Bools) -> Intercepts:
        """Return the intercepts to keep."""
        return Intercepts(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


def in_body(holes: DrillHoles, options: BodyOptions) -> tuple[Bools, str]:
    """Return which intervals are the body's, and the column that tells.

    Raises
    ------
    OptionError
        The column or a code does not exist, or several columns hold the codes.
    InputError
        No interval has the grade.
    """
    source = holes.sources["assay"]
    if options.cut_off is not None:
        name, value = options.cut_off
        if name not in holes.grades:
            raise OptionError(
                f"{source}: no grade '{shown(name)}' for the cut-off"
                f"{_near(name, holes.grades)}; grades: {listing(holes.grades)}"
            )
        inside = holes.grades[name] >= value
        if not inside.any():
            known = holes.grades[name][np.isfinite(holes.grades[name])]
            most = f"the largest is {known.max():g}" if len(known) else "none has a value"
            raise InputError(f"{source}: no interval has {name} of {value:g} or more; {most}")
        return np.asarray(inside), name
    columns = {**holes.words, **holes.grades}
    name = options.code_column or _column_of(columns, options, source)
    if name not in columns:
        raise OptionError(
            f"{source}: no column '{shown(name)}' of codes{_near(name, columns)}; columns: "
            f"{listing(columns)}"
        )
    codes, labels = codes_of([pd.Series(columns[name])])
    for code in options.code:
        if code not in labels:
            raise OptionError(
                f"{source}: column {name} has no code '{shown(code)}'{_near(code, labels)}; "
                f"codes: {listing(labels)}"
            )
    return np.isin(codes, [labels.index(code) for code in options.code]), name


def _column_of(columns: dict[str, np.ndarray], options: BodyOptions, source: str) -> str:
    """Return the one column that holds all codes."""
    found, some = [], []
    for name, values in columns.items():
        labels = set(codes_of([pd.Series(values)])[1])
        if labels.issuperset(options.code):
            found.append(name)
        elif labels.intersection(options.code):
            some.append(name)
    if len(found) == 1:
        return found[0]
    codes = listing(options.code)
    if found:
        raise OptionError(
            f"{source}: several columns hold the codes {codes}: {listing(found)}; choose one by "
            "--code-column"
        )
    if some:
        return some[0]
    raise OptionError(
        f"{source}: no column holds the codes {codes}; columns: {listing(columns)}; name the "
        "column by --code-column, or give --cut-off"
    )


def _near(name: str, known: object) -> str:
    near = nearest_name(name, known)  # type: ignore[arg-type]
    return f"; did you mean {shown(near)}?" if near else ""


def intercepts_of(holes: DrillHoles, inside: Bools, options: BodyOptions) -> Intercepts:
    """Return the intercepts of the intervals in the body.

    Intervals of one hole join across waste up to `max_waste`. An end is open if the hole's record
    begins or ends there; an unlogged gap counts as waste.

    Raises
    ------
    InputError
        No intercept is as long as `least_length`.
    """
    iv = holes.intervals
    hole, start, end = iv.hole[inside], iv.start[inside], iv.end[inside]
    slack = _ROUNDING * np.maximum(1.0, np.abs(start[1:]))
    gap = start[1:] - end[:-1]
    new = np.r_[True, (hole[1:] != hole[:-1]) | (gap > options.max_waste + slack)]
    group = np.cumsum(new) - 1
    first = np.flatnonzero(new)
    last = np.r_[first[1:], len(hole)] - 1
    length = np.bincount(group, end - start)
    h, a, b = hole[first], start[first], end[last]
    keep = b - a >= options.least_length * (1 - _ROUNDING)
    if not keep.any():
        raise InputError(
            f"{holes.sources['assay']}: no intercept is {options.least_length:g} long; the longest "
            f"is {(b - a).max():.4g}"
        )
    deepest = holes.ends[h]
    return Intercepts(
        hole=h,
        start=a,
        end=b,
        upper=holes.paths.at(h, a)[0],
        lower=holes.paths.at(h, b)[0],
        # Unlogged ground above a hole's first interval is waste, unless it begins at the collar.
        open_above=a <= _ROUNDING * np.maximum(1.0, deepest),
        open_below=b >= deepest * (1 - _ROUNDING),
        waste=(b - a) - length,
    ).kept(keep)
