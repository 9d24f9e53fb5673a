"""Table of the bodies that fight back: how well each unfolds, and whether that is proved.

It stands in docs/results/fight-back.md.

    python tests/benchmarks/fight_back.py [NAME ...] [-o TABLE.md]

Figures against the exact truth: epsilon(W, Y) (thesis, equation 2.4) beside what doing nothing
would score; RMS distance after the best proper rotation and mean error of the stratigraphic
coordinate, in sides of a mean block; strain: root mean square over the edges of the flattened mid
surface, which no flattening avoids on bodies folded twice; proved: the certificate's word;
CPU seconds of the unfolding, and the share of its wall time that the certificate took.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import geounfold as gu
from geounfold.synthetic import CASES

LARGE = ("large", "thin_wide")
COLUMNS = (
    *("body", "blocks", "doing nothing", "epsilon(W, Y)", "RMS, blocks", "horizons, blocks"),
    *("strain", "proved", "rung", "CPU s", "proof"),
)
HEAD = f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}"


def row(name):
    """Return one body's line of the table."""
    body = gu.simulate(name)
    side = float(np.prod(body.steps) ** (1 / 3))
    nothing = gu.epsilon(body.truth, body.folded).mean()
    start = time.process_time()
    try:
        u = gu.unfold(body.folded)
    except gu.GeounfoldError as error:
        seconds = time.process_time() - start
        return (
            f"| {name} | {len(body.folded):,} | {nothing:.4f} | {type(error).__name__}: {error} "
            f"| | | | | | {seconds:.1f} | |"
        )
    seconds = time.process_time() - start
    epsilon = gu.epsilon(body.truth, u.points).mean()
    rms = gu.aligned_rms(u.points, body.truth) / side
    off = np.abs(u.stratigraphic - body.stratigraphic) * (body.top - body.bottom) / side
    fit = u.fits[0]
    strain = fit.flattenings["mid"].edge_error[-1]
    share = u.seconds["certificate"] / sum(u.seconds.values())
    proved = "yes" if u.certificate.injective else "**no**"
    return (
        f"| {name} | {len(body.folded):,} | {nothing:.4f} | {epsilon:.5f} | {rms:.3f} "
        f"| {off.mean():.3f} | {strain:.4f} | {proved} | {fit.notes['rung']} | {seconds:.1f} "
        f"| {share:.0%} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=[n for n in CASES if n not in LARGE])
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    lines = [HEAD]
    sys.stdout.write(HEAD + "\n")
    for name in args.names:
        lines.append(row(name))
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    if args.output:
        args.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
