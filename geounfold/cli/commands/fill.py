"""`geounfold fill`: blocks in a wireframe."""

from __future__ import annotations

from argparse import Namespace

from geounfold.cli.answers.file_endings import JSON, POINTS_OUT
from geounfold.cli.inputs.points import files_given
from geounfold.cli.inputs.solid import filled, source
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import Outputs, write_json
from geounfold.io.tables.files import write_table


def run(args: Namespace, console: Console) -> None:
    """Write the blocks in a closed surface, or between two open ones."""
    if (args.points is None) == (args.top is None and args.bottom is None):
        raise OptionError("fill needs SOLID, or --top and --bottom")
    if (args.top is None) != (args.bottom is None):
        raise OptionError("--top and --bottom belong together: give both or neither")
    outputs = Outputs.planned(
        {"--output": (args.output, POINTS_OUT), "--summary": (args.summary, JSON)},
        files_given(args.points, args.top, args.bottom),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    made = filled(args, console)
    console.stage("writing")
    facts = {"source": source(args), **made.facts()}
    with outputs.writing() as parts:
        write_table(parts["--output"], made.table)
        if "--summary" in parts:
            write_json(parts["--summary"], facts)
    console.done(f"{len(made)} blocks written into {args.output}")
    console.answer(facts)
