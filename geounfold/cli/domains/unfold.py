"""`geounfold unfold --by COLUMN`: every domain of a model on its own, in one run."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.cli.answers.locations import outside_warnings, place_counts
from geounfold.cli.answers.unfolded import block_results
from geounfold.cli.inputs.unfold_options import command_line
from geounfold.errors import OptionError
from geounfold.io import write_json
from geounfold.io.result_columns import UNFOLDED, result_columns, world_columns
from geounfold.io.selection import column_position
from geounfold.io.selection.labels import codes_of
from geounfold.io.selection.mixed import box_told, left_out
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    from geounfold.cli.inputs.body import BodyInputs
    from geounfold.cli.inputs.drillholes import HoleData
    from geounfold.cli.terminal.console import Console
    from geounfold.geometry.mesh import Floats, Ints
    from geounfold.io import Outputs
    from geounfold.unfolding.domains import Domains
    from geounfold.unfolding.options import UnfoldOptions

_ONE = ("report", "mesh", "grade", "top", "bottom", "crosscheck")
"""Options of a single body."""


def check_by(args: Namespace) -> None:
    """Raise OptionError if an option of a single body is given with --by."""
    if args.by is None:
        return
    for name in _ONE:
        if getattr(args, name):
            raise OptionError(
                f"--{name} is for one body: go without --by, and choose a domain by --where "
                f"'{args.by}=NAME'"
            )


def unfold_by(
    args: Namespace,
    console: Console,
    outputs: Outputs,
    options: UnfoldOptions,
    body: BodyInputs,
) -> None:
    """Unfold every domain, and write all outputs that are wanted.

    Raises
    ------
    DomainError
        A domain failed; the others were written.
    GeounfoldError
        All domains failed; nothing was written.
    """
    from geounfold.unfolding import run as unfolding
    from geounfold.unfolding.domains import (
        Domains,
        check_domains_named,
        each_domain,
        model_warnings,
        parts_of_rows,
    )

    given = body.table
    table = given.table if isinstance(given, PartedTable) else given
    chosen = table.chosen
    selected = np.ones(len(table), dtype=bool) if chosen is None else chosen
    codes, names = table.categories(args.by)
    codes = np.where(selected, codes, -1)

    def run(rows: Ints, stage: Any) -> Any:
        return unfolding.unfold(table.points[rows], options, progress=stage)

    check_domains_named(codes, names, f"{table.source}: column '{args.by}'")
    column = table.names[column_position(table.names, args.by, table.source)]
    told = model_warnings(column, codes, names, selected, table.points[selected])
    for warning in told:  # at once: waste may take long
        console.warn(warning)
    results, failures, blocks = each_domain(codes, names, run, console.stage)
    part = parts_of_rows(codes, names, list(results), selected)
    found = Domains(column, results, failures, blocks, None, part)
    if not results:
        found.check()
    parted = PartedTable(table, part, len(results))
    console.stage("writing")
    answer = _Answer(args, body, found, parted)
    with outputs.writing() as parts:
        answer.write(parts, told)
    for warning in answer.warnings:
        console.warn(warning)
    console.done(f"{len(results)} domains, {len(parted)} points unfolded into {args.output}")
    console.answer(answer.summary, None if args.quiet else lambda: domain_lines(found))
    found.check()


class _Answer:
    """The outputs of a run over domains.

    Attributes
    ----------
    warnings : list of str
    summary : dict
    """

    def __init__(
        self, args: Namespace, body: BodyInputs, found: Domains, table: PartedTable
    ) -> None:
        self._body, self._found, self._table = body, found, table
        wanted = {
            "mended": args.mended_column,
            "body_part": args.part_column or any(u.junctions for u in found.values()),
        }
        self._asked = [name for name, asked in wanted.items() if asked]
        self._samples, self._holes = self._carried()
        summaries = {name: u.summary() for name, u in found.items()}
        self.warnings = [
            f"{found.column} {name}: {warning}"
            for name, summary in summaries.items()
            for warning in [*_boxed(found.column, name, summary), *summary["warnings"]]
        ] + self._carried_warnings()
        read = body.table.facts() | ({} if body.frame is None else body.frame.facts())
        first = next(iter(summaries.values()))
        self.summary: dict[str, Any] = {
            "version": first.get("version"),
            "by": found.column,
            "domains": found.facts(),
            "points": len(table),
            "elsewhere": int(np.count_nonzero(table.part == -2)),
            "summaries": summaries,
            "command": command_line(args),
            "warnings": self.warnings,
            "input": read,
        }
        if body.samples is not None:
            self.summary["samples"] = body.samples.facts()
        if body.holes is not None:
            self.summary["drillholes"] = body.holes.facts(self._holes)

    def write(self, parts: Mapping[str, Path], told: list[str]) -> None:
        """Write the outputs that are wanted; ``told`` are the warnings that were given already."""
        body = self._body
        makes = [partial(self._columns, name) for name in self._found]
        self._table.write_parts(parts["--output"], *makes)
        self.summary.update(body.volumes.facts())
        self.warnings += body.volumes.warnings()
        self.summary["warnings"] = [*told, *self.warnings]
        if body.samples is not None and "--samples-out" in parts:
            body.samples.write(parts["--samples-out"], self._samples)
        if body.holes is not None:
            body.holes.write(parts, self._holes)
        if "--map" in parts:
            self._found.save(parts["--map"])
        if "--summary" in parts:
            write_json(parts["--summary"], self.summary)

    def _columns(
        self, name: str, frame: pd.DataFrame, points: Floats, rows: slice
    ) -> dict[str, Any]:
        world = {} if self._body.frame is None else world_columns(points)
        found = block_results(self._found[name], rows, self._asked)
        return {**world, **found, **self._body.volumes.columns(frame, found)}

    def _carried(self) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Return the columns of loose samples, and those of holes."""
        body, samples = self._body, {}
        maps = {name: u.map for name, u in self._found.items()}
        if body.samples is not None:
            samples = carried_columns(
                maps, self._found.column, body.samples.frame, body.samples.points
            )
            samples |= self._deviations(body.samples.points, samples)
        holes = carried_holes(maps, self._found.column, body.holes)
        for name, columns in holes.items():
            points = getattr(body.holes, name)[list("xyz")].to_numpy(dtype=np.float64)
            columns |= self._deviations(points, columns)
        return samples, holes

    def _deviations(self, points: Floats, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Return the standard deviations of carried points, if --uncertainty measured them."""
        from geounfold.quality.uncertainty import joined

        parts = [u.uncertainty for u in self._found.values() if u.uncertainty is not None]
        if not parts:
            return {}
        return joined(parts).columns(points, np.isfinite(columns[UNFOLDED[0]]))

    def _carried_warnings(self) -> list[str]:
        body = self._body
        found = [] if body.holes is None else body.holes.holes.messages()
        if body.samples is not None:
            found += outside_warnings(body.samples.source, place_counts(self._samples))
        told = {"the samples": self._samples}
        told |= {f"the holes' {name}": columns for name, columns in self._holes.items()}
        found += placed_told(self._found.column, told)
        for name, columns in self._holes.items():
            found += outside_warnings(f"the holes' {name}", place_counts(columns))
        return found


def _boxed(column: str, name: str, summary: Mapping[str, Any]) -> list[str]:
    """Return the warning of a domain that fills its lattice's box; none if it does not."""
    way_out = f'if it is no body, leave it out by --where "{left_out(column, [name])}"'
    told = box_told(summary.get("lattice", {}).get("full_box"), way_out)
    return [told] if told else []


def carried_holes(
    maps: Mapping[str, Any], column: str, holes: HoleData | None
) -> dict[str, dict[str, Any]]:
    """Return the results of drill-holes, each point by its domain's map, as `carried_columns`."""
    found = {}
    for name in () if holes is None else ("samples", "traces"):
        frame = getattr(holes, name)
        if frame is not None:
            points = frame[list("xyz")].to_numpy(dtype=np.float64)
            found[name] = carried_columns(maps, column, frame, points)
    return found


def placed_told(column: str, carried: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the warnings of points that were given to domains by their place."""
    return [
        f"{name}: no column '{column}': each point was given to the domain in or nearest to whose "
        "body it lies; the output has the column"
        for name, columns in carried.items()
        if column in columns
    ]


def carried_columns(
    maps: Mapping[str, Any], column: str, frame: pd.DataFrame, points: Floats
) -> dict[str, Any]:
    """Return the results of points, each by its domain's map.

    A table without the column of the domains gets it: each point belongs to the domain in or
    nearest to whose body it lies.
    """
    from geounfold.mapping.domain_map import carry_domains, nearest_domain

    names = [str(name) for name in frame.columns]
    same = [k for k, n in enumerate(names) if n.strip().casefold() == column.strip().casefold()]
    every, own = list(maps), {}
    if same:
        codes, labels = codes_of([frame.iloc[:, same[0]]])
        place = np.array([every.index(n) if n in every else -1 for n in labels] + [-1])
        part = place[codes]
    else:
        part = nearest_domain(list(maps.values()), points)
        own = {column: np.array([*every, ""], dtype=object)[part]}
    carried = carry_domains(list(maps.values()), points, part)
    found = result_columns(UNFOLDED, carried)
    if same:
        found["location"] = np.where(part < 0, "elsewhere", found["location"])
    return {**own, **found}


def domain_lines(found: Domains) -> str:
    """Return a line per domain, as a terminal shows it."""
    rows = found.facts()
    width = max(len("domain"), *(len(row["domain"]) for row in rows))
    lines = [f"{'domain':<{width}}{'blocks':>10}  {'outcome':<12}{'trust':<7}NMD\n"]
    for row in rows:
        figures = row["error"] or f"{row['nmd_mean']:.4g}"
        lines.append(
            f"{row['domain']:<{width}}{row['blocks']:>10}  {row['outcome']:<12}"
            f"{row['trust'] or '-':<7}{figures}\n"
        )
    return "".join(lines)
