"""Bodies rebuilt from their holes: errors of volume, horizons and layers by spacing.

    python tests/study/from_holes.py [--bodies NAME ...] [--spacings 25 50 100]
                                     [-o data/from_holes.csv]

Each simulated body is drilled, its intervals are coded ORE and WASTE, and `body_from_holes`
rebuilds it with blocks of 10 m. Rows that are in the output already are not computed again.

  volume   volume of the rebuilt blocks over the true volume, less 1
  right    share of the rebuilt blocks whose centres lie in the true body
  met      share of the true blocks whose centres the rebuilt body holds
  horizon  RMS distance across the layer of both walls from the true ones, m, a thickness or more
           inside the outline: at a rim the wall of the rebuilt body bends over its end
  layer    RMS error of the height in the layer after `unfold` of the rebuilt body, m; which side
           of an overturned fold is the top is left open
  known    the same after `unfold` of the true blocks
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.synthetic import GradeField, drill

BODIES = (
    *(("sim_case_1", "vertical"), ("plunging", "vertical"), ("swelling", "inclined")),
    *(("steep", "vertical"), ("box", "vertical"), ("recumbent", "inclined")),
)
SPACINGS = (25, 50, 100)
SIDE = 10.0
FIELD = GradeField("spherical", (200.0, 200.0, 25.0), seed=1)


def horizon_error(body, made) -> float:
    """Return the RMS distance of both walls from the true ones, across the layer, off the rims."""
    errors = []
    for wall, side in ((made.hanging_wall, 1), (made.footwall, 0)):
        truth, there = body.sheet.unfold(wall.V)
        heights = body.sheet.heights(truth[:, 0], truth[:, 1])
        middle = truth.copy()
        middle[:, 2] = 0.5 * (heights[0] + heights[1])
        low, high = body.truth[:, :2].min(axis=0), body.truth[:, :2].max(axis=0)
        rim = float((body.top - body.bottom).mean())
        inner = ((truth[:, :2] > low + rim) & (truth[:, :2] < high - rim)).all(axis=1)
        inside = there & inner & body.sheet.inside(middle)
        errors.append((truth[:, 2] - heights[side])[inside])
    return float(np.sqrt((np.concatenate(errors) ** 2).mean()))


def layer_error(body, points) -> float:
    """Return the RMS error of the height in the layer of unfolded blocks that lie in the body."""
    u = gu.unfold(points)
    truth, there = body.sheet.unfold(points)
    inside = there & body.sheet.inside(truth)
    low, high = body.sheet.heights(truth[:, 0], truth[:, 1])
    level = ((truth[:, 2] - low) / (high - low))[inside]
    found = u.stratigraphic[inside]
    thick = float((body.top - body.bottom).mean())
    return thick * min(float(np.sqrt(np.nanmean((way - level) ** 2))) for way in (found, 1 - found))


def run(name: str, pattern: str, spacing: float, known: float) -> dict:
    """Return the row of one body and spacing."""
    body = gu.simulate(name)
    tables = drill(body, FIELD, spacing, pattern=pattern, seed=3, waste=True)
    start = time.process_time()
    row = {"body": name, "pattern": pattern, "spacing": spacing}
    try:
        made = gu.body_from_holes(*tables, code="ORE", block_size=SIDE)
    except gu.GeounfoldError as error:
        return {**row, "outcome": str(error)}
    seconds = time.process_time() - start
    truth, there = body.sheet.unfold(made.points)
    right = there & body.sheet.inside(truth)
    cells = set(map(tuple, np.floor(made.points / SIDE).astype(int).tolist()))
    own = np.floor(body.folded / SIDE).astype(int).tolist()
    row |= {
        "outcome": "plane" if "over a plane" in made.told[0] else "fold",
        "intercepts": len(made.intercepts),
        "foretold_wrongly": made.error,
        "volume": made.volume / float(len(body.folded) * np.prod(body.steps)) - 1,
        "right": right.mean(),
        "met": np.mean([tuple(cell) in cells for cell in own]),
        "horizon": horizon_error(body, made),
        "known": known,
        "seconds": seconds,
    }
    try:
        row["layer"] = layer_error(body, made.points)
    except gu.GeounfoldError as error:
        row["refused"] = str(error)
    return row


def markdown(table: pd.DataFrame) -> str:
    """Return the table of the documentation."""
    lines = [
        "| body, holes | spacing, m | intercepts | over | foretold wrongly | volume | right | met "
        "| horizons, m | layer, m | layer of the known body, m |",
        "|" + "---|" * 11,
    ]
    for row in table.itertuples():
        if row.outcome not in ("plane", "fold"):
            start = f"| {row.body}, {row.pattern} | {row.spacing:g} | {row.outcome} |"
            lines.append(start + " |" * 8)
            continue
        layer = "refused" if pd.isna(row.layer) else f"{row.layer:.1f}"
        lines.append(
            f"| {row.body}, {row.pattern} | {row.spacing:g} | {row.intercepts:.0f} | {row.outcome} "
            f"| {row.foretold_wrongly:.2f} | {100 * row.volume:+.1f} % | {row.right:.3f} "
            f"| {row.met:.3f} | {row.horizon:.1f} | {layer} | {row.known:.1f} |"
        )
    return "\n".join(lines) + "\n"


def main(argv=None) -> int:
    """Compute the rows that are not in the output."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spacings", type=int, nargs="+", default=list(SPACINGS))
    parser.add_argument("--bodies", nargs="+", default=[name for name, _ in BODIES])
    parser.add_argument("-o", "--output", type=Path, default=Path("data/from_holes.csv"))
    args = parser.parse_args(argv)
    table = pd.read_csv(args.output) if args.output.exists() else pd.DataFrame()
    for name, pattern in BODIES:
        done = table[table["body"] == name] if len(table) else table
        left = [s for s in args.spacings if not len(done) or s not in set(done["spacing"])]
        if not left or name not in args.bodies:
            continue
        body = gu.simulate(name)
        known = layer_error(body, body.folded)
        for spacing in left:
            row = run(name, pattern, spacing, known)
            table = pd.concat([table, pd.DataFrame([row])], ignore_index=True)
            table.to_csv(args.output, index=False, float_format="%.5g", lineterminator="\n")
    sys.stdout.write(markdown(table))
    return 0


if __name__ == "__main__":
    sys.exit(main())
