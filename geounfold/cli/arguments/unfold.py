"""Arguments of the command unfold."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.groups import (
    add_block_size,
    add_columns,
    add_command,
    add_frame,
    add_holes,
    add_method,
    add_samples_choice,
)
from geounfold.cli.arguments.help import Parser, Section
from geounfold.cli.arguments.texts import (
    ANGLES,
    FORMATS,
    HOLES,
    KEPT_ROWS,
    LIMITS,
    POINTS,
    RESULTS,
    WHERE,
    joined,
)

_DISTORTION = """\
  volume_ratio, nmd_error, stretch_min, stretch_max, shear
                   distortion of each block
  sd_along, sd_across
                   with --uncertainty: standard deviation of the place, in
                   the flat space: along each axis of the layers, and across
  mended           with --mended-column: cut, dropped or smoothed if the hull
                   leaves the block out; else empty
  body_part        if a body has several sheets, or with --part-column: sheet
                   of each block, 0 the largest; -1 outside the bodies
  fault_block      with --faults or --fault-blocks: block between faults, 0
                   the largest; flat points are carried back by it
  block_volume, unfolded_volume
                   if the blocks' sides are known: from --sizes, or from
                   columns called XINC, dx, size_x or alike"""

ENGINES = ("auto", "memory", "batches")

_EXAMPLES = (
    "geounfold unfold blocks.csv -o flat.csv --summary s.json --report r.html",
    "geounfold unfold blocks.csv -o flat.csv --map m.npz \\\n"
    "    --holes collar.csv survey.csv assay.csv --composite 2 --samples-out q.csv",
)


def add_unfold(commands: Any) -> Parser:
    """Add the command unfold and its arguments."""
    parser = add_command(
        commands,
        "unfold",
        "take the folds out of an ore body",
        details=joined(
            f"{RESULTS}\n{_DISTORTION}", KEPT_ROWS, WHERE, LIMITS, ANGLES, HOLES, FORMATS
        ),
        examples=_EXAMPLES,
    )
    group = parser.section("body")
    group.add(
        "points",
        nargs="?",
        metavar="POINTS",
        help="block centroids, or a closed surface to fill",
    )
    add_columns(group)
    group.add("--by", metavar="COLUMN", help="unfold every domain that a column names on its own")
    group.add(
        "--sizes",
        metavar="X,Y,Z",
        help="sides of a block, for volumes: columns or lengths",
    )
    add_block_size(group, rare=True)
    _add_faults(group)
    group.add(
        "--limits",
        nargs="+",
        metavar="L",
        help="where the model was cut off: surfaces or a box",
    )
    group.add("--top", metavar="T", help="the top surface: a mesh file or a table")
    group.add("--bottom", metavar="B", help="the bottom surface")
    add_frame(group, "POINTS")
    _add_outputs(parser)
    group = parser.section("large tables")
    group.add(
        "--engine",
        choices=ENGINES,
        default=ENGINES[0],
        rare=True,
        help="memory: all rows at once; batches: a Parquet file or folder, row by row; auto "
        "(default): batches from 4 million rows on",
    )
    group = parser.section("samples and drill-holes")
    group.add("--samples", metavar="P", help="other points to carry, in any format of POINTS")
    group.add("--samples-out", metavar="Q", help="the carried samples, loose or of drill-holes")
    add_samples_choice(group)
    add_holes(group)
    group.add(
        "--grade",
        metavar="NAME",
        rare=True,
        help="column of samples or assays that the report explores",
    )
    group = parser.section("method")
    add_method(group)
    _add_checks(parser)
    return parser


def _add_checks(parser: Parser) -> None:
    """Add the arguments for what is proved and how far off the answer may be."""
    group = parser.section("checks")
    group.add(
        "--allow-uncertified",
        action=argparse.BooleanOptionalAction,
        default=argparse.SUPPRESS,
        help="write a result that is not proved; it is marked",
    )
    group.add(
        "--uncertainty",
        nargs="?",
        metavar="N",
        const="8",
        default=argparse.SUPPRESS,
        help="error of every place, from N other unfoldings (8)",
    )
    group.add(
        "--crosscheck",
        action="store_true",
        rare=True,
        help="compare the control mesh with other meshes of its border",
    )


def _add_faults(group: Section) -> None:
    """Add the arguments for faults."""
    group.add("--faults", nargs="+", metavar="F", help="surfaces of the faults that cut the body")
    group.add("--fault-blocks", metavar="COLUMN", help="column of the fault block of each block")
    group.add(
        "--slip-direction",
        nargs="+",
        metavar="NAME=TREND/PLUNGE",
        rare=True,
        help="direction of slip along a fault, in degrees; without NAME= along all",
    )
    group.add(
        "--outline",
        metavar="O",
        rare=True,
        help="ore (default): rims mark the slip along faults; model: the block model was cut off",
    )


def _add_outputs(parser: Parser) -> None:
    """Add the arguments for what is written."""
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="OUT", required=True, help=f"the result: {POINTS}")
    group.add("--summary", metavar="S.json", help="options, figures, proof, warnings, seconds")
    group.add("--map", metavar="M.npz", help="the map, for `geounfold map`")
    group.add(
        "--unit", metavar="U", rare=True, help="unit of the coordinates, for the report: m, ft"
    )
    group.add("--report", metavar="R.html", help="a page: verdict, 3-D views, figures")
    group.add(
        "--slips",
        metavar="S.csv",
        rare=True,
        help="a row per slip vector: places on both walls of a fault, throw, heave, strike slip",
    )
    group.add(
        "--mesh", metavar="C.vtu", rare=True, help="the control mesh in both spaces, flaws marked"
    )
    group.add(
        "--mended-column",
        action="store_true",
        rare=True,
        help="add the column mended: blocks that the hull leaves out",
    )
    group.add(
        "--part-column", action="store_true", rare=True, help="add the column body_part always"
    )
