"""The options that several commands share."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.help import HelpAll, Parser, Section


def add_command(commands: Any, name: str, summary: str, **settings: Any) -> Parser:
    """Add a command and return its parser; `settings` are those of `Parser`."""
    description = f"{summary[0].upper()}{summary[1:]}."
    parser: Parser = commands.add_parser(name, help=summary, description=description, **settings)
    return parser


def add_common(parser: Parser) -> None:
    """Add the options that every command has."""
    group = parser.section("all commands")
    group.add("--overwrite", action="store_true", help="replace outputs that exist")
    group.add("--json", action="store_true", help="print the answer as one JSON object")
    group.add("--quiet", action="store_true", help="no progress and no warnings")
    group.add("-v", "--verbose", action="count", default=0, help="log to stderr; twice: more")
    group.add("-h", "--help", action="help", help="print this help")
    group.add("--help-all", action=HelpAll, help="print rarer options, results and formats too")


def add_columns(section: Section) -> None:
    """Add the options for the columns of coordinates and for the choice of rows."""
    section.add(
        "--columns",
        metavar="A,B,C",
        help="columns of the coordinates, if of unusual names",
    )
    add_where(section, "where", "rows to take, such as ROCK=ORE; others stay empty", rare=False)
    add_element(section, "element", "POINTS")
    section.add(
        "--drop-invalid",
        action="store_true",
        rare=True,
        help="leave out rows whose coordinates are missing or infinite; the summary counts them",
    )


def add_where(section: Section, name: str, help_text: str, *, rare: bool = True) -> None:
    """Add an option that chooses rows by an expression."""
    section.add(f"--{name}", metavar="EXPR", rare=rare, help=help_text)


def add_element(section: Section, name: str, whose: str) -> None:
    """Add an option that chooses one element of a file of several."""
    section.add(
        f"--{name}",
        metavar="NAME",
        rare=True,
        help=f"point set, block model or surface to read, if {whose} has several (OMF, geoh5)",
    )


def add_domain(section: Section) -> None:
    """Add the options for a map of several domains."""
    section.add(
        "--by",
        metavar="COLUMN",
        rare=True,
        help="column of the domains, of a map of several (default: as in `geounfold unfold --by`)",
    )
    section.add(
        "--domain", metavar="NAME", rare=True, help="the one domain to take of a map of several"
    )


def add_samples_choice(section: Section) -> None:
    """Add the options that choose samples."""
    section.add(
        "--samples-columns",
        metavar="A,B,C",
        rare=True,
        help="columns of the samples' coordinates, as --columns",
    )
    add_where(section, "samples-where", "samples to take, loose or assays; as --where")
    add_element(section, "samples-element", "the file of samples")


def add_frame(section: Section, whose: str, rotation: str = "") -> None:
    """Add the options of a block model in coordinates of its own."""
    section.add(
        "--origin",
        metavar="X,Y,Z",
        rare=True,
        help=f"world coordinates of the model's origin, if {whose} are in the model's own",
    )
    section.add(
        "--rotation",
        metavar="BEARING,PLUNGE,DIP",
        rare=True,
        help=rotation or "with --origin: how the model is turned, in degrees (default 0,0,0)",
    )


SIZE_BY_DEFAULT = " for a cube (default: an eighth of its thickness, or what its faces show)"


def add_block_size(section: Section, *, rare: bool = False) -> None:
    """Add the options of blocks that fill a closed surface."""
    section.add(
        "--block-size",
        metavar="X,Y,Z",
        help="sides of blocks in a closed surface, or one" + ("" if rare else SIZE_BY_DEFAULT),
    )
    section.add(
        "--sub-blocks",
        metavar="N",
        rare=rare,
        help="split the sides of blocks that the surface cuts into 2, 4 or 8",
    )


def add_holes(section: Section) -> None:
    """Add the options of drill-holes."""
    section.add(
        "--holes",
        nargs=3,
        metavar=("COLLAR", "SURVEY", "ASSAY"),
        help="tables of drill-holes; paths by minimum curvature",
    )
    section.add(
        "--composite", metavar="LENGTH", help="length of composites along a hole, from its collar"
    )
    add_grade_values(section)
    section.add(
        "--traces-out", metavar="T", help="the holes' paths in both spaces: a table or .vtp"
    )
    add_hole_rules(section)
    add_strict(section)


def add_hole_tables(section: Section, dest: str, metavar: str, what: str) -> None:
    """Add the three tables of drill-holes as arguments, and how they are read."""
    section.add("collar", metavar="COLLAR", help="collars: hole, x, y, z")
    section.add("survey", metavar="SURVEY", help="surveys: hole, depth, azimuth, dip")
    section.add(dest, metavar=metavar, help=f"{what}: hole, from, to, ...")
    add_hole_rules(section)
    add_strict(section)
    section.add(
        "--drop-invalid",
        action="store_true",
        rare=True,
        help="leave out holes that cannot be placed",
    )


def add_hole_rules(section: Section) -> None:
    """Add the options by which tables of drill-holes are read."""
    section.add(
        "--holes-columns",
        metavar="FIELD=NAME,...",
        rare=True,
        help="columns that are not found by name; fields: hole, x, y, z, depth, at, azimuth, dip, "
        "from, to",
    )
    section.add(
        "--dip-positive-down",
        action=argparse.BooleanOptionalAction,
        default=None,
        rare=True,
        help="whether positive dips point down (default: by their sign, if all have the same)",
    )


def add_strict(section: Section) -> None:
    """Add the option that refuses what is otherwise a warning."""
    section.add(
        "--strict",
        action="store_true",
        rare=True,
        help="refuse what is otherwise a warning: rows left out, cut or changed, and poor trust",
    )


def add_grade_values(section: Section, *, rare: bool = True) -> None:
    """Add the options for the values of grades."""
    section.add(
        "--missing",
        metavar="V,V,...",
        rare=rare,
        help="values of grades that mean no value, such as -99,-999,-",
    )
    section.add(
        "--below-detection",
        metavar="RULE",
        rare=rare,
        help="what <0.01 in a grade becomes: missing (default), half of the limit, or zero",
    )
    section.add(
        "--cap",
        metavar="COLUMN=VALUE",
        action="append",
        rare=rare,
        help="cap a grade at a number or a percentile such as p99; once for each column",
    )


def add_method(section: Section) -> None:
    """Add the options that become `UnfoldOptions`.

    They have no defaults here: `UnfoldOptions` knows and checks them.
    """
    section.add(
        "--config",
        metavar="C.toml",
        default=argparse.SUPPRESS,
        help="file of options; those given here override it",
    )
    for name, metavar, rare, help_text in _METHOD:
        section.add(
            f"--{name}", metavar=metavar, rare=rare, default=argparse.SUPPRESS, help=help_text
        )


_METHOD = (
    (
        *("method", "M", False),
        "how the map is made: sheet (default), thesis, ufo, stratigraphic, shear, volumetric or "
        "isomap",
    ),
    ("datum", "D", False, "flat surface: mid (default), top, bottom, proportional"),
    ("up", "X,Y,Z", False, "direction of the top (hanging wall) (default 0,0,1)"),
    ("body", "N", False, "one of several bodies, 0 the largest, or all"),
    ("parts", "P", False, "sheets of a branched body: auto (default) or one"),
    ("flattener", "F", True, "spring (default) or another; `geounfold compare` tries all"),
    (
        *("hull", "H", True),
        "surface around the body: auto (default), alpha, ball_pivoting, poisson or density",
    ),
    (
        *("split", "S", True),
        "how the hull is split into top and bottom: signed (default; right on overturned folds "
        "too) or normal",
    ),
    (
        *("coordinates", "K", True),
        "coordinates in the control mesh: tet (default; proved one-to-one), wachspress or mvc (of "
        "its prisms; smooth, not proved)",
    ),
    ("neighbours", "K", True, "neighbours of a block in NMD and epsilon (default 26)"),
    (
        "reach",
        "B",
        True,
        "distance around the body to which points are carried, in blocks (default 3)",
    ),
)
"""Name, value, whether rare, and help."""
