"""Unfold the field suite with default options, each body in a process of its own.

    python tests/soak/field.py [--seed 0] [--family NAME ...] [--body NAME ...] [--jobs 1]
                               [--seconds 120] [--memory 6000] [--option NAME=VALUE ...]
                               [--table FILE.csv] [--summary FILE.json]

Bodies are ``FIELD_BODIES`` of ``geounfold.synthetic.field_bodies``, drawn from --seed.  A body's
``outcome`` is answered, refused (an error that geounfold raises on purpose), failed (anything else)
or timeout.  Its verdict is one of

  right            answered; err <= 0.05, or 0.1 if a ply is thinner than five blocks; no true part
                   above twice that; 99 % of the blocks that have a level are answered
  told             answered, not right, and trust is poor
  refused rightly  refused; the user expects to be told, and the reason is not a false one
  refused wrongly  refused; the user expects an answer, or the reason is false
  silent           answered, not right, without a word
  failed, timeout  as the outcome

``err`` is the mean of |stratigraphic - level| over the blocks that have a level.  Every part of the
answer (``u.body_part``) may be turned over; the answer is one part if it has no such column.  A
body without any level is right if its map is proved and at most 1 % of ``stratigraphic`` lies
outside [-0.25, 1.25].  Exit status 1 when a body failed or ran out of time.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pool import load_libraries, place_of, tabulated
from soak import option, say

ROOT = Path(__file__).resolve().parents[2]
VERDICTS = (
    "right", "told", "refused rightly", "refused wrongly", "silent", "failed", "timeout"
)  # fmt: skip
MOST_ERROR, MOST_ERROR_THIN = 0.05, 0.1  # of the level; thin: a ply below five blocks
LEAST_COVERAGE = 0.99
MOST_OUTSIDE = 0.01  # of the blocks; sound bodies have at most 0.7 %
LONG = 60.0  # seconds that no body should take
# No body of the suite is a tube.
FALSE_REASON = re.compile("closes on itself")
FALSE_OF_ONE_PIECE = re.compile("do not touch")
NAN = float("nan")


@dataclass
class Row:
    """What came of one body."""

    name: str
    family: str
    expects: str
    blocks: int = 0
    seconds: float = NAN
    cpu: float = NAN  # seconds of the processor, all threads and child processes
    outcome: str = "failed"
    verdict: str = "failed"
    certified: str = ""  # yes or no
    trust: str = ""
    outside: float = NAN  # share of the blocks outside [-0.25, 1.25]
    err: float = NAN
    err_part: float = NAN  # of the worst true part
    coverage: float = NAN  # share of the blocks with a level that are answered
    parts: int = 0  # of the answer
    warnings: str = ""
    message: str = ""


# ---------------------------------------------------------------- one body


def judge(row: Row, body: Any, u: Any) -> None:
    """Fill in an answer's figures and verdict."""
    level = np.asarray(u.stratigraphic, float)
    summary = u.summary()
    trust = summary.get("trust")
    row.outcome = "answered"
    row.certified = "yes" if summary["injective"] else "no"
    row.trust = str(trust["word"] if isinstance(trust, dict) else trust or "")
    row.warnings = " | ".join(summary["warnings"])
    found = np.isfinite(level)
    row.outside = float((np.abs(level[found] - 0.5) > 0.75).sum() / len(level))
    own = u.body_part
    row.parts = len(np.unique(own[found]))
    meant = np.isfinite(body.level)
    if meant.any():
        row.coverage = float(found[meant].mean())
        errors = [errors_of(level, truth, own, body.part) for truth in (body.level, *body.others)]
        row.err, row.err_part = min(errors)
    row.verdict = "right" if is_right(row, body) else "told" if is_told(row) else "silent"


def errors_of(
    level: np.ndarray, truth: np.ndarray, own: np.ndarray, part: np.ndarray
) -> tuple[float, float]:
    """Return the mean error of the level, and that of the worst true part with 2 % of the blocks.

    Each of the answer's own parts is turned over if that is nearer the truth.
    """
    off = np.full(len(level), np.nan)
    for k in np.unique(own):
        rows = (own == k) & np.isfinite(level) & np.isfinite(truth)
        if rows.any():
            ways = [np.abs(level[rows] - truth[rows]), np.abs(1 - level[rows] - truth[rows])]
            off[rows] = min(ways, key=lambda way: float(way.mean()))
    rows = np.isfinite(off)
    if not rows.any():
        return NAN, NAN
    big = [k for k in np.unique(part[rows]) if (part[rows] == k).mean() >= 0.02]
    return float(off[rows].mean()), max(float(off[rows & (part == k)].mean()) for k in big)


def is_right(row: Row, body: Any) -> bool:
    """Return whether an answer is near the truth."""
    if not np.isfinite(body.level).any():
        return row.certified == "yes" and row.outside <= MOST_OUTSIDE
    most = MOST_ERROR if body.thinnest >= 5 else MOST_ERROR_THIN
    return row.err <= most and row.err_part <= 2 * most and row.coverage >= LEAST_COVERAGE


def is_told(row: Row) -> bool:
    """Return whether the user is told that an answer may be wrong."""
    return row.trust == "poor"


def refusal(row: Row, whole: bool) -> str:
    """Return the verdict on a refusal; ``whole``: the body is in one piece."""
    false = FALSE_REASON.search(row.message)
    false = false or (whole and FALSE_OF_ONE_PIECE.search(row.message))
    return "refused wrongly" if false or row.expects == "right" else "refused rightly"


def in_one_piece(cells: np.ndarray) -> bool:
    """Return whether lattice cells (n, 3) are connected by their faces."""
    import scipy.ndimage as ndi

    low = cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) - low + 1, bool)
    grid[tuple((cells - low).T)] = True
    return bool(ndi.label(grid)[1] == 1)


def processor_seconds() -> float:
    """Return the processor time of this process and of its children that ended."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def unfolded(row: Row, seed: int, options: dict[str, Any]) -> None:
    """Draw a body, unfold it and fill in its row."""
    import geounfold as gu
    from geounfold.errors import GeounfoldError
    from geounfold.synthetic.field_bodies import FIELD_BODIES

    body = FIELD_BODIES[row.name].blocks(seed)
    row.blocks = len(body.points)
    start, used = time.monotonic(), processor_seconds()
    try:
        u = gu.unfold(body.points, **options)
    except GeounfoldError as error:
        row.seconds, row.cpu = time.monotonic() - start, processor_seconds() - used
        row.outcome, row.message = "refused", f"{type(error).__name__}: {error}"
        row.verdict = refusal(row, in_one_piece(body.cells))
        return
    row.seconds, row.cpu = time.monotonic() - start, processor_seconds() - used
    judge(row, body, u)


def work(row: Row, seed: int, options: dict[str, Any]) -> None:
    """Unfold one body and fill in its row, whatever comes of it."""
    try:
        unfolded(row, seed, options)
    except Exception as error:
        row.message = f"{type(error).__name__}: {error} ({place_of(error)})"


def stopped(row: Row, how: str, message: str) -> None:
    """Fill in the row of a body that did not end by itself."""
    row.message = message
    if how == "timeout":
        row.outcome = row.verdict = how


# ---------------------------------------------------------------- many


def run(args: argparse.Namespace) -> list[Row]:
    """Unfold the chosen bodies; return their rows in the suite's order."""
    from geounfold.synthetic.field_bodies import FIELD_BODIES

    load_libraries()
    task = partial(work, seed=args.seed, options=dict(args.options))
    chosen = [
        Row(body.name, body.family, body.expects)
        for body in FIELD_BODIES.values()
        if (not args.family or body.family in args.family)
        and (not args.body or body.name in args.body)
    ]
    order = [row.name for row in chosen]
    rows = tabulated(task, chosen, args, stopped, lambda row: say(line(row)))
    return sorted(rows, key=lambda row: order.index(row.name))


def line(row: Row) -> str:
    """Return a row of the printed table."""
    figures = f"err {row.err:5.3f} worst part {row.err_part:5.3f} outside {row.outside:6.4f}"
    shown = f"{figures} {row.trust:5}" if row.outcome == "answered" else row.message[:90]
    return (
        f"{row.name:20} {row.family:12} {row.blocks:7} {row.seconds:6.1f} s  "
        f"{row.verdict:15} {shown}"
    )


def takes_long(row: Row) -> bool:
    """Return whether a body takes more than 60 s; other load on the machine does not count."""
    return row.outcome == "timeout" or min(row.seconds, row.cpu) > LONG


def summarise(rows: list[Row], args: argparse.Namespace) -> dict[str, Any]:
    """Return the run's totals, ready for JSON."""
    from geounfold import __version__

    verdicts = Counter(row.verdict for row in rows)
    families = dict.fromkeys(row.family for row in rows)
    return {
        "version": __version__,
        "seed": args.seed,
        "options": dict(args.options),
        "bodies": len(rows),
        "verdicts": {verdict: verdicts[verdict] for verdict in VERDICTS},
        "over_60_s": [row.name for row in rows if takes_long(row)],
        "right_but_poor": [r.name for r in rows if r.verdict == "right" and r.trust == "poor"],
        "seconds": float(np.nansum([row.seconds for row in rows])),
        "families": {
            family: dict(Counter(row.verdict for row in rows if row.family == family))
            for family in families
        },
        "rows": [
            {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in asdict(row).items()}
            for row in rows
        ],
    }


# ---------------------------------------------------------------- command line


def parse(argv: list[str] | None) -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="from which the bodies are drawn")
    parser.add_argument("--family", action="append", default=[], help="these families only")
    parser.add_argument("--body", action="append", default=[], help="these bodies only")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=120, help="limit of one body")
    parser.add_argument("--memory", type=int, default=6000, help="limit of one body, MiB; 0 none")
    parser.add_argument("--option", type=option, action="append", default=[], dest="options")
    parser.add_argument("--table", type=Path, default=ROOT / "soak" / "field.csv")
    parser.add_argument("--summary", type=Path, default=ROOT / "data" / "field_suite.json")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    """Run; return 1 when a body failed or ran out of time."""
    args = parse(argv)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    rows = run(args)
    with args.table.open("w", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    summary = summarise(rows, args)
    args.summary.parent.mkdir(parents=True, exist_ok=True)
    args.summary.write_text(json.dumps(summary, indent=2) + "\n")
    for family, counts in summary["families"].items():
        say(f"{family:14}" + ", ".join(f"{n} {verdict}" for verdict, n in counts.items()))
    totals = ", ".join(f"{n} {verdict}" for verdict, n in summary["verdicts"].items())
    say(f"{len(rows)} bodies: {totals}; {len(summary['over_60_s'])} over {LONG:.0f} s")
    return int(summary["verdicts"]["failed"] + summary["verdicts"]["timeout"] > 0)


if __name__ == "__main__":
    sys.exit(main())
