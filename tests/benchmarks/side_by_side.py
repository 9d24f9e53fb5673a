"""Time geounfold beside the thesis's stages, landmark Isomap and a search tree, in one run.

    python tests/benchmarks/side_by_side.py [--runs 3] [--only NAME ...] [--page]
                                            [--keep] [--out data/releases.csv]

Every figure is the least of the runs, in processor seconds of a process of its own that has the
points in memory; the methods of a body take turns, so that a busy machine slows all of them:

  tree     scipy.spatial.cKDTree of the points, and its query of them all (k=1): the unit
  sheet    geounfold, all columns
  thesis   the thesis's stages, rewritten (method `thesis`, as in notebook 03)
  isomap   landmark Isomap of the mid surface (method `isomap`, as in Unfolding.jl)

A dash is a body that the method does not unfold, or one too large for it.  ``--keep`` writes the
figures as those of this version; a later version is compared with the last one before it, and the
exit status is 1 if `sheet` then takes a quarter more times the tree.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path

from bench import BenchmarkError
from scale import ROOT, run

PAGE = ROOT / "docs" / "results" / "speed.md"
BEGIN, END = "<!-- side by side: made by make bench -->", "<!-- end of side by side -->"
METHODS = ("tree", "sheet", "thesis", "isomap")
BODIES = {  # name: (case, blocks or None for the case's own number; "field": of the field suite)
    "sim_case_1": ("sim_case_1", None),
    "sim_case_2": ("sim_case_2", None),
    "recumbent": ("recumbent", None),
    "ragged": ("ragged", None),
    "uneven, five times as thick": ("bulge_x5", "field"),
    "seam of two plies": ("split_thick", "field"),
    "crude indicator shell": ("shell_20k", "field"),
    "large, 100 k": ("large", 100_000),
    "large, 1 M": ("large", 1_000_000),
}
MOST = {"thesis": 50_000, "isomap": 200_000}
"""Blocks up to which a method is timed: the thesis calls its own cost quadratic."""

SLOWER = 1.25
"""Ratio to the version before above which the exit status is 1.

Measured: the least of three runs differs by up to a tenth from run to run on a busy machine.
"""

TIMED = """
import json, sys, time, warnings
import numpy as np
warnings.simplefilter("ignore")
method, case, blocks = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
if blocks == "field":
    from geounfold.synthetic.field_bodies import FIELD_BODIES
    P = FIELD_BODIES[case].blocks(0).points
else:
    from geounfold.synthetic import simulate
    P = simulate(case, blocks=blocks).folded
P = np.ascontiguousarray(P)
import geounfold as gu
from scipy.spatial import cKDTree
if method == "tree":
    work = lambda: cKDTree(P).query(P, k=1, workers=2)
else:
    gu.unfold(gu.simulate("slab").folded, method=method, allow_uncertified=True)  # imports
    work = lambda: gu.unfold(P, method=method, allow_uncertified=method != "sheet")
start = time.process_time()
try:
    work()
    seconds = time.process_time() - start
except gu.GeounfoldError:
    seconds = None
print(json.dumps([len(P), seconds]))
"""


def version() -> str:
    """Return the version of the tree that is measured."""
    found: dict[str, str] = {}
    exec((ROOT / "geounfold" / "_version.py").read_text(encoding="utf-8"), found)
    return found["__version__"]


def measured(python: str, name: str, runs: int) -> dict[str, str]:
    """Return the row of one body."""
    case, blocks = BODIES[name]
    best: dict[str, float] = {}
    count = 0
    for _ in range(runs):
        for method in METHODS:
            if count > MOST.get(method, count):
                continue
            count, seconds = json.loads(run(python, TIMED, method, case, json.dumps(blocks)))
            if seconds is not None:
                best[method] = min(seconds, best.get(method, seconds))
    figures = {method: f"{best[method]:.4g}" if method in best else "" for method in METHODS}
    return {"version": version(), "body": name, "blocks": str(count), **figures}


def read(path: Path) -> list[dict[str, str]]:
    """Return the rows of all versions, the oldest first."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def write(path: Path, rows: list[dict[str, str]]) -> None:
    """Write the rows of all versions."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(
            stream, ("version", "body", "blocks", *METHODS), lineterminator="\n"
        )
        writer.writeheader()
        writer.writerows(rows)


def times(row: dict[str, str]) -> float | None:
    """Return the seconds of `sheet` times those of the tree; None if it was refused."""
    return float(row["sheet"]) / float(row["tree"]) if row["sheet"] else None


def before(row: dict[str, str], kept: list[dict[str, str]]) -> dict[str, str] | None:
    """Return the last row kept of the same body and of another version; None if there is none."""
    found = [r for r in kept if r["body"] == row["body"] and r["version"] != row["version"]]
    return found[-1] if found else None


def table(rows: list[dict[str, str]], kept: list[dict[str, str]]) -> str:
    """Return the rows as a markdown table, with the change since the version before."""
    head = "| body | blocks | tree, s | sheet, s | times the tree | version before | thesis, s | "
    head += "Isomap, s |"
    lines = [head, "|" + "---|" * (head.count("|") - 1)]
    for r in rows:
        own, last = times(r), before(r, kept)
        old = None if last is None else times(last)
        cells = [r["body"], f"{int(r['blocks']):,}", *(seconds(r[m]) for m in METHODS[:2])]
        cells += ["-" if own is None else f"{own:.0f}", "-" if old is None else f"{old:.0f}"]
        cells += [seconds(r[m]) for m in METHODS[2:]]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def seconds(text: str) -> str:
    """Return a figure to two digits, or a dash."""
    return f"{float(text):.2g}" if text else "-"


def into_page(text: str) -> None:
    """Put the table between the page's two marks."""
    content = PAGE.read_text(encoding="utf-8")
    start, end = content.index(BEGIN) + len(BEGIN), content.index(END)
    PAGE.write_text(f"{content[:start]}\n{text}{content[end:]}", encoding="utf-8")


def slower(rows: list[dict[str, str]], kept: list[dict[str, str]]) -> list[str]:
    """Return the bodies that take a quarter more times the tree than in the version before."""
    found = []
    for row in rows:
        last = before(row, kept)
        own, old = times(row), None if last is None else times(last)
        if own is not None and old is not None and own > SLOWER * old:
            found.append(row["body"])
    return found


def main(argv: list[str] | None = None) -> int:
    """Measure, print, and keep the figures if asked; return the exit status."""
    parser = argparse.ArgumentParser(description="time geounfold beside others, in one run")
    parser.add_argument("--runs", type=int, default=3, help="runs of each, the least counts")
    parser.add_argument("--only", nargs="+", choices=list(BODIES), default=list(BODIES))
    parser.add_argument("--keep", action="store_true", help="keep the figures of this version")
    parser.add_argument("--page", action="store_true", help=f"put the table into {PAGE.name}")
    parser.add_argument("--out", type=Path, default=ROOT / "data" / "releases.csv")
    parser.add_argument("--python", default=sys.executable, help="interpreter that has geounfold")
    args = parser.parse_args(argv)
    kept, rows = read(args.out), []
    for name in args.only:
        sys.stderr.write(f"{name} ...\n")
        try:
            rows.append(measured(args.python, name, args.runs))
        except BenchmarkError as error:
            sys.stderr.write(f"{name}: {error}\n")
            return 1
        if args.keep:
            fresh = {(r["version"], r["body"]) for r in rows}
            write(args.out, [r for r in kept if (r["version"], r["body"]) not in fresh] + rows)
    text = table(rows, kept)
    sys.stdout.write(text)
    if args.page:
        into_page(text)
    for name in (late := slower(rows, kept)):
        sys.stderr.write(f"{name}: slower than in the version before\n")
    return int(bool(late))


if __name__ == "__main__":
    sys.exit(main())
