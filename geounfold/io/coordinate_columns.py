"""The columns of coordinates, found by name, and column values as numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.column_values import objects
from geounfold.io.messages import counted, listing, rows_named, shown
from geounfold.io.packages.names import (
    DEGREES,
    DEPTHS,
    DOWN,
    WORLD,
    Triple,
    coordinate_sets,
    plain_name,
)

_NUMBER = r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf|infinity|nan)"

_DECIMAL_COMMA = re.compile(r"[+-]?\d{1,3}(?:[. '\u00a0\u2009\u202f]?\d{3})*,\d+|[+-]?\d+,\d+")

_WORLD_NAMES = frozenset(sum(WORLD, ()))

MISSING = frozenset({"", "na", "n/a", "#n/a", "nan", "null", "none", "<na>", "nil"})
"""Words, in any letter case, that mean no value."""


def parse_columns(text: str) -> Triple:
    """Return the three names of a ``a,b,c`` option, in which quotes protect commas.

    Raises
    ------
    OptionError
        The text does not hold three different names.
    """
    names = [name.strip() for name in next(csv.reader([text], skipinitialspace=True), [])]
    if len(names) != 3 or len(set(names)) != 3 or not all(names):
        raise OptionError(
            f"--columns needs three different column names such as XC,YC,ZC, not '{shown(text)}'"
        )
    return names[0], names[1], names[2]


def coordinate_columns(
    names: Sequence[str],
    columns: Triple | None = None,
    *,
    source: str = "the table",
    own: bool = False,
) -> tuple[int, int, int]:
    """Return the positions of the three coordinate columns.

    Parameters
    ----------
    names : sequence of str
        The table's column names.
    columns : three str, optional
        Their names. By default centroid_x/y/z, x/y/z, XC/YC/ZC, xcentre/ycentre/zcentre,
        easting/northing/elevation and the like, in any letter case; world_x/y/z before any other.
    source : str, optional
        The file's name, with which messages begin.
    own : bool, optional
        True to find a block model's own coordinates: world_x/y/z are passed over.

    Raises
    ------
    InputError
        No complete set of names, more than one, or a name of two columns.

    Examples
    --------
    >>> coordinate_columns(["IJK", "XC", "YC", "ZC", "XINC"])
    (1, 2, 3)
    """
    if columns is not None:
        a, b, c = (_position(names, name, source) for name in columns)
        if len({a, b, c}) != 3:
            raise InputError(f"{source}: the columns {listing(columns)} are not three columns")
        if plain_name(names[c]) in DOWN:
            raise _counts_down(source, names[c])
        return a, b, c
    plain = [plain_name(name) for name in names]
    found = _sets(names, own)
    if found:
        return _only(found, names, plain, source)
    if any(plan <= set(plain) for plan in map(set, DEGREES)):
        raise InputError(
            f"{source}: longitudes and latitudes are degrees, and a body needs one unit of length "
            "along all axes; project them to metres (UTM or the mine's grid) and export again"
        )
    down = next((d for d in DEPTHS if set(d) <= set(plain)), None)
    if down is not None:
        raise _counts_down(source, names[plain.index(down[2])])
    if _all_numbers(names):
        hint = "the first row must name the columns"
    elif {"from", "to"} <= set(plain):
        hint = (
            "intervals of drill-holes have no place of their own: --holes COLLAR SURVEY ASSAY "
            "places them, and --samples-out writes composites with x, y, z"
        )
    elif len(names) == 1:
        hint = "columns are separated by commas, semicolons or tabs"
    else:
        hint = "name them by --columns a,b,c"
    raise InputError(
        f"{source}: no coordinate columns (such as x, y, z or centroid_x, centroid_y, "
        f"centroid_z) found; the file has: {listing(names)}; {hint}"
    )


def _counts_down(source: str, name: str) -> InputError:
    return InputError(
        f"{source}: column '{shown(name)}' counts downwards, and a body needs heights that count "
        "upwards, or it would be mirrored; change the sign (z = -depth, or surface less depth) and "
        "name the new column z"
    )


def _sets(names: Sequence[str], own: bool) -> list[Triple]:
    """Return the sets of coordinates to choose from; ``own``: without the world's."""
    if own:
        return coordinate_sets([n for n in names if plain_name(n) not in _WORLD_NAMES])
    found = coordinate_sets(names)
    return [family for family in found if family in WORLD] or found


def _all_numbers(names: Sequence[str]) -> bool:
    return all(re.fullmatch(_NUMBER, str(n).strip(), re.IGNORECASE) for n in names)


def _position(names: Sequence[str], wanted: str, source: str) -> int:
    """Return the position of a named column: by its exact name, else in any letter case."""
    for same in (str.__eq__, lambda a, b: a.strip().casefold() == b.strip().casefold()):
        found = [i for i, name in enumerate(names) if same(str(name), wanted)]
        if len(found) > 1:
            raise InputError(
                f"{source}: the column '{shown(wanted)}' is ambiguous: it is there "
                f"{len(found)} times ({listing(names[i] for i in found)}); rename all but one"
            )
        if found:
            return found[0]
    raise InputError(f"{source}: no column '{shown(wanted)}' found; the file has: {listing(names)}")


def _only(
    found: list[Triple], names: Sequence[str], plain: list[str], source: str
) -> tuple[int, int, int]:
    """Return the positions of the one set found; raise an error that names the sets if several."""
    if len(found) > 1:
        sets = " and ".join(
            "/".join(shown(names[plain.index(axis)]) for axis in family) for family in found
        )
        raise InputError(f"{source}: ambiguous coordinate columns {sets}; choose by --columns")
    for axis in found[0]:
        twice = [names[i] for i, name in enumerate(plain) if name == axis]
        if len(twice) > 1:
            raise InputError(
                f"{source}: ambiguous coordinate columns, several have the same name: "
                f"{listing(twice)}; choose by --columns, or rename all but one"
            )
    a, b, c = (plain.index(axis) for axis in found[0])
    return a, b, c


def numbers(column: pd.Series, *, source: str = "the table") -> Floats:
    """Return a column's values, (n,) float; missing ones are NaN.

    Raises
    ------
    InputError
        A value is not a number; the message names the first one and its row.
    """
    name = shown(column.name)
    if _has_other_type(column):
        raise InputError(f"{source}: column '{name}' is not numeric: it holds {column.dtype}")
    values, wrong = readable_numbers(column)
    bad = np.flatnonzero(wrong)
    if len(bad):
        first = str(objects(column)[bad[0]]).strip()
        others = f" ({counted(len(bad), 'such value')})" if len(bad) > 1 else ""
        raise InputError(
            f"{source}: column '{name}' is not numeric: data row {bad[0] + 1} has "
            f"'{shown(first)}'{others}{number_hint(first)}"
        )
    return values


_NINES = np.array([v for k in range(2, 8) for v in (10**k - 1.0, 10**k - 0.01)])
"""Codes of missing values that programs write: 99, 99.99, 999 ..., of either sign."""

_NINES_SET = frozenset(_NINES.tolist())

_ALONE = 0.1
"""Share of the other values' extent that a code is off the nearest of them, else it is a place."""


def coded(values: Floats, codes: Floats | None = None) -> Bools:
    """Return which coordinates along one axis are codes of missing values, (n,).

    A code is a value of ``codes`` that lies far from all others. By default codes are nines of
    either sign, if one of them is the smallest or the largest value.

    Examples
    --------
    >>> coded(np.array([0.0, 500, -999, 1000])).tolist()
    [False, False, True, False]
    >>> coded(np.array([-999.0, -980, -600])).tolist()  # the level below is near
    [False, False, False]
    """
    if codes is None and not _NINES_SET & {abs(float(end)) for end in _ends(values)}:
        return np.zeros(len(values), dtype=bool)
    known = np.abs(values) if codes is None else values
    found: Bools = np.isin(known, _NINES if codes is None else codes)
    rest = values[~found & np.isfinite(values)]
    if not found.any() or not len(rest):
        return np.zeros(len(values), dtype=bool)
    for value in np.unique(values[found]):
        if np.abs(rest - value).min() <= _ALONE * np.ptp(rest):
            found &= values != value
    return found


def without(values: Floats, missing: tuple[float, ...]) -> Floats:
    """Return coordinates along one axis with NaN in place of the codes given, see `coded`."""
    if not missing:
        return values
    return np.where(coded(values, np.array(missing)), np.nan, values)


def _ends(values: Floats) -> tuple[float, float]:
    """Return the smallest and the largest value, of those that are numbers."""
    if not len(values):
        return 0.0, 0.0
    return float(np.fmin.reduce(values)), float(np.fmax.reduce(values))


def coded_told(points: Floats, columns: Sequence[str], rows: Callable[[], Ints]) -> str:
    """Return the sentence on coordinates that are codes of missing values; empty without any.

    Parameters
    ----------
    points : (n, 3) float
        Coordinates.
    columns : sequence of str
        Their names.
    rows : callable
        Returns the data row of each in the file, from 1; called if there are such coordinates.
    """
    there = [(name, values, coded(values)) for name, values in zip(columns, points.T, strict=True)]
    if not any(mask.any() for _, _, mask in there):
        return ""
    row = rows()
    told = [(name, values[mask], row[mask]) for name, values, mask in there if mask.any()]
    every = np.unique(np.concatenate([at for _, _, at in told]))
    code = f"{told[0][1][0]:g}"
    verb = "has" if len(every) == 1 else "have"
    return (
        f"{counted(len(every), 'row')} {verb} {code} as {' and '.join(name for name, _, _ in told)}"
        f", far from all others, perhaps a code for a missing value: {rows_named(every.tolist())}; "
        f'--missing {code} --drop-invalid, or --where "{told[0][0]}!={code}", leaves such rows out'
    )


def readable_numbers(column: pd.Series) -> tuple[Floats, Bools]:
    """Return a column's values, (n,) float, and a mask of those that are not numbers, (n,) bool.

    Missing values are NaN and not in the mask; values that are not numbers are NaN too.
    """
    kind = column.dtype
    if _has_other_type(column):
        return np.full(len(column), np.nan), column.notna().to_numpy(dtype=bool)
    if pd.api.types.is_numeric_dtype(kind):
        values = column.to_numpy(dtype=np.float64, na_value=np.nan)
        return np.asarray(values, dtype=np.float64), np.zeros(len(column), dtype=bool)
    text = objects(column)
    try:
        values = text.astype(np.float64)
    except (TypeError, ValueError):
        return _with_gaps(text)
    if "_" in "".join(map(str, text)):  # Python reads 1_000 as 1000; no other tool does
        return _with_gaps(text)
    return np.asarray(values, dtype=np.float64), np.zeros(len(column), dtype=bool)


def _has_other_type(column: pd.Series) -> bool:
    kind = column.dtype
    return pd.api.types.is_bool_dtype(kind) or pd.api.types.is_datetime64_any_dtype(kind)


def _with_gaps(text: np.ndarray) -> tuple[Floats, Bools]:
    """Return the numbers among texts, (n,), NaN for others, and a mask of those not missing."""
    words = pd.Series([str(value).strip() for value in text], dtype=object)
    missing = words.str.casefold().isin(MISSING).to_numpy()
    good = words.str.fullmatch(_NUMBER, case=False).to_numpy(dtype=bool)
    values = np.full(len(words), np.nan)
    values[good & ~missing] = words.to_numpy(dtype=object)[good & ~missing].astype(np.float64)
    return values, np.asarray(~missing & ~good)


def number_hint(word: str) -> str:
    """Return the remedy for a number with a decimal comma or thousands separators, else nothing."""
    if "," in word and _DECIMAL_COMMA.fullmatch(word):
        return "; write decimals with a point, not a comma"
    if re.fullmatch(r"[+-]?\d{1,3}(?:[, '\u00a0\u2009\u202f]\d{3})+(?:\.\d+)?", word):
        return "; write numbers without thousands separators"
    return ""
