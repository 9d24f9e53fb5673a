"""Arguments of the command map."""

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
)

_MAP = (
    RESULTS_HELP
    + """\
with --inverse (columns unfolded_x/y/z are taken first where they exist):
  folded_x, folded_y, folded_z         coordinates with the folds put back
  location, mesh_distance               as above, in the unfolded space

Every input column and row comes back in order. An input column called as a result is replaced
in its place.

"""
    + ANGLES_HELP
)


ENGINES = ("local", "dask")


def add_map(commands: Any, common: argparse.ArgumentParser, *, holes: bool) -> None:
    """Add the command map and its arguments."""
    summary = "carry other points or drill-holes with a saved map"
    parser = add_command(commands, "map", summary, common, _MAP + HOLES_HELP + FORMATS_HELP)
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    # An optional POINTS would be missed behind an option, so it is there or it is not.
    if holes:
        parser.set_defaults(points=None)
    else:
        parser.add_argument(
            "points", metavar="POINTS", help=f"{POINTS_HELP}; or a surface; or give --holes instead"
        )
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help=f"where POINTS go: {POINTS_HELP}; a surface as a mesh file keeps its triangles",
    )
    parser.add_argument("--inverse", action="store_true", help="from unfolded to folded")
    parser.add_argument(
        "--engine",
        choices=ENGINES,
        default=ENGINES[0],
        help="local (default): this process; dask: POINTS, a .parquet or .csv file or a folder of "
        "them, is carried in parts by a cluster, and OUT becomes a folder of such parts",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a running Dask cluster, such as tcp://host:8786; without, this machine's cores",
    )
    add_frame(parser, "POINTS")
    add_columns(parser)
    add_holes(parser).add_argument("--samples-out", metavar="Q", help="where samples go")
