"""Does taking faults out pay? Kriging of faulted bodies in seven kinds of coordinates.

    python tests/study/fault_gain.py [--seeds 4] [--bodies NAME ...] [--spacings 8 12]
                                     [-o data/fault_gain.csv] [--page docs/results/faults.md]

Grades are simulated in the true flat space of a faulted body (spherical, range 250 along the
layer and 25 across it, variance 1, error of a sample 0.1), sampled along vertical holes some
blocks apart, and estimated at every fourth other block, in arms that differ by the coordinates:

  folded           folded coordinates, the best of ten settings of ranges, judged by the truth
  folded by block  the same, each fault block from its own samples
  one body         unfolded as one sheet, faults untold
  each alone       fault blocks unfolded, each estimated from its own samples
  rejoined         unfolded with fault surfaces: all blocks in one flat space
  true height      x and y of rejoined, moved onto the truth as a whole, with the true height: what
                   is lost between it and truth is lost by the joining
  truth            true flat coordinates: the ceiling

Every flat arm is kriged with the field's own variogram, every arm with the 24 nearest samples in
units of the ranges. Share of the possible gain: (folded - arm) / (folded - truth), of mean RMSE.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.errors import GeounfoldError, InputError
from geounfold.estimation import krige
from geounfold.estimation.variogram import Structure
from geounfold.quality.flat_truth import aligned_flat
from geounfold.synthetic import GradeField
from geounfold.synthetic.faulted import simulate_faulted

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "soak"))
from faults import into_page  # noqa: E402

BODIES = ("domino", "crossing", "strike_slip")
RANGES = (250.0, 250.0, 25.0)
NOISE = 0.1  # standard deviation of a sample's error
ARMS = (
    *("folded", "folded by block", "one body", "each alone", "rejoined", "true height", "truth"),
)
FOLDED = (
    *((60.0, 60.0, 60.0), (100.0, 100.0, 100.0), (150.0, 150.0, 150.0), (250.0, 250.0, 25.0)),
    *((150.0, 250.0, 60.0), (80.0, 250.0, 80.0), (120.0, 250.0, 40.0), (60.0, 250.0, 60.0)),
    *((100.0, 250.0, 100.0), (250.0, 250.0, 60.0)),
)
"""Ranges along x, y and z of the folded arms; the fold axes run along y."""
FEW = 3  # samples of a fault block below which it is estimated from all


def estimated(
    P: np.ndarray, z: np.ndarray, T: np.ndarray, ranges: tuple[float, float, float]
) -> np.ndarray:
    """Return estimates at targets T (m, 3) from samples at P (n, 3)."""
    model = gu.Variogram(NOISE**2, (Structure("spherical", 1.0, ranges),))
    far = 4 * float(np.linalg.norm(np.ptp(np.concatenate([P, T]), axis=0))) / min(ranges)
    near = gu.Neighbourhood(
        radii=tuple(far * r for r in ranges), min_samples=1, max_samples=min(24, len(z))
    )
    return krige(P, z, T, model, near).estimate


def by_block(
    P: np.ndarray,
    z: np.ndarray,
    T: np.ndarray,
    ranges: tuple[float, float, float],
    own: np.ndarray,
    of: np.ndarray,
) -> np.ndarray:
    """Return estimates from the samples of each target's own fault block."""
    out = np.empty(len(T))
    for block in np.unique(of):
        some = own == block if (own == block).sum() >= FEW else np.ones(len(own), bool)
        out[of == block] = estimated(P[some], z[some], T[of == block], ranges)
    return out


def run(name: str, spacing: int, seed: int, flat: dict[str, np.ndarray], block: np.ndarray) -> dict:
    """Return the RMSE of every arm, of one body, spacing and seed."""
    body = simulate_faulted(name)
    X = body.folded
    grade = GradeField("spherical", RANGES, seed=seed).at(body.truth, body.level)
    rng = np.random.default_rng([seed, spacing])
    column = np.floor((X[:, :2] - X[:, :2].min(axis=0)) / body.step + 0.5).astype(int)
    drilled = (column % spacing == rng.integers(spacing, size=2)).all(axis=1)
    S = np.flatnonzero(drilled)
    T = np.flatnonzero(~drilled)[::4]
    z = grade[S] + rng.normal(0, NOISE, len(S))

    def rmse(found: np.ndarray) -> float:
        return float(np.sqrt(np.mean((found - grade[T]) ** 2)))

    own, of = block[S], block[T]
    row = {
        "body": name, "spacing": spacing, "seed": seed, "samples": len(S),
        "folded": min(rmse(estimated(X[S], z, X[T], r)) for r in FOLDED),
        "folded by block": min(rmse(by_block(X[S], z, X[T], r, own, of)) for r in FOLDED),
    }  # fmt: skip
    Y = flat["rejoined"]
    row["each alone"] = rmse(by_block(Y[S], z, Y[T], RANGES, own, of))
    for arm in ("one body", "rejoined", "true height", "truth"):
        row[arm] = rmse(estimated(flat[arm][S], z, flat[arm][T], RANGES)) if arm in flat else np.nan
    return row


def coordinates(name: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return a body's flat coordinates by arm, and its fault blocks as found."""
    body = simulate_faulted(name)
    u = gu.unfold(body.folded, faults=body.surfaces)
    if not np.isfinite(u.points).all():
        raise InputError(f"{name}: blocks without flat coordinates cannot be compared")
    level = np.column_stack([aligned_flat(u.points, body.truth)[:, :2], body.truth[:, 2]])
    flat = {"truth": body.truth, "rejoined": u.points, "true height": level}
    try:
        one = gu.unfold(body.folded, body="all").points
    except GeounfoldError as error:
        sys.stdout.write(f"{name} as one body: {error}\n")
    else:
        if np.isfinite(one).all():
            flat["one body"] = one
    return flat, np.asarray(u.fault_block)


def share(means: pd.Series, arm: str) -> float:
    """Return the share of the possible gain that an arm reaches."""
    return float((means["folded"] - means[arm]) / (means["folded"] - means["truth"]))


def table_of(rows: pd.DataFrame) -> str:
    """Return mean RMSE by body and spacing, and shares of the possible gain."""
    shown = ("rejoined", "true height", "each alone")
    heads = ["body", "blocks between holes", *ARMS, *(f"share {arm}" for arm in shown)]
    lines = [heads, ["---"] * len(heads)]
    for (body, spacing), some in rows.groupby(["body", "spacing"], sort=False):
        means = some[list(ARMS)].mean()
        shares = [share(means, arm) for arm in shown]
        cells = ["-" if np.isnan(means[arm]) else f"{means[arm]:.3f}" for arm in ARMS]
        lines.append([str(body), str(spacing), *cells, *(f"{value:.2f}" for value in shares)])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def main(argv: list[str] | None = None) -> int:
    """Run; write the rows and the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--bodies", nargs="+", default=list(BODIES))
    parser.add_argument("--spacings", type=int, nargs="+", default=[8, 12])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "data" / "fault_gain.csv")
    parser.add_argument("--page", type=Path, help="put the table into this page")
    args = parser.parse_args(argv)
    rows = []
    for name in args.bodies:
        flat, block = coordinates(name)
        for spacing in args.spacings:
            for seed in range(args.seeds):
                rows.append(run(name, spacing, seed, flat, block))
                sys.stdout.write(f"{name} {spacing} {seed}\n")
                sys.stdout.flush()
    table = pd.DataFrame(rows)
    table.round(4).to_csv(args.output, index=False, lineterminator="\n")
    text = table_of(table)
    sys.stdout.write(f"{text}\n")
    if args.page:
        into_page(args.page, {"gain": text})
    return 0


if __name__ == "__main__":
    sys.exit(main())
