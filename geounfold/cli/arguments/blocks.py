"""Arguments of the commands that make and fill block models: fill, grid and transfer."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_block_size,
    add_command,
    add_domain,
    add_element,
    add_frame,
    add_grade_values,
    add_where,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import (
    ANGLES,
    FORMATS,
    POINT_FORMATS,
    POINTS,
    TABLES,
    WHERE,
    joined,
)

_GRID = """\
The blocks lie along the axes of the unfolded space; their faces are at whole
multiples of their sides. Columns: x, y, z, dx, dy, dz, and i, j, k from 0.
Columns unfolded_x/y/z of FLAT are read before other coordinates."""

_TRANSFER = """\
Each block of TARGET is cut into equal parts. A part has the value of the block
of SOURCE at the image of its centre. OUT has the mean over the parts, and
NAME_share, the share of the parts that have a value. The summary has the sums
of volume times value of both files.

Sides are columns (XINC, dx, size_x and alike are found) or lengths; without,
they are the steps of the centroids' lattice."""


_FILL = """\
Columns: x, y, z of the centroids, dx, dy, dz. A block belongs to the solid if
the winding number of its centre is above one half; corners of blocks lie at
whole multiples of their sides. Corners that should be one, small holes, loose
triangles and parts that cross are mended, and told. A surface that is not
closed is refused: give the surfaces above and below by --top and --bottom."""


def add_fill(commands: Any) -> Parser:
    """Add the command fill and its arguments."""
    parser = add_command(
        commands,
        "fill",
        "fill a wireframe with blocks",
        details=joined(_FILL, FORMATS),
        examples=(
            "geounfold fill solid.dxf -o blocks.parquet",
            "geounfold fill solid.stl -o blocks.csv --block-size 10,10,5 --sub-blocks 4",
            "geounfold fill --top roof.ts --bottom floor.ts -o blocks.csv --block-size 2",
        ),
    )
    group = parser.section("solid")
    group.add(
        "points",
        nargs="?",
        metavar="SOLID",
        help="a closed surface: .dxf .obj .stl .ply .off .ts .vtp .omf .geoh5",
    )
    group.add("--top", metavar="T", help="without SOLID: the surface above the body")
    group.add("--bottom", metavar="B", help="the surface below it")
    group.add("--element", metavar="NAME", help="the surface to read, in a file of several")
    add_block_size(group)
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="OUT", required=True, help=f"the blocks: {POINTS}")
    group.add("--summary", metavar="S.json", help="figures, and what was mended")
    return parser


def add_grid(commands: Any) -> Parser:
    """Add the command grid and its arguments."""
    parser = add_command(
        commands,
        "grid",
        "make a regular grid of blocks over unfolded points",
        details=joined(_GRID, WHERE, POINT_FORMATS),
        examples=(
            "geounfold grid flat.csv -o grid.csv --sizes 10,10,5",
            "geounfold grid flat.csv -o grid.csv --sizes 10,10,5 --map m.npz",
        ),
    )
    group = parser.section("grid")
    group.add("points", metavar="FLAT", help=f"unfolded points that the grid covers: {POINTS}")
    group.add("--columns", metavar="A,B,C", help="columns of the coordinates")
    add_where(group, "where", "rows of FLAT to take, such as ROCK=ORE", rare=False)
    add_element(group, "element", "FLAT")
    group.add("-o", "--output", metavar="GRID", required=True, help=f"the blocks: {TABLES}")
    group.add("--sizes", metavar="X,Y,Z", required=True, help="sides of a block")
    group.add("--map", metavar="M.npz", help="keep only blocks with a part in this map's body")
    add_domain(group)
    parser.set_defaults(drop_invalid=False)
    return parser


def add_transfer(commands: Any) -> Parser:
    """Add the command transfer and its arguments."""
    parser = add_command(
        commands,
        "transfer",
        "move values between folded and unfolded blocks",
        details=joined(_TRANSFER, WHERE, ANGLES, POINT_FORMATS),
        examples=(
            "geounfold transfer m.npz grid.csv blocks.csv -o graded.csv --values au,cu",
            "geounfold transfer m.npz blocks.csv grid.csv -o flat.csv --values au \\\n"
            "    --to unfolded --summary s.json",
        ),
    )
    group = parser.section("inputs")
    group.add("map", metavar="M.npz", help="a map that `geounfold unfold --map` saved")
    group.add("source", metavar="SOURCE", help=f"blocks that have values: {POINTS}")
    group.add("target", metavar="TARGET", help="blocks that get values")
    group.add("--values", metavar="A,B,...", required=True, help="columns of SOURCE to move")
    group.add(
        "--to",
        metavar="SPACE",
        default="folded",
        help="space of TARGET: folded (default) or unfolded; SOURCE is in the other",
    )
    for side in ("source", "target"):
        name = side.upper()
        group.add(f"--{side}-sizes", metavar="X,Y,Z", help=f"sides of {name}: columns or lengths")
    for side in ("source", "target"):
        group.add(
            f"--{side}-columns",
            metavar="A,B,C",
            rare=True,
            help=f"columns of {side.upper()}'s coordinates",
        )
    add_where(group, "where", "rows of TARGET that get values; others stay empty", rare=False)
    add_where(group, "source-where", "rows of SOURCE to take, as --where", rare=False)
    for side in ("source", "target"):
        add_element(group, f"{side}-element", side.upper())
    add_grade_values(group)
    add_domain(group)
    group.add(
        "--drop-invalid", action="store_true", rare=True, help="leave out rows without coordinates"
    )
    add_frame(
        group,
        "the folded blocks",
        "how the folded blocks are turned, in degrees (default: measured)",
    )
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="OUT", required=True, help="TARGET with the values")
    group.add("--summary", metavar="S.json", help="sums, and blocks without a value")
    group.add(
        "--split", metavar="N", default="4", help="parts of a block along each axis (default 4)"
    )
    return parser
