"""The commands and their options.

Options of the unfolding have no defaults here: what is not given is left to `UnfoldOptions`,
which checks what is given and lists the valid values.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from geounfold import _version
from geounfold.cli.arguments.blocks import add_grid, add_transfer
from geounfold.cli.arguments.compare import add_compare, add_crosscheck, add_quality
from geounfold.cli.arguments.estimate import add_estimate
from geounfold.cli.arguments.map import add_map
from geounfold.cli.arguments.shared import EXIT_STATUS, Parser, common_arguments
from geounfold.cli.arguments.tools import (
    add_completion,
    add_doctor,
    add_init,
    add_simulate,
    add_view,
)
from geounfold.cli.arguments.unfold import add_unfold


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the parsed arguments; `handler` names the command's function, `words` is argv.

    Raises
    ------
    OptionError
        Unknown commands, options or values, or ones that are missing.
    SystemExit
        After ``--help`` and ``--version``, with status 0.
    """
    args = build_parser(holes="--holes" in argv).parse_args(_joined(argv))
    args.words = list(argv)
    return args


def _joined(argv: Sequence[str]) -> list[str]:
    """Return arguments with ``--up -1,0,0`` as one, which argparse takes for an option else."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] == "--up" and word[:1] == "-":
            joined[-1] = f"--up={word}"
        else:
            joined.append(word)
    return joined


def build_parser(*, holes: bool = False) -> Parser:
    """Return the parser of all commands; with `holes`, `map` takes these instead of POINTS."""
    parser = Parser(
        prog="geounfold",
        description="Takes the folds out of an ore body, and puts them back.",
        epilog=EXIT_STATUS,
    )
    parser.add_argument("--version", action="version", version=f"geounfold {_version.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    common = common_arguments()
    add_unfold(commands, common)
    add_map(commands, common, holes=holes)
    add_estimate(commands, common)
    add_compare(commands, common)
    add_crosscheck(commands, common)
    add_quality(commands, common)
    add_simulate(commands, common)
    add_view(commands, common)
    add_grid(commands, common)
    add_transfer(commands, common)
    add_init(commands, common)
    add_doctor(commands, common)
    add_completion(commands, common)
    return parser
