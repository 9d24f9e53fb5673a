"""Does it pay? Kriging in folded, stratigraphic, unfolded and true coordinates, against the truth.

    python tests/study/study.py [--seeds 2] [--bodies NAME ...] [--spacings 25 50 100]
                                [--ranges 60 120 200] [--nuggets 0 0.3 0.6] [-o data/study.csv]

Grades with nugget are simulated in the true flat space of a simulated body, drilled in the folded
one, and estimated at blocks drawn from it, in arms that differ by nothing but the coordinates:

  isotropic      folded coordinates, one range
  plane          folded coordinates, one plane of anisotropy, found from the samples: of the mean
                 plane of their places and the two along which grades are most alike, the one of the
                 likeliest variogram
  plane_truth    the same planes and the layer's mean plane; the truth chooses, as no user could
  limbs          domains of like dip of the layer, each with its own plane, none uses another's
                 samples
  stratigraphic  x, y, and the height in the layer times the mean thickness
  rebuilt        unfolded from a body that is rebuilt from the holes; none if it foretells badly
  geounfold      unfolded from the blocks, with the defaults
  truth          the true flat coordinates: the ceiling

Errors are those of the grade without its nugget, as a block has it; `cv_rmse` is the error at the
samples of left-out holes, nugget and all. Every arm has the same samples, the same automatic fit of
a variogram (to the same whole holes, some 400 samples), and the 24 nearest samples in units of the
ranges, no more than 6 of a hole. Seeds alternate between normal grades (standard deviation 0.4 of
the mean) and lognormal ones (1 of the mean). An arm of locally varying anisotropy is left out: of
the kept libraries gstlearn has variograms whose angles vary, but no search that follows them.

`foretold_...` are the gains that `gu.assess` foretells from the same samples. Rows that are in the
output already are not computed again.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.estimation import hole_numbers, score
from geounfold.gain.arms import Places, mean_normal, places_of, thickness_of
from geounfold.gain.assessment import RIVALS, assessed
from geounfold.gain.trial import Trial, Tried, whole_holes
from geounfold.synthetic import GradeField, drill
from geounfold.synthetic.faulted import simulate_faulted

BODIES = {
    "sim_case_1": ("gently flexed", "vertical"),
    "recumbent": ("tight", "inclined"),
    "refolded_tight": ("doubly curved", "vertical"),
    "domino": ("faulted", "vertical"),
}
SPACINGS, RANGES, NUGGETS = (25, 50, 100), (60, 120, 200), (0.0, 0.3, 0.6)
ARMS = (
    *("isotropic", "plane", "plane_truth", "limbs", "stratigraphic", "rebuilt", "geounfold"),
    "truth",
)
KEY = ["body", "spacing", "range", "nugget", "seed"]

THINNER = 8  # range along the layer over that across it
COMPOSITE = 4.0
TARGETS, CHECKED, FITTED = 300, 150, 400  # blocks; samples of cross-validation and of the fit


@dataclass(frozen=True)
class Grades:
    """Grades at places of the true flat space: a field and nugget."""

    reach: float
    nugget: float
    seed: int

    @property
    def lognormal(self) -> bool:
        return self.seed % 2 == 1

    @cached_property
    def field(self) -> GradeField:
        kind = ("spherical", "exponential")[self.seed // 2 % 2]
        reach = (self.reach, self.reach, self.reach / THINNER)
        return GradeField(kind, reach, seed=self.seed + round(7 * self.reach))

    def at(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the grades of samples, and those of blocks, without nugget."""
        share = 1 - self.nugget
        z = np.sqrt(share) * self.field.standard(places)
        e = np.sqrt(self.nugget) * np.random.default_rng(self.seed).normal(size=len(z))
        if not self.lognormal:
            return 1 + 0.4 * (z + e), 1 + 0.4 * z
        s = np.sqrt(np.log(2.0))  # a standard deviation of 1 of the mean
        return np.exp(s * (z + e) - s**2 / 2), np.exp(s * z - share * s**2 / 2)


@dataclass(frozen=True, eq=False)
class Drilled:
    """One body and its holes: places of samples and targets in all coordinates."""

    name: str
    spacing: int
    holes: np.ndarray
    own: Places
    targets: Places
    true: np.ndarray  # of samples
    true_targets: np.ndarray
    rebuilt: tuple[np.ndarray, np.ndarray] | None


def drilled(name: str, spacing: int) -> Drilled:
    """Return a body's samples and targets."""
    if name == "domino":
        return _faulted(name, spacing)
    body = gu.simulate(name)
    field = GradeField("spherical", (100.0, 100.0, 10.0), seed=0)
    how = {"pattern": BODIES[name][1], "seed": spacing, "interval": COMPOSITE / 2}
    samples = gu.read_drillholes(*drill(body, field, spacing, **how)).samples(COMPOSITE)
    folded = samples[["x", "y", "z"]].to_numpy()
    true, there = body.sheet.unfold(folded)
    holes = samples["hole"].to_numpy()
    rows = np.random.default_rng(spacing).choice(len(body.folded), TARGETS, replace=False)
    u = gu.unfold(body.folded)
    rebuilt = None
    try:
        made = gu.body_from_holes(*drill(body, field, spacing, waste=True, **how), code="ORE")
        if made.error is None or made.error > 0.5:  # of which a warning tells the user
            raise gu.InputError("left-out holes are foretold badly")
        again = gu.unfold(made.points).map
        rebuilt = again.to_flat(folded), again.to_flat(body.folded[rows])
    except gu.GeounfoldError as error:
        sys.stdout.write(f"{name} {spacing}: not rebuilt: {error}\n")
    return _placed(name, spacing, u, (folded, true, there, holes), (body, rows), rebuilt)


def _faulted(name: str, spacing: int) -> Drilled:
    """Return the same of a faulted body, whose samples are blocks in columns."""
    body = simulate_faulted(name)
    X, step = body.folded, spacing / body.step
    column = (X[:, :2] - X[:, :2].min(axis=0)) / body.step
    number = np.floor(column / step + 1e-9)
    middle = np.floor((number + 0.5) * step)
    own = (np.abs(column - middle) < 0.51).all(axis=1)
    holes = np.array([f"{a:.0f}-{b:.0f}" for a, b in middle[own]], dtype=object)
    rest = np.flatnonzero(~own)
    rows = np.random.default_rng(spacing).choice(rest, min(TARGETS, len(rest)), replace=False)
    u = gu.unfold(X, faults=body.surfaces)
    there = np.ones(int(own.sum()), dtype=bool)
    return _placed(name, spacing, u, (X[own], body.truth[own], there, holes), (body, rows), None)


def _placed(name, spacing, u, samples, targets, rebuilt) -> Drilled:
    """Return the places of samples and targets that the map reaches."""
    folded, true, there, holes = samples
    body, rows = targets
    own, reached = places_of(u.map, folded[there])
    kept = np.flatnonzero(there)[reached]
    far, met = places_of(u.map, body.folded[rows])
    if rebuilt is not None:
        rebuilt = rebuilt[0][kept], rebuilt[1][met]
    return Drilled(
        name, spacing, hole_numbers(holes[kept]), own, far, true[kept], body.truth[rows][met],
        rebuilt,
    )  # fmt: skip


def arms_of(drawn: Drilled, trial: Trial, block: np.ndarray) -> dict[str, Tried]:
    """Return the estimates of every arm."""
    own, far = drawn.own, drawn.targets
    planes = trial.planes(own, far, drawn.spacing)
    every = [*planes, trial.turned(own, far, mean_normal(own.normal))]
    thickness, level = thickness_of(own), {"anisotropy": "transverse"}
    out = {
        "isotropic": trial.run(own.folded, far.folded, anisotropy="isotropic"),
        "plane": min(planes, key=lambda tried: tried.value),
        "plane_truth": min(every, key=lambda tried: score(block, tried.found).rmse),
        "limbs": trial.limbs(own, far),
        "stratigraphic": trial.run(
            own.stratigraphic(thickness), far.stratigraphic(thickness), **level
        ),
        "geounfold": trial.run(own.flat, far.flat, **level),
        "truth": trial.run(drawn.true, drawn.true_targets, **level),
    }
    if drawn.rebuilt is not None:
        out["rebuilt"] = trial.run(*drawn.rebuilt, **level)
    return out


def run(drawn: Drilled, reach: float, nugget: float, seed: int) -> list[dict]:
    """Return the rows of one cell, one for each arm."""
    grades = Grades(reach, nugget, seed)
    values, _ = grades.at(drawn.true)
    _, block = grades.at(drawn.true_targets)
    trial = Trial(
        values, drawn.holes, whole_holes(drawn.holes, FITTED, seed),
        whole_holes(drawn.holes, CHECKED, seed + 1),
    )  # fmt: skip
    found = arms_of(drawn, trial, block)
    told = assessed(drawn.own, drawn.holes, values, drawn.targets, found["geounfold"].model, None)
    cell = {
        **dict(zip(KEY, (drawn.name, drawn.spacing, reach, nugget, seed), strict=True)),
        "lognormal": grades.lognormal,
        "holes": int(drawn.holes.max()) + 1,
        "samples": len(values),
        "turn_in_range": told.turn_in_range,
        "turn_in_spacing": told.turn_in_spacing,
        "off_plane": told.off_plane,
        **{f"foretold_{name}": told.gains.loc[name, "gain"] for name in RIVALS},
    }
    rows = []
    there = np.isfinite(np.column_stack([tried.found for tried in found.values()])).all(axis=1)
    for arm in ARMS:
        if arm not in found:
            continue
        tried, model = found[arm], found[arm].model
        got = score(block[there], tried.found[there])
        rows.append(
            {
                **cell, "arm": arm, "rmse": got.rmse, "bias": got.bias, "slope": got.slope,
                "correlation": got.correlation, "missing": int((~there).sum()),
                "cv_rmse": trial.error(tried), "range_along": model.ranges[0],
                "range_across": model.ranges[2], "fitted_nugget": model.nugget / model.sill,
            }
        )  # fmt: skip
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
    table = table.sort_values([*KEY, "arm"], key=lambda c: c.map(order) if c.name == "arm" else c)
    part = path.with_suffix(".part")
    table.to_csv(part, index=False, lineterminator="\n")
    part.replace(path)


def main(argv=None) -> int:
    """Compute the rows that are not in the output."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--bodies", nargs="+", default=list(BODIES))
    parser.add_argument("--spacings", type=int, nargs="+", default=list(SPACINGS))
    parser.add_argument("--ranges", type=float, nargs="+", default=list(RANGES))
    parser.add_argument("--nuggets", type=float, nargs="+", default=list(NUGGETS))
    parser.add_argument("-o", "--output", type=Path, default=Path("data/study.csv"))
    args = parser.parse_args(argv)
    table = pd.read_csv(args.output) if args.output.exists() else pd.DataFrame()
    done = set(zip(*(table[k] for k in KEY), strict=True)) if len(table) else set()
    tasks = [
        (b, d, r, n, s) for s in range(args.seeds) for b in args.bodies for d in args.spacings
        for r in args.ranges for n in args.nuggets if (b, d, r, n, s) not in done
    ]  # fmt: skip
    # In a drawn order, so that a run that is stopped has some of everything.
    tasks = [tasks[k] for k in np.random.default_rng(0).permutation(len(tasks))]
    sys.stdout.write(f"{len(tasks)} runs to do, {len(done)} done\n")
    start, places = time.process_time(), {}
    for number, (name, spacing, *cell) in enumerate(tasks, 1):
        if (name, spacing) not in places:
            places[name, spacing] = drilled(name, spacing)
        table = pd.concat([table, rounded(run(places[name, spacing], *cell))], ignore_index=True)
        if number % 9 == 0 or number == len(tasks):
            write(args.output, table)
            seconds = time.process_time() - start
            sys.stdout.write(f"{number} of {len(tasks)} in {seconds:.0f} s\n")
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
