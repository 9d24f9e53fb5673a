"""Table of methods: ours against every other on simulated bodies that can be laid flat exactly.

    python tests/benchmarks/methods.py [NAME ...] [-o TABLE.csv] [--blocks N] [--methods A,B]
    python tests/benchmarks/methods.py --peer FOLDER [-o PEER.csv]
    python tests/benchmarks/methods.py --show TABLE.csv

The first makes rows (see `geounfold.contest.METHOD_COLUMNS`) and puts them into the table in place
of those of the same bodies, whole or cut to about N blocks.  The second unfolds Unfolding.jl's own
body (block_model.csv, samples.csv) by `sheet` and by `isomap`.  The third prints a table as
Markdown: RMS from the truth in blocks, and how many times ours the best other method's is.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.comparison.methods import compare_methods
from geounfold.methods import METHODS
from geounfold.quality.neighbour_distances import neighbours
from geounfold.synthetic import CASES

LARGE = ("large", "thin_wide")
NEAR = 16  # neighbours in Unfolding.jl's measure
OFF = 5.0  # metres: more, and it calls a block bad


def say(text):
    """Write lines at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def rows(name, blocks, methods):
    """Return one body's rows; None if it has no exact flat image."""
    body = gu.simulate(name, blocks=blocks)
    if not body.developable:
        return None
    table = compare_methods(body, methods)
    for column in table.select_dtypes("float"):
        table[column] = [float(f"{value:.4g}") for value in table[column]]
    return table


def merged(path, new):
    """Return the table in a file with new rows in place of those of the same bodies."""
    if not Path(path).exists():
        return new
    old = pd.read_csv(path, keep_default_na=True)
    kept = old[~old.body.isin(new.body)]
    return pd.concat([kept.astype(object), new.astype(object)]) if len(kept) else new


def markdown(table):
    """Yield a table of RMS per body and method, with the margin of ours."""
    others = [name for name in METHODS if name != "sheet"]
    yield f"| body | blocks | nothing | {' | '.join(['sheet', *others])} | margin |"
    yield f"|{'---|' * (len(others) + 5)}"
    for body, part in table.groupby("body", sort=False):
        part = part.set_index("method")
        rms = part.rms.astype(float).reindex(["sheet", *others])
        ours, best = rms["sheet"], rms[others].min()
        cells = ["-" if pd.isna(v) else f"{v:.3f}" for v in rms]
        nothing = part.rms_nothing.dropna().iloc[:1].map("{:.2f}".format).sum()
        margin = "-" if pd.isna(ours) else f"{best / ours:.1f}"
        yield f"| {body} | {part.blocks.iloc[0]:,} | {nothing} | {' | '.join(cells)} | {margin} |"


def peer(folder):
    """Return how `sheet` and `isomap` do on Unfolding.jl's body, by its own measure and layers."""
    blocks = pd.read_csv(folder / "block_model.csv")[["XC", "YC", "ZC"]].to_numpy(float)
    samples = pd.read_csv(folder / "samples.csv")
    places, layers = samples[["X", "Y", "Z"]].to_numpy(float), samples["value"].to_numpy()
    ids = neighbours(blocks, NEAR)
    out = []
    for method in ("sheet", "isomap"):
        clock = time.process_time()
        u = gu.unfold(blocks, method=method, allow_uncertified=True)
        seconds = time.process_time() - clock
        before, after = (np.linalg.norm(P[ids] - P[:, None], axis=2) for P in (u.folded, u.points))
        off = np.abs(after - before)
        share = u.map.carry(places).stratigraphic
        there = np.isfinite(share)
        within = pd.Series(share[there]).groupby(layers[there]).transform(lambda s: s - s.mean())
        out.append(
            {
                "method": method,
                "blocks": len(blocks),
                "samples_placed": int(there.sum()),
                "layer_spread": float(np.sqrt((within**2).mean())),
                "spread_over_all": float(np.sqrt((within**2).mean()) / share[there].std()),
                "distance_error_mean": float(off.mean()),
                "distance_error_p95": float(np.percentile(off, 95)),
                "distance_error_max": float(off.max()),
                "bad_share": float((off > OFF).any(axis=1).mean()),
                "proved": u.injective,
                "torn": u.torn,
                "cpu_seconds": seconds,
            }
        )
        say(f"{out[-1]}")
    table = pd.DataFrame(out)
    for column in table.select_dtypes("float"):
        table[column] = [float(f"{value:.4g}") for value in table[column]]
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", metavar="NAME", nargs="*", help="bodies; all without")
    parser.add_argument("-o", "--output", help="a CSV table to put the rows into")
    parser.add_argument("--blocks", type=int, metavar="N", help="cut bodies to about N")
    parser.add_argument("--methods", metavar="A,B", help="all without")
    parser.add_argument("--peer", type=Path, metavar="FOLDER", help="Unfolding.jl's test data")
    parser.add_argument("--show", metavar="TABLE.csv", help="print a table as Markdown")
    args = parser.parse_args()
    if args.show:
        say("\n".join(markdown(pd.read_csv(args.show))))
        return 0
    if args.peer:
        table = peer(args.peer)
        if args.output:
            table.to_csv(args.output, index=False)
        return 0
    for name in args.names or [name for name in CASES if name not in LARGE]:
        table = rows(name, args.blocks, args.methods.split(",") if args.methods else "all")
        if table is None:
            continue
        say("\n".join(list(markdown(table))[2:]))
        if args.output:
            merged(args.output, table).to_csv(args.output, index=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
