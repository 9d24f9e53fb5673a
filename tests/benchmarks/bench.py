"""Time the command line on simulated bodies, as whole processes, and print a table.

    python tests/benchmarks/bench.py [--runs 5] [--only NAME ...] [--args '--flattener spring']
                                     [--python PYTHON] [-o TABLE.md]

Columns, medians over the runs (of the peak: the largest):

  whole s        wall seconds of ``python -m geounfold unfold in.csv -o out.csv --summary s.json``
  CPU s          its user and system seconds: compare with wall on a busy machine
  stages s       sum of the summary's seconds per stage: without starting Python, reading, writing
  us/block       wall microseconds per block
  x imports      wall seconds over those of ``python -c "import pymeshlab, igl"``
  peak MiB       largest resident memory of the process

A second table gives the seconds of every stage.  Exit status 1 when a body could not be unfolded.
Only the standard library is loaded here: a child's peak memory includes its parent's.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
BODIES = {  # name: (case, blocks or None for the case's own number)
    "sim_case_1": ("sim_case_1", None),
    "30k": ("large", 30_000),
    "100k": ("large", 100_000),
    "300k": ("large", 300_000),
    "thin_wide": ("thin_wide", None),
}
IMPORTS = "import pymeshlab, igl"


class BenchmarkError(Exception):
    """A process that was to be measured failed; the message is its last line."""


@dataclass
class Run:
    """What one process took."""

    wall: float
    cpu: float
    peak: float  # MiB


@dataclass
class Result:
    """All runs on one body, and the stages' seconds of each."""

    name: str
    blocks: int
    runs: list[Run] = field(default_factory=list)
    stages: list[dict[str, float]] = field(default_factory=list)
    error: str | None = None

    def median(self, what: str) -> float:
        """Return the median of wall or cpu seconds."""
        return float(statistics.median(getattr(run, what) for run in self.runs))

    def stage(self, name: str) -> float:
        """Return the median seconds of one stage; 0 if it did not run."""
        return statistics.median(stages.get(name, 0.0) for stages in self.stages)

    def own(self) -> float:
        """Return the median of the stages' sum."""
        return statistics.median(sum(stages.values()) for stages in self.stages)


def measure(command: list[str], folder: Path) -> Run:
    """Run a command to its end; BenchmarkError with its last line if it fails."""
    with tempfile.TemporaryFile("w+") as log:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
        )
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            log.seek(0)
            last = (log.read().strip().splitlines() or ["no message"])[-1]
            raise BenchmarkError(f"exit status {process.returncode}: {last}")
    scale = 1024 if sys.platform != "darwin" else 1024**2
    return Run(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / scale)


def make_body(python: str, name: str, folder: Path) -> tuple[Path, int]:
    """Write a body's blocks; return the file and their number."""
    case, blocks = BODIES[name]
    out = folder / f"{name}.csv"
    size = [] if blocks is None else ["--blocks", str(blocks)]
    command = [python, str(HERE / "make_body.py"), case, str(out), *size]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise BenchmarkError(f"no body {name}: {done.stderr.strip().splitlines()[-1]}")
    return out, int(done.stdout)


def bench(python: str, name: str, runs: int, extra: list[str], folder: Path) -> Result:
    """Unfold one body so many times; a failure is kept in the result."""
    points, blocks = make_body(python, name, folder)
    result = Result(name, blocks)
    out, summary = folder / f"{name}_out.csv", folder / f"{name}.json"
    command = [python, "-m", "geounfold", "unfold", str(points), "-o", str(out)]
    command += ["--summary", str(summary), "--overwrite", "--quiet", *extra]
    try:
        for _ in range(runs):
            result.runs.append(measure(command, folder))
            result.stages.append(json.loads(summary.read_text())["seconds"])
    except BenchmarkError as err:
        result.error = str(err)
    return result


def table(rows: list[list[str]]) -> str:
    """Return rows, the first of them the head, as a markdown table."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = [
        "| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |"
        for row in rows
    ]
    lines.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    return "\n".join(lines)


def row(r: Result, imports: float) -> list[str]:
    """Return one body's row; for a body that failed, a row with the reason."""
    if r.error is not None:
        return [r.name, f"{r.blocks:,}", r.error, "", "", "", "", ""]
    wall = r.median("wall")
    return [
        r.name,
        f"{r.blocks:,}",
        f"{wall:.2f}",
        f"{r.median('cpu'):.2f}",
        f"{r.own():.2f}",
        f"{wall / r.blocks * 1e6:.1f}",
        f"{wall / imports:.1f}",
        f"{max(run.peak for run in r.runs):.0f}",
    ]


def figures(results: list[Result], imports: Result) -> str:
    """Return the main table."""
    wall, peak = imports.median("wall"), max(run.peak for run in imports.runs)
    cpu = imports.median("cpu")
    rows = [["body", "blocks", "whole s", "CPU s", "stages s", "us/block", "x imports", "peak MiB"]]
    rows.append([f"`{IMPORTS}`", "", f"{wall:.2f}", f"{cpu:.2f}", "", "", "1.0", f"{peak:.0f}"])
    rows += [row(r, wall) for r in results]
    return table(rows)


def stages(results: list[Result]) -> str:
    """Return the seconds of every stage, one column each."""
    good = [r for r in results if r.error is None]
    names = list(dict.fromkeys(name for r in good for name in r.stages[0]))
    rows = [["body", *names]]
    rows += [[r.name, *(f"{r.stage(name):.2f}" for name in names)] for r in good]
    return table(rows)


def import_baseline(python: str, runs: int, folder: Path) -> Result:
    """Measure a process that only loads the two large libraries."""
    result = Result(IMPORTS, 0)
    result.runs += [measure([python, "-c", IMPORTS], folder) for _ in range(runs)]
    return result


def main(argv: list[str] | None = None) -> int:
    """Measure, print, and write the tables if asked; return the exit status."""
    parser = argparse.ArgumentParser(description="time geounfold's command line")
    parser.add_argument("--runs", type=int, default=5, help="processes per body (default 5)")
    parser.add_argument("--only", nargs="+", choices=list(BODIES), default=list(BODIES))
    parser.add_argument("--args", default="", help="further options of `unfold`, in one string")
    parser.add_argument("--python", default=sys.executable, help="interpreter that has geounfold")
    parser.add_argument("-o", "--out", type=Path, help="write the tables here too")
    args = parser.parse_args(argv)
    if args.runs < 1:
        parser.error("--runs must be 1 or more")
    results: list[Result] = []
    with tempfile.TemporaryDirectory(prefix="bench_") as name:
        folder = Path(name)
        try:
            baseline = import_baseline(args.python, args.runs, folder)
            for body in args.only:
                sys.stderr.write(f"{body} ...\n")
                results.append(bench(args.python, body, args.runs, shlex.split(args.args), folder))
        except BenchmarkError as err:
            sys.stderr.write(f"{err}\n")
            return 1
    text = figures(results, baseline)
    if any(r.error is None for r in results):
        text += f"\n\nSeconds per stage, median of {args.runs}:\n\n{stages(results)}"
    sys.stdout.write(text + "\n")
    if args.out is not None:
        args.out.write_text(text + "\n")
    return int(any(r.error is not None for r in results))


if __name__ == "__main__":
    sys.exit(main())
