"""`geounfold estimate`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geounfold.cli.answers.file_endings import JSON, POINTS_OUT
from geounfold.cli.inputs.points import files_given, read_all, read_samples
from geounfold.cli.inputs.unfold_options import command_line
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import Outputs, write_json
from geounfold.io.paths import existing_file
from geounfold.io.tables.parted import PartedTable


def run(args: Namespace, console: Console) -> None:
    """Estimate a grade on blocks from samples, in the unfolded space of a saved map."""
    from geounfold.cli.inputs.estimation import estimation, summarised

    outputs = Outputs.planned(
        {"--output": (args.output, POINTS_OUT), "--summary": (args.summary, JSON)},
        files_given(args.map, args.samples, args.points, args.variogram),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    table = PartedTable.chosen(read_all(args.points, args, console))
    table.check_writable(args.output)
    samples = read_samples(args, console)
    if samples is None:
        raise OptionError("estimate needs SAMPLES")
    result = estimation(args, samples, table, console.stage)
    summary = {**summarised(args, result, console.stage), "command": command_line(args)}
    with outputs.writing() as parts:
        table.write(parts["--output"], result.columns)
        if "--summary" in parts:
            write_json(parts["--summary"], summary)
    for warning in result.warnings():
        console.warn(warning)
    known = result.blocks.counts()["estimated"]
    console.done(f"{args.grade} estimated on {known} of {len(table)} blocks into {args.output}")
    console.answer(summary)
