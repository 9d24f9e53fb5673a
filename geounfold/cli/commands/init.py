"""`geounfold init`."""

from __future__ import annotations

from argparse import Namespace

from geounfold.cli.answers.file_endings import TOML
from geounfold.cli.terminal.console import Console
from geounfold.io import Outputs


def run(args: Namespace, console: Console) -> None:
    """Write every option of the unfolding with its default and its meaning."""
    outputs = Outputs.planned(
        {"--output": (args.output, TOML)}, overwrite=args.overwrite, watcher=console.journal
    )
    from geounfold.unfolding.options_toml import template

    if args.output is None:
        console.say(template())
        return
    with outputs.writing() as parts:
        parts["--output"].write_text(template(), encoding="utf-8", newline="\n")
    console.done(f"options written into {args.output}")
    console.answer({"output": args.output})
