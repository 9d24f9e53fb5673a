"""`geounfold init`, `doctor` and `completion`: what helps to use the others."""

from __future__ import annotations

from argparse import Namespace

from geounfold.cli.file_endings import TOML
from geounfold.cli.terminal.console import Console
from geounfold.io import Outputs


def init(args: Namespace, console: Console) -> None:
    """Write every option with its default and what it does, to a file or to stdout."""
    outputs = Outputs.planned(
        {"--output": (args.output, TOML)}, overwrite=args.overwrite, watcher=console.journal
    )
    from geounfold.unfolding.options_toml import template

    if args.output is None:
        console.say(template())
        return
    with outputs.writing() as parts:
        parts["--output"].write_text(template(), encoding="utf-8")
    console.done(f"options written into {args.output}")
    console.answer({"output": args.output})


def doctor(args: Namespace, console: Console) -> None:
    """Say what is installed and whether it works."""
    from geounfold.cli.doctor import check_up, healthy, in_words

    found = check_up(console.stage)
    console.done("checked")
    console.answer(found, lambda: in_words(found))
    healthy(found)


def completion(args: Namespace, console: Console) -> None:
    """Print what teaches a shell to complete the command line."""
    from geounfold.cli.terminal.completion import script

    console.say(script(args.shell))
