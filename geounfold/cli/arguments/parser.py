"""The parser of the whole command line: every command and its options."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from itertools import takewhile

from geounfold import _version
from geounfold.cli.arguments.blocks import add_fill, add_grid, add_transfer
from geounfold.cli.arguments.compare import add_compare, add_crosscheck, add_quality
from geounfold.cli.arguments.estimate import add_estimate
from geounfold.cli.arguments.gain import add_assess, add_study_holes
from geounfold.cli.arguments.groups import add_common
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.map import add_map
from geounfold.cli.arguments.modelling import add_body_from_holes
from geounfold.cli.arguments.tools import (
    add_completion,
    add_doctor,
    add_init,
    add_simulate,
    add_view,
)
from geounfold.cli.arguments.unfold import add_unfold
from geounfold.errors import OptionError

_NEGATIVE = (
    "--up",
    "--missing",
    "--origin",
    "--rotation",
    "--limits",
)  # values may begin with a minus sign

GREEDY = ("--faults", "--limits", "--slip-direction", "--uncertainty", "--colour")
"""Options that take the words behind them, also a file that is meant as POINTS."""

_EXAMPLES = ("geounfold unfold --help", "geounfold unfold blocks.csv -o flat.csv --report r.html")


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the parsed arguments.

    Parameters
    ----------
    argv : sequence of str
        The words after ``geounfold``. Without any, the commands are printed.

    Returns
    -------
    Namespace
        The options; ``command`` is the command's name, ``words`` is `argv`.

    Raises
    ------
    OptionError
        An unknown command, option or value, or one that is missing.
    SystemExit
        After a help and ``--version``, with status 0.
    """
    words = list(argv) or ["--help"]
    try:
        args = build_parser(holes="--holes" in words).parse_args(_joined(words))
    except OptionError as error:
        if "arguments are required: " not in str(error):
            raise
        taken = taken_by_options(words)
        raise OptionError(f"{error}{taken and '; '}{taken}") from error
    args.words = list(argv)
    return args


def taken_by_options(words: Sequence[str]) -> str:
    """Return which options took the words behind them, for an error on a missing file.

    Examples
    --------
    >>> taken_by_options(["unfold", "--faults", "F1.ts", "blocks.csv", "-o", "flat.csv"])
    "--faults took all words behind it; if 'blocks.csv' is the file that is missing, put it first"
    >>> taken_by_options(["unfold", "-o", "flat.csv"])
    ''
    """
    found = []
    for k, word in enumerate(words):
        behind = list(takewhile(lambda w: w[:1] != "-", words[k + 1 :]))
        if word in GREEDY and behind:
            found.append((word, f"'{behind[-1]}'"))
    if not found:
        return ""
    options, last = (" and ".join(names) for names in zip(*found, strict=True))
    each = "it" if len(found) == 1 else "them"
    which = last if len(found) == 1 else f"one of {last}"
    return (
        f"{options} took all words behind {each}; if {which} is the file that is missing, put it "
        "first"
    )


def _joined(argv: Sequence[str]) -> list[str]:
    """Return arguments with ``--up -1,0,0`` as one word, which argparse takes for a flag else."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] in _NEGATIVE and word[:1] == "-" and word[:2] != "--":
            joined[-1] = f"{joined[-1]}={word}"
        else:
            joined.append(word)
    return joined


def build_parser(*, holes: bool = False) -> Parser:
    """Return the parser of all commands; with `holes`, `map` takes these instead of POINTS."""
    parser = Parser(
        prog="geounfold",
        description="Takes the folds out of an ore body, and puts them back.",
        examples=_EXAMPLES,
    )
    commands = parser.commands()
    for add in (
        *(add_unfold, partial(add_map, holes=holes), add_estimate, add_body_from_holes),
        *(add_assess, add_study_holes),
        *(add_compare, add_crosscheck, add_quality, add_simulate, add_view),
        *(add_fill, add_grid, add_transfer, add_init, add_doctor, add_completion),
    ):
        add_common(add(commands))
    options = parser.section("options")
    options.add("-h", "--help", action="help", help="print the commands")
    version = f"geounfold {_version.__version__}"
    options.add("--version", action="version", version=version, help="print the version")
    return parser
