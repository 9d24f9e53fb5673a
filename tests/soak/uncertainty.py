"""Unfold bodies of known truth with uncertainty, and count what the bands hold.

    python tests/soak/uncertainty.py [--seed 0] [--each 4] [--faulted 12] [--members 8]
                                     [--minutes 30] [--jobs 1] [--seconds 120] [--memory 6000]
                                     [--table FILE.csv] [--summary FILE.json]
                                     [--figure FILE.png] [--page FILE.md]

Bodies are ``random_body(seed, family)`` of every family but tubes, --each of a family, from --seed
on (the k-th family has the seeds from --seed + 100 k on), and ``random_faulted(seed)``, half of
them plain and half wide, given with their fault surfaces.  Their places are compared with the
truth after the best rotation and shift; those of faulted bodies after the best turn, shift and
common shear, as in `faults.py`, because faults leave the pin line open.  Sheet parts lie in flat
spaces of their own and are compared one by one.  A band of 90 % holds a block if its error is
within the distance that holds 90 % of normal deviations of its ``sd_along`` (in two dimensions)
and ``sd_across``.

The table of trust counts all answers, by the word and by the distance from the truth.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from faults import into_page, number
from field import processor_seconds
from pool import load_libraries, place_of, tabulated
from soak import say

ROOT = Path(__file__).resolve().parents[2]
LEVELS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
FAULTED = ("plain", "wide")
WORDS = ("good", "fair", "poor")
CLASSES = (("within 0.3", 0.0, 0.3), ("0.3 to 1", 0.3, 1.0), ("1 to 3", 1.0, 3.0),
           ("above 3", 3.0, np.inf))  # fmt: skip
NAN = float("nan")


@dataclass
class Row:
    """What came of one body.  Lengths in blocks."""

    family: str
    seed: int
    blocks: int = 0
    cpu: float = NAN  # seconds of the processor
    outcome: str = "failed"
    trust: str = ""
    rms: float = NAN  # true distance
    told: float = NAN  # the same as the summary expects it
    within: float = NAN  # the summary's 90 % distance
    within_holds: float = NAN  # share of the blocks that it holds
    along: list[float] = field(default_factory=list)  # share held by the band of each of LEVELS
    across: list[float] = field(default_factory=list)
    message: str = ""


# ---------------------------------------------------------------- one body


def given(row: Row) -> tuple[Any, np.ndarray, dict[str, Any], float]:
    """Return a body's blocks, their truth, what geounfold is told, and the side of a block."""
    if row.family in FAULTED:
        from geounfold.synthetic.faulted import random_faulted

        body = random_faulted(row.seed, row.family)
        return body.folded, body.truth, {"faults": body.surfaces}, body.step
    from geounfold.synthetic import random_body

    body = random_body(row.seed, row.family)
    return body.folded, body.truth, {}, float(np.cbrt(body.sizes.prod(axis=1).mean()))


def errors(Y: np.ndarray, W: np.ndarray) -> np.ndarray:
    """Return the distances (n, 3) of places from the truth after the best rotation and shift."""
    a, b = Y - Y.mean(axis=0), W - W.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return a @ (left @ proper @ right) - b


def faulted_errors(Y: np.ndarray, W: np.ndarray) -> np.ndarray:
    """Return the distances (n, 3) after the best turn, shift and common shear."""
    from geounfold.quality.flat_truth import aligned_flat

    return aligned_flat(Y, W) - W


def measure(row: Row, members: int) -> None:
    """Unfold a body and fill in its row; errors pass through."""
    import geounfold as gu

    points, truth, more, side = given(row)
    row.blocks, used = len(points), processor_seconds()
    u = gu.unfold(points, uncertainty=members, **more)
    row.cpu, row.outcome = processor_seconds() - used, "answered"
    row.trust = "" if u.trust is None else u.trust.word
    kept = u.carried.placed
    off = np.empty((int(kept.sum()), 3))
    part = u.body_part[kept] if u.junctions else np.zeros(len(off), int)
    for rows in (part == k for k in np.unique(part)):
        align = faulted_errors if row.family in FAULTED else errors
        off[rows] = align(u.points[kept][rows], truth[kept][rows])
    row.rms = float(np.sqrt((off**2).sum(axis=1).mean())) / side
    figures = u.summary()["uncertainty"]
    row.told, row.within = figures["rms"] / side, figures["within_90"] / side
    row.within_holds = float((np.linalg.norm(off, axis=1) <= row.within * side).mean())
    along = np.hypot(off[:, 0], off[:, 1]) / u.columns["sd_along"][kept]
    across = np.abs(off[:, 2]) / u.columns["sd_across"][kept]
    row.along = [float((along <= np.sqrt(-2 * np.log(1 - p))).mean()) for p in LEVELS]
    row.across = [float((across <= deviations(p)).mean()) for p in LEVELS]


def deviations(share: float) -> float:
    """Return the distance, in standard deviations, within which a share of a line's errors lies."""
    from scipy.special import ndtri

    return float(ndtri((1 + share) / 2))


def work(row: Row, members: int, end: float) -> None:
    """Fill in one body's row, whatever comes of it; leave it if the time is up."""
    from geounfold.errors import GeounfoldError

    if time.monotonic() > end:
        row.outcome = "left"
        return
    try:
        measure(row, members)
    except GeounfoldError as error:
        row.outcome, row.message = "refused", f"{type(error).__name__}: {error}"
    except Exception as error:
        row.message = f"{type(error).__name__}: {error} ({place_of(error)})"


def stopped(row: Row, how: str, message: str) -> None:
    """Fill in the row of a body that did not end by itself."""
    row.outcome, row.message = how, message


# ---------------------------------------------------------------- many


def chosen(args: argparse.Namespace) -> list[Row]:
    """Return the rows to fill in."""
    from geounfold.synthetic.random_families import FAMILIES

    families = [f for f in FAMILIES if f != "tube"]
    rows = [
        Row(family, args.seed + 100 * k + i)
        for i in range(args.each)
        for k, family in enumerate(families)
    ]
    return [Row(FAULTED[i % 2], args.seed + i // 2) for i in range(args.faulted)] + rows


def held(rows: list[Row], name: str) -> list[float]:
    """Return the mean share held by the band of each of LEVELS; every body counts once."""
    values = [getattr(row, name) for row in rows if getattr(row, name)]
    return [float(x) for x in np.mean(values, axis=0)] if values else [NAN] * len(LEVELS)


def figures_of(rows: list[Row]) -> dict[str, Any]:
    """Return the figures of a group of bodies."""
    there = [row for row in rows if row.outcome == "answered"]
    at = LEVELS.index(0.9)
    return {
        "bodies": len(rows),
        "answered": len(there),
        "rms_median": float(np.median([row.rms for row in there])) if there else None,
        "told_median": float(np.median([row.told for row in there])) if there else None,
        "along_90": held(there, "along")[at],
        "across_90": held(there, "across")[at],
        "within_90": float(np.mean([row.within_holds for row in there])) if there else None,
    }


def trust_counts(rows: list[Row]) -> dict[str, dict[str, int]]:
    """Return how many answers have each word, by their distance from the truth."""
    return {
        name: {w: sum(low <= r.rms < high and r.trust == w for r in rows) for w in WORDS}
        for name, low, high in CLASSES
    }


def summarise(rows: list[Row], args: argparse.Namespace) -> dict[str, Any]:
    """Return the run's figures, ready for JSON."""
    from geounfold import __version__

    there = [row for row in rows if row.outcome == "answered"]
    families = sorted({row.family for row in rows})
    return {
        "version": __version__,
        "seed": args.seed,
        "members": args.members,
        "levels": list(LEVELS),
        "all": figures_of(rows),
        "along": held(there, "along"),
        "across": held(there, "across"),
        "families": {f: figures_of([r for r in rows if r.family == f]) for f in families},
        "trust": trust_counts(there),
        "left": [f"{r.family} {r.seed}: {r.outcome} {r.message}" for r in rows
                 if r.outcome != "answered"],
    }  # fmt: skip


def families_table(summary: dict[str, Any]) -> str:
    """Return a row for each family and one for all."""
    heads = ("family", "bodies", "median RMS", "as told", "90 % band along", "across",
             "90 % distance")  # fmt: skip
    lines: list[tuple[str, ...]] = [heads, ("---",) * len(heads)]
    for name, f in {**summary["families"], "all": summary["all"]}.items():
        shares = [number(f[k], 2) for k in ("along_90", "across_90", "within_90")]
        lines.append((name, f"{f['answered']} of {f['bodies']}", number(f["rms_median"], 3),
                      number(f["told_median"], 3), *shares))  # fmt: skip
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def trust_table(summary: dict[str, Any]) -> str:
    """Return the counts of words by distance from the truth."""
    lines = [("blocks from the truth", *WORDS), ("---",) * 4]
    lines += [(name, *(str(n[w]) for w in WORDS)) for name, n in summary["trust"].items()]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def draw(rows: list[Row], path: Path) -> None:
    """Draw the reliability diagram, and told beside true distances."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    there = [row for row in rows if row.outcome == "answered"]
    figure = Figure(figsize=(10, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0.4, 1], [0.4, 1], "k--", lw=1, label="exact")
    for name, colour in (("along", "tab:blue"), ("across", "tab:orange")):
        left.plot(LEVELS, held(there, name), "o-", color=colour, label=f"sd_{name}")
    left.axhspan(0.85, 0.95, color="0.9", zorder=0, label="aim at 0.9")
    left.set(
        xlabel="share that the band should hold",
        ylabel="share of the blocks held",
        title=f"{len(there)} bodies, one vote each",
    )
    left.legend(loc="lower right")
    colours = {"good": "tab:green", "fair": "tab:orange", "poor": "tab:red"}
    for word in WORDS:
        some = [row for row in there if row.trust == word]
        right.loglog([r.told for r in some], [r.rms for r in some], ".", color=colours[word],
                     label=f"trust {word}: {len(some)}")  # fmt: skip
    right.plot([1e-3, 20], [1e-3, 20], "k--", lw=1)
    right.set(xlabel="RMS error as told, blocks", ylabel="true RMS error, blocks",
              title="one dot, one body")  # fmt: skip
    right.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_png(path)


def line(row: Row) -> str:
    """Return a row of the printed table."""
    at = LEVELS.index(0.9)
    shown = row.message[:80]
    if row.outcome == "answered":
        shown = (f"rms {row.rms:6.3f} told {row.told:6.3f} held {row.along[at]:.2f} "
                 f"{row.across[at]:.2f} {row.trust}")  # fmt: skip
    return f"{row.family:16} {row.seed} {row.blocks:6} {row.cpu:5.1f} s  {row.outcome:9} {shown}"


def parse(argv: list[str] | None) -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--each", type=int, default=4, help="bodies of each family")
    parser.add_argument("--faulted", type=int, default=12, help="faulted bodies")
    parser.add_argument("--members", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=30, help="no body is begun later")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=120, help="limit of one body")
    parser.add_argument("--memory", type=int, default=6000, help="limit of one body, MiB; 0 none")
    parser.add_argument("--table", type=Path, default=ROOT / "soak" / "uncertainty.csv")
    parser.add_argument("--summary", type=Path, default=ROOT / "data" / "uncertainty.json")
    parser.add_argument("--figure", type=Path, default=ROOT / "docs" / "assets" / "reliability.png")
    parser.add_argument("--page", type=Path, help="page whose tables are renewed")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    """Run; return 0 if no body failed."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    args = parse(argv)
    load_libraries()
    start = time.monotonic()
    task: Callable[[Row], None] = partial(work, members=args.members, end=start + 60 * args.minutes)
    rows = tabulated(task, chosen(args), args, stopped, lambda row: say(line(row)))
    rows = [row for row in rows if row.outcome != "left"]
    rows.sort(key=lambda row: (row.family, row.seed))
    summary = summarise(rows, args)
    args.summary.parent.mkdir(parents=True, exist_ok=True)
    args.summary.write_text(
        json.dumps(summary | {"rows": [asdict(row) for row in rows]}, indent=1) + "\n"
    )
    draw(rows, args.figure)
    if args.page is not None:
        into_page(args.page, {"families": families_table(summary), "trust": trust_table(summary)})
    held_90 = f"along {summary['all']['along_90']:.3f}, across {summary['all']['across_90']:.3f}"
    say(f"{len(rows)} bodies, {time.monotonic() - start:.0f} s: 90 % bands hold {held_90}")
    return int(any(row.outcome in ("failed", "killed") for row in rows))


if __name__ == "__main__":
    sys.exit(main())
