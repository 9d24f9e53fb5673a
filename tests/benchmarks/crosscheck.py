"""Table of the cross-check of meshes over the public bodies.

    python tests/benchmarks/crosscheck.py [NAME ...] [-o TABLE.csv] [--width W]

Each body is unfolded, and its control mesh checked against fTetWild's and TetGen's of the same
border; lengths are in blocks.  Columns are those of `geounfold crosscheck`, a few left out, and

  developable   whether an exact flattening exists
  rms_truth     RMS distance of our map's places from the truth, after the best proper rotation
  rms_truth_places   of the places that the other mesh gives

Bodies already in the table are skipped, so that a stopped run continues.  `--width` cuts simulated
bodies short along the fold axis, to a dozen blocks at least, which saves time and leaves their
folds as they are; not those with an outline of their own.  Names are those of the simulated bodies,
and of the acceptance bodies with `accept/` before them, where these are present.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.io import read_points
from geounfold.synthetic import CASES

TRUE = ("true_x", "true_y", "true_z")
LEFT_OUT = ["boundary_volume", "worst_x", "worst_y", "worst_z"]


def load(name, shared, width):
    """Return folded points, truth or None, and whether the body is developable."""
    kind, _, case = name.rpartition("/")
    if not kind:
        spec = CASES[case]
        wide = width is not None and spec.width > width >= 12 * spec.steps[1] and not spec.outline
        body = gu.simulate(case, **({"width": width} if wide else {}))
        return body.folded, body.truth, body.developable
    folder = shared / "acceptance" / "cases"
    index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    path = folder / f"{case}.csv"
    folded = read_points(str(path)).points
    frame = pd.read_csv(path)
    truth = frame[list(TRUE)].to_numpy() if set(TRUE) <= set(frame.columns) else None
    return folded, truth, bool(index[case].get("developable", False))


def rows(name, shared, width, seconds):
    """Return one body's rows."""
    folded, truth, developable = load(name, shared, width)
    facts = {"body": name, "blocks_given": len(folded), "developable": developable}
    try:
        u = gu.unfold(folded)
    except gu.GeounfoldError as error:
        return pd.DataFrame([{**facts, "error": f"not unfolded: {type(error).__name__}"}])
    check = gu.crosscheck(u, seconds=seconds)
    table = check.table.drop(columns=LEFT_OUT, errors="ignore")
    for at, (key, value) in enumerate(facts.items()):
        table.insert(at, key, value)
    table["hull_volume"] = check.hull_volume
    if truth is not None:
        table["rms_truth"] = gu.aligned_rms(u.points, truth) / check.block
        places = table["mesh"] + "_" + table["interior"]
        table["rms_truth_places"] = [_rms(check, key, truth) for key in places]
    return table


def _rms(check, key, truth):
    if key not in check.points:
        return np.nan
    known = np.isfinite(check.points[key]).all(axis=1)
    return gu.aligned_rms(check.points[key][known], truth[known]) / check.block


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--width", type=float, help="of simulated bodies, along the fold axis")
    parser.add_argument("--shared", type=Path, default=Path("../shared"))
    parser.add_argument("--seconds", type=float, default=600.0, help="per mesher")
    args = parser.parse_args()
    index = args.shared / "acceptance" / "cases" / "index.json"
    accept = json.loads(index.read_text(encoding="utf-8")) if index.exists() else {}
    names = args.names or [*(f"accept/{name}" for name in accept), *CASES]
    done = pd.DataFrame({"body": []})
    if args.output and args.output.exists():
        done = pd.read_csv(args.output)
    for name in names:
        if name in set(done["body"]):
            continue
        found = rows(name, args.shared, args.width, args.seconds)
        shown = [c for c in ("mesh", "interior", "volume_difference", "rms", "error") if c in found]
        sys.stdout.write(f"{name}\n{found[shown].to_string(index=False)}\n")
        sys.stdout.flush()
        done = pd.concat([done, found], ignore_index=True)
        if args.output:
            done.to_csv(args.output, index=False, float_format="%.5g")
    return 0


if __name__ == "__main__":
    sys.exit(main())
