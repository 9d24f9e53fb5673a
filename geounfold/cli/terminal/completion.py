"""Completion of the command line by shells."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from geounfold.cli.arguments.parser import build_parser
from geounfold.errors import MissingDependencyError

_FILES = frozenset(
    {
        *("points", "output", "summary", "map", "mesh", "report", "samples", "samples_out", "top"),
        *("bottom", "holes", "traces_out", "folded", "unfolded", "truth", "config"),
    }
)


def script(shell: str) -> str:
    """Return the script that teaches a shell (one of ``parser.SHELLS``) to complete.

    It knows the commands, their options, the options' names for values, the simulated bodies, and
    where files belong.

    Raises
    ------
    MissingDependencyError
        shtab is not installed.
    """
    try:
        import shtab
    except ImportError as error:
        raise MissingDependencyError(
            "shells are taught by shtab, which is not installed: "
            "pip install 'geounfold[completion]'"
        ) from error
    parser = build_parser()
    named = _named()
    for action in _actions(parser):
        if action.dest in _FILES:
            action.complete = shtab.FILE
        elif action.dest in named and action.choices is None:
            action.choices = named[action.dest]
    return str(shtab.complete(parser, shell=shell)) + "\n"


def _named() -> dict[str, tuple[str, ...]]:
    """Return the values that have names, by option."""
    from geounfold.synthetic import CASES
    from geounfold.unfolding.options import VALID

    return {**VALID, "case": tuple(CASES)}


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    """Yield every option and argument of a parser and its commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
