"""`geounfold completion`: a script that lets a shell complete the command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from geounfold.cli.arguments.parser import build_parser
from geounfold.cli.terminal.console import Console
from geounfold.errors import MissingDependencyError

_FILES = frozenset(
    {
        *("points", "output", "summary", "map", "mesh", "report", "samples", "samples_out", "top"),
        *("bottom", "holes", "traces_out", "folded", "unfolded", "truth", "config"),
        *("source", "target", "variogram", "differences", "faults_out"),
        *("collar", "survey", "intervals", "assays", "polygon", "top_out", "bottom_out"),
        "intercepts_out",
        "body",
        "table",
    }
)


def run(args: argparse.Namespace, console: Console) -> None:
    """Print the script."""
    console.say(script(args.shell))


def script(shell: str) -> str:
    """Return the script for a shell.

    It completes commands, all their options, the named values of options, the simulated bodies,
    and files.

    Parameters
    ----------
    shell : str
        One of `geounfold.cli.arguments.tools.SHELLS`.

    Raises
    ------
    MissingDependencyError
        shtab is not installed.
    """
    try:
        import shtab
    except ImportError as error:
        raise MissingDependencyError(
            "shell completion needs shtab, which is not installed: "
            "pip install 'geounfold[completion]'"
        ) from error
    parser = build_parser()
    named = _named_values()
    for action in _actions(parser):
        if action.dest in _FILES:
            action.complete = shtab.FILE
        elif action.dest in named and action.choices is None:
            action.choices = named[action.dest]
    return str(shtab.complete(parser, shell=shell)) + "\n"


def _named_values() -> dict[str, tuple[str, ...]]:
    """Return the valid words of the options that have words as values."""
    from geounfold.synthetic import CASES
    from geounfold.synthetic.faulted import FAULTED_CASES
    from geounfold.unfolding.options import VALID

    return {**VALID, "case": (*CASES, *FAULTED_CASES)}


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    """Yield every option and argument of a parser and of its commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
