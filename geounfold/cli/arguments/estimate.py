"""Arguments of the command estimate."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_columns,
    add_command,
    add_domain,
    add_grade_values,
    add_samples_choice,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import POINT_FORMATS, POINTS, WHERE, joined

_RESULTS = """\
results, for a grade CU:
  CU_estimate      at the block's centroid, as a point, or the block's mean with
                   --block-size; empty if there is none
  CU_variance      kriging variance, in the grade's unit squared
  CU_efficiency, CU_slope   with --block-size: kriging efficiency, and slope of
                   the regression of true on estimated grades
  CU_samples       number of samples used
  CU_flag          estimated, too_few_samples, outside_map, outside_body or
                   unsolvable
  location         of the block: inside the control mesh, extrapolated around
                   it, or outside

SAMPLES and BLOCKS are in the folded space; the map carries both. The variogram
and the search are in the unfolded space: the first two axes lie in the layer,
the third across it. Azimuths there are from the unfolded y axis, not from
north. --variogram-out writes the model as --variogram reads it, with the
directions of the axes in the body as comments:
  nugget = 0.1
  rotation = [0, 0, 0]       # azimuth of axis 2, its plunge, dip of axis 1
  [[structures]]             # one or more
  kind = "spherical"         # or exponential, gaussian, matern (smoothness)
  sill = 0.9
  ranges = [150, 150, 20]

Needs: pip install 'geounfold[geostat]'"""

_EXAMPLES = (
    "geounfold estimate m.npz samples.csv blocks.csv -o grades.csv --grade CU",
    "geounfold estimate m.npz samples.csv blocks.csv -o grades.csv --grade CU \\\n"
    "    --max-per-hole 6 --cross-validate --summary s.json",
)


def add_estimate(commands: Any) -> Parser:
    """Add the command estimate and its arguments."""
    parser = add_command(
        commands,
        "estimate",
        "estimate a grade on blocks, in the unfolded space",
        details=joined(_RESULTS, WHERE, POINT_FORMATS),
        examples=_EXAMPLES,
    )
    group = parser.section("inputs")
    group.add("map", metavar="M.npz", help="a map that `geounfold unfold --map` saved")
    group.add("samples", metavar="SAMPLES", help=f"composites: {POINTS}")
    group.add("points", metavar="BLOCKS", help=f"block centroids: {POINTS}")
    group.add("--grade", metavar="NAME", required=True, help="column of SAMPLES to estimate")
    group.add("--hole", metavar="NAME", help="column of the holes' names, if it is not found")
    add_samples_choice(group)
    add_grade_values(group)
    add_domain(group)
    add_columns(group)
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="OUT", required=True, help="BLOCKS with the estimates")
    group.add("--report", metavar="R.html", help="a page: the grades in 3-D, folded and flat")
    group.add("--summary", metavar="S.json", help="options, variogram, figures, warnings")
    group.add("--variogram-out", metavar="V.toml", help="the variogram, to edit and give back")
    group.add(
        "--cross-validate",
        action="store_true",
        help="in the summary: errors at samples that their own hole does not estimate",
    )
    _add_method(parser)
    _add_search(parser)
    return parser


def _add_method(parser: Parser) -> None:
    """Add the options of the method."""
    group = parser.section("method")
    group.add(
        "--method",
        metavar="M",
        default="ordinary",
        help="ordinary (default) or simple kriging, inverse_distance or nearest",
    )
    group.add(
        "--also",
        metavar="M,M",
        help="other methods side by side, a column each, or all: CU_simple ...",
    )
    group.add(
        "--block-size",
        metavar="X,Y,Z",
        help="krige means of blocks of these sides (default: points)",
    )
    group.add(
        "--discretise",
        metavar="N,N,N",
        rare=True,
        help="points along the sides of a block (default 3,3,3)",
    )
    group.add(
        "--variogram",
        metavar="V.toml",
        help="a model, or a summary (.json) that holds one (default: fitted)",
    )
    group.add(
        "--position-error",
        metavar="ALONG,ACROSS",
        rare=True,
        help="standard deviations of a place in the unfolded space, as `geounfold unfold\n"
        "--uncertainty` finds them, or its summary (.json); widens the kriging variance",
    )
    group.add(
        "--decluster",
        metavar="X,Y,Z",
        help="cells that weigh clustered samples in statistics: sides, or auto",
    )
    group.add(
        "--mean", metavar="X", rare=True, help="mean for simple kriging (default: that of SAMPLES)"
    )
    group.add(
        "--power", metavar="X", default="2", rare=True, help="power of inverse distance (default 2)"
    )
    group.add(
        "--realisations",
        metavar="N",
        rare=True,
        help="columns of so many conditional simulations of points: CU_r1, CU_r2 ...",
    )
    group.add(
        "--seed", metavar="N", default="1", rare=True, help="seed of the realisations (default 1)"
    )
    group.add(
        "--workers", metavar="N", default="1", rare=True, help="number of processes (default 1)"
    )


def _add_search(parser: Parser) -> None:
    """Add the options that choose samples and blocks."""
    group = parser.section("search")
    group.add(
        "--soft-boundary",
        metavar="B",
        default="0",
        help="use samples outside the body too, within B blocks of it (default 0)",
    )
    group.add(
        "--all-blocks",
        action="store_true",
        help="estimate blocks outside the body too, as far as the map reaches",
    )
    group.add(
        "--radii",
        metavar="A,B,C",
        help="radii of the search (default: twice the variogram's ranges, or as\n"
        "much more as the blocks need)",
    )
    group.add(
        "--rotation",
        metavar="B,P,D",
        help="bearing, plunge and dip of the search, in degrees (default 0,0,0)",
    )
    group.add("--min-samples", metavar="N", help="fewest samples of an estimate (default 4)")
    group.add("--max-samples", metavar="N", help="most samples of an estimate (default 24)")
    group.add("--max-per-hole", metavar="N", help="most samples of one hole (default: no limit)")
    group.add(
        "--max-per-octant", metavar="N", rare=True, help="most samples of one octant of the search"
    )
    group.add("--min-holes", metavar="N", rare=True, help="fewest holes of an estimate (default 1)")
    group.add(
        "--min-octants", metavar="N", rare=True, help="fewest octants with samples (default 1)"
    )
