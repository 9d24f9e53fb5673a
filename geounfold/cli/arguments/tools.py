"""Arguments of simulate, view, init, doctor and completion."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import add_columns, add_command
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import POINT_FORMATS, POINTS, WHERE, joined

_SIMULATE = """\
columns: centroid_x, centroid_y, centroid_z folded, true_x, true_y, true_z
before folding, in metres, to four decimals; of faulted bodies true_fault_block
too. The same case gives the same file."""

_DOCTOR = """\
The exit status is 1 if a library that geounfold needs is missing, has another
version than geounfold needs, or does not work. Libraries of extras may be
missing."""

_COMPLETION = "Needs: pip install 'geounfold[completion]'"

SHELLS = ("bash", "zsh", "tcsh")


def add_simulate(commands: Any) -> Parser:
    """Add the command simulate and its arguments."""
    parser = add_command(
        commands,
        "simulate",
        "make a simulated folded or faulted body, and its truth",
        details=_SIMULATE,
        examples=(
            "geounfold simulate --list",
            "geounfold simulate plunging -o blocks.csv",
            "geounfold simulate horst -o horst.csv --faults-out horst.ts",
        ),
    )
    group = parser.section("body")
    group.add("case", metavar="CASE", nargs="?", help="the body's name")
    group.add("--list", action="store_true", help="list the bodies, one line each")
    group.add("-o", "--output", metavar="OUT", help=f"the blocks: {POINTS}")
    group.add(
        "--faults-out",
        metavar="F",
        help="the surfaces of a faulted body, a file each: horst_f1.ts, ... of horst.ts",
    )
    group.add(
        "--blocks",
        metavar="N",
        help="scale the body in its plane, not its thickness, to about N blocks; of a faulted "
        "body, scale the blocks",
    )
    return parser


def add_view(commands: Any) -> Parser:
    """Add the command view and its arguments."""
    parser = add_command(
        commands,
        "view",
        "draw points or a saved map into a picture",
        details=joined(WHERE, POINT_FORMATS),
        examples=(
            "geounfold view flat.csv -o flat.png",
            "geounfold view flat.csv -o shear.png --colour shear",
        ),
    )
    group = parser.section("picture")
    group.add(
        "points",
        metavar="FILE",
        help=f"points: {POINTS}; or a map .npz. A table with unfolded_x/y/z or true_x/y/z too is "
        "drawn in both spaces",
    )
    group.add("-o", "--output", metavar="PICTURE.png", help="the picture")
    group.add(
        "--colour",
        nargs="?",
        const="",
        metavar="COLUMN",
        help="column of numbers that colours the points; without COLUMN, list them",
    )
    add_columns(group)
    return parser


def add_init(commands: Any) -> Parser:
    """Add the command init and its arguments."""
    parser = add_command(
        commands,
        "init",
        "write all options of the unfolding, with meanings",
        examples=(
            "geounfold init -o options.toml",
            "geounfold unfold blocks.csv -o flat.csv --config options.toml",
        ),
    )
    group = parser.section("output")
    group.add("-o", "--output", metavar="C.toml", help="file for --config (default: stdout)")
    return parser


def add_doctor(commands: Any) -> Parser:
    """Add the command doctor and its arguments."""
    return add_command(
        commands,
        "doctor",
        "show what is installed, and whether it works",
        details=_DOCTOR,
        examples=("geounfold doctor", "geounfold doctor --json"),
    )


def add_completion(commands: Any) -> Parser:
    """Add the command completion and its arguments."""
    parser = add_command(
        commands,
        "completion",
        "print a script that lets a shell complete commands",
        details=_COMPLETION,
        examples=(
            "geounfold completion bash > ~/.geounfold.bash     # source it from ~/.bashrc",
            "geounfold completion zsh > ~/.zsh/_geounfold      # a folder in fpath",
            "geounfold completion tcsh > ~/.geounfold.csh      # source it from ~/.tcshrc",
        ),
    )
    parser.section("shell").add("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
    return parser
