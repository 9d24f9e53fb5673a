"""The commands and their options.

Options of the unfolding have no defaults here: what is not given is left to `UnfoldOptions`,
which checks what is given and lists the valid values.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from geounfold import _version
from geounfold.errors import OptionError

_TABLES = ".csv, .csv.gz or .parquet"
_POINTS = f"{_TABLES}, or another format (see below)"
_FORMATS = """

formats of points: .csv .csv.gz .parquet, GSLIB .gslib .geoeas .dat .gs (text as codes), VTK .vtu
  .vtp and .vti (read only; of solid cells the centres), GOCAD .vs (text as codes) and .ts (read
  only), OMF .omf, .geoh5 (of block models the centroids, with dx, dy, dz and i, j, k)
formats of surfaces: .ply .obj .off .stl (single precision), .vtp, GOCAD .ts, .dxf (faces), .omf,
  .geoh5, or a table with columns x, y, z, v1, v2, v3
  geoh5 and DXF, and OMF to be written, need: pip install 'geounfold[formats]'"""
_RESULTS = """\
results:
  unfolded_x, unfolded_y, unfolded_z   coordinates with the folds taken out, in the input's
                     unit; z is up towards the top side, in true thickness
  stratigraphic      0 at the bottom surface, 1 at the top
  location           inside the control mesh, extrapolated around it, or outside: left empty
  mesh_distance      distance from the control mesh, 0 inside it
"""
_ANGLES = """\
Of turned models, bearing is the compass direction of the model's own y axis (0: not turned), plunge
its inclination below the horizontal, and dip how far the x axis turns downwards about it, all in
degrees. With --origin, results have world_x, world_y, world_z too, which are found first wherever
points are read."""
_UNFOLD = (
    _RESULTS
    + """\
  volume_ratio, nmd_error, stretch_min, stretch_max, shear   distortion of each block
  block_volume, unfolded_volume   where the blocks' sides are known (see --sizes)

Every input column and row comes back in order. An input column called as a result is replaced
in its place. Output tables are separated by commas, whatever the input's separator.

"""
    + _ANGLES
)
_MAP = (
    _RESULTS
    + """\
with --inverse (columns unfolded_x/y/z are taken first where they exist):
  folded_x, folded_y, folded_z         coordinates with the folds put back
  location, mesh_distance               as above, in the unfolded space

Every input column and row comes back in order. An input column called as a result is replaced
in its place.

"""
    + _ANGLES
)
_HOLES = """

drill-holes: --samples-out has hole, from, to, x, y, z of each interval's midpoint (or composite's),
  position (surveyed, or extrapolated straight on beyond a hole's surveys), coverage of composites,
  the grades, and the results; --traces-out has hole, depth, x, y, z, position and the results along
  every hole. As .vtp it holds lines in the folded space, with the other as point array unfolded.
  Rows that cannot be used are named on stderr and in the summary."""
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
    + _ANGLES
)
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
_COMPARE = """\
without --methods, rows are the top, bottom and mid surface of a body, or the surface given, by
each flattener
columns:
  area_error         E_s: relative difference of the triangles' areas
  edge_strain        root mean square of the edges' relative change
  area_distortion, angle_distortion, symmetric_dirichlet   1, 1 and 4 for an isometry
  flips              triangles turned over
  iterations, stop, seconds, note                          how it went
  error              why there are no figures; empty where it worked

with --methods, rows are whole bodies unfolded by each method (and each flattener, for methods that
lay a surface flat; default the one of --flattener)
columns:
  epsilon_folded, epsilon_truth, epsilon_nothing   mean relative change of the distances to the
                     neighbours: X to Y; with --truth W to Y, and W to X (doing nothing)
  rms, rms_nothing   distance from the truth after the best rigid motion, in blocks
  injective          whether the map is proved one-to-one
  torn, unplaced, extrapolated                     blocks parted from a neighbour, without an
                     image, and past the surfaces' border
  area_error ... overlaps                          as above, of the mid surface (else the top)
  iterations, seconds, cpu_seconds, note, error    how it went"""
_CROSSCHECK = """\
rows: the control mesh of prisms and, by each mesher, another mesh of its border; each with its
border laid flat by our map and its inside following it (harmonic, or arap: as rigid as possible)
columns: lengths in blocks, volumes in the input's unit
  volume, volume_difference            of the mesh; against that inside the control mesh's border
  hausdorff_to, hausdorff_from         largest distance between the borders, both ways
  dihedral_..., radius_ratio_...       shape of the tetrahedra: degrees; 1 regular, 0 flat
  rms, p95, max                        distance of the blocks' flat places from the map's
  along_layers, across_layers          rms of its horizontal and vertical part
  worst_x, worst_y, worst_z            where the largest is, folded
  rms_same_interior                    what is left against the control mesh with the same inside
  outside, inverted_unfolded           blocks that the mesh does not hold; tetrahedra turned over
  error                                why there are no figures; empty where it worked

Warnings go to stderr: volumes that differ by more than 1 %, borders by more than 0.5 blocks, places
by more than 0.25 blocks RMS. tetwild draws random numbers that cannot be seeded: its figures repeat
to about three digits, not bit for bit. tetgen (AGPL) needs: pip install 'geounfold[tetgen]'"""
_QUALITY = """\
figures: mean, standard deviation, 95th percentile and maximum, or one number each
  nmd_folded, nmd_unfolded, nmd_truth   mean distance to the neighbours, in the unit of the file
  epsilon_folded     relative change of it, folded to unfolded, with the neighbours kept;
                     a body left as it is scores 0
  epsilon_own_neighbours                the same, with each file's own neighbours
  distances          |ratio - 1| of far distances, unfolded over folded (or over the truth)
with --truth:
  epsilon_truth      relative change, truth to unfolded
  rms                distance from the truth after the best rigid motion, never mirrored
  spacing            of neighbours along x, y and z, unfolded over truth
  ..._nothing        what leaving the body folded would score

Rows of the files belong together one by one. Columns unfolded_x/y/z of UNFOLDED and true_x/y/z
of W are taken first where they exist. All files must have the same unit."""
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
ENGINES = ("local", "dask")
SHELLS = ("bash", "zsh", "tcsh")
_EXIT = "exit status: 0 done, 2 input or options at fault, 1 anything else, 130 interrupted"


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are errors of ours: one line, no usage text before it."""

    def __init__(self, **settings: Any) -> None:
        settings.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        """Raise OptionError instead of printing the usage and leaving."""
        raise OptionError(f"{message} (see '{self.prog} --help')")


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the parsed arguments; `handler` names the command's function, `words` is argv.

    Raises
    ------
    OptionError
        Unknown commands, options or values, or ones that are missing.
    SystemExit
        After ``--help`` and ``--version``, with status 0.
    """
    args = build_parser(holes="--holes" in argv).parse_args(_joined(argv))
    args.words = list(argv)
    return args


def _joined(argv: Sequence[str]) -> list[str]:
    """Return arguments with ``--up -1,0,0`` as one, which argparse takes for an option else."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] == "--up" and word[:1] == "-":
            joined[-1] = f"--up={word}"
        else:
            joined.append(word)
    return joined


def build_parser(*, holes: bool = False) -> Parser:
    """Return the parser of all commands; with `holes`, `map` takes these instead of POINTS."""
    parser = Parser(
        prog="geounfold",
        description="Takes the folds out of an ore body, and puts them back.",
        epilog=_EXIT,
    )
    parser.add_argument("--version", action="version", version=f"geounfold {_version.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    common = _common()
    _add_unfold(commands, common)
    _add_map(commands, common, holes=holes)
    _add_estimate(commands, common)
    _add_compare(commands, common)
    _add_crosscheck(commands, common)
    _add_quality(commands, common)
    _add_simulate(commands, common)
    _add_view(commands, common)
    _add_grid(commands, common)
    _add_transfer(commands, common)
    _add_init(commands, common)
    _add_doctor(commands, common)
    _add_completion(commands, common)
    return parser


def _common() -> argparse.ArgumentParser:
    """Return the options that every command has."""
    common = argparse.ArgumentParser(add_help=False)
    group = common.add_argument_group("all commands")
    group.add_argument(
        "--json", action="store_true", help="answer on stdout as one JSON object, for machines"
    )
    group.add_argument("--overwrite", action="store_true", help="replace outputs that exist")
    group.add_argument("--quiet", action="store_true", help="no progress and no warnings")
    group.add_argument(
        "-v", "--verbose", action="count", default=0, help="say more; twice for everything"
    )
    return common


def _add_command(
    commands: Any, name: str, summary: str, common: argparse.ArgumentParser, epilog: str = ""
) -> Parser:
    parser: Parser = commands.add_parser(
        name,
        parents=[common],
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"{epilog}\n\n{_EXIT}".strip(),
    )
    parser.set_defaults(handler=name)
    return parser


def _add_columns(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--columns",
        metavar="A,B,C",
        help="the coordinate columns, where they are not called x/y/z, centroid_x/y/z, "
        "XC/YC/ZC, xcentre/ycentre/zcentre, easting/northing/elevation or alike",
    )
    parser.add_argument(
        "--drop-invalid",
        action="store_true",
        help="go on without rows whose coordinates are missing or infinite; they are counted "
        "in the summary and left out of the output",
    )


def _add_model(parser: argparse.ArgumentParser, title: str = "method") -> Any:
    """Add the options that become `UnfoldOptions`, and return their group."""
    group = parser.add_argument_group(title)
    given: dict[str, Any] = {"default": argparse.SUPPRESS}
    group.add_argument(
        "--config",
        metavar="C.toml",
        help="options from a file such as `geounfold init` writes; those given here go before it",
        **given,
    )
    group.add_argument(
        "--method",
        metavar="M",
        help="sheet (default), thesis, ufo, stratigraphic, shear, volumetric or isomap: how the "
        "map is made",
        **given,
    )
    group.add_argument(
        "--flattener", metavar="F", help="spring (default) or another: `compare` shows all", **given
    )
    group.add_argument(
        "--hull",
        metavar="H",
        help="auto (default), alpha, ball_pivoting, poisson or density: the surface around the "
        "body",
        **given,
    )
    group.add_argument(
        "--split",
        metavar="S",
        help="signed (default; holds on overturned folds) or normal: top from bottom",
        **given,
    )
    group.add_argument("--up", metavar="X,Y,Z", help="direction of the top side", **given)
    group.add_argument(
        "--datum",
        metavar="D",
        help="mid (default), top, bottom or proportional: the surface that becomes flat",
        **given,
    )
    group.add_argument(
        "--coordinates",
        metavar="K",
        help="tet (default; proved one-to-one), wachspress or mvc: what carries points between "
        "the control mesh's vertices, its tetrahedra or its prisms",
        **given,
    )
    group.add_argument(
        "--body", metavar="N", help="which of several separate bodies, or all", **given
    )
    group.add_argument(
        "--neighbours", metavar="K", help="neighbours per block in NMD (default 26)", **given
    )
    group.add_argument(
        "--reach",
        metavar="B",
        help="how far around the body points are carried, in blocks (default 3)",
        **given,
    )
    return group


def _add_frame(parser: argparse.ArgumentParser, whose: str, rotation: str = "") -> None:
    """Add the options of a block model in coordinates of its own."""
    parser.add_argument(
        "--origin",
        metavar="X,Y,Z",
        help=f"{whose} are in the model's own coordinates; their origin in the world",
    )
    parser.add_argument(
        "--rotation",
        metavar="BEARING,PLUNGE,DIP",
        help=rotation
        or "with --origin: how the model's own axes are turned (default 0,0,0; see below)",
    )


def _add_unfold(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(commands, "unfold", "unfold a body", common, _UNFOLD + _HOLES + _FORMATS)
    parser.add_argument("points", metavar="POINTS", help=f"block centroids: {_POINTS}")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=_POINTS)
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
    _add_frame(parser, "POINTS")
    parser.add_argument("--samples", metavar="P", help=f"other points to carry: {_POINTS}")
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
    _add_columns(parser)
    _add_holes(parser)
    _add_model(parser).add_argument(
        "--allow-uncertified",
        action=argparse.BooleanOptionalAction,
        default=argparse.SUPPRESS,
        help="write the answer, marked, even where the map is not proved one-to-one",
    )


def _add_holes(parser: argparse.ArgumentParser) -> Any:
    """Add the options that drill-holes have, and return their group."""
    group = parser.add_argument_group("drill-holes")
    group.add_argument(
        "--holes",
        nargs=3,
        metavar=("COLLAR", "SURVEY", "ASSAY"),
        help=f"the three tables: {_TABLES}; desurveyed by minimum curvature",
    )
    group.add_argument(
        "--composite",
        metavar="LENGTH",
        help="average grades over this length along each hole, counted from the collar",
    )
    group.add_argument(
        "--dip-positive-down",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="whether dips point down where positive; taken from their sign, where all have one",
    )
    group.add_argument(
        "--holes-columns",
        metavar="FIELD=NAME,...",
        help="columns that are not found by name; fields: hole, x, y, z, depth, at, azimuth, dip, "
        "from, to",
    )
    group.add_argument(
        "--strict",
        action="store_true",
        help="refuse where a row of the tables would be left out, cut or taken otherwise than it "
        "stands",
    )
    group.add_argument(
        "--traces-out", metavar="T", help=f"the holes' paths in both spaces: {_TABLES}, or .vtp"
    )
    return group


def _add_map(commands: Any, common: argparse.ArgumentParser, *, holes: bool) -> None:
    summary = "carry other points or drill-holes with a saved map"
    parser = _add_command(commands, "map", summary, common, _MAP + _HOLES + _FORMATS)
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    # An optional POINTS would be missed behind an option, so it is there or it is not.
    if holes:
        parser.set_defaults(points=None)
    else:
        parser.add_argument(
            "points", metavar="POINTS", help=f"{_POINTS}; or a surface; or give --holes instead"
        )
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help=f"where POINTS go: {_POINTS}; a surface as a mesh file keeps its triangles",
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
    _add_frame(parser, "POINTS")
    _add_columns(parser)
    _add_holes(parser).add_argument("--samples-out", metavar="Q", help="where samples go")


def _add_estimate(commands: Any, common: argparse.ArgumentParser) -> None:
    summary = "estimate a grade on blocks from samples, in the unfolded space"
    parser = _add_command(commands, "estimate", summary, common, _ESTIMATE + _FORMATS)
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    parser.add_argument("samples", metavar="SAMPLES", help=f"composites: {_POINTS}")
    parser.add_argument("points", metavar="BLOCKS", help=f"block centroids: {_POINTS}")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=_POINTS)
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
    _add_columns(parser)


def _add_compare(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands,
        "compare",
        "try flatteners on the same surfaces, or methods on a body",
        common,
        _COMPARE,
    )
    parser.add_argument(
        "points",
        metavar="POINTS",
        help=f"block centroids: {_TABLES}; or one surface: .ply, .obj, .stl, .off, .ts, .dxf ...",
    )
    parser.add_argument("-o", "--output", metavar="TABLE", required=True, help=_TABLES)
    parser.add_argument(
        "--flatteners", metavar="A,B,...", help="which ones, or all (default without --methods)"
    )
    parser.add_argument(
        "--methods", metavar="A,B,...", help="compare whole bodies by these methods, or all"
    )
    parser.add_argument(
        "--truth", metavar="W", help="with --methods: the same points, as they truly lay"
    )
    parser.add_argument("--truth-columns", metavar="A,B,C", help="coordinate columns of W")
    _add_columns(parser)
    _add_model(parser, "how a body's surfaces are found")


def _add_crosscheck(commands: Any, common: argparse.ArgumentParser) -> None:
    summary = "check an unfolding's control mesh against other meshes of its border"
    parser = _add_command(commands, "crosscheck", summary, common, _CROSSCHECK)
    parser.add_argument("points", metavar="POINTS", help=f"block centroids: {_POINTS}")
    parser.add_argument(
        "-o", "--output", metavar="TABLE", help=f"{_TABLES}, or .json; without, it goes to stdout"
    )
    parser.add_argument(
        "--differences",
        metavar="D",
        help="POINTS with a column difference_MESHER_INSIDE for each way, in blocks: "
        f"{_TABLES}, or another format",
    )
    parser.add_argument(
        "--meshers", metavar="A,B", help="tetwild, tetgen (default: tetwild, and tetgen if there)"
    )
    parser.add_argument("--interiors", metavar="A,B", help="harmonic, arap (default both)")
    _add_columns(parser)
    _add_model(parser, "how the body is unfolded")


def _add_quality(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands,
        "quality",
        "measure an unfolding: NMD, epsilon, distance ratios, aligned RMS",
        common,
        _QUALITY,
    )
    parser.add_argument("folded", metavar="FOLDED", help=_TABLES)
    parser.add_argument("unfolded", metavar="UNFOLDED", help="the same points, unfolded")
    parser.add_argument("--truth", metavar="W", help="the same points, as they truly lay")
    parser.add_argument("--columns", metavar="A,B,C", help="coordinate columns of FOLDED")
    parser.add_argument("--unfolded-columns", metavar="A,B,C", help="those of UNFOLDED")
    parser.add_argument("--truth-columns", metavar="A,B,C", help="those of W")
    parser.add_argument("--neighbours", metavar="K", help="per point (default 26)")
    parser.add_argument("-o", "--output", metavar="F.json", help="the figures as JSON")


def _add_simulate(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands, "simulate", "make a simulated folded body with its exact truth", common, _SIMULATE
    )
    parser.add_argument("case", metavar="CASE", nargs="?", help="which one")
    parser.add_argument("--list", action="store_true", help="list the cases and what they are")
    parser.add_argument("-o", "--output", metavar="OUT", help=_TABLES)
    parser.add_argument(
        "--blocks", metavar="N", help="grow or shrink the body in its plane to about N blocks"
    )


def _add_view(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(commands, "view", "draw points or a saved map into a picture", common)
    parser.add_argument(
        "points",
        metavar="FILE",
        help=f"{_TABLES}, or a map .npz; a table that has unfolded_x/y/z or true_x/y/z too is "
        "drawn in both spaces",
    )
    parser.add_argument("-o", "--output", metavar="PICTURE.png", required=True)
    parser.add_argument(
        "--colour",
        metavar="COLUMN",
        help="colour by a column of numbers (default stratigraphic, or height)",
    )
    _add_columns(parser)


def _add_grid(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands, "grid", "make a regular grid of blocks over unfolded points", common, _GRID
    )
    parser.add_argument(
        "points",
        metavar="FLAT",
        help=f"what it covers: {_TABLES}; columns unfolded_x/y/z come first where they exist",
    )
    parser.add_argument("-o", "--output", metavar="GRID", required=True, help=_TABLES)
    parser.add_argument("--sizes", metavar="X,Y,Z", required=True, help="sides of a block")
    parser.add_argument(
        "--map", metavar="M.npz", help="leave out blocks no part of which lies in this map's body"
    )
    parser.add_argument("--columns", metavar="A,B,C", help="the coordinate columns")
    parser.set_defaults(drop_invalid=False)


def _add_transfer(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands, "transfer", "move values between folded and unfolded blocks", common, _TRANSFER
    )
    parser.add_argument("map", metavar="M.npz", help="a map saved by `geounfold unfold --map`")
    parser.add_argument("source", metavar="SOURCE", help=f"blocks that have values: {_POINTS}")
    parser.add_argument("target", metavar="TARGET", help="blocks that get them")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=_POINTS)
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
    _add_frame(
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


def _add_init(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands, "init", "write all options, with their defaults and what they do", common
    )
    parser.add_argument(
        "-o", "--output", metavar="C.toml", help="for --config; without, they go to stdout"
    )


def _add_doctor(commands: Any, common: argparse.ArgumentParser) -> None:
    _add_command(
        commands, "doctor", "tell what is installed, and whether it works", common, _DOCTOR
    )


def _add_completion(commands: Any, common: argparse.ArgumentParser) -> None:
    parser = _add_command(
        commands, "completion", "print a script that makes a shell complete", common, _COMPLETION
    )
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
