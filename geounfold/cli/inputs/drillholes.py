"""Drill-holes on the command line: options, tables, outputs in both spaces."""

from __future__ import annotations

import csv
from argparse import Namespace
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.cli.inputs.values import values_rules
from geounfold.errors import OptionError
from geounfold.io.paths import ending
from geounfold.io.polylines import write_polylines
from geounfold.io.tables.files import check_writable, with_columns, write_table

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.cli.terminal.console import Console
    from geounfold.drillholes import DrillHoles
    from geounfold.geometry.mesh import Floats

_XYZ = ("x", "y", "z")

_NEEDS_HOLES = ("composite", "dip_positive_down", "holes_columns", "traces_out")

Carry = Callable[["Floats"], dict[str, Any]]
"""From folded points, (n, 3), to output columns."""


@dataclass(frozen=True, eq=False)
class HoleData:
    """Drill-holes that a command carries.

    Attributes
    ----------
    holes : DrillHoles
        As read.
    length : float or None
        Length of composites; None for the intervals as assayed.
    samples, traces : DataFrame or None
        None if neither an output nor the report has them.
    """

    holes: DrillHoles
    length: float | None
    samples: pd.DataFrame | None
    traces: pd.DataFrame | None

    def facts(self, results: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
        """Return counts of what was read and carried, for the summary."""
        counts = {
            name: {
                "points": len(columns["location"]),
                "extrapolated": int(np.count_nonzero(columns["location"] == "extrapolated")),
                "outside": int(np.count_nonzero(columns["location"] == "outside")),
            }
            for name, columns in results.items()
        }
        return {**self.holes.facts(), "composite_length": self.length, **counts}

    def carried(self, carry: Carry) -> dict[str, dict[str, Any]]:
        """Return the output columns of ``samples`` and ``traces``."""
        frames = {"samples": self.samples, "traces": self.traces}
        return {
            name: carry(frame[list(_XYZ)].to_numpy(dtype=np.float64))
            for name, frame in frames.items()
            if frame is not None
        }

    def write(self, parts: Mapping[str, Path], results: Mapping[str, dict[str, Any]]) -> None:
        """Write the outputs that are wanted."""
        if self.samples is not None and "--samples-out" in parts:
            frame = with_columns(self.samples, results["samples"])
            write_table(parts["--samples-out"], frame, columns=_XYZ)
        if self.traces is not None and "--traces-out" in parts:
            _write_traces(parts["--traces-out"], self.traces, results["traces"])


def check_hole_options(args: Namespace) -> None:
    """Raise OptionError if options of drill-holes contradict each other.

    Raises
    ------
    OptionError
        An option of drill-holes without --holes; --holes without an output, or with --samples.
    """
    if args.holes is None:
        for name in _NEEDS_HOLES:
            if getattr(args, name) not in (None, False):
                raise OptionError(f"--{name.replace('_', '-')} needs --holes COLLAR SURVEY ASSAY")
        return
    if getattr(args, "samples", None) is not None:
        raise OptionError("--samples and --holes exclude each other: both go to --samples-out")
    if args.samples_out is None and args.traces_out is None and not _reported(args):
        raise OptionError("--holes needs --samples-out or --traces-out, or both")


def read_holes(args: Namespace, console: Console, where: str = "samples_where") -> HoleData | None:
    """Return the drill-holes of a command, and warn of rows that cannot be used.

    Parameters
    ----------
    args : Namespace
        The options.
    console : Console
        Shows the stage and the warnings.
    where : str, optional
        Name of the option that chooses assays; empty for none.
    """
    if args.holes is None:
        return None
    length = _length(args.composite)
    settings = hole_settings(args)
    from geounfold.drillholes import read_drillholes

    console.stage("reading drill-holes")
    chosen = getattr(args, where, None) if where else None
    holes = read_drillholes(*args.holes, where=chosen, **settings)
    for line in holes.messages():
        console.warn(line)
    drawn = _reported(args)
    samples = holes.samples(length) if args.samples_out is not None or drawn else None
    if samples is not None and args.samples_out is not None:
        check_writable(args.samples_out, samples)
    traces = holes.traces(length) if args.traces_out is not None or drawn else None
    return HoleData(holes, length, samples, traces)


def hole_settings(args: Namespace) -> dict[str, Any]:
    """Return the arguments of `read_drillholes` that options state, without the choice of rows."""
    return {
        "columns": _fields(args.holes_columns),
        "dip_positive_down": args.dip_positive_down,
        "strict": args.strict,
        "drop_invalid": args.drop_invalid,
        "values": values_rules(args),
    }


def _reported(args: Namespace) -> bool:
    """Return whether a report draws the holes."""
    return getattr(args, "report", None) is not None


def _length(text: str | None) -> float | None:
    if text is None:
        return None
    try:
        return float(text)
    except ValueError as error:
        raise OptionError(f"--composite needs a length, not '{text}'") from error


def _fields(text: str | None) -> dict[str, str]:
    """Return the columns by field of ``field=name,...``; a name with a comma has quotes."""
    fields: dict[str, str] = {}
    for item in next(csv.reader([text or ""], skipinitialspace=True), []):
        field, equals, name = item.partition("=")
        if not equals or not name.strip() or field.strip().lower() in fields:
            raise OptionError(
                f"--holes-columns needs FIELD=NAME, each field once, such as at=DEPTH,dip=INCL, "
                f"not '{text}'"
            )
        fields[field.strip().lower()] = name.strip()
    return fields


def _write_traces(path: Path, traces: pd.DataFrame, columns: dict[str, Any]) -> None:
    """Write traces as a table; as .vtp, lines in the folded space and an array ``unfolded``."""
    if ending(path) != ".vtp":
        write_table(path, with_columns(traces, columns))
        return
    names = list(columns)
    point_data = {
        "unfolded": np.column_stack([columns[name] for name in names[:3]]),
        "stratigraphic": columns["stratigraphic"],
        "inside": (columns["location"] == "inside").astype(np.uint8),
        "surveyed": (traces["position"] == "surveyed").to_numpy().astype(np.uint8),
        "depth": traces["depth"].to_numpy(),
    }
    hole = traces["hole"].to_numpy()
    first = np.r_[0, np.flatnonzero(hole[1:] != hole[:-1]) + 1, len(hole)]
    points = traces[list(_XYZ)].to_numpy(dtype=np.float64)
    write_polylines(path, points, first, point_data, {"hole": [str(h) for h in hole[first[:-1]]]})
