"""`geounfold crosscheck`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

from geounfold.cli.answers.file_endings import JSON, POINTS_OUT
from geounfold.cli.inputs.points import files_given, read_all
from geounfold.cli.inputs.unfold_options import (
    command_line,
    config_file,
    flagged,
    unfold_options,
)
from geounfold.cli.terminal.console import Console
from geounfold.io import Outputs, write_json
from geounfold.io.paths import TABLE_ENDINGS, ending
from geounfold.io.tables.files import write_table
from geounfold.io.tables.parted import PartedTable


def run(args: Namespace, console: Console) -> None:
    """Unfold a body and check its control mesh against other meshes of the same border."""
    outputs = Outputs.planned(
        {
            "--output": (args.output, (*TABLE_ENDINGS, *JSON)),
            "--differences": (args.differences, POINTS_OUT),
        },
        files_given(args.points, config_file(args)),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    table = PartedTable.chosen(read_all(args.points, args, console))
    if args.differences is not None:
        table.check_writable(args.differences)
    from geounfold.cli.answers.figures import crosscheck_lines
    from geounfold.comparison import crosscheck
    from geounfold.unfolding import run as unfolding

    given = {"meshers": args.meshers, "interiors": args.interiors}
    named: dict[str, Any] = {
        name: tuple(word.strip() for word in words.split(","))
        for name, words in given.items()
        if words is not None
    }
    chosen = flagged(lambda values: crosscheck.CrossCheckOptions(**values), named)
    result = unfolding.unfold(table.points, unfold_options(args), progress=console.stage)
    check = crosscheck.crosscheck(result, chosen, progress=console.stage)
    facts = {**check.as_dict(), "input": table.facts(), "command": command_line(args)}
    console.stage("writing")
    with outputs.writing() as parts:
        if "--differences" in parts:
            columns = {f"difference_{name}": v for name, v in check.differences.items()}
            table.write(parts["--differences"], columns)
        if "--output" in parts and ending(Path(args.output)) in JSON:
            write_json(parts["--output"], facts)
        elif "--output" in parts:
            write_table(parts["--output"], check.table)
    for warning in [*result.summary()["warnings"], *check.warnings]:
        console.warn(warning)
    console.done(f"{len(check.meshes) - 1} meshes compared")
    quiet = args.output is not None
    console.answer(facts, None if quiet else lambda: "".join(crosscheck_lines(check)))
