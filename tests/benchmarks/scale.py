"""Time one simulated body at block sizes from 21,600 to 10 million blocks; keep a table.

    python tests/benchmarks/scale.py [--sizes 21600 1e5 1e6 5e6 1e7] [--again] [--profile]
                                     [--folder DIR] [--out data/bench.csv] [--page]
                                     [--figure docs/assets/profile_1M.png]

The body is always the same, open folds 100 m thick; the blocks get smaller.  Every size is a row of
the table, written as soon as it is measured; sizes that are there are left alone, so that a run
that was stopped goes on.  Whole runs are processes of their own:

  geounfold unfold BODY.parquet -o OUT.parquet --summary S.json --map M.npz

Columns: seconds are wall seconds, `cpu` those of all cores; `peak_mb` is the largest resident
memory; stages are the summary's.  Beside each run, in one process that has the points in memory:

  read_csv       pandas.read_csv of the points as CSV (three columns)
  tree, nearest  scipy.spatial.cKDTree of the points, and its query of them all (k=1, workers=2)
  in_element     libigl's in_element of the points in the control mesh, its tree built already
  carry          UnfoldingMap.carry of the points: located, barycentric, written into arrays
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path

from bench import BenchmarkError, measure

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PAGE = ROOT / "docs" / "results" / "speed.md"
FIGURE = ROOT / "docs" / "assets" / "profile_1M.png"
SIZES = (21_600, 100_000, 1_000_000, 5_000_000, 10_000_000)
STAGES = ("frame", "hull", "split", "sheet", "map", "certificate", "quality")
FLOORS = ("read_csv", "tree", "nearest", "in_element", "carry")
COLUMNS = ("blocks", "seconds", "cpu", "peak_mb", *STAGES, "rest", *FLOORS)
VOLUME = 2000 * 1500 * 100  # m3: of the body `large`
THESIS = (
    "The thesis's own code took 49 s for 21,600 points (table 4.2: surfaces 13 s, flattening 13 s, "
    "mesh 21 s, carrying 2.3 s; four cores, 16 GB). The thesis calls its cost quadratic and gives "
    "no larger body."
)
BEGIN, END = "<!-- scale: made by make bench -->", "<!-- end of scale -->"

MAKE = """
import sys
from geounfold.synthetic import simulate
blocks, stem = int(sys.argv[1]), sys.argv[2]
side = float(f"{({volume} / blocks) ** (1 / 3):.3g}")
frame = simulate("large", steps=(side,) * 3).frame(4).iloc[:, :3]
frame.to_parquet(stem + ".parquet", index=False)
frame.to_csv(stem + ".csv", index=False)
""".replace("{volume}", str(VOLUME))

FLOOR = """
import json, sys, time
import numpy as np, pandas as pd
from scipy.spatial import cKDTree
import geounfold as gu
from geounfold.backends.igl import TetIndex
stem, found = sys.argv[1], {}
def timed(name, work):
    start = time.perf_counter()
    result = work()
    found[name] = time.perf_counter() - start
    return result
P = np.ascontiguousarray(timed("read_csv", lambda: pd.read_csv(stem + ".csv")).to_numpy())
tree = timed("tree", lambda: cKDTree(P))
timed("nearest", lambda: tree.query(P, k=1, workers=2))
del tree
saved = gu.load(stem + ".npz")
saved.carry(P[:1000])
timed("carry", lambda: saved.carry(P))
mesh, work = saved.control.folded, saved.frame.to_work(P)
index = TetIndex(mesh.V, mesh.T)
timed("in_element", lambda: index.locate(work))
found["points"] = len(P)
print(json.dumps(found))
"""

PROFILE = """
import sys
import pandas as pd
import geounfold as gu
from pyinstrument import Profiler
P = pd.read_parquet(sys.argv[1]).to_numpy()
with Profiler(interval=0.01) as profiler:
    gu.unfold(P).summary()
from pyinstrument.renderers import JSONRenderer
print(profiler.output(JSONRenderer()))
"""


def run(python: str, code: str, *words: str) -> str:
    """Return what a script writes on stdout."""
    import subprocess

    done = subprocess.run([python, "-c", code, *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchmarkError((done.stderr.strip().splitlines() or ["no message"])[-1])
    return done.stdout


def measured(python: str, blocks: int, folder: Path) -> dict[str, float]:
    """Return one row of the table."""
    stem = folder / f"scale_{blocks}"
    if not stem.with_suffix(".csv").exists():
        run(python, MAKE, str(blocks), str(stem))
    out, summary = folder / "scale_out.parquet", folder / "scale.json"
    command = [python, "-m", "geounfold", "unfold", f"{stem}.parquet", "-o", str(out)]
    command += ["--summary", str(summary), "--map", f"{stem}.npz", "--overwrite", "--quiet"]
    whole = measure(command, folder)
    stages = json.loads(summary.read_text())["seconds"]
    floors = json.loads(run(python, FLOOR, str(stem)))
    row = {"blocks": floors["points"], "seconds": whole.wall, "cpu": whole.cpu}
    row |= {"peak_mb": whole.peak, "rest": whole.wall - sum(stages.values())}
    row |= {name: stages.get(name, 0.0) for name in STAGES}
    return row | {name: floors[name] for name in FLOORS}


def read(path: Path) -> dict[int, dict[str, float]]:
    """Return the table's rows by the size that was asked for."""
    if not path.exists():
        return {}
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    return {int(r.pop("size")): {k: float(v) for k, v in r.items()} for r in rows}


def write(path: Path, rows: dict[int, dict[str, float]]) -> None:
    """Write the table, smallest body first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["size", *COLUMNS])
        for size, row in sorted(rows.items()):
            writer.writerow([size, *(f"{row[name]:.4g}" for name in COLUMNS)])


def table(rows: dict[int, dict[str, float]]) -> str:
    """Return the table for the page on speed."""
    head = (
        "| blocks | whole, s | us per block | peak MiB | fit, s | other stages, s | files and "
        "start, s | times `read_csv` | carrying, M points/s | carrying, times a nearest "
        "neighbour | `in_element`, s |"
    )
    lines = [head, "|" + "---|" * (head.count("|") - 1)]
    for _, r in sorted(rows.items()):
        fit = r["hull"] + r["split"] + r["sheet"]
        other = r["frame"] + r["map"] + r["certificate"] + r["quality"]
        cells = [
            f"{int(r['blocks']):,}",
            f"{r['seconds']:.1f}",
            f"{r['seconds'] / r['blocks'] * 1e6:.1f}",
            f"{r['peak_mb']:.0f}",
            f"{fit:.1f}",
            f"{other:.1f}",
            f"{r['rest']:.1f}",
            f"{r['seconds'] / r['read_csv']:.0f}",
            f"{r['blocks'] / r['carry'] / 1e6:.1f}",
            f"{r['carry'] / r['nearest']:.2f}",
            f"{r['in_element']:.2f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + f"\n\n{THESIS}\n"


def into_page(text: str) -> None:
    """Put the table between the page's two marks."""
    content = PAGE.read_text(encoding="utf-8")
    start, end = content.index(BEGIN) + len(BEGIN), content.index(END)
    PAGE.write_text(f"{content[:start]}\n{text}{content[end:]}", encoding="utf-8")


def profile(python: str, folder: Path, blocks: int, out: Path) -> None:
    """Draw where the time of a run goes: the calls that take 3 % and more, by depth.

    Calls that only pass on to one that takes nearly all of their time are left out.
    """
    stem = folder / f"scale_{blocks}"
    if not stem.with_suffix(".csv").exists():
        run(python, MAKE, str(blocks), str(stem))
    root = json.loads(run(python, PROFILE, f"{stem}.parquet"))["root_frame"]
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(11, 3.6), dpi=90)
    colours = plt.get_cmap("Pastel2").colors
    total = root["time"]

    def heaviest(frame: dict) -> list[dict]:
        """Return a frame's calls, the heaviest first; wrappers give way to what they call."""
        calls = []
        for child in frame.get("children", []):
            inner = max(child.get("children", []), key=lambda c: c["time"], default=None)
            passed = inner is not None and inner["time"] > 0.93 * child["time"]
            wrapper = child["function"].startswith(("<", "_", "inner", "__")) and passed
            calls += heaviest(child) if wrapper else [child]
        return sorted(calls, key=lambda c: -c["time"])

    def draw(frame: dict, left: float, depth: int) -> int:
        deepest, at = depth, left
        for child in heaviest(frame):
            name, share = child["function"], child["time"] / total
            if share >= 0.03 and depth < 8:
                box = axes.barh(
                    -depth,
                    share,
                    left=at,
                    height=0.9,
                    edgecolor="white",
                    color=colours[hash_of(name) % len(colours)],
                )
                word = axes.text(at + 0.003, -depth, name, va="center", fontsize=7.5)
                word.set_clip_path(box[0])
                deepest = max(deepest, draw(child, at, depth + 1))
            at += share
        return deepest

    deepest = draw(root, 0.0, 0)
    axes.set(xlim=(0, 1), ylim=(-deepest - 0.5, 0.5), yticks=[])
    axes.set_xlabel(f"share of {total:.1f} s: unfold() of {blocks:,} blocks")
    figure.tight_layout()
    figure.savefig(out)


def hash_of(name: str) -> int:
    """Return a number that is the same for a name in every run."""
    return sum(ord(letter) * (k + 1) for k, letter in enumerate(name))


def main(argv: list[str] | None = None) -> int:
    """Measure what is missing, print and keep the table; return the exit status."""
    parser = argparse.ArgumentParser(description="time one body at many block sizes")
    parser.add_argument("--sizes", nargs="+", type=float, default=list(SIZES))
    parser.add_argument("--again", action="store_true", help="measure sizes that are there again")
    parser.add_argument("--profile", action="store_true", help="draw the profile of 1 M blocks")
    parser.add_argument("--folder", type=Path, default=ROOT / ".benchmarks" / "scale")
    parser.add_argument("--out", type=Path, default=ROOT / "data" / "bench.csv")
    parser.add_argument("--figure", type=Path, default=FIGURE, help="where the profile goes")
    parser.add_argument("--page", action="store_true", help=f"put the table into {PAGE.name}")
    parser.add_argument("--python", default=sys.executable, help="interpreter that has geounfold")
    args = parser.parse_args(argv)
    args.folder.mkdir(parents=True, exist_ok=True)
    rows, status = read(args.out), 0
    for size in map(int, args.sizes):
        if size in rows and not args.again:
            continue
        sys.stderr.write(f"{size:,} blocks ...\n")
        try:
            rows[size] = measured(args.python, size, args.folder)
        except BenchmarkError as error:
            sys.stderr.write(f"{size:,} blocks: {error}\n")
            status = 1
            continue
        write(args.out, rows)
    if args.profile:
        profile(args.python, args.folder, 1_000_000, args.figure)
    if rows:
        sys.stdout.write(table(rows))
        if args.page:
            into_page(table(rows))
    return status


if __name__ == "__main__":
    sys.exit(main())
