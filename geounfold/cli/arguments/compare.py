"""Arguments of the commands that compare: compare, crosscheck and quality."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_columns,
    add_command,
    add_element,
    add_method,
    add_where,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import FORMATS, POINT_FORMATS, POINTS, TABLES, WHERE, joined

_COMPARE = """\
Without --methods, a row is one flattener on the top, bottom or mid surface of
the body, or on the given surface:
  area_error       E_s: relative difference of the triangles' areas
  edge_strain      root mean square of the edges' relative change
  area_distortion, angle_distortion, symmetric_dirichlet
                   1, 1 and 4 for an isometry
  flips            triangles turned over
  iterations, stop, seconds, note
                   how the flattener ran
  error            why there are no figures; else empty

With --methods, a row is the body unfolded by one method; for methods that
flatten a surface, by one method and one flattener (default: --flattener):
  epsilon_folded, epsilon_truth, epsilon_nothing
                   mean relative change of the distances to the neighbours:
                   folded to unfolded; truth to unfolded; truth to folded
  rms, rms_nothing distance from the truth after the best rigid motion, in
                   blocks: of the unfolded body, of the folded body itself
  injective        whether the map is proved one-to-one
  torn, unplaced, extrapolated
                   blocks parted from a neighbour, blocks without an image,
                   blocks beyond the border of the surfaces
  area_error ... overlaps
                   as above, of the mid surface, or of the top if there is none
  iterations, seconds, cpu_seconds, note, error
                   how the method ran"""

_CROSSCHECK = """\
A row is the control mesh of prisms, or a mesh of the same border that a mesher
made. The map lays its border flat; its inside follows: harmonic, or arap (as
rigid as possible). Lengths are in blocks, volumes in the input's unit:
  volume, volume_difference
                   of the mesh; against the volume inside the control mesh's
                   border
  hausdorff_to, hausdorff_from
                   largest distance between the borders, both ways
  dihedral_..., radius_ratio_...
                   shape of the tetrahedra: degrees; 1 regular, 0 flat
  rms, p95, max    distance of the blocks' unfolded places from the map's
  along_layers, across_layers
                   root mean square of its horizontal and its vertical part
  worst_x, worst_y, worst_z
                   place of the largest distance, folded
  rms_same_interior
                   distance from the control mesh with the same inside
  outside, inverted_unfolded
                   blocks outside the mesh; tetrahedra turned over
  error            why there are no figures; else empty

A warning is printed if volumes differ by more than 1 %, borders by more than
0.5 blocks, places by more than 0.25 blocks RMS. tetwild draws random numbers
that cannot be seeded: its figures repeat to about three digits. tetgen (AGPL)
needs: pip install 'geounfold[tetgen]'"""

_QUALITY = """\
figures: mean, standard deviation, 95th percentile and maximum; or one number
  nmd_folded, nmd_unfolded, nmd_truth
                   mean distance to the neighbours, in the unit of the file
  epsilon_folded   its relative change from folded to unfolded, with the same
                   neighbours; 0 for a body left as it is
  epsilon_own_neighbours
                   the same, with each file's own neighbours
  distances        |ratio - 1| of far distances, unfolded over folded, or over
                   the truth
with --truth:
  epsilon_truth    relative change from truth to unfolded
  rms              distance from the truth after the best rigid motion, without
                   mirroring
  spacing          of neighbours along x, y and z, unfolded over truth
  ..._nothing      the figure of the folded body itself

Row i of every file is the same point. All files have the same unit. Columns
unfolded_x/y/z of UNFOLDED and true_x/y/z of W are read before others."""


def add_compare(commands: Any) -> Parser:
    """Add the command compare and its arguments."""
    parser = add_command(
        commands,
        "compare",
        "compare flatteners on one surface, or methods on one body",
        details=joined(_COMPARE, WHERE, FORMATS),
        examples=(
            "geounfold compare blocks.csv -o flatteners.csv",
            "geounfold compare blocks.csv -o methods.csv --methods sheet,ufo,shear",
        ),
    )
    group = parser.section("inputs")
    group.add("points", metavar="POINTS", help=f"block centroids: {POINTS}; or one surface")
    add_columns(group)
    group.add("--truth", metavar="W", help="with --methods: the same points before folding")
    group.add("--truth-columns", metavar="A,B,C", rare=True, help="columns of W's coordinates")
    group = parser.section("comparison")
    group.add("-o", "--output", metavar="TABLE", required=True, help=f"one row each: {TABLES}")
    group.add("--flatteners", metavar="A,B,...", help="names, or all (default without --methods)")
    group.add("--methods", metavar="A,B,...", help="unfold the whole body by these, or all")
    add_method(parser.section("surfaces of a body"))
    return parser


def add_crosscheck(commands: Any) -> Parser:
    """Add the command crosscheck and its arguments."""
    parser = add_command(
        commands,
        "crosscheck",
        "compare a control mesh with other meshes of its border",
        details=joined(_CROSSCHECK, WHERE, POINT_FORMATS),
        examples=(
            "geounfold crosscheck blocks.csv",
            "geounfold crosscheck blocks.csv -o meshes.csv --differences d.csv",
        ),
    )
    group = parser.section("body")
    group.add("points", metavar="POINTS", help=f"block centroids: {POINTS}")
    add_columns(group)
    group = parser.section("comparison")
    group.add("-o", "--output", metavar="TABLE", help=f"{TABLES}, or .json (default: stdout)")
    group.add(
        "--differences",
        metavar="D",
        help="POINTS with a column difference_MESHER_INSIDE each, in blocks",
    )
    group.add(
        "--meshers", metavar="A,B", help="tetwild, tetgen (default: those that are installed)"
    )
    group.add("--interiors", metavar="A,B", help="harmonic, arap (default both)")
    add_method(parser.section("method"))
    return parser


def add_quality(commands: Any) -> Parser:
    """Add the command quality and its arguments."""
    parser = add_command(
        commands,
        "quality",
        "measure an unfolding: NMD, epsilon, distance ratios, RMS",
        details=joined(_QUALITY, WHERE, POINT_FORMATS),
        examples=(
            "geounfold quality blocks.csv flat.csv",
            "geounfold quality blocks.csv flat.csv --truth blocks.csv -o figures.json",
        ),
    )
    group = parser.section("inputs")
    group.add("folded", metavar="FOLDED", help=f"the folded points: {POINTS}")
    group.add("unfolded", metavar="UNFOLDED", help="the same points, unfolded")
    group.add("--truth", metavar="W", help="the same points before folding")
    group.add("--columns", metavar="A,B,C", help="columns of FOLDED's coordinates")
    add_where(group, "where", "rows of FOLDED to take, and those of the other files", rare=False)
    for name, whose in (("element", "FOLDED"), ("unfolded-element", "UNFOLDED")):
        add_element(group, name, whose)
    group.add("--unfolded-columns", metavar="A,B,C", help="columns of UNFOLDED's coordinates")
    group.add("--truth-columns", metavar="A,B,C", help="columns of W's coordinates")
    group = parser.section("figures")
    group.add("--neighbours", metavar="K", help="neighbours of a point (default 26)")
    group.add("-o", "--output", metavar="F.json", help="the figures as JSON")
    return parser
