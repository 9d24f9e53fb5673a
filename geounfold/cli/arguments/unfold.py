"""Arguments of the command unfold."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.shared import (
    ANGLES_HELP,
    FORMATS_HELP,
    HOLES_HELP,
    POINTS_HELP,
    RESULTS_HELP,
    add_columns,
    add_command,
    add_frame,
    add_holes,
    add_model,
)

_UNFOLD = (
    RESULTS_HELP
    + """\
  volume_ratio, nmd_error, stretch_min, stretch_max, shear   distortion of each block
  block_volume, unfolded_volume   where the blocks' sides are known (see --sizes)

Every input column and row comes back in order. An input column called as a result is replaced
in its place. Output tables are separated by commas, whatever the input's separator.

"""
    + ANGLES_HELP
)


def add_unfold(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command unfold and its arguments."""
    parser = add_command(
        commands, "unfold", "unfold a body", common, _UNFOLD + HOLES_HELP + FORMATS_HELP
    )
    parser.add_argument("points", metavar="POINTS", help=f"block centroids: {POINTS_HELP}")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=POINTS_HELP)
    parser.add_argument("--summary", metavar="S.json", help="what ran and how good it is")
    parser.add_argument("--map", metavar="M.npz", help="the map, for `geounfold map`")
    parser.add_argument("--report", metavar="R.html", help="verdict, 3-D views, figures")
    parser.add_argument(
        "--mesh", metavar="C.vtu", help="the control mesh in both spaces, flaws marked"
    )
    parser.add_argument(
        "--sizes",
        metavar="X,Y,Z",
        help="sides of the blocks, for their volumes: three columns (XINC, dx and alike are "
        "found) or lengths",
    )
    add_frame(parser, "POINTS")
    parser.add_argument("--samples", metavar="P", help=f"other points to carry: {POINTS_HELP}")
    parser.add_argument("--samples-out", metavar="Q", help="where they, or the holes' samples, go")
    parser.add_argument(
        "--samples-columns", metavar="A,B,C", help="their coordinate columns, as --columns"
    )
    parser.add_argument(
        "--grade",
        metavar="NAME",
        help="a column of the samples or assays to explore in the report: histogram, layers, "
        "variograms in both spaces, swaths, contacts",
    )
    parser.add_argument(
        "--top", metavar="T", help="the top surface: a mesh file or a table (see below)"
    )
    parser.add_argument("--bottom", metavar="B", help="the bottom surface")
    parser.add_argument(
        "--crosscheck",
        action="store_true",
        help="check the control mesh against others of its border, in summary and report",
    )
    add_columns(parser)
    add_holes(parser)
    add_model(parser).add_argument(
        "--allow-uncertified",
        action=argparse.BooleanOptionalAction,
        default=argparse.SUPPRESS,
        help="write the answer, marked, even where the map is not proved one-to-one",
    )
