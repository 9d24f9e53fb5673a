"""Take the faults out of bodies whose truth is known, each body in a process of its own.

    python tests/soak/faults.py [--random 100] [--wide 40] [--body NAME ...] [--way WAY ...]
                                [--jobs 1] [--seconds 120] [--memory 6000]
                                [--option NAME=VALUE ...] [--cost] [--table FILE.csv]
                                [--summary FILE.json] [--page FILE.md]

Bodies are ``FAULTED_CASES`` of ``geounfold.synthetic.faulted`` and ``random_faulted(seed)``
of both families.  A way is what geounfold is given besides the blocks:

  surfaces   the exact fault surfaces
  ids        the true fault block of every block, no surface
  both       surfaces and fault blocks
  one of VARIANTS, such as off_half: surfaces as users draw them

``rms`` is the distance from the truth in blocks after the best turn, shift and one common shear
(``flat_rms``); ``alone`` that of each true fault block fitted by itself.  ``jump`` is the error of
the slip: the median distance, in blocks, that the answer leaves between both halves of one rock on
a fault; ``jump_worst`` that of the worst fault.  ``throw_off`` is the largest error of a median
throw in the table of faults, in blocks.  A body's verdict is one of

  right            answered, and rms <= 0.5
  told             answered, not right, and trust is poor
  refused          an error that geounfold raises on purpose
  silent           answered, not right, without a word
  failed, timeout  as the outcome

Exit status 1 when a body failed or ran out of time.
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
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from field import processor_seconds
from pool import load_libraries, place_of, tabulated
from scipy.spatial import cKDTree
from soak import option, say

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results" / "faults.md"
VERDICTS = ("right", "told", "refused", "silent", "failed", "timeout")
MOST_RMS = 0.5  # blocks
DRAWN = ("thrust_5T", "listric", "crossing", "branch")  # bodies whose surfaces are drawn otherwise
DRAWN_NAME = re.compile(r"(plain|wide)(\d+)")
NEAR = 24  # blocks of a wall that carry a rock's half into the answer
NAN = float("nan")


@dataclass
class Row:
    """What came of one body."""

    name: str
    way: str = "surfaces"
    blocks: int = 0
    fault_blocks: int = 0  # true ones
    found: int = 0  # fault blocks of the answer
    sorted_right: float = NAN  # share of the blocks in the fault block of most of their true one
    seconds: float = NAN
    cpu: float = NAN  # seconds of the processor, all threads and child processes
    cpu_alone: float = NAN  # the same, true fault blocks unfolded one by one
    outcome: str = "failed"
    verdict: str = "failed"
    placed: float = NAN  # share of the blocks that are answered
    rms: float = NAN
    alone: float = NAN
    jump: float = NAN
    jump_worst: float = NAN
    slip: float = NAN  # mean true slip, blocks
    throw_off: float = NAN
    gap: float = NAN  # area, blocks squared
    overlap: float = NAN  # area, blocks squared
    certified: str = ""  # yes or no
    trust: str = ""
    settled: str = ""  # how strike slip was settled, fault by fault
    warnings: str = ""
    message: str = ""


# ---------------------------------------------------------------- one body


def body_of(name: str, way: str) -> Any:
    """Return a body by its name, its surfaces drawn as the way says."""
    from geounfold.synthetic import faulted

    drawn = DRAWN_NAME.fullmatch(name)
    body = (
        faulted.random_faulted(int(drawn[2]), drawn[1]) if drawn else faulted.simulate_faulted(name)
    )
    return faulted.drawn_otherwise(body, way) if way in faulted.VARIANTS else body


def given(body: Any, way: str) -> dict[str, Any]:
    """Return what geounfold is told about the faults."""
    ids = {"fault_blocks": body.fault_block}
    if way == "ids":
        return ids
    return {"faults": body.surfaces} | (ids if way == "both" else {})


def sorted_right(found: np.ndarray, true: np.ndarray) -> float:
    """Return the share of blocks that lie in the true fault block of most of their found one."""
    ids, inverse = np.unique(found, return_inverse=True)
    table = np.zeros((len(ids), int(true.max()) + 1), int)
    np.add.at(table, (inverse.ravel(), true), 1)
    return float(table.max(axis=1).sum() / len(true))


def alone_rms(Y: np.ndarray, body: Any, kept: np.ndarray) -> float:
    """Return the distance from the truth if each true fault block is fitted by itself."""
    from geounfold.quality.flat_truth import flat_rms

    total = 0.0
    for k in np.unique(body.fault_block[kept]):
        rows = kept & (body.fault_block == k)
        total += flat_rms(Y[rows], body.truth[rows]) ** 2 * rows.sum()
    return float(np.sqrt(total / kept.sum()))


def jumps(Y: np.ndarray, body: Any, kept: np.ndarray) -> dict[str, float]:
    """Return by fault the median distance, in blocks, between both halves of one rock.

    The answer's error beside a wall is the mean error of the nearest blocks of the wall's own
    fault block, in true coordinates. It is smooth in a fault block, and jumps by the error of the
    slip from one to the next.
    """
    from geounfold.quality.flat_truth import aligned_flat

    W, error = body.truth, np.full(Y.shape, np.nan)
    error[kept] = aligned_flat(Y[kept], W[kept]) - W[kept]
    out: dict[str, float] = {}
    for name, slip in body.slips.items():
        walls = [beside(slip.flat, slip.blocks[:, k], body, error, kept) for k in (0, 1)]
        apart = np.linalg.norm(walls[1] - walls[0], axis=1)
        apart = apart[np.isfinite(apart)]
        if len(apart) >= 10:
            out[name] = float(np.median(apart) / body.step)
    return out


def beside(
    flat: np.ndarray, ids: np.ndarray, body: Any, error: np.ndarray, kept: np.ndarray
) -> np.ndarray:
    """Return the mean error (n, 3) of the blocks of fault blocks ids (n,) nearest to places (n, 3).

    It is NaN two blocks or more from the nearest of them.
    """
    out = np.full(flat.shape, np.nan)
    for k in np.unique(ids):
        own = np.flatnonzero(kept & (body.fault_block == k))
        if len(own) < NEAR:
            continue
        rows = np.flatnonzero(ids == k)
        distance, at = cKDTree(body.truth[own]).query(flat[rows], k=NEAR)
        near = distance[:, 0] < 2 * body.step
        out[rows[near]] = error[own[at[near]]].mean(axis=1)
    return out


def true_slip(body: Any) -> float:
    """Return the mean true slip over all faults, in blocks."""
    sizes = [np.linalg.norm(slip.vectors, axis=1) for slip in body.slips.values()]
    return float(np.concatenate(sizes).mean() / body.step)


def throw_off(table: list[dict[str, Any]], body: Any, found: np.ndarray) -> float:
    """Return the largest error of a median throw, in blocks; NaN if none can be compared.

    A row of the table is compared with the true slip between the same two fault blocks.
    """
    true = {int(k): int(np.bincount(body.fault_block[found == k]).argmax())
            for k in np.unique(found[found >= 0])}  # fmt: skip
    errors = []
    blocks = np.concatenate([slip.blocks for slip in body.slips.values()])
    throw = np.concatenate([slip.throw for slip in body.slips.values()])
    for row in table:
        pair = [true.get(row[wall]) for wall in ("footwall_block", "hanging_wall_block")]
        rows = (blocks == pair).all(axis=1)
        if row["throw"] is not None and rows.sum() >= 10:
            errors.append(abs(row["throw"] - float(np.median(throw[rows]))) / body.step)
    return max(errors, default=NAN)


def judge(row: Row, body: Any, u: Any) -> None:
    """Fill in an answer's figures and verdict."""
    from geounfold.quality.flat_truth import flat_rms

    summary = u.summary()
    row.outcome = "answered"
    row.certified = "yes" if summary["injective"] else "no"
    row.trust = str((summary.get("trust") or {}).get("word", ""))
    row.warnings = " | ".join(summary["warnings"])
    Y = np.asarray(u.points, float)
    kept = np.isfinite(Y).all(axis=1)
    row.placed = float(kept.mean())
    found = np.asarray(u.fault_block)
    row.found = len(np.unique(found[kept]))
    row.sorted_right = sorted_right(found, body.fault_block)
    row.rms = flat_rms(Y[kept], body.truth[kept]) / body.step
    row.alone = alone_rms(Y, body, kept) / body.step
    apart = jumps(Y, body, kept)
    if apart:
        row.jump, row.jump_worst = float(np.median(list(apart.values()))), max(apart.values())
    table = summary["faults"]
    row.throw_off = throw_off(table, body, found)
    row.gap = sum(fault["gap_area"] for fault in table) / body.step**2
    row.overlap = sum(fault["overlap_area"] for fault in table) / body.step**2
    row.settled = ", ".join(f"{fault['fault']} {fault['resolved_by']}" for fault in table)
    right = row.rms <= MOST_RMS
    row.verdict = "right" if right else "told" if row.trust == "poor" else "silent"


def unfolded(row: Row, options: dict[str, Any], cost: bool) -> None:
    """Make a body, take its faults out and fill in its row."""
    import geounfold as gu
    from geounfold.errors import GeounfoldError

    body = body_of(row.name, row.way)
    row.blocks, row.fault_blocks = len(body.folded), int(body.fault_block.max()) + 1
    row.slip = true_slip(body)
    if cost:
        row.cpu_alone = one_by_one(body, options)
    start, used = time.monotonic(), processor_seconds()
    try:
        u = gu.unfold(body.folded, **given(body, row.way), **options)
    except GeounfoldError as error:
        row.outcome = row.verdict = "refused"
        row.message = f"{type(error).__name__}: {error}"
        u = None
    row.seconds, row.cpu = time.monotonic() - start, processor_seconds() - used
    if u is not None:
        judge(row, body, u)


def one_by_one(body: Any, options: dict[str, Any]) -> float:
    """Return processor seconds of unfolding each true fault block by itself; NaN if one fails."""
    import geounfold as gu
    from geounfold.errors import GeounfoldError

    used = processor_seconds()
    try:
        for k in range(int(body.fault_block.max()) + 1):
            gu.unfold(body.folded[body.fault_block == k], body="all", **options)
    except GeounfoldError:
        return NAN
    return processor_seconds() - used


def work(row: Row, options: dict[str, Any], cost: bool) -> None:
    """Take the faults out of one body and fill in its row, whatever comes of it."""
    try:
        unfolded(row, options, cost)
    except Exception as error:
        row.message = f"{type(error).__name__}: {error} ({place_of(error)})"


def stopped(row: Row, how: str, message: str) -> None:
    """Fill in the row of a body that did not end by itself."""
    row.message = message
    if how == "timeout":
        row.outcome = row.verdict = how


# ---------------------------------------------------------------- many


def chosen(args: argparse.Namespace) -> list[Row]:
    """Return the rows to fill in: body by body, way by way."""
    from geounfold.synthetic.faulted import FAULTED_CASES, VARIANTS

    names = [*FAULTED_CASES, *(f"plain{seed}" for seed in range(args.random))]
    names += [f"wide{seed}" for seed in range(args.wide)]
    names = args.body or names
    rows = []
    for way in args.way or ["surfaces", "ids", *VARIANTS]:
        for name in names:
            some = args.body or args.way or way == "surfaces"
            if some or (way == "ids" and name in FAULTED_CASES) or name in DRAWN:
                rows.append(Row(name, way))
    return rows


def run(args: argparse.Namespace) -> list[Row]:
    """Take the faults out of the chosen bodies; return their rows in order."""
    load_libraries()
    task: Callable[[Row], None] = partial(work, options=dict(args.options), cost=args.cost)
    left = chosen(args)
    order = [(row.name, row.way) for row in left]
    rows = tabulated(task, left, args, stopped, lambda row: say(line(row)))
    return sorted(rows, key=lambda row: order.index((row.name, row.way)))


def line(row: Row) -> str:
    """Return a row of the printed table."""
    figures = (
        f"rms {row.rms:6.2f} alone {row.alone:5.2f} jump {row.jump:5.2f} throw {row.throw_off:5.2f}"
        f" gap {row.gap:5.1f} {row.found} of {row.fault_blocks} blocks {row.trust:5}"
    )
    shown = figures if row.outcome == "answered" else row.message[:100]
    return f"{row.name:16} {row.way:9} {row.blocks:6} {row.seconds:5.1f} s  {row.verdict:8} {shown}"


def figures_of(rows: list[Row]) -> dict[str, Any]:
    """Return the figures of a group of bodies; refused and failed ones count as wrong."""
    rms = np.array([row.rms for row in rows])
    answered = rms[np.isfinite(rms)]
    jump = np.array([row.jump for row in rows])
    jump = jump[np.isfinite(jump)]
    verdicts = Counter(row.verdict for row in rows)
    cost = [row.cpu / row.cpu_alone for row in rows if row.cpu_alone > 0]
    return {
        "bodies": len(rows),
        "answered": len(answered),
        "rms_median": float(np.median(answered)) if len(answered) else None,
        "rms_p90": float(np.quantile(answered, 0.9)) if len(answered) else None,
        "rms_max": float(answered.max()) if len(answered) else None,
        "jump_median": float(np.median(jump)) if len(jump) else None,
        "within_half": sum(row.rms <= 0.5 for row in rows),
        "within_one": sum(row.rms <= 1 for row in rows),
        "above_one_untold": [r.name for r in rows if r.rms > 1 and r.trust != "poor"],
        "proved": sum(row.certified == "yes" for row in rows),
        "cost_median": float(np.median(cost)) if cost else None,
        "verdicts": {verdict: verdicts[verdict] for verdict in VERDICTS},
    }


def group_of(row: Row) -> str:
    """Return the group whose figures a row enters."""
    drawn = DRAWN_NAME.fullmatch(row.name)
    return f"{f'random, {drawn[1]}' if drawn else 'named'}, {row.way}"


def summarise(rows: list[Row], args: argparse.Namespace) -> dict[str, Any]:
    """Return the run's totals, ready for JSON."""
    from geounfold import __version__

    groups = dict.fromkeys(map(group_of, rows))
    return {
        "version": __version__,
        "options": dict(args.options),
        "groups": {g: figures_of([row for row in rows if group_of(row) == g]) for g in groups},
        "rows": [
            {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in asdict(row).items()}
            for row in rows
        ],
    }


# ---------------------------------------------------------------- page


def number(value: float | None, digits: int = 2) -> str:
    """Return a figure of a table; a dash for none."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def said(row: Row) -> str:
    """Return the distance from the truth, or what happened instead."""
    return number(row.rms) if row.outcome == "answered" else row.verdict


def designed_table(rows: list[Row]) -> str:
    """Return a row for each named body: by surfaces and by ids."""
    from geounfold.synthetic.faulted import FAULTED_CASES

    of = {(row.name, row.way): row for row in rows}
    heads = ("body", "what it is", "fault blocks", "slip", "surfaces", "ids", "each block alone",
             "slip error", "throw error", "gaps", "overlaps", "proved", "trust", "s")  # fmt: skip
    lines = [heads, ("---",) * len(heads)]
    for name, spec in FAULTED_CASES.items():
        row, ids = of.get((name, "surfaces")), of.get((name, "ids"))
        if row is None:
            continue
        lines.append((
            f"`{name}`", spec.about, f"{row.found} of {row.fault_blocks}", number(row.slip, 1),
            said(row), said(ids) if ids else "-", number(row.alone), number(row.jump_worst),
            number(row.throw_off), number(row.gap, 1), number(row.overlap, 1),
            row.certified or "-", row.trust or "-", number(row.seconds, 1),
        ))  # fmt: skip
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def groups_table(summary: dict[str, Any]) -> str:
    """Return a row for each group of bodies."""
    heads = ("bodies", "number", "answered", "median RMS", "90 %", "worst", "within 0.5",
             "within 1", "proved", "median slip error")  # fmt: skip
    lines = [heads, ("---",) * len(heads)]
    for group, f in summary["groups"].items():
        lines.append((
            group, str(f["bodies"]), str(f["answered"]), number(f["rms_median"]),
            number(f["rms_p90"]), number(f["rms_max"]), str(f["within_half"]),
            str(f["within_one"]), str(f["proved"]), number(f["jump_median"]),
        ))  # fmt: skip
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def into_page(path: Path, tables: dict[str, str]) -> None:
    """Put each table between the page's two marks of its name."""
    page = path.read_text()
    for name, text in tables.items():
        first, last = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        if first not in page or last not in page:
            raise SystemExit(f"{path} has no marks {first.strip()} and {last}")
        before, rest = page.split(first, 1)
        page = f"{before}{first}{text}\n{last}{rest.split(last, 1)[1]}"
    path.write_text(page)


# ---------------------------------------------------------------- command line


def parse(argv: list[str] | None) -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random", type=int, default=100, help="bodies drawn from seeds 0, 1, ...")
    parser.add_argument("--wide", type=int, default=40, help="bodies of the wide family")
    parser.add_argument("--body", action="append", default=[], help="these bodies only")
    parser.add_argument("--way", action="append", default=[], help="these ways only")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=120, help="limit of one body")
    parser.add_argument("--memory", type=int, default=6000, help="limit of one body, MiB; 0 none")
    parser.add_argument("--option", type=option, action="append", default=[], dest="options")
    parser.add_argument("--cost", action="store_true", help="also unfold fault blocks one by one")
    parser.add_argument("--table", type=Path, default=ROOT / "soak" / "faults.csv")
    parser.add_argument("--summary", type=Path, default=ROOT / "data" / "fault_suite.json")
    parser.add_argument("--page", type=Path, help=f"put the tables into this page, as {PAGE.name}")
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
    if args.page:
        into_page(args.page, {"designed": designed_table(rows), "groups": groups_table(summary)})
    for group, f in summary["groups"].items():
        totals = ", ".join(f"{n} {verdict}" for verdict, n in f["verdicts"].items() if n)
        say(
            f"{group:20} median {number(f['rms_median'])} worst {number(f['rms_max'])} "
            f"slip error {number(f['jump_median'])}: {totals}"
        )
    return int(any(row.verdict in ("failed", "timeout") for row in rows))


if __name__ == "__main__":
    sys.exit(main())
