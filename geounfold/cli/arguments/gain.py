"""Arguments of assess and study-holes."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_command,
    add_grade_values,
    add_hole_tables,
    add_samples_choice,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import POINT_FORMATS, POINTS, TABLES, WHERE, joined

_BODY = "a map .npz, block centroids, or a closed surface; the latter two are unfolded first"

_ASSESS = """\
The variogram of the samples in the unfolded space is taken as true. The error
of kriging in folded coordinates (one range; one plane; a plane for each limb),
in stratigraphic ones and in the unfolded space then follows from the samples'
places alone. The gain is 1 less the unfolded error over the other. Between the
two bounds lie nine of ten runs of the study (docs/study.md).

Needs: pip install 'geounfold[geostat]'"""

_STUDY = """\
Each sample is estimated without its own hole, in folded, stratigraphic and
unfolded coordinates, with the same samples, automatic variogram and search. The
page has the errors, the gain of unfolding with its interval over holes drawn
with replacement, and the gain that was to be expected. Nothing leaves the
machine.

Needs: pip install 'geounfold[geostat]'"""


def add_assess(commands: Any) -> Parser:
    """Add the command assess and its arguments."""
    parser = add_command(
        commands,
        "assess",
        "tell what unfolding will gain, before the work",
        details=joined(_ASSESS, WHERE, POINT_FORMATS),
        examples=(
            "geounfold assess m.npz samples.csv --grade CU",
            "geounfold assess blocks.csv samples.csv --grade CU --summary verdict.json",
        ),
    )
    group = parser.section("inputs")
    group.add("body", metavar="BODY", help=_BODY)
    group.add("samples", metavar="SAMPLES", help=f"composites: {POINTS}")
    group.add("--grade", metavar="NAME", required=True, help="column of SAMPLES")
    group.add("--hole", metavar="NAME", help="column of the holes' names, if it is not found")
    group.add("--block-size", metavar="X,Y,Z", help="sides of blocks in a closed surface")
    group.add(
        "--variogram",
        metavar="V.toml",
        help="a model in the unfolded space, or a summary (.json) with one (default: fitted)",
    )
    add_samples_choice(group)
    add_grade_values(group)
    group = parser.section("outputs")
    group.add("--summary", metavar="S.json", help="the same figures and more")
    parser.set_defaults(drop_invalid=False)
    return parser


def add_study_holes(commands: Any) -> Parser:
    """Add the command study-holes and its arguments."""
    parser = add_command(
        commands,
        "study-holes",
        "compare unfolding with other ways on holes left out",
        details=joined(_STUDY, WHERE, POINT_FORMATS),
        examples=(
            "geounfold study-holes collar.csv survey.csv assay.csv --body m.npz \\\n"
            "    --grade CU -o study.html",
            "geounfold study-holes collar.csv survey.csv assay.csv --cut-off CU=0.2 \\\n"
            "    --grade CU,NI --composite 2 -o study.html --table study.csv",
        ),
    )
    group = parser.section("holes")
    add_hole_tables(group, "assays", "ASSAYS", "grades of intervals")
    group.add("--grade", metavar="A,B", help="columns of ASSAYS to compare, needed")
    group.add("--composite", metavar="LENGTH", help="length of composites along a hole")
    group.add("--where", metavar="EXPR", help="rows of ASSAYS to take")
    add_grade_values(group)
    group = parser.section("body")
    group.add("--body", metavar="BODY", help=_BODY)
    group.add("--code", metavar="A,B", help="without BODY: codes of the body's intervals")
    group.add("--code-column", metavar="NAME", help="column of the codes, if it is not found")
    group.add("--cut-off", metavar="GRADE=VALUE", help="or a cut-off; see body-from-holes")
    group.add("--max-waste", metavar="L", help="longest waste inside an intercept (default 0)")
    group.add("--block-size", metavar="X,Y,Z", help="sides of blocks")
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="PAGE", required=True, help="the page, .html")
    group.add("--table", metavar="T", help=f"its table: {TABLES}")
    group.add("--summary", metavar="S.json", help="the same figures and more")
    return parser
