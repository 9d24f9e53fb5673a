"""Arguments of the commands that make and fill block models: grid and transfer."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.shared import (
    ANGLES_HELP,
    POINTS_HELP,
    TABLES_HELP,
    add_command,
    add_frame,
)

_GRID = """\
The grid's blocks lie along the axes of the unfolded space, with faces at whole multiples of their
sides: columns x, y, z, dx, dy, dz, and i, j, k from 0."""


_TRANSFER = (
    """\
Each target block is cut into equal parts; the source block at the image of a part's centre gives
its value, and the mean over the parts is written, with NAME_share, the share of the parts that have
one. The summary has the sums of volume times value on both sides.

Sides are columns (XINC, dx, size_x and alike are found) or the steps of the centroids' lattice.

"""
    + ANGLES_HELP
)


def add_grid(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command grid and its arguments."""
    parser = add_command(
        commands, "grid", "make a regular grid of blocks over unfolded points", common, _GRID
    )
    parser.add_argument(
        "points",
        metavar="FLAT",
        help=f"what it covers: {TABLES_HELP}; columns unfolded_x/y/z come first where they exist",
    )
    parser.add_argument("-o", "--output", metavar="GRID", required=True, help=TABLES_HELP)
    parser.add_argument("--sizes", metavar="X,Y,Z", required=True, help="sides of a block")
    parser.add_argument(
        "--map", metavar="M.npz", help="leave out blocks no part of which lies in this map's body"
    )
    parser.add_argument("--columns", metavar="A,B,C", help="the coordinate columns")
    parser.set_defaults(drop_invalid=False)


def add_transfer(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command transfer and its arguments."""
    parser = add_command(
        commands, "transfer", "move values between folded and unfolded blocks", common, _TRANSFER
    )
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    parser.add_argument("source", metavar="SOURCE", help=f"blocks that have values: {POINTS_HELP}")
    parser.add_argument("target", metavar="TARGET", help="blocks that get them")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=POINTS_HELP)
    parser.add_argument("--values", metavar="A,B,...", required=True, help="columns of SOURCE")
    parser.add_argument(
        "--to",
        metavar="SPACE",
        default="folded",
        help="where TARGET lies: folded (default; SOURCE is then unfolded) or unfolded",
    )
    parser.add_argument(
        "--split", metavar="N", default="4", help="parts of a block along each axis (default 4)"
    )
    add_frame(
        parser,
        "the folded blocks",
        "how the folded blocks are turned, in degrees (default: measured; see below)",
    )
    for side in ("source", "target"):
        name = side.upper()
        parser.add_argument(
            f"--{side}-sizes", metavar="X,Y,Z", help=f"columns, or lengths, of {name}'s sides"
        )
        parser.add_argument(
            f"--{side}-columns", metavar="A,B,C", help=f"{name}'s coordinate columns"
        )
    parser.add_argument(
        "--drop-invalid", action="store_true", help="leave out rows without finite coordinates"
    )
    parser.add_argument("--summary", metavar="S.json", help="totals, and blocks without a value")
