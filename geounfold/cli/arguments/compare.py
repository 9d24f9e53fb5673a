"""Arguments of the commands that compare: compare, crosscheck and quality."""

from __future__ import annotations

import argparse
from typing import Any

from geounfold.cli.arguments.shared import (
    POINTS_HELP,
    TABLES_HELP,
    add_columns,
    add_command,
    add_model,
)

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


def add_compare(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command compare and its arguments."""
    parser = add_command(
        commands,
        "compare",
        "try flatteners on the same surfaces, or methods on a body",
        common,
        _COMPARE,
    )
    parser.add_argument(
        "points",
        metavar="POINTS",
        help=f"block centroids: {TABLES_HELP}; or one surface: .ply, .obj, .stl, .off, .ts, .dxf",
    )
    parser.add_argument("-o", "--output", metavar="TABLE", required=True, help=TABLES_HELP)
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
    add_columns(parser)
    add_model(parser, "how a body's surfaces are found")


def add_crosscheck(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command crosscheck and its arguments."""
    summary = "check an unfolding's control mesh against other meshes of its border"
    parser = add_command(commands, "crosscheck", summary, common, _CROSSCHECK)
    parser.add_argument("points", metavar="POINTS", help=f"block centroids: {POINTS_HELP}")
    parser.add_argument(
        "-o",
        "--output",
        metavar="TABLE",
        help=f"{TABLES_HELP}, or .json; without, it goes to stdout",
    )
    parser.add_argument(
        "--differences",
        metavar="D",
        help="POINTS with a column difference_MESHER_INSIDE for each way, in blocks: "
        f"{TABLES_HELP}, or another format",
    )
    parser.add_argument(
        "--meshers", metavar="A,B", help="tetwild, tetgen (default: tetwild, and tetgen if there)"
    )
    parser.add_argument("--interiors", metavar="A,B", help="harmonic, arap (default both)")
    add_columns(parser)
    add_model(parser, "how the body is unfolded")


def add_quality(commands: Any, common: argparse.ArgumentParser) -> None:
    """Add the command quality and its arguments."""
    parser = add_command(
        commands,
        "quality",
        "measure an unfolding: NMD, epsilon, distance ratios, aligned RMS",
        common,
        _QUALITY,
    )
    parser.add_argument("folded", metavar="FOLDED", help=TABLES_HELP)
    parser.add_argument("unfolded", metavar="UNFOLDED", help="the same points, unfolded")
    parser.add_argument("--truth", metavar="W", help="the same points, as they truly lay")
    parser.add_argument("--columns", metavar="A,B,C", help="coordinate columns of FOLDED")
    parser.add_argument("--unfolded-columns", metavar="A,B,C", help="those of UNFOLDED")
    parser.add_argument("--truth-columns", metavar="A,B,C", help="those of W")
    parser.add_argument("--neighbours", metavar="K", help="per point (default 26)")
    parser.add_argument("-o", "--output", metavar="F.json", help="the figures as JSON")
