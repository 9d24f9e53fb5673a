"""Unfold many random bodies, each in a process of its own, and record what came of it.

    python tests/soak/soak.py [--minutes 30] [--bodies 1000] [--seed 0] [--jobs 2]
                              [--option NAME=VALUE ...] [--family NAME ...] [--work DIR]
                              [--summary FILE.json] [--figure FILE.png] [--restart]
    python tests/soak/soak.py --only SEED [--option NAME=VALUE ...]

Bodies are ``geounfold.synthetic.random_body(seed)`` for seeds from --seed on; --only unfolds one
again, here and with a traceback.  Every body ends as one of

  ok           unfolded, and its map is proved one-to-one
  uncertified  unfolded only with ``allow_uncertified``: without that proof, or with blocks torn
               from their neighbours or without an image
  refused      an error that geounfold raises on purpose; the right end of a closed tube
  crash        anything else: another exception, a wrong answer (coordinates that are not finite,
               a tube unfolded as a sheet), a process killed, over --seconds or over --memory

WORK/bodies.csv has one row for each body: figures in block sides, options, and the reason of a
failure.  A run that was stopped continues if it is started again with the same arguments.  The
exit status is 1 if a body crashed or more than 1 % of the sheets are uncertified.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pool import Job, finished, load_libraries, place_of, started

ROOT = Path(__file__).resolve().parents[2]
OUTCOMES = ("ok", "uncertified", "refused", "crash")
MOST_UNCERTIFIED = 0.01  # of the bodies that are sheets
NAN = float("nan")


@dataclass
class Row:
    """What came of one body.  Lengths in sides of a cube of a block's volume."""

    seed: int
    family: str
    outcome: str = "crash"
    reason: str = ""  # the error's class, or what was wrong
    message: str = ""
    blocks: int = 0
    seconds: float = NAN
    peak_mib: float = NAN
    epsilon: float = NAN  # mean epsilon(W, Y)
    rms: float = NAN  # from the truth, after the best proper rotation
    trust: str = ""  # good, fair or poor
    strain: float = NAN  # median over the blocks of the largest principal strain
    horizon: float = NAN  # mean error of the height within the layer
    outside: float = NAN  # share of the blocks
    inverted: int = 0
    torn: int = 0
    round_trip: float = NAN
    options: str = "{}"
    description: str = ""


# ---------------------------------------------------------------- one body


def unfolded(row: Row, options: dict[str, Any]) -> Row:
    """Simulate a body, unfold it and fill in its row; errors pass through."""
    import geounfold as gu
    from geounfold.synthetic import random_body

    body = random_body(row.seed, row.family)
    row.blocks, row.description = len(body.folded), body.description
    start = time.monotonic()
    u = gu.unfold(body.folded, allow_uncertified=True, **options)
    row.seconds = time.monotonic() - start
    measure(row, body, u)
    return row


def measure(row: Row, body: Any, u: Any) -> None:
    """Fill in the figures of an unfolded body, and its outcome."""
    import geounfold as gu

    side = float(np.cbrt(body.sizes.prod(axis=1).mean()))
    placed = u.carried.placed
    if not np.isfinite(u.points[placed]).all() or not np.isfinite(u.stratigraphic[placed]).all():
        row.reason = "coordinates that are not finite"
        return
    columns = u.columns
    stretch = np.maximum(columns["stretch_max"] - 1, 1 - columns["stretch_min"])[placed]
    level, truth = u.stratigraphic[placed], body.stratigraphic[placed]
    # The top of a body that was turned over is the bottom of its truth.
    off = min((level - truth, 1 - level - truth), key=lambda d: float(np.abs(d).mean()))
    height = np.abs(off) * (body.top - body.bottom)[placed]
    row.epsilon = float(gu.epsilon(body.truth[placed], u.points[placed]).mean())
    row.rms = float(gu.aligned_rms(u.points[placed], body.truth[placed])) / side
    row.trust = "" if u.trust is None else u.trust.word
    row.strain = float(np.median(stretch))
    row.horizon = float(height.mean()) / side
    row.outside = float(u.outside_share)
    row.inverted = u.certificate.inverted_folded + u.certificate.inverted_unfolded
    row.torn = u.summary()["torn"]
    row.round_trip = float(u.round_trip_max) / side
    if body.sheet.spec.closed:
        row.reason = "a closed tube was unfolded"
        return
    row.reason, row.message = failing(row, u)
    row.outcome = "uncertified" if row.reason else "ok"


def failing(row: Row, u: Any) -> tuple[str, str]:
    """Return why ``unfold`` would have refused this answer unless told to allow it, or nothing."""
    if not u.certificate.injective:
        return "not proved", "; ".join(u.certificate.faults)
    if row.torn:
        return "torn blocks", f"{row.torn} blocks"
    unplaced = int((~u.carried.placed).sum())
    return ("blocks without image", f"{unplaced} blocks") if unplaced else ("", "")


def work(row: Row, options: dict[str, Any]) -> None:
    """Unfold one body and fill in its row, whatever comes of it."""
    from geounfold.backends.system.memory import peak_memory_mb
    from geounfold.errors import GeounfoldError

    try:
        unfolded(row, options)
    except GeounfoldError as error:
        row.outcome, row.reason, row.message = "refused", type(error).__name__, str(error)
    except Exception as error:
        row.reason, row.message = type(error).__name__, f"{error} ({place_of(error)})"
    row.peak_mib = peak_memory_mb()


def stopped(row: Row, how: str, message: str) -> None:
    """Fill in the row of a body that did not end by itself."""
    row.reason, row.message = how, message


# ---------------------------------------------------------------- many


def run(args: argparse.Namespace, rows: list[Row], path: Path) -> list[Row]:
    """Unfold the seeds that have no row yet until the time is up; return all rows."""
    from geounfold.synthetic import random_family

    load_libraries()
    done = {row.seed for row in rows}
    wanted = (s for s in range(args.seed, args.seed + args.bodies) if s not in done)
    seeds = (s for s in wanted if not args.family or random_family(s) in args.family)
    end = time.monotonic() + 60 * args.minutes
    task = partial(work, options=args.options)
    jobs: list[Job] = []
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Row)])
        if not path.stat().st_size:
            writer.writeheader()
        try:
            while True:
                while len(jobs) < args.jobs and time.monotonic() < end:
                    seed = next(seeds, None)
                    if seed is None:
                        break
                    jobs.append(started(task, Row(seed, random_family(seed)), args.memory))
                if not jobs:
                    return rows
                for row in finished(jobs, args.seconds, stopped):
                    row.options = json.dumps(args.options, sort_keys=True)
                    rows.append(row)
                    writer.writerow(asdict(row))
                    file.flush()
                    tell(rows)
        finally:
            for job in jobs:
                job.process.kill()


def tell(rows: list[Row]) -> None:
    """Print one line of progress, and the last body if it failed."""
    counts = Counter(row.outcome for row in rows)
    row = rows[-1]
    if row.outcome != "ok" and not (row.family == "tube" and row.outcome == "refused"):
        what = f"{row.outcome}: {row.reason} {row.message}"[:150]
        say(f"seed {row.seed} ({row.family}) {what}")
    if len(rows) % 25 == 0:
        say(f"{len(rows)} bodies: " + ", ".join(f"{counts[o]} {o}" for o in OUTCOMES))


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def read(path: Path) -> list[Row]:
    """Return the rows of an earlier run."""
    kinds = {f.name: {"int": int, "float": float, "str": str}[str(f.type)] for f in fields(Row)}
    with path.open(newline="") as file:
        return [
            Row(**{name: kinds[name](text) for name, text in line.items()})
            for line in csv.DictReader(file)
        ]


# ---------------------------------------------------------------- what it comes to


def summarise(rows: list[Row], args: argparse.Namespace) -> dict[str, Any]:
    """Return the run's figures, ready for JSON."""
    from geounfold import __version__

    sheets = [row for row in rows if row.family != "tube"]
    unproved = sum(row.outcome == "uncertified" for row in sheets)
    return {
        "version": __version__,
        "seed": args.seed,
        "bodies": len(rows),
        "options": args.options,
        "outcomes": {o: sum(row.outcome == o for row in rows) for o in OUTCOMES},
        "uncertified_share": unproved / max(1, len(sheets)),
        "seconds": figures([row.seconds for row in rows]),
        "families": {
            family: family_summary([row for row in rows if row.family == family])
            for family in sorted({row.family for row in rows})
        },
        "reasons": dict(Counter(f"{r.outcome}: {r.reason}" for r in rows if r.reason)),
        "failed_seeds": {
            reason: sorted(r.seed for r in rows if f"{r.outcome}: {r.reason}" == reason)
            for reason in sorted({f"{r.outcome}: {r.reason}" for r in rows if r.reason})
        },
    }


def family_summary(rows: list[Row]) -> dict[str, Any]:
    """Return one family's counts and figures."""
    return {
        "outcomes": {o: n for o in OUTCOMES if (n := sum(row.outcome == o for row in rows))},
        **{
            name: figures([getattr(row, name) for row in rows])
            for name in ("epsilon", "rms", "strain", "horizon")
        },
    }


def figures(values: list[float]) -> dict[str, float] | None:
    """Return median, 95th percentile and largest of the finite values, or None."""
    kept = np.array([v for v in values if np.isfinite(v)])
    if not len(kept):
        return None
    names = ("median", "p95", "max")
    return dict(zip(names, np.percentile(kept, [50, 95, 100]).round(6).tolist(), strict=True))


def draw(rows: list[Row], path: Path) -> None:
    """Draw epsilon and RMS per family, and what the failures were."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    families = sorted({row.family for row in rows})
    figure = Figure(figsize=(13, 2.2 + 0.26 * len(families)), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1))
    limits = {"epsilon": (1e-5, 1), "rms": (1e-3, 100)}
    titles = {"epsilon": "mean epsilon(W, Y)", "rms": "RMS from the truth, block sides"}
    for axes, name in ((left, "epsilon"), (middle, "rms")):
        edges = np.geomspace(*limits[name], 41)
        image = np.array([
            np.histogram(
                np.clip([getattr(r, name) for r in rows if r.family == f], *limits[name]), edges
            )[0]
            for f in families
        ])  # fmt: skip
        axes.pcolormesh(edges, np.arange(len(families) + 1), np.where(image, image, np.nan))
        medians = [np.nanmedian(v) if np.isfinite(v := [
            getattr(r, name) for r in rows if r.family == f]).any() else np.nan for f in families
        ]  # fmt: skip
        axes.plot(medians, np.arange(len(families)) + 0.5, "r|", markersize=9)
        axes.set(xscale="log", title=titles[name], ylim=(len(families), 0))
        axes.set_yticks(np.arange(len(families)) + 0.5, families if axes is left else [])
    colours = dict(zip(OUTCOMES, ("tab:green", "tab:orange", "tab:blue", "tab:red"), strict=True))
    start = np.zeros(len(families))
    for outcome in OUTCOMES:
        count = np.array([
            sum(r.family == f and r.outcome == outcome for r in rows) for f in families
        ])  # fmt: skip
        label = f"{outcome}: {count.sum()}"
        right.barh(np.arange(len(families)) + 0.5, count, left=start, color=colours[outcome],
                   label=label)  # fmt: skip
        start += count
    right.set(title=f"{len(rows)} bodies", ylim=(len(families), 0), yticks=[])
    reasons = Counter(f"{r.outcome}: {r.reason}" for r in rows if r.reason)
    for reason, count in reasons.most_common(12):
        right.plot([], [], " ", label=f"{count} {reason}")
    right.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_png(path)


# ---------------------------------------------------------------- command line


def option(text: str) -> tuple[str, Any]:
    """Return NAME=VALUE as a pair; values are JSON if they can be read so."""
    name, sign, value = text.partition("=")
    if not sign:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def parse(argv: list[str] | None) -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--bodies", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first body")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=120, help="limit of one body")
    parser.add_argument("--memory", type=int, default=6000, help="limit of one body, MiB; 0 none")
    parser.add_argument("--option", type=option, action="append", default=[], dest="options")
    parser.add_argument("--family", action="append", default=[], help="these families only")
    parser.add_argument("--only", type=int, help="unfold this seed alone, with a traceback")
    parser.add_argument("--work", type=Path, default=ROOT / "soak")
    parser.add_argument("--summary", type=Path, default=ROOT / "data" / "soak.json")
    parser.add_argument("--figure", type=Path, default=ROOT / "docs" / "assets" / "soak.png")
    parser.add_argument("--restart", action="store_true", help="forget the earlier rows")
    args = parser.parse_args(argv)
    args.options = dict(args.options)
    return args


def earlier(args: argparse.Namespace, path: Path) -> list[Row]:
    """Return the rows to go on from; leave where they belong to other arguments."""
    args.work.mkdir(parents=True, exist_ok=True)
    about = args.work / "run.json"
    this = {"seed": args.seed, "options": args.options, "family": sorted(args.family)}
    if path.exists() and not args.restart:
        if json.loads(about.read_text()) != this:
            sys.exit(f"{path} is of a run with other arguments: give --restart or another --work")
        return read(path)
    path.unlink(missing_ok=True)
    about.write_text(json.dumps(this))
    return []


def main(argv: list[str] | None = None) -> int:
    """Run; return 0 when nothing crashed and enough was proved."""
    args = parse(argv)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if args.only is not None:
        from geounfold.synthetic import random_family

        row = unfolded(Row(args.only, random_family(args.only)), args.options)
        say(json.dumps(asdict(row), indent=2))
        return int(row.outcome == "crash")
    path = args.work / "bodies.csv"
    rows = sorted(run(args, earlier(args, path), path), key=lambda row: row.seed)
    summary = summarise(rows, args)
    args.summary.parent.mkdir(parents=True, exist_ok=True)
    args.summary.write_text(json.dumps(summary, indent=2) + "\n")
    draw(rows, args.figure)
    outcomes = summary["outcomes"]
    say(f"{len(rows)} bodies: " + ", ".join(f"{n} {o}" for o, n in outcomes.items()))
    return int(outcomes["crash"] > 0 or summary["uncertified_share"] > MOST_UNCERTIFIED)


if __name__ == "__main__":
    sys.exit(main())
