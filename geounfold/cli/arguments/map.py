"""Arguments of the command map."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_columns,
    add_command,
    add_domain,
    add_frame,
    add_holes,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import (
    ANGLES,
    FORMATS,
    HOLES,
    KEPT_ROWS,
    POINTS,
    RESULTS,
    WHERE,
    joined,
)

_INVERSE = """\
with --inverse:
  folded_x, folded_y, folded_z
                   coordinates with the folds put back
  location, mesh_distance
                   as above, in the unfolded space
  Columns unfolded_x/y/z are read before other coordinates."""

_USAGE = """\
%(prog)s M.npz POINTS -o OUT [options]
       %(prog)s M.npz --holes COLLAR SURVEY ASSAY --samples-out Q [options]"""

_EXAMPLES = (
    "geounfold map m.npz wireframe.ply -o wireframe_flat.ply",
    "geounfold map m.npz grid.csv --inverse -o grid_folded.csv",
)

ENGINES = ("local", "dask")


def add_map(commands: Any, *, holes: bool) -> Parser:
    """Add the command map and its arguments; with `holes`, it takes these instead of POINTS."""
    parser = add_command(
        commands,
        "map",
        "carry samples, drill-holes or wireframes with a saved map",
        usage=_USAGE,
        details=joined(RESULTS, _INVERSE, KEPT_ROWS, WHERE, ANGLES, HOLES, FORMATS),
        examples=_EXAMPLES,
    )
    group = parser.section("points")
    group.add("map", metavar="M.npz", help="a map that `geounfold unfold --map` saved")
    # argparse does not find an optional POINTS behind an option, so POINTS is needed or absent.
    if holes:
        parser.set_defaults(points=None)
    else:
        group.add("points", metavar="POINTS", help=f"{POINTS}; or a surface")
    group.add(
        "-o",
        "--output",
        metavar="OUT",
        help="the carried POINTS; a surface as a mesh file keeps its triangles",
    )
    group.add("--inverse", action="store_true", help="from the unfolded to the folded space")
    add_columns(group)
    add_domain(group)
    add_frame(group, "POINTS")
    group = parser.section("drill-holes, instead of POINTS")
    add_holes(group)
    group.add("--samples-out", metavar="Q", help="the carried samples")
    group = parser.section("large tables")
    group.add(
        "--engine",
        choices=ENGINES,
        default=ENGINES[0],
        help="local (default): this process; dask: a cluster carries POINTS, a table or a folder "
        "of tables, into a folder OUT",
    )
    group.add(
        "--scheduler",
        metavar="ADDRESS",
        help="a running Dask cluster, such as tcp://host:8786 (default: this machine's cores)",
    )
    return parser
