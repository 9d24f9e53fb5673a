"""Arguments of the command estimate."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.shared import FORMATS_HELP, POINTS_HELP, add_columns, add_command

_ESTIMATE = """\
results, by the grade's column, say CU:
  CU_estimate        at the block's centroid, as a point; empty where there is none
  CU_variance        kriging variance, in the grade's unit squared
  CU_samples         how many samples were found
  CU_flag            estimated, too_few_samples, outside_map or unsolvable

SAMPLES and BLOCKS are where they were drilled and mined: the map carries both. The variogram and
the search hold in the unfolded space, whose first two axes lie in the layer and whose third lies
across it. The summary holds the variogram, in the form that --variogram reads:
  {"nugget": 0.1, "structures": [{"kind": "spherical", "sill": 0.9, "ranges": [150, 150, 20]}],
   "rotation": [0, 0, 0]}
kinds: spherical, exponential, gaussian; rotation: bearing, plunge and dip of the axes, degrees.

Needs: pip install 'geounfold[geostat]'"""


def add_estimate(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command estimate and its arguments."""
    summary = "estimate a grade on blocks from samples, in the unfolded space"
    parser = add_command(commands, "estimate", summary, common, _ESTIMATE + FORMATS_HELP)
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    parser.add_argument("samples", metavar="SAMPLES", help=f"composites: {POINTS_HELP}")
    parser.add_argument("points", metavar="BLOCKS", help=f"block centroids: {POINTS_HELP}")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=POINTS_HELP)
    parser.add_argument("--grade", metavar="NAME", required=True, help="the samples' column")
    parser.add_argument("--hole", metavar="NAME", help="the column of hole names, if not found")
    parser.add_argument(
        "--method", metavar="M", default="ordinary", help="ordinary (default) or simple kriging, "
        "or inverse_distance"
    )  # fmt: skip
    parser.add_argument(
        "--variogram", metavar="V.json", help="a model, or a summary that holds one; fitted without"
    )
    parser.add_argument(
        "--radii", metavar="A,B,C", help="of the search; default twice the variogram's ranges"
    )
    parser.add_argument(
        "--rotation", metavar="B,P,D", help="of the search: bearing, plunge, dip (default 0,0,0)"
    )
    parser.add_argument("--min-samples", metavar="N", help="fewest (default 4)")
    parser.add_argument("--max-samples", metavar="N", help="most (default 24)")
    parser.add_argument("--max-per-hole", metavar="N", help="most of one hole (default no limit)")
    parser.add_argument("--mean", metavar="X", help="of simple kriging; the samples' without")
    parser.add_argument("--power", metavar="X", default="2", help="of inverse distance (default 2)")
    parser.add_argument("--workers", metavar="N", default="1", help="processes (default 1)")
    parser.add_argument(
        "--cross-validate",
        action="store_true",
        help="tell in the summary how samples are estimated without their own hole",
    )
    parser.add_argument("--summary", metavar="S.json", help="what ran, and how good it is")
    parser.add_argument(
        "--samples-columns", metavar="A,B,C", help="their coordinate columns, as --columns"
    )
    add_columns(parser)
