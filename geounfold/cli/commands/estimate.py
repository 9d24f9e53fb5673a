"""`geounfold estimate`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from geounfold.cli.answers.estimate_report import write_estimate_report
from geounfold.cli.answers.file_endings import HTML, JSON, POINTS_OUT, TOML
from geounfold.cli.domains.estimate import estimate_by
from geounfold.cli.domains.maps import domains_of, load_map
from geounfold.cli.inputs.points import files_given, read_all, read_samples
from geounfold.cli.inputs.unfold_options import command_line
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError
from geounfold.io import Outputs, write_json
from geounfold.io.paths import SWAPPED, existing_file
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    from geounfold.mapping.mesh_map import UnfoldingMap


def run(args: Namespace, console: Console) -> None:
    """Estimate a grade on blocks from samples, in the unfolded space of a saved map."""
    from geounfold.cli.inputs.estimation import estimation, summarised
    from geounfold.estimation.axes import axes_told

    outputs = Outputs.planned(
        {
            "--output": (args.output, POINTS_OUT),
            "--summary": (args.summary, JSON),
            "--report": (args.report, HTML),
            "--variogram-out": (args.variogram_out, TOML),
        },
        files_given(args.map, args.samples, args.points, args.variogram),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    whole = read_all(args.points, args, console)
    whole.check_writable(args.output)
    samples = read_samples(args, console)
    if samples is None:
        raise OptionError("estimate needs SAMPLES")
    if args.grade not in list(samples.frame.columns) and args.grade in whole.names:
        raise InputError(
            f"{args.samples}: no column '{args.grade}', but {args.points} has it: {SWAPPED} "
            "SAMPLES comes before BLOCKS"
        )
    saved = load_map(args)
    several = domains_of(saved)
    if several is not None:
        if args.report is not None:
            raise OptionError("--report is for one domain: the map holds several")
        if args.variogram_out is not None:
            raise OptionError("--variogram-out is for one domain: the map holds several")
        estimate_by(args, console, several, outputs, samples, whole)
        return
    table = PartedTable.chosen(whole)
    one = cast("UnfoldingMap", saved)
    result = estimation(args, one, samples, table.points, console.stage)
    facts = summarised(args, result, console.stage, console.note)
    summary = {**facts, "command": command_line(args)}
    with outputs.writing() as parts:
        table.write(parts["--output"], result.columns)
        if "--summary" in parts:
            write_json(parts["--summary"], summary)
        if "--variogram-out" in parts:
            if result.variogram is None:
                raise OptionError("--variogram-out: inverse_distance has no variogram")
            parts["--variogram-out"].write_text(
                result.variogram.to_toml(axes_told(result.axes)), encoding="utf-8", newline="\n"
            )
        if "--report" in parts:
            write_estimate_report(parts["--report"], summary, result, one, table, samples)
    for warning in facts["warnings"]:
        console.warn(warning)
    known = result.blocks.counts()["estimated"]
    console.done(f"{args.grade} estimated on {known} of {len(table)} blocks into {args.output}")
    console.answer(summary)
