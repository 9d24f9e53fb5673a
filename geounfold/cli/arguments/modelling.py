"""Arguments of body-from-holes."""

from __future__ import annotations

from typing import Any

from geounfold.cli.arguments.groups import (
    add_command,
    add_grade_values,
    add_hole_tables,
    add_where,
)
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.texts import POINT_FORMATS, POINTS, TABLES, WHERE, joined

_BODY = """\
INTERVALS has a code or a grade for each interval; ground without an interval is
waste. Hanging wall and footwall pass through all contacts, over the mean plane
of the intercepts or over a fold about an axis that is measured. Of the two that
one is taken whose walls foretell left-out holes better. An end of an intercept
at the end of its hole is no contact.

Columns of OUT: x, y, z of the centroids, dx, dy, dz."""


def add_body_from_holes(commands: Any) -> Parser:
    """Add the command body-from-holes and its arguments."""
    parser = add_command(
        commands,
        "body-from-holes",
        "make a body of blocks from coded intervals of drill-holes",
        details=joined(_BODY, WHERE, POINT_FORMATS),
        examples=(
            "geounfold body-from-holes collar.csv survey.csv lith.csv --code ORE1,ORE2 \\\n"
            "    -o body.parquet",
            "geounfold body-from-holes collar.csv survey.csv assay.csv --cut-off CU=0.3 \\\n"
            "    --max-waste 5 -o body.parquet --composite 2 --samples-out samples.csv",
        ),
    )
    group = parser.section("holes")
    add_hole_tables(group, "intervals", "INTERVALS", "codes or grades of intervals")
    group.add("--code", metavar="A,B", help="codes of the body's intervals")
    group.add("--code-column", metavar="NAME", help="column of the codes, if it is not found")
    group.add("--cut-off", metavar="GRADE=VALUE", help="instead of codes: intervals at or above")
    group.add("--max-waste", metavar="L", help="longest waste inside an intercept (default 0)")
    group.add("--least-length", metavar="L", help="shortest intercept that is used (default 0)")
    add_where(group, "where", "rows of INTERVALS to take, such as DOMAIN=1; others are waste")
    add_grade_values(group)
    group = parser.section("body")
    group.add(
        "--shape",
        metavar="S",
        help="plane, fold, or auto (default): the one that foretells left-out holes better",
    )
    group.add("--axis", metavar="TREND,PLUNGE", help="fold axis in degrees (default: measured)")
    group.add("--extent", metavar="L", help="reach beyond outer holes (default: half the spacing)")
    group.add("--polygon", metavar="P", help="instead: outline in x and y, a table or strings")
    group.add("--least-thickness", metavar="L", help="widen the body to it (default 0)")
    group.add("--block-size", metavar="X,Y,Z", help="sides of blocks, or one for a cube")
    group = parser.section("outputs")
    group.add("-o", "--output", metavar="OUT", required=True, help=f"the blocks: {POINTS}")
    group.add("--top-out", metavar="T", help="the hanging wall, a surface such as .ts or .dxf")
    group.add("--bottom-out", metavar="B", help="the footwall")
    group.add("--intercepts-out", metavar="I", help=f"a row for each intercept: {TABLES}")
    group.add("--samples-out", metavar="S", help="samples of the body; none crosses a contact")
    group.add("--assays", metavar="ASSAY", help="for them: table of grades, if not INTERVALS")
    group.add("--composite", metavar="LENGTH", help="for them: length of composites along a hole")
    group.add("--summary", metavar="S.json", help="figures, and what was chosen and left out")
    return parser
