"""One rule for the values of a grade: numbers, codes of missing values, values below detection.

The same rule holds for assays, composites and blocks. A value that is no number counts as missing,
never as zero, and is told.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError, check_one_of
from geounfold.geometry.mesh import Bools, Floats
from geounfold.io.column_values import objects
from geounfold.io.coordinate_columns import number_hint, readable_numbers
from geounfold.io.messages import listing, shown
from geounfold.io.selection import nearest_name
from geounfold.io.selection.mixed import is_rock

BELOW_DETECTION = ("missing", "half", "zero")

_CODES = 40  # kinds of rock at most: more are numbers of another kind

_BELOW = re.compile(r"<\s*=?\s*(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?)", re.IGNORECASE)
_PERCENTILE = re.compile(r"p(\d{1,2}(?:\.\d+)?|100)", re.IGNORECASE)
_SHARE = {"half": 0.5, "zero": 0.0, "missing": np.nan}


@dataclass(frozen=True, kw_only=True)
class GradeRules:
    """How the values of grades are read.

    Parameters
    ----------
    missing : sequence of str or float
        Values that mean no value, such as -99 or ``-``. Numbers are compared as numbers, words in
        any letter case.
    below_detection : str
        What a value such as ``<0.01`` becomes: ``missing``, ``half`` of the limit, or ``zero``.
    cap : dict of float or str
        Largest value by column, above which values are set to it: a number, or a percentile of the
        column's values such as ``p99``.

    Raises
    ------
    OptionError
        A value outside its valid ones.

    Examples
    --------
    >>> rules = GradeRules(missing=(-99,), below_detection="half")
    >>> rules.read(pd.Series(["1.5", "-99.0", "<0.02"])).values.tolist()
    [1.5, nan, 0.01]
    """

    missing: tuple[str | float, ...] = ()
    below_detection: str = "missing"
    cap: Mapping[str, float | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_one_of("below_detection", self.below_detection, BELOW_DETECTION)
        object.__setattr__(self, "missing", tuple(self.missing))
        for name, value in self.cap.items():
            if not (_is_cap(value)):
                raise OptionError(
                    f"the cap of {name} must be a number or a percentile such as p99, not '{value}'"
                )

    def read(self, column: pd.Series) -> GradeValues:
        """Return the values of a column, before its cap."""
        values, wrong = readable_numbers(column)
        wrong = wrong | np.isinf(values)
        values = np.where(wrong, np.nan, values)
        declared = self._declared(column, values)
        below = np.zeros(len(values), dtype=bool)
        limits = np.full(len(values), np.nan)
        text = objects(column)
        for row in np.flatnonzero(wrong & ~declared):
            found = _BELOW.fullmatch(str(text[row]).strip())
            if found:
                below[row], limits[row] = True, float(found.group(1))
        values = np.where(declared, np.nan, values)
        values = np.where(below, _SHARE[self.below_detection] * limits, values)
        return GradeValues(values, declared, below, wrong & ~declared & ~below, self)

    def check_columns(self, names: Sequence[str], source: str) -> None:
        """Raise OptionError if a cap names a column that is no grade of a table."""
        for name in self.cap:
            if name not in names:
                near = nearest_name(name, names)
                hint = f"; did you mean {shown(near)}?" if near else ";"
                raise OptionError(
                    f"{source}: no column '{shown(name)}' to cap{hint} grades: {listing(names)}"
                )

    def _declared(self, column: pd.Series, values: Floats) -> Bools:
        """Return which values mean no value."""
        found = np.zeros(len(values), dtype=bool)
        words = set()
        for code in self.missing:
            number = _number(code)
            if number is None:
                words.add(str(code).strip().casefold())
            else:
                found |= values == number
        if words:
            codes, kinds = pd.factorize(objects(column))
            found |= np.array([str(k).strip().casefold() in words for k in kinds], bool)[codes]
        return found

    def capped(self, name: str, values: Floats) -> tuple[Floats, Capped | None]:
        """Return values with the column's cap, and what it changed; None without a cap."""
        limit = self.cap.get(name)
        known = values[np.isfinite(values)]
        if limit is None or not len(known):
            return values, None
        percentile = _PERCENTILE.fullmatch(str(limit).strip())
        top = np.percentile(known, float(percentile.group(1))) if percentile else float(limit)
        out = np.minimum(values, top)
        changed = int(np.count_nonzero(known > top))
        after = float(np.minimum(known, top).mean())
        return out, Capped(name, str(limit), float(top), changed, len(known), known.mean(), after)


@dataclass(frozen=True)
class Capped:
    """What a cap changed.

    Attributes
    ----------
    column : str
    given : str
        As the user gave it.
    value : float
        The largest value left.
    changed, count : int
        Number of values above it, and of all values.
    mean_before, mean_after : float
    """

    column: str
    given: str
    value: float
    changed: int
    count: int
    mean_before: float
    mean_after: float

    def __str__(self) -> str:
        given = f" ({self.given})" if _number(self.given) is None else ""
        return (
            f"{self.column} was capped at {self.value:.6g}{given}: {self.changed} of {self.count} "
            f"values, mean {self.mean_before:.6g} before, {self.mean_after:.6g} after"
        )


@dataclass(frozen=True, eq=False)
class GradeValues:
    """The values of a grade as `GradeRules` read them.

    Attributes
    ----------
    values : (n,) float
        NaN if missing.
    declared : (n,) bool
        Values that the rules declare missing.
    below : (n,) bool
        Values below detection.
    wrong : (n,) bool
        Other values that are no numbers.
    rules : GradeRules
    """

    values: Floats
    declared: Bools
    below: Bools
    wrong: Bools
    rules: GradeRules

    @property
    def negative(self) -> Bools:
        """Which values are negative, (n,)."""
        return np.asarray(self.values < 0)

    @property
    def nines(self) -> Bools:
        """Which values are 999, 9999 or more nines and more than twice the next largest, (n,)."""
        known = np.unique(self.values[np.isfinite(self.values)])
        if not len(known) or not re.fullmatch(r"9{3,}(?:\.0*|\.9+)?", f"{known[-1]:.10g}"):
            return np.zeros(len(self.values), dtype=bool)
        alone = len(known) > 1 and known[-1] > 2 * known[-2]
        return np.asarray(self.values == known[-1]) & alone

    def is_grade(self, column: pd.Series) -> bool:
        """Return whether a column holds a grade: half of its values or more are numbers.

        So is one whose numbers are of more kinds than its words: it holds few codes, and grades
        that differ. A column of codes of rock has few different numbers.
        """
        known = np.isfinite(self.values) | self.below | self.declared
        if 2 * np.count_nonzero(self.wrong) <= np.count_nonzero(self.wrong | known):
            return True
        return len(np.unique(self.values[np.isfinite(self.values)])) > len(self._words(column))

    def check(self, column: pd.Series, source: str, rows: Any = None) -> None:
        """Raise InputError if fewer than half of a grade's values are numbers.

        Parameters
        ----------
        column : Series
            As it was read.
        source : str
            The file.
        rows : (n,) int, optional
            Data rows in the file, from 1.
        """
        bad = np.flatnonzero(self.wrong)
        known = np.count_nonzero(np.isfinite(self.values) | self.below | self.declared)
        if 2 * len(bad) <= known + len(bad):
            return
        if not known:
            raise InputError(
                f"{source}: column '{shown(column.name)}' holds words, such as "
                f"{listing(self._words(column)[:3])}, and no number: it is no grade"
            )
        row = bad[0] + 1 if rows is None else rows[bad[0]]
        words = self._words(column)
        first = str(objects(column)[bad[0]]).strip()
        raise InputError(
            f"{source}: column '{shown(column.name)}' is a grade, but {len(bad)} of its "
            f"{known + len(bad)} values are no numbers, the first '{shown(first)}' at data row "
            f"{row}{number_hint(first)}; if they mean no value, declare them: --missing "
            f"{','.join(map(shown, words[:3]))}"
        )

    def messages(self, column: pd.Series, source: str) -> list[str]:
        """Return one line for each kind of value that is not a plain number."""
        name, text = shown(column.name), objects(column)
        lines = [self._coded_told(name, source)] if self._coded(name) else []
        rest = (
            (self.below, "below detection", self._below_told()),
            (self.wrong, "no numbers", "taken as missing; declare codes by --missing"),
            (self.negative, "negative", "kept; declare codes by --missing"),
            (self.nines, "nines, perhaps a code", "kept; declare codes by --missing"),
        )
        for mask, what, done in rest:
            at = np.flatnonzero(mask)
            if len(at):
                verb = "values is" if len(at) == 1 else "values are"
                lines.append(
                    f"{source}: column '{name}': {len(at)} of {len(mask)} {verb} {what}, the first "
                    f"'{shown(str(text[at[0]]).strip())}' at data row {at[0] + 1}: {done}"
                )
        return lines

    def _coded(self, name: str) -> bool:
        """Return whether the values are few whole numbers, in a column that is named for rock."""
        kinds = np.unique(self.values[np.isfinite(self.values)])
        return is_rock(name) and len(kinds) <= _CODES and bool((kinds == np.rint(kinds)).all())

    def _coded_told(self, name: str, source: str) -> str:
        kinds = np.unique(self.values[np.isfinite(self.values)])
        return (
            f"{source}: column '{name}' holds {len(kinds)} whole numbers "
            f"({listing(f'{kind:g}' for kind in kinds)}) and is named as a code of rock is: a mean "
            "of codes is no grade; --samples-where chooses samples by it"
        )

    def _below_told(self) -> str:
        rule = self.rules.below_detection
        if rule == "missing":
            return "taken as missing; --below-detection half or zero gives them a value"
        return f"taken as {'zero' if rule == 'zero' else 'half of the limit'}"

    def facts(self) -> dict[str, int]:
        """Return the counts, for a summary."""
        return {
            "declared_missing": int(np.count_nonzero(self.declared)),
            "below_detection": int(np.count_nonzero(self.below)),
            "no_numbers": int(np.count_nonzero(self.wrong)),
            "negative": int(np.count_nonzero(self.negative)),
            "nines": int(np.count_nonzero(self.nines)),
        }

    def _words(self, column: pd.Series) -> list[str]:
        """Return the different values that are no numbers, in the file's order."""
        text = objects(column)[self.wrong]
        return list(dict.fromkeys(str(value).strip() for value in text))


def grade_of(
    column: pd.Series, source: str, rules: GradeRules | None = None
) -> tuple[Floats, list[str], dict[str, Any]]:
    """Return a grade's values, the lines that tell of its other values, and the counts.

    Parameters
    ----------
    column : Series
        As it was read.
    source : str
        The file, for messages.
    rules : GradeRules, optional
        The default has no codes and no caps.

    Raises
    ------
    InputError
        Fewer than half of the values are numbers.
    """
    rules = rules or GradeRules()
    found = rules.read(column)
    found.check(column, source)
    values, capped = rules.capped(str(column.name), found.values)
    lines = found.messages(column, source)
    facts: dict[str, Any] = found.facts()
    if capped is not None:
        lines.append(f"{source}: {capped}")
        facts["cap"] = capped.__dict__
    return values, lines, facts


def grades_of(frame: pd.DataFrame) -> list[str]:
    """Return the columns of a table that may be grades: half of their values are numbers."""
    found = []
    for k, name in enumerate(frame.columns):
        values, wrong = readable_numbers(frame.iloc[:, k])
        known = np.isfinite(values) & ~wrong
        if known.any() and 2 * np.count_nonzero(wrong) <= np.count_nonzero(wrong | known):
            found.append(str(name))
    return found


def grade_rules(given: GradeRules | Mapping[str, Any] | None) -> GradeRules:
    """Return rules given as such, as a mapping of some of their parameters, or not at all."""
    if isinstance(given, GradeRules):
        return given
    words = dict(given or {})
    unknown = set(words) - {"missing", "below_detection", "cap"}
    if unknown:
        raise OptionError(
            f"grades have no rule '{shown(sorted(unknown)[0])}'; rules: missing, below_detection, "
            "cap"
        )
    return GradeRules(**words)


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _is_cap(value: Any) -> bool:
    number = _number(value)
    if number is not None:
        return bool(np.isfinite(number))
    return bool(_PERCENTILE.fullmatch(str(value).strip()))
