"""Does it pay? Kriging in folded, stratigraphic, unfolded and true coordinates, against the truth.

    python tests/study/study.py [--seeds 20] [--bodies NAME ...] [--spacings 25 50 100]
                                [--jobs 2] [-o data/study.csv]

Grades are simulated in the true flat space of a simulated body, drilled in the folded one, and
estimated at blocks drawn from it, in arms that differ by nothing but the coordinates:

  folded_isotropic  folded coordinates, one range
  folded_best       folded coordinates, the best of nine settings: one range; one range along and
                    one across planes that hold the fold axis and dip by -60, -30, 0, 30 or 60
                    degrees; three ranges at -30, 0 and 30. The true fold axis is given, and which
                    setting is best is judged by the truth: no user could do as well.
  stratigraphic     x, y, and the true height between bottom and top times the mean thickness
  geounfold         coordinates unfolded from the blocks, with the defaults
  truth             the true flat coordinates: the ceiling

An arm of locally varying anisotropy is left out: of the kept libraries gstlearn has variograms
whose angles vary, but no search that follows them, so neighbours would not be chosen alike.

Every arm has the same samples, the same automatic fit of a variogram (to the same samples, of
whole holes, at most 700), and the same neighbourhood: the 24 nearest in the measure of the fitted
ranges, no more than 6 of a hole. Rows that are in the output already are not computed again.
"""

from __future__ import annotations

import argparse
import multiprocessing as mp
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.estimation import (
    Neighbourhood,
    fit_variogram,
    grade_tonnage,
    hole_numbers,
    krige,
    score,
)
from geounfold.synthetic import PATTERNS, GradeField, drill

BODIES = ("sim_case_2", "plunging", "steep", "recumbent", "box", "swelling")
SPACINGS = (25, 50, 100)
FIELDS = ("rough", "smooth")
ARMS = ("folded_isotropic", "folded_best", "stratigraphic", "geounfold", "truth")
KEY = ["body", "spacing", "seed"]

RANGES = (200.0, 200.0, 25.0)
COMPOSITE = 4.0
TARGETS, CHECKED, FITTED = 600, 300, 700  # blocks; samples of cross-validation and of the fit
NEAREST, PER_HOLE = 24, 6
CUTOFFS = (0.5, 0.75, 0.9)  # quantiles of the true grades
TILTS = (-60.0, -30.0, 0.0, 30.0, 60.0)
LIFE = 4  # runs of a process: gstlearn keeps memory of what it solves


def field_of(name: str, seed: int) -> GradeField:
    """Return a field: rough ones are spherical or exponential, lognormal or not, layered or not."""
    if name == "smooth":
        return GradeField("gaussian", RANGES, seed=1000 + seed, mean=1.0, deviation=0.4)
    return GradeField(
        ("spherical", "exponential")[seed % 2],
        RANGES,
        seed=seed,
        mean=1.0,
        deviation=0.4,
        lognormal=seed // 2 % 2 == 1,
        layers=(0.0, 0.4, 0.1, 0.3) if seed % 5 == 4 else (),
    )


def some_holes(holes: np.ndarray, most: int, seed: int) -> np.ndarray:
    """Return rows of whole holes, drawn until there would be more than so many."""
    order = np.random.default_rng(seed).permutation(np.unique(holes))
    count = np.cumsum(np.bincount(holes)[order])
    chosen = order[: max(2, int(np.searchsorted(count, most, side="right")))]
    return np.flatnonzero(np.isin(holes, chosen))


def neighbourhood(model, points) -> Neighbourhood:
    """Return the search: everything within reach, the nearest in units of the ranges first."""
    ranges = np.array(model.ranges) if model.structures else np.ones(3)
    extent = np.linalg.norm(np.ptp(points, axis=0))
    radii = 2 * extent * ranges / ranges.min()
    return Neighbourhood(
        radii=tuple(radii),
        rotation=model.rotation,
        min_samples=1,
        max_samples=NEAREST,
        max_per_hole=PER_HOLE,
    )


def settings(spec) -> list[dict]:
    """Return the nine settings of the folded space: how the variogram is fitted."""
    turned = [(spec.azimuth, spec.plunge, spec.tilt + t) for t in TILTS]
    return [
        {"anisotropy": "isotropic"},
        *({"anisotropy": "transverse", "rotation": r} for r in turned),
        *({"anisotropy": "orthotropic", "rotation": r} for r in turned[1:4]),
    ]


def estimated(points, values, holes, targets, fitted_rows, how) -> tuple:
    """Return estimates at targets, the model and the neighbourhood of one arm."""
    model = fit_variogram(points[fitted_rows], values[fitted_rows], **how).model
    near = neighbourhood(model, points)
    found = krige(points, values, targets, model, near, holes=holes)
    return found.estimate, model, near


def figures(truth, found, points, values, holes, model, near, checked) -> dict:
    """Return one arm's row of figures."""
    at_blocks = score(truth, found)
    rows = np.flatnonzero(np.isin(holes, holes[checked]))
    back = krige(
        points, values, points[rows], model, near, holes=holes, leave_out=holes[rows]
    ).estimate
    left_out = score(values[rows], back)
    cutoffs = np.quantile(truth, CUTOFFS)
    true, got = grade_tonnage(truth, cutoffs), grade_tonnage(found, cutoffs)
    row = {
        "rmse": at_blocks.rmse,
        "bias": at_blocks.bias,
        "slope": at_blocks.slope,
        "correlation": at_blocks.correlation,
        "missing": at_blocks.missing,
        "cv_rmse": left_out.rmse,
        "cv_bias": left_out.bias,
        "cv_slope": left_out.slope,
        "cv_correlation": left_out.correlation,
        "range_along": model.ranges[0],
        "range_across": model.ranges[2],
        "nugget": model.nugget / model.sill,
    }
    for q, a, b in zip(CUTOFFS, true.itertuples(), got.itertuples(), strict=True):
        row[f"tonnage_{q:g}"] = b.tonnage - a.tonnage
        row[f"metal_{q:g}"] = b.metal / a.metal - 1
    return row


def run(task: tuple) -> list[dict]:
    """Return the rows of one body, spacing and seed: both fields, every arm."""
    name, spacing, seed, path = task
    body, mapping = gu.simulate(name), gu.load(path)
    spec = body.sheet.spec
    pattern = PATTERNS[seed % len(PATTERNS)]
    drawn = np.random.default_rng(seed).choice(len(body.folded), TARGETS, replace=False)
    rows = []
    for field_name in FIELDS:
        field = field_of(field_name, seed)
        tables = drill(body, field, spacing, pattern=pattern, seed=seed, interval=COMPOSITE / 2)
        samples = gu.read_drillholes(*tables).samples(COMPOSITE)
        folded = samples[["x", "y", "z"]].to_numpy()
        true, there = body.sheet.unfold(folded)
        flat = mapping.to_flat(folded)
        kept = there & np.isfinite(flat).all(axis=1)
        folded, true, flat = folded[kept], true[kept], flat[kept]
        values = samples["grade"].to_numpy()[kept]
        holes = hole_numbers(samples["hole"].to_numpy()[kept])
        low, high = body.sheet.heights(true[:, 0], true[:, 1])
        thick = float((body.top - body.bottom).mean())
        level = thick * (true[:, 2] - low) / (high - low)
        truth = field.at(body.truth[drawn], body.stratigraphic[drawn])
        places = {
            "stratigraphic": (
                np.column_stack([folded[:, :2], level]),
                np.column_stack([body.folded[drawn, :2], thick * body.stratigraphic[drawn]]),
            ),
            "geounfold": (flat, mapping.to_flat(body.folded[drawn])),
            "truth": (true, body.truth[drawn]),
        }
        fitted = some_holes(holes, FITTED, seed)
        checked = some_holes(holes, CHECKED, seed + 1)
        arms = {}
        tries = [
            estimated(folded, values, holes, body.folded[drawn], fitted, how)
            for how in settings(spec)
        ]
        best = min(tries, key=lambda found: score(truth, found[0]).rmse)
        arms["folded_isotropic"] = (folded, *tries[0])
        arms["folded_best"] = (folded, *best)
        for arm, (points, targets) in places.items():
            arms[arm] = (points, *estimated(points, values, holes, targets, fitted, {}))
        for arm in ARMS:
            points, found, model, near = arms[arm]
            rows.append(
                {
                    **dict(zip(KEY, (name, spacing, seed), strict=True)),
                    "field": field_name,
                    "kind": field.kind,
                    "lognormal": field.lognormal,
                    "layered": bool(field.layers),
                    "pattern": pattern,
                    "holes": len(np.unique(holes)),
                    "samples": len(values),
                    "arm": arm,
                    **figures(truth, found, points, values, holes, model, near, checked),
                }
            )
    return rows


def rounded(rows: list[dict]) -> pd.DataFrame:
    """Return rows as a table, numbers to five digits."""
    table = pd.DataFrame(rows)
    for name in table.select_dtypes("float"):
        table[name] = [float(f"{v:.5g}") for v in table[name]]
    return table


def write(path: Path, table: pd.DataFrame) -> None:
    """Write the table whole, sorted."""
    order = {arm: k for k, arm in enumerate(ARMS)}
    table = table.sort_values(
        [*KEY, "field", "arm"], key=lambda c: c.map(order) if c.name == "arm" else c
    )
    part = path.with_suffix(".part")
    table.to_csv(part, index=False, lineterminator="\n")
    part.replace(path)


def main(argv=None) -> int:
    """Compute the rows that are not in the output."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--bodies", nargs="+", default=list(BODIES))
    parser.add_argument("--spacings", type=int, nargs="+", default=list(SPACINGS))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("-o", "--output", type=Path, default=Path("data/study.csv"))
    args = parser.parse_args(argv)
    table = pd.read_csv(args.output) if args.output.exists() else pd.DataFrame()
    done = set(zip(*(table[k] for k in KEY), strict=True)) if len(table) else set()
    tasks = [
        (b, d, s) for s in range(args.seeds) for b in args.bodies for d in args.spacings
        if (b, d, s) not in done
    ]  # fmt: skip
    sys.stdout.write(f"{len(tasks)} runs to do, {len(done)} done\n")
    if not tasks:
        return 0
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        maps = {name: str(Path(folder) / f"{name}.npz") for name in args.bodies}
        for name, path in maps.items():
            gu.unfold(gu.simulate(name).folded).save(path)
        with mp.get_context("spawn").Pool(args.jobs, maxtasksperchild=LIFE) as pool:
            jobs = [(*task, maps[task[0]]) for task in tasks]
            for number, rows in enumerate(pool.imap_unordered(run, jobs), 1):
                table = pd.concat([table, rounded(rows)], ignore_index=True)
                if number % 10 == 0 or number == len(jobs):
                    write(args.output, table)
                    seconds = time.perf_counter() - start
                    sys.stdout.write(f"{number} of {len(jobs)} in {seconds:.0f} s\n")
                    sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
