"""Arguments of simulate, view, init, doctor and completion."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.shared import TABLES_HELP, add_columns, add_command

_SIMULATE = """\
columns: centroid_x, centroid_y, centroid_z folded, true_x, true_y, true_z before folding, in
metres, to four decimals. The same case gives the same file."""


_DOCTOR = """\
The exit status is 1 where a library that geounfold needs is missing, is of a version it was not
made for, or does not work. Libraries of extras may be missing."""


_COMPLETION = """\
bash:  geounfold completion bash > ~/.local/share/bash-completion/completions/geounfold
zsh:   geounfold completion zsh > ~/.zsh/_geounfold    (a folder in fpath)
tcsh:  geounfold completion tcsh > ~/.geounfold.csh    (and source it from ~/.tcshrc)

Needs: pip install 'geounfold[completion]'"""


SHELLS = ("bash", "zsh", "tcsh")


def add_simulate(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command simulate and its arguments."""
    parser = add_command(
        commands, "simulate", "make a simulated folded body with its exact truth", common, _SIMULATE
    )
    parser.add_argument("case", metavar="CASE", nargs="?", help="which one")
    parser.add_argument("--list", action="store_true", help="list the cases and what they are")
    parser.add_argument("-o", "--output", metavar="OUT", help=TABLES_HELP)
    parser.add_argument(
        "--blocks", metavar="N", help="grow or shrink the body in its plane to about N blocks"
    )


def add_view(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command view and its arguments."""
    parser = add_command(commands, "view", "draw points or a saved map into a picture", common)
    parser.add_argument(
        "points",
        metavar="FILE",
        help=f"{TABLES_HELP}, or a map .npz; a table that has unfolded_x/y/z or true_x/y/z too is "
        "drawn in both spaces",
    )
    parser.add_argument("-o", "--output", metavar="PICTURE.png", required=True)
    parser.add_argument(
        "--colour",
        metavar="COLUMN",
        help="colour by a column of numbers (default stratigraphic, or height)",
    )
    add_columns(parser)


def add_init(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command init and its arguments."""
    parser = add_command(
        commands, "init", "write all options, with their defaults and what they do", common
    )
    parser.add_argument(
        "-o", "--output", metavar="C.toml", help="for --config; without, they go to stdout"
    )


def add_doctor(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command doctor and its arguments."""
    add_command(commands, "doctor", "tell what is installed, and whether it works", common, _DOCTOR)


def add_completion(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command completion and its arguments."""
    parser = add_command(
        commands, "completion", "print a script that makes a shell complete", common, _COMPLETION
    )
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
