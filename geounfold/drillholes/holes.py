"""Read, check and desurvey drill-holes; return their samples and traces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.drillholes import checks
from geounfold.drillholes.checks import Collars, Intervals, Stations
from geounfold.drillholes.composite import CompositeOptions, Residual, composite
from geounfold.drillholes.desurvey import Paths, desurvey, directions
from geounfold.drillholes.findings import ERROR, NOTE, Finding, Log, facts, messages, refusal
from geounfold.drillholes.grades import AssayColumns, grade_columns
from geounfold.drillholes.names import matched_names
from geounfold.drillholes.tables import HoleTable, check_fields, read_hole_table
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.grade_values import GradeRules, grade_rules
from geounfold.io.messages import listing, shown
from geounfold.io.selection.labels import codes_of

SURVEYED, EXTRAPOLATED = "surveyed", "extrapolated"
SAMPLE_COLUMNS = ("hole", "from", "to", "x", "y", "z", "position", "coverage")

_MOST_TRACE_POINTS = 20_000_000


@dataclass(frozen=True, eq=False)
class DrillHoles:
    """Checked drill-holes with their paths.

    Attributes
    ----------
    sources : dict of str
        Names of the tables by kind: collar, survey, assay.
    collars : Collars
        The h holes that could be placed.
    stations : Stations
        Survey stations of these holes; dips positive down.
    intervals : Intervals
        The n assayed intervals of these holes.
    paths : Paths
        Paths of these holes.
    ends : (h,) float
        Depth of each hole's end: of its last interval, its last survey or the collar table,
        whichever is deepest.
    grades : dict of (n,) float
        Numbers of the intervals, by column; NaN if not assayed.
    words : dict of (n,) object
        Other columns of the intervals.
    positive_down : bool
        The dip convention of the tables.
    stated : bool
        Whether the user stated the convention; else it was detected.
    rows : dict of int
        Number of rows of each table as read.
    findings : tuple of Finding
        Findings of the checks.
    assay_columns : AssayColumns
        How the values of the assay table were read.
    """

    sources: Mapping[str, str]
    collars: Collars
    stations: Stations
    intervals: Intervals
    paths: Paths
    ends: Floats
    grades: Mapping[str, Floats]
    words: Mapping[str, np.ndarray]
    positive_down: bool
    stated: bool
    rows: Mapping[str, int]
    findings: tuple[Finding, ...]
    assay_columns: AssayColumns

    def __len__(self) -> int:
        return len(self.collars)

    def __repr__(self) -> str:
        return (
            f"DrillHoles({len(self)} holes, {len(self.stations.depth)} stations, "
            f"{len(self.intervals.start)} intervals, {len(self.findings)} findings)"
        )

    @property
    def names(self) -> list[str]:
        """Names of the holes, in the collar table's order."""
        return [str(name) for name in self.collars.names]

    def at(self, hole: str, depth: Floats) -> Floats:
        """Return positions (n, 3) at depths along one hole.

        Raises
        ------
        InputError
            No placed hole has this name.
        """
        where = self.collars.find(np.array([hole], dtype=object))[0]
        if where < 0:
            raise InputError(f"no hole '{hole}' could be placed")
        depths = np.atleast_1d(np.asarray(depth, dtype=np.float64))
        return self.paths.at(np.full(len(depths), where), depths)[0]

    def samples(
        self,
        length: float | None = None,
        *,
        residual: Residual = "merge",
        min_coverage: float = 0.5,
        by: str | None = None,
    ) -> pd.DataFrame:
        """Return the intervals, or composites of a length, with the coordinates of their midpoints.

        Parameters
        ----------
        length : float, optional
            Length of composites along the hole, in the tables' unit; the default is the intervals
            as they are.
        residual : {"merge", "drop", "keep"}, optional
            Treatment of a short last composite, as in `CompositeOptions`.
        min_coverage : float, optional
            Smallest assayed share of a composite with a grade, as in `CompositeOptions`.
        by : str, optional
            Column of codes, such as the rock. Composites begin anew where the code changes, so that
            none crosses a contact, and each has its code.

        Returns
        -------
        DataFrame
            Columns hole, from, to, x, y, z (of the midpoint along the hole, in the collars'
            coordinates), position (surveyed, or extrapolated beyond a hole's surveys), for
            composites coverage (share of the length that intervals cover), and the assay
            table's other columns. A column with one of these names gets the prefix ``assay_``.
            Sorted by hole, in the collar table's order, and depth.

        Raises
        ------
        OptionError
            A length or rule is outside its valid values, or there is no column `by`.
        InputError
            No composite is assayed over enough of its length.
        """
        iv = self.intervals
        extra: dict[str, Any] = {}
        if length is None:
            hole, start, end = iv.hole, iv.start, iv.end
            own: dict[str, Any] = {**self.grades, **self.words}
        else:
            options = CompositeOptions(length=length, residual=residual, min_coverage=min_coverage)
            run, owner, above = self._runs(by)
            made = composite(
                run, iv.start - above[run], iv.end - above[run],
                _stacked(self.grades, len(iv.hole), np.float64),
                _stacked(self.words, len(iv.hole), object), options,
            )  # fmt: skip
            hole, start, end = owner[made.hole], made.start, made.end
            start, end = start + above[made.hole], end + above[made.hole]
            if not len(hole):
                raise InputError(
                    f"{self.sources['assay']}: no composite of {length:g} is assayed over "
                    f"{min_coverage:.0%} of its length; take a shorter length or a lower share"
                )
            extra["coverage"] = np.minimum(made.covered / (end - start), 1.0)
            own = {name: made.grades[:, j] for j, name in enumerate(self.grades)}
            own |= {name: made.words[:, j] for j, name in enumerate(self.words)}
        points, enclosed = self.paths.at(hole, 0.5 * (start + end))
        columns = {
            "hole": self.collars.names[hole],
            "from": start,
            "to": end,
            "x": points[:, 0],
            "y": points[:, 1],
            "z": points[:, 2],
            "position": _position(enclosed),
            **extra,
        }
        for name in (*self.grades, *self.words):
            columns[f"assay_{name}" if name.lower() in SAMPLE_COLUMNS else name] = own[name]
        return pd.DataFrame(columns)

    def _runs(self, by: str | None) -> tuple[Ints, Ints, Floats]:
        """Return the run of each interval, and the hole and first depth of each run.

        Without a column, every hole is a run from its collar; else intervals of one code are.
        """
        iv = self.intervals
        if by is None:
            return iv.hole, np.arange(len(self)), np.zeros(len(self))
        columns = {**self.words, **self.grades}
        if by not in columns:
            raise OptionError(
                f"{self.sources['assay']}: no column '{shown(by)}' of codes; columns: "
                f"{listing(columns)}"
            )
        codes = codes_of([pd.Series(columns[by])])[0]
        new = np.r_[True, (iv.hole[1:] != iv.hole[:-1]) | (codes[1:] != codes[:-1])]
        first = np.flatnonzero(new)
        return np.cumsum(new) - 1, iv.hole[first], iv.start[first]

    def traces(self, step: float | None = None) -> pd.DataFrame:
        """Return points along every hole, from the collar to its end.

        Parameters
        ----------
        step : float, optional
            Length between points, in the tables' unit. Points lie at its whole multiples, at
            every station and at the end. The default is the median length of the intervals.

        Returns
        -------
        DataFrame
            Columns hole, depth, x, y, z and position (as `samples`), sorted by hole and depth.

        Raises
        ------
        OptionError
            The step is not above 0, or gives more than 20 million points.
        """
        if step is None:
            step = float(np.median(self.intervals.end - self.intervals.start))
        if not (np.isfinite(step) and step > 0):
            raise OptionError(f"the step along traces must be above 0, not {step}")
        share = np.floor(self.ends / step)
        if share.sum() > _MOST_TRACE_POINTS:
            raise OptionError(
                f"a step of {step:g} makes {share.sum():.3g} trace points; take a larger one"
            )
        count = share.astype(np.int64) + 1
        owner = np.repeat(np.arange(len(self)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        hole = np.r_[owner, self.stations.hole, np.arange(len(self))]
        depth = np.r_[number * step, self.stations.depth, self.ends]
        order = np.lexsort((depth, hole))
        hole, depth = hole[order], depth[order]
        new = np.r_[True, (hole[1:] != hole[:-1]) | (np.diff(depth) > 1e-9 * step)]
        hole, depth = hole[new], depth[new]
        points, enclosed = self.paths.at(hole, depth)
        return pd.DataFrame(
            {
                "hole": self.collars.names[hole],
                "depth": depth,
                "x": points[:, 0],
                "y": points[:, 1],
                "z": points[:, 2],
                "position": _position(enclosed),
            }
        )

    def messages(self) -> list[str]:
        """Return one line for each kind of finding, and for each cap what it changed."""
        capped = [f"{self.sources['assay']}: {cap}" for cap in self.assay_columns.caps]
        return messages(self.findings) + capped

    def facts(self) -> dict[str, Any]:
        """Return the counts of rows, holes and findings, for a summary."""
        return {
            "files": dict(self.sources),
            "rows": dict(self.rows),
            "holes": len(self),
            "stations": len(self.stations.depth),
            "intervals": len(self.intervals.start),
            "dip_positive_down": self.positive_down,
            "dip_convention": "stated" if self.stated else "detected",
            "grades": list(self.grades),
            "grade_values": {n: dict(c) for n, c in self.assay_columns.counts.items()},
            "caps": [asdict(cap) for cap in self.assay_columns.caps],
            **facts(self.findings),
        }


def read_drillholes(  # 10 arguments: a public name; seven of them are choices by keyword
    collar: str | Path | pd.DataFrame,
    survey: str | Path | pd.DataFrame,
    assay: str | Path | pd.DataFrame,
    *,
    columns: Mapping[str, str] | None = None,
    grades: Sequence[str] | None = None,
    dip_positive_down: bool | None = None,
    strict: bool = False,
    drop_invalid: bool = False,
    where: str | None = None,
    values: GradeRules | Mapping[str, Any] | None = None,
) -> DrillHoles:
    """Return drill-holes from their three tables, checked and desurveyed.

    Parameters
    ----------
    collar, survey, assay : path or DataFrame
        Collars (hole, x, y, z; optionally depth, azimuth, dip), surveys (hole, at, azimuth, dip)
        and assays (hole, from, to and any others). All lengths have one unit. Angles are in
        degrees, azimuths clockwise from y. Columns are found by name in any letter case
        (`ALIASES`).
    columns : dict of str, optional
        Names of columns by field (hole, x, y, z, depth, at, azimuth, dip, from, to), for columns
        that `ALIASES` does not find.
    grades : names, optional
        Columns of the assay table to average as numbers; the default is all columns of numbers.
    dip_positive_down : bool, optional
        Whether positive dips point down. The default is taken from the dips' sign, because most
        holes go down, and reported.
    strict : bool, optional
        Raise if any row is left out, cut or changed.
    drop_invalid : bool, optional
        Leave out the holes that have assays but cannot be placed (no collar, two collars, no
        survey) instead of raising.
    where : str, optional
        Chooses rows of the assay table, such as ``"LITH=QZ and AU>0.2"``.
    values : GradeRules or mapping, optional
        How the values of grades are read: ``missing`` codes, ``below_detection`` (missing, half or
        zero), ``cap`` by column (a number or p99).

    Raises
    ------
    InputError
        A table cannot be read, a column is missing or ambiguous, no row is left, dips have both
        signs and no convention is stated, fewer than half of a grade's values are numbers, a hole
        cannot be placed (without `drop_invalid`), or there is a finding other than notes (with
        `strict`).

    Examples
    --------
    >>> import pandas as pd
    >>> collar = pd.DataFrame({"BHID": ["A"], "X": [0.0], "Y": [0.0], "Z": [100.0]})
    >>> survey = pd.DataFrame({"BHID": ["A"], "AT": [0.0], "AZ": [90.0], "DIP": [30.0]})
    >>> assay = pd.DataFrame({"BHID": ["A"], "FROM": [10.0], "TO": [30.0], "CU": [1.5]})
    >>> holes = read_drillholes(collar, survey, assay, dip_positive_down=True)
    >>> holes.samples()[["hole", "x", "z", "CU"]].round(3).to_numpy().tolist()
    [['A', 17.321, 90.0, 1.5]]
    """
    log = Log()
    names = dict(columns or {})
    tables = {
        kind: read_hole_table(kind, given, names, log, where if kind == "assay" else None)
        for kind, given in (("collar", collar), ("survey", survey), ("assay", assay))
    }
    check_fields(names, tables)
    for kind in ("survey", "assay"):
        tables[kind] = matched_names(tables[kind], tables["collar"], log)
    good, with_assays = checks.checked_intervals(tables["assay"], log)
    assayed = {str(name) for name in with_assays}
    collars = checks.checked_collars(tables["collar"], assayed, log)
    intervals = checks.placed_intervals(tables["assay"], good, collars, log)
    source = tables["survey"].source
    stations = checks.checked_stations(tables["survey"], collars, intervals, assayed, log)
    _check_left(stations, intervals, tables, log)
    down = checks.dip_positive_down(stations.dip, dip_positive_down, source, log)
    stations = _turned(stations, down)
    stations = checks.checked_turns(stations, collars, source, log)
    collars, stations, intervals = _placed(collars, stations, intervals)
    ends = _ends(collars, stations, intervals)
    checks.extrapolated(stations, ends, collars, source, log)
    chosen = None if grades is None else tuple(grades)
    columns_read = grade_columns(tables["assay"], chosen, grade_rules(values), log)
    _refuse(log.found, strict=strict, drop_invalid=drop_invalid)
    paths = desurvey(
        collars.points, stations.hole, stations.depth, directions(stations.azimuth, stations.dip)
    )
    return DrillHoles(
        sources={kind: table.source for kind, table in tables.items()},
        collars=collars,
        stations=stations,
        intervals=intervals,
        paths=paths,
        ends=ends,
        grades=_at(columns_read.grades, intervals),
        words=_at(columns_read.words, intervals),
        positive_down=down,
        stated=dip_positive_down is not None,
        rows={kind: int(table.row[-1]) for kind, table in tables.items()},
        findings=tuple(log.found),
        assay_columns=columns_read,
    )


def _at(columns: Mapping[str, np.ndarray], intervals: Intervals) -> dict[str, np.ndarray]:
    """Return columns of the assay table at the intervals that are kept."""
    return {name: values[intervals.position] for name, values in columns.items()}


def _check_left(
    stations: Stations, intervals: Intervals, tables: Mapping[str, HoleTable], log: Log
) -> None:
    """Raise if no hole has both a survey and an interval."""
    if not np.intersect1d(stations.hole, intervals.hole).size:
        why = (
            refusal([f for f in log.found if f.severity != NOTE] or log.found, "correct the tables")
            if log.found
            else "the three tables name different holes"
        )
        raise InputError(
            f"no hole of {tables['collar'].source} has both a survey and assays that can be "
            f"used: {why}"
        )


def _turned(stations: Stations, down: bool) -> Stations:
    """Return stations with dips positive down."""
    dip = stations.dip if down else -stations.dip
    return Stations(stations.hole, stations.depth, stations.azimuth, dip, stations.row)


def _placed(
    collars: Collars, stations: Stations, intervals: Intervals
) -> tuple[Collars, Stations, Intervals]:
    """Return only the holes that have a direction, renumbered."""
    keep = np.zeros(len(collars), dtype=bool)
    keep[stations.hole] = True
    number = np.cumsum(keep) - 1
    stations = Stations(
        number[stations.hole], stations.depth, stations.azimuth, stations.dip, stations.row
    )
    kept = intervals.kept(keep[intervals.hole])
    intervals = Intervals(number[kept.hole], kept.start, kept.end, kept.position)
    return checks.without_holes(collars, keep), stations, intervals


def _ends(collars: Collars, stations: Stations, intervals: Intervals) -> Floats:
    """Return the greatest known depth of each hole."""
    ends = np.where(np.isfinite(collars.depth), collars.depth, 0.0)
    np.maximum.at(ends, stations.hole, stations.depth)
    np.maximum.at(ends, intervals.hole, intervals.end)
    return ends


def _refuse(findings: Sequence[Finding], *, strict: bool, drop_invalid: bool) -> None:
    """Raise on holes that cannot be placed and, with `strict`, on any finding except notes."""
    grave = [f for f in findings if f.severity == ERROR]
    if grave and not drop_invalid:
        raise InputError(refusal(grave, "correct it, or leave such holes out by --drop-invalid"))
    other = [f for f in findings if f.severity != NOTE]
    if other and strict:
        raise InputError(refusal(other, "correct it, or run without --strict"))


def _stacked(columns: Mapping[str, np.ndarray], rows: int, kind: Any) -> np.ndarray:
    """Return columns side by side, (rows, c)."""
    return np.column_stack(list(columns.values())) if columns else np.empty((rows, 0), dtype=kind)


def _position(enclosed: Bools) -> np.ndarray:
    return np.where(enclosed, SURVEYED, EXTRAPOLATED)
