"""`geounfold assess`: what unfolding will gain."""

from __future__ import annotations

from argparse import Namespace

from geounfold.cli.answers.file_endings import JSON
from geounfold.cli.inputs.carrier import carrier_of
from geounfold.cli.inputs.estimation import sample_table, variogram_file
from geounfold.cli.inputs.points import files_given, read_samples
from geounfold.cli.inputs.values import values_rules
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import Outputs, write_json


def run(args: Namespace, console: Console) -> None:
    """Print the verdict, and write its figures."""
    outputs = Outputs.planned(
        {"--summary": (args.summary, JSON)},
        files_given(args.body, args.samples, args.variogram),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    samples = read_samples(args, console)
    if samples is None:
        raise OptionError("assess needs SAMPLES")
    table = sample_table(samples, args)
    model = None if args.variogram is None else variogram_file(args.variogram)
    if "hole" in table.columns:  # before the body is unfolded, which takes its time
        from geounfold.gain.assessment import check_three_holes

        check_three_holes(
            int(table.loc[table[args.grade].notna(), "hole"].nunique()), "with values"
        )
    saved = carrier_of(args.body, args, console)
    console.stage("assessing")
    from geounfold.gain import assess

    found = assess(saved, table, grade=args.grade, variogram=model, values=values_rules(args))
    for line in found.samples.warnings(args.grade):
        console.warn(line)
    with outputs.writing() as parts:
        if "--summary" in parts:
            write_json(parts["--summary"], found.facts())
    console.answer(found.facts(), lambda: "\n".join(found.lines()) + "\n")
