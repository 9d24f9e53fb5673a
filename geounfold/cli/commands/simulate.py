"""`geounfold simulate`."""

from __future__ import annotations

from argparse import Namespace

from geounfold.cli.answers.file_endings import POINTS_OUT
from geounfold.cli.inputs.numbers import whole_number
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import Outputs
from geounfold.io.tables.files import write_table


def run(args: Namespace, console: Console) -> None:
    """Print the names of the simulated bodies, or write one of them with its truth."""
    from geounfold import synthetic

    if args.list:
        if args.case is not None or args.output is not None:
            raise OptionError("--list has neither CASE nor -o: it prints the names of all cases")
        cases = {name: case.description for name, case in synthetic.CASES.items()}
        console.answer({"cases": cases}, lambda: _lined_up(cases))
        return
    if args.case is None or args.output is None:
        raise OptionError("simulate needs CASE and -o OUT, or --list")
    blocks = None if args.blocks is None else whole_number(args.blocks, "--blocks")
    outputs = Outputs.planned(
        {"--output": (args.output, POINTS_OUT)},
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    console.stage("simulating")
    body = synthetic.simulate(args.case, blocks=blocks)
    frame = body.frame(4)
    with outputs.writing() as parts:
        write_table(parts["--output"], frame)
    console.done(f"{len(frame)} points written into {args.output}")
    console.answer({"case": args.case, "points": len(frame), "output": args.output})


def _lined_up(texts: dict[str, str]) -> str:
    """Return names and texts as two columns."""
    width = max(map(len, texts))
    return "".join(f"{name:<{width}}  {text}\n" for name, text in texts.items())
