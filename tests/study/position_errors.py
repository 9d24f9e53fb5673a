"""What the kriging variance's interval of 90 % holds, with and without the error of places.

    python tests/study/position_errors.py [--seeds 1] [--bodies NAME ...] [-o FILE.csv]

Bodies of the study with noise of 0.2 block sides, and oblique rims.  Grades are simulated in the
true flat space, normal ones, and kriged at blocks in true coordinates, in
unfolded ones, and in unfolded ones with the variogram blurred by the uncertainty of the unfolding.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.estimation import Neighbourhood, fit_variogram, hole_numbers, krige
from geounfold.estimation.position_error import with_position_error
from geounfold.synthetic import PATTERNS, GradeField, drill

BODIES = {
    "plunging": {"noise": 0.2},
    "steep": {"noise": 0.2},
    "swelling": {"noise": 0.2},
    "oblique_rims": {},
}
FIELDS = ("rough", "smooth")
RANGES = (200.0, 200.0, 25.0)
COMPOSITE = 4.0
TARGETS, FITTED = 600, 700  # blocks; most samples of the fit
NEAREST, PER_HOLE = 24, 6
SPACINGS = (50, 100)
NINETY = 1.6448536  # standard deviations that hold 90 % of normal errors


def field_of(kind: str, seed: int) -> GradeField:
    """Return a field of normal grades: spherical or exponential, or gaussian."""
    if kind == "smooth":
        return GradeField("gaussian", RANGES, seed=1000 + seed, mean=1.0, deviation=0.4)
    model = ("spherical", "exponential")[seed % 2]
    return GradeField(model, RANGES, seed=seed, mean=1.0, deviation=0.4)


def some_holes(holes: np.ndarray, most: int, seed: int) -> np.ndarray:
    """Return rows of whole holes, drawn until there would be more than so many."""
    order = np.random.default_rng(seed).permutation(np.unique(holes))
    count = np.cumsum(np.bincount(holes)[order])
    chosen = order[: max(2, int(np.searchsorted(count, most, side="right")))]
    return np.flatnonzero(np.isin(holes, chosen))


def neighbourhood(model, points) -> Neighbourhood:
    """Return the search: everything within reach, the nearest in units of the ranges first."""
    ranges = np.array(model.ranges) if model.structures else np.ones(3)
    radii = 2 * np.linalg.norm(np.ptp(points, axis=0)) * ranges / ranges.min()
    return Neighbourhood(
        radii=tuple(radii),
        rotation=model.rotation,
        min_samples=1,
        max_samples=NEAREST,
        max_per_hole=PER_HOLE,
    )


def held(name: str, seed: int, spacing: int, kind: str, u: gu.Unfolding, body) -> list[dict]:
    """Return a row per arm: the share of true grades in the interval, and the error."""
    field = field_of(kind, seed)
    pattern = PATTERNS[seed % len(PATTERNS)]
    tables = drill(body, field, spacing, pattern=pattern, seed=seed, interval=COMPOSITE / 2)
    samples = gu.read_drillholes(*tables).samples(COMPOSITE)
    folded = samples[["x", "y", "z"]].to_numpy()
    (true, there), flat = body.sheet.unfold(folded), u.to_flat(folded)
    kept = there & np.isfinite(flat).all(axis=1)
    true, flat, values = true[kept], flat[kept], samples["grade"].to_numpy()[kept]
    holes = hole_numbers(samples["hole"].to_numpy()[kept])
    placed = np.flatnonzero(u.carried.placed)
    drawn = np.random.default_rng(seed).choice(placed, TARGETS, replace=False)
    truth = field.at(body.truth[drawn], body.stratigraphic[drawn])
    rows = some_holes(holes, FITTED, seed)
    models = [fit_variogram(P[rows], values[rows], holes=holes[rows]).model for P in (true, flat)]
    blurred = with_position_error(models[1], *u.uncertainty.mean)
    out = []
    for arm, points, targets, model in (
        ("truth", true, body.truth[drawn], models[0]),
        ("unfolded", flat, u.points[drawn], models[1]),
        ("blurred", flat, u.points[drawn], blurred),
    ):
        found = krige(points, values, targets, model, neighbourhood(model, points), holes=holes)
        off = np.abs(found.estimate - truth)
        known = np.isfinite(off)
        inside = off[known] <= NINETY * np.sqrt(found.variance[known])
        out.append(
            {
                "body": name,
                "seed": seed,
                "spacing": spacing,
                "field": kind,
                "arm": arm,
                "held": float(inside.mean()),
                "rmse": float(np.sqrt((off[known] ** 2).mean())),
            }
        )
    return out


def main(argv=None) -> int:
    """Compute all rows and print the means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--bodies", nargs="+", default=list(BODIES))
    parser.add_argument("-o", "--output", type=Path, default=Path("data/position_error.csv"))
    args = parser.parse_args(argv)
    for name in args.bodies:
        rows: list[dict] = []
        body = gu.simulate(name, **BODIES[name])
        u = gu.unfold(body.folded, uncertainty=8)
        for seed in range(args.seeds):
            for spacing in SPACINGS:
                for kind in FIELDS:
                    rows += held(name, seed, spacing, kind, u, body)
        table = pd.DataFrame(rows).round(4)
        if args.output.exists():
            before = pd.read_csv(args.output)
            table = pd.concat([before[before.body != name], table])
        table.to_csv(args.output, index=False, lineterminator="\n")
    means = table.pivot_table(index="body", columns="arm", values=["held", "rmse"], margins=True)
    sys.stdout.write(means.round(3).to_string() + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
