"""Write the blocks of a simulated body, without its truth, for the benchmark.

    python make_body.py CASE OUT.csv [--blocks N]

Prints the number of blocks.  It runs as a process of its own, so that the memory it takes
is not counted for the process that measures (a child's peak includes its parent's).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def main(argv: list[str] | None = None) -> int:
    """Write one body; return the exit status."""
    parser = argparse.ArgumentParser(description="blocks of a simulated body")
    parser.add_argument("case")
    parser.add_argument("out", type=Path)
    parser.add_argument("--blocks", type=int)
    args = parser.parse_args(argv)

    from geounfold.synthetic import simulate

    body = simulate(args.case, blocks=args.blocks)
    body.frame(4).iloc[:, :3].to_csv(args.out, index=False)
    sys.stdout.write(f"{len(body.folded)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
