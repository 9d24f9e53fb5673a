"""The parser class and the arguments that several commands share."""

from __future__ import annotations

import argparse
from typing import Any, NoReturn

from geounfold.errors import OptionError

TABLES_HELP = ".csv, .csv.gz or .parquet"


POINTS_HELP = f"{TABLES_HELP}, or another format (see below)"


FORMATS_HELP = """

formats of points: .csv .csv.gz .parquet, GSLIB .gslib .geoeas .dat .gs (text as codes), VTK .vtu
  .vtp and .vti (read only; of solid cells the centres), GOCAD .vs (text as codes) and .ts (read
  only), OMF .omf, .geoh5 (of block models the centroids, with dx, dy, dz and i, j, k)
formats of surfaces: .ply .obj .off .stl (single precision), .vtp, GOCAD .ts, .dxf (faces), .omf,
  .geoh5, or a table with columns x, y, z, v1, v2, v3
  geoh5 and DXF, and OMF to be written, need: pip install 'geounfold[formats]'"""


RESULTS_HELP = """\
results:
  unfolded_x, unfolded_y, unfolded_z   coordinates with the folds taken out, in the input's
                     unit; z is up towards the top side, in true thickness
  stratigraphic      0 at the bottom surface, 1 at the top
  location           inside the control mesh, extrapolated around it, or outside: left empty
  mesh_distance      distance from the control mesh, 0 inside it
"""


ANGLES_HELP = """\
Of turned models, bearing is the compass direction of the model's own y axis (0: not turned), plunge
its inclination below the horizontal, and dip how far the x axis turns downwards about it, all in
degrees. With --origin, results have world_x, world_y, world_z too, which are found first wherever
points are read."""


HOLES_HELP = """

drill-holes: --samples-out has hole, from, to, x, y, z of each interval's midpoint (or composite's),
  position (surveyed, or extrapolated straight on beyond a hole's surveys), coverage of composites,
  the grades, and the results; --traces-out has hole, depth, x, y, z, position and the results along
  every hole. As .vtp it holds lines in the folded space, with the other as point array unfolded.
  Rows that cannot be used are named on stderr and in the summary."""


EXIT_STATUS = "exit status: 0 done, 2 input or options at fault, 1 anything else, 130 interrupted"


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are errors of ours: one line, no usage text before it."""

    def __init__(self, **settings: Any) -> None:
        settings.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        """Raise OptionError instead of printing the usage and leaving."""
        raise OptionError(f"{message} (see '{self.prog} --help')")


def common_arguments() -> argparse.ArgumentParser:
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


def add_command(
    commands: Any, name: str, summary: str, common: argparse.ArgumentParser, epilog: str = ""
) -> Parser:
    """Add a command with its help and examples; return its parser."""
    parser: Parser = commands.add_parser(
        name,
        parents=[common],
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"{epilog}\n\n{EXIT_STATUS}".strip(),
    )
    parser.set_defaults(handler=name)
    return parser


def add_columns(parser: argparse.ArgumentParser) -> None:
    """Add --columns: which columns hold the coordinates."""
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


def add_model(parser: argparse.ArgumentParser, title: str = "method") -> Any:
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


def add_frame(parser: argparse.ArgumentParser, whose: str, rotation: str = "") -> None:
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


def add_holes(parser: argparse.ArgumentParser) -> Any:
    """Add the options that drill-holes have, and return their group."""
    group = parser.add_argument_group("drill-holes")
    group.add_argument(
        "--holes",
        nargs=3,
        metavar=("COLLAR", "SURVEY", "ASSAY"),
        help=f"the three tables: {TABLES_HELP}; desurveyed by minimum curvature",
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
        "--traces-out", metavar="T", help=f"the holes' paths in both spaces: {TABLES_HELP}, or .vtp"
    )
    return group
