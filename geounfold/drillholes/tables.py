"""Read the three drill-hole tables: find columns by name and convert values to numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from geounfold.drillholes.findings import NOTE, WARNING, Log
from geounfold.errors import InputError, OptionError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.column_values import objects, unique_names
from geounfold.io.coordinate_columns import readable_numbers
from geounfold.io.messages import listing, shown
from geounfold.io.packages.names import plain_name
from geounfold.io.paths import SWAPPED
from geounfold.io.selection import read_where
from geounfold.io.tables.files import Table, read_table
from geounfold.io.tables.points import chosen_rows

HOLE = "hole"
_HOLE = (
    "bhid", "holeid", "hole", "dhid", "ddhid", "dhhole", "drillhole", "drillholeid", "boreholeid",
    "borehole", "holeno", "holenumber", "holename", "wellid", "well",
)  # fmt: skip
_AZIMUTH = ("az", "azi", "azim", "azimuth", "bearing", "brg", "azgrid", "azimuthgrid")
_DIP = ("dip", "dipangle", "plunge")

# Spelled without case, spaces, underscores and units, as for coordinates. Inclination is left out:
# some trades count it from the vertical, others from the horizontal.
ALIASES: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "collar": {
        HOLE: _HOLE,
        "x": ("xcollar", "collarx", "x", "xc", "xcoord", "easting", "east", "utme", "collareast"),
        "y": ("ycollar", "collary", "y", "yc", "ycoord", "northing", "north", "utmn",
              "collarnorth"),
        "z": ("zcollar", "collarz", "z", "zc", "zcoord", "elevation", "elev", "rl", "collarrl",
              "collarelevation"),
        "depth": ("depth", "maxdepth", "eoh", "eohdepth", "enddepth", "totaldepth", "holedepth",
                  "finaldepth", "holelength", "length"),
        "azimuth": _AZIMUTH,
        "dip": _DIP,
    },
    "survey": {
        HOLE: _HOLE,
        "at": ("at", "depth", "surveydepth", "depthat", "distance", "md", "measureddepth"),
        "azimuth": _AZIMUTH,
        "dip": _DIP,
    },
    "assay": {
        HOLE: _HOLE,
        "from": ("from", "depthfrom", "fromdepth", "mfrom", "sampfrom", "start"),
        "to": ("to", "depthto", "todepth", "mto", "sampto", "end"),
    },
}  # fmt: skip
"""Names of columns by table and field."""

_OPTIONAL = {"collar": {"depth", "azimuth", "dip"}, "survey": set[str](), "assay": set[str]()}


@dataclass(frozen=True, eq=False)
class HoleTable:
    """One of the three tables, with its columns identified.

    Attributes
    ----------
    source : str
        Path of the file as given; else collar, survey or assay.
    hole : (n,) object
        Names of the holes as text without surrounding blanks; empty if missing.
    numbers : dict of (n,) float
        Values by field; NaN if missing or not a number.
    rest : DataFrame, n rows
        All other columns unchanged; a number is added to repeated names.
    row : (n,) int
        Data rows in the file, from 1.
    names : tuple of str
        Names of all columns.
    """

    source: str
    hole: np.ndarray
    numbers: Mapping[str, Floats]
    rest: pd.DataFrame
    row: Ints
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.hole)

    def kept(self, keep: Bools) -> HoleTable:
        """Return the table with the rows to keep."""
        if keep.all():
            return self
        return HoleTable(
            self.source,
            self.hole[keep],
            {name: v[keep] for name, v in self.numbers.items()},
            self.rest.loc[keep].reset_index(drop=True),
            self.row[keep],
            self.names,
        )


def read_hole_table(
    kind: str,
    given: str | Path | pd.DataFrame,
    columns: Mapping[str, str],
    log: Log,
    where: str | None = None,
) -> HoleTable:
    """Return one of the three tables; rows without a hole's name are left out.

    Parameters
    ----------
    kind : {"collar", "survey", "assay"}
        Kind of table.
    given : path or DataFrame
        File in a format that `geounfold.io.tables` reads, or the table itself.
    columns : dict of str
        Names of columns by field, for columns that `ALIASES` does not find; fields of other
        tables are ignored.
    log : Log
        Collects the findings.
    where : str, optional
        Chooses rows; the others are as if they were not there.

    Raises
    ------
    InputError
        The file does not exist, `where` chooses no row, a column is missing or ambiguous, or no
        row names a hole.
    """
    if isinstance(given, pd.DataFrame):
        source, table = f"the {kind} table", Table(given.reset_index(drop=True), text=False)
        if not len(given):
            raise InputError(f"{source}: has no rows")
    else:
        source, table = str(given), read_table(given)
        for line in table.notes:
            log.add(source, line, NOTE, "")
    names = [str(name) for name in table.frame.columns]
    fields = _fields(kind, names, columns, source)
    row = np.arange(1, len(table.frame) + 1)
    if where is not None:
        chosen = chosen_rows(read_where(where), table.frame, source)
        table = replace(table, frame=table.frame.loc[chosen].reset_index(drop=True))
        row = row[chosen]
    hole = _hole_names(table.frame.iloc[:, fields[HOLE]])
    values: dict[str, Floats] = {}
    for field, position in fields.items():
        if field == HOLE:
            continue
        column = table.frame.iloc[:, position]
        read, wrong = readable_numbers(column)
        wrong = wrong | (np.abs(read) > LARGEST_COORDINATE)
        values[field] = np.where(wrong, np.nan, read)
        for i in np.flatnonzero(wrong):
            log.add(
                source, f"{field} is not a number, or too large", WARNING, "taken as missing",
                hole=str(hole[i]), row=int(row[i]), detail=f"'{shown(column.iloc[i])}'",
            )  # fmt: skip
    rest = table.frame.iloc[:, [i for i in range(len(names)) if i not in fields.values()]]
    rest = rest.set_axis(pd.Index(unique_names(rest.columns), dtype=object), axis=1)
    whole = HoleTable(source, hole, values, rest, row, tuple(names))
    named = hole != ""
    for i in np.flatnonzero(~named):
        log.add(source, "no hole named", WARNING, "left out", row=int(row[i]))
    if not named.any():
        raise InputError(f"{source}: no row names a hole in column '{names[fields[HOLE]]}'")
    return whole.kept(named)


def _fields(kind: str, names: list[str], columns: Mapping[str, str], source: str) -> dict[str, int]:
    """Return the position of each field's column."""
    plain = [plain_name(name) for name in names]
    where: dict[str, int] = {}
    for field, aliases in ALIASES[kind].items():
        if field in columns and columns[field] in names:
            found = [i for i, name in enumerate(names) if name == columns[field]]
        else:
            found = [i for i, name in enumerate(plain) if name in aliases]
        if len(found) > 1:
            raise InputError(
                f"{source}: several columns may be the {kind} table's {field}: "
                f"{listing(names[i] for i in found)}; choose by --holes-columns "
                f"{field}={names[found[0]]}"
            )
        if found:
            where[field] = found[0]
        elif field not in _OPTIONAL[kind]:
            raise InputError(
                f"{source}: the {kind} table needs a column for {field} (such as "
                f"{listing(aliases[:4])}); the file has: {listing(names)}; "
                f"{_cure(kind, field, plain)}"
            )
    if len(set(where.values())) < len(where):
        raise InputError(f"{source}: one column was named for two fields")
    return where


def _cure(kind: str, field: str, plain: list[str]) -> str:
    """Return what to do about a field that is missing: another order of the files, or a name."""
    for other, fields in ALIASES.items():
        needed = [f for f in fields if f not in _OPTIONAL[other]]
        if other != kind and all(set(fields[f]) & set(plain) for f in needed):
            order = ", ".join(ALIASES)
            return f"it has those of the {other} table: {SWAPPED} The order is {order}"
    return f"name it by --holes-columns {field}=NAME"


def check_fields(columns: Mapping[str, str], tables: Mapping[str, HoleTable]) -> None:
    """Raise OptionError if a given field belongs to no table, or a given column does not exist."""
    for field, name in columns.items():
        homes = [kind for kind, fields in ALIASES.items() if field in fields]
        if not homes:
            known = sorted({f for fields in ALIASES.values() for f in fields})
            raise OptionError(
                f"drill-hole tables have no field '{shown(field)}'; fields: {listing(known)}"
            )
        if not any(name in tables[kind].names for kind in homes):
            where = " or ".join(tables[kind].source for kind in homes)
            raise OptionError(f"no column '{shown(name)}' for {field} in {where}")


def _hole_names(column: pd.Series) -> np.ndarray:
    """Return names as text; 34873.0, which a spreadsheet with blanks yields, becomes 34873."""
    values = objects(column)
    whole = [
        int(v) if isinstance(v, float) and np.isfinite(v) and v == int(v) else v for v in values
    ]
    return np.array([str(v).strip() for v in whole], dtype=object)
