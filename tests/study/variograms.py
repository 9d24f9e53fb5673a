"""The automatic variogram against the true model: simulated grades in both spaces.

    python tests/study/variograms.py [--sets 50] [--first 0] [-o data/variograms.csv]

A set is a simulated body, drilled, and a random field of known covariance: stationary in the true
flat space of the body, or in the folded one. From set to set change the body, the kind, the ranges
(60 to 200 m along, one or two in the layer, 12 to 40 m across), the nugget (0, 30, 60 %), the
spacing (40, 50, 60 m) and the distribution (normal, lognormal). Blocks drawn from the body are
kriged with the model of each way of fitting, and with the true covariance: 24 nearest samples, no
more than 6 of a hole. The truth of a block has no nugget. A row's share is the RMSE with the true
covariance over that with the fit.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.estimation import Neighbourhood, Variogram, fit_variogram, hole_numbers
from geounfold.estimation.neighbourhood import Search
from geounfold.estimation.variogram import correlation
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic import PATTERNS, GradeField, drill

BODIES = ("steep", "sim_case_2", "plunging", "box", "swelling", "recumbent")
KINDS = ("spherical", "exponential", "gaussian")
NUGGETS = (0.0, 0.3, 0.6)
SPACINGS = (60, 50, 40)
SPACES = ("unfolded", "folded")
WAYS = {
    "likelihood": {},
    "near lags": {"weights": "near", "scores": True},
    "cressie": {"weights": "cressie", "scores": True},
}
TARGETS, COMPOSITE = 500, 6.0
NEAREST, PER_HOLE = 24, 6
SPREAD = 0.8  # deviation of the logarithms of lognormal grades
OUTPUT = Path("data/variograms.csv")


class Truth:
    """A field with a nugget, normal or lognormal, and its exact covariance.

    Parameters
    ----------
    number : int
        Of the set; everything follows from it.
    """

    def __init__(self, number: int) -> None:
        rng = np.random.default_rng(1000 + number)
        along = float(rng.uniform(60, 200))
        ratio = (1.0, 1.0, 2.0)[int(rng.integers(3))]
        self.ranges = (along, along / ratio, float(rng.uniform(12, 40)))
        self.bearing = float(rng.uniform(0, 180))
        self.kind = KINDS[number % 3]
        self.nugget = NUGGETS[number // 3 % 3]
        self.lognormal = number % 2 == 1
        self.axes = rotation_from_angles(self.bearing, 0.0, 0.0)
        self.field = GradeField(self.kind, self.ranges, seed=number)
        self.seed = number

    def at(self, points, *, noise: bool):
        """Return grades at points; without noise, their means over the nugget."""
        smooth = np.sqrt(1 - self.nugget) * self.field.standard(points @ self.axes.T)
        if noise:
            draw = np.random.default_rng(self.seed).normal(size=len(points))
            z, variance = smooth + np.sqrt(self.nugget) * draw, 1.0
        else:
            z, variance = smooth, 1 - self.nugget
        if not self.lognormal:
            return z
        return np.exp(SPREAD * z - 0.5 * SPREAD**2 * variance)

    def covariance(self, gaps):
        """Return the covariance of grades at separations (n, 3), the nugget left out."""
        rho = correlation(self.kind, np.linalg.norm(gaps @ self.axes.T / self.ranges, axis=1))
        rho = (1 - self.nugget) * rho
        return np.expm1(SPREAD**2 * rho) if self.lognormal else rho

    @property
    def sill(self) -> float:
        """Variance of the grades."""
        return float(np.expm1(SPREAD**2)) if self.lognormal else 1.0


def kriged(points, values, holes, targets, rule):
    """Return ordinary kriging estimates; rule: covariance, sill, ranges and rotation."""
    covariance, sill, ranges, rotation = rule
    radii = 4 * np.linalg.norm(np.ptp(points, axis=0)) * np.array(ranges) / min(ranges)
    near = Neighbourhood(
        radii=tuple(radii), rotation=rotation, min_samples=1,
        max_samples=NEAREST, max_per_hole=PER_HOLE,
    )  # fmt: skip
    found = Search(points, holes, near).find(targets)
    most = found.rows.shape[1]
    used = np.arange(most) < found.counts[:, None]
    places = points[found.rows]
    gaps = (places[:, :, None] - places[:, None]).reshape(-1, 3)
    C = covariance(gaps).reshape(len(targets), most, most)
    C = np.where(used[:, :, None] & used[:, None], C, 0.0)
    diagonal = np.where(used, sill * (1 + 1e-6), 1.0)
    C[:, np.arange(most), np.arange(most)] = diagonal
    c = covariance((places - targets[:, None]).reshape(-1, 3)).reshape(len(targets), most)
    sides = np.stack([np.where(used, c, 0.0), used.astype(float)], axis=2)
    solved = np.linalg.solve(C, sides)
    total = solved.sum(axis=1)
    weights = solved[:, :, 0] + solved[:, :, 1] * ((1 - total[:, 0]) / total[:, 1])[:, None]
    return (weights * values[found.rows]).sum(axis=1)


def by_model(model: Variogram):
    """Return the rule of a fitted model."""
    plain = model.sill - model.nugget
    ranges = model.reach if model.structures else (1.0, 1.0, 1.0)

    def covariance(gaps):
        gamma = model.gamma(gaps)
        return np.where((gaps == 0).all(axis=1), plain, model.sill - gamma)

    return covariance, model.sill, ranges, model.rotation


def run(number: int, ways=WAYS, spaces=SPACES) -> list[dict]:
    """Return the rows of a set."""
    truth = Truth(number)
    name, spacing = BODIES[number % len(BODIES)], SPACINGS[number // 9 % 3]
    body = gu.simulate(name)
    pattern = PATTERNS[number % len(PATTERNS)]
    tables = drill(body, truth.field, spacing, pattern=pattern, seed=number, interval=COMPOSITE / 2)
    samples = gu.read_drillholes(*tables).samples(COMPOSITE)
    folded = samples[["x", "y", "z"]].to_numpy()
    flat, there = body.sheet.unfold(folded)
    holes = hole_numbers(samples["hole"].to_numpy()[there])
    some = np.random.default_rng(number).choice(len(body.folded), TARGETS, replace=False)
    places = {
        "unfolded": (flat[there], body.truth[some]),
        "folded": (folded[there], body.folded[some]),
    }
    rows = []
    for space in spaces:
        points, targets = places[space]
        values, true = truth.at(points, noise=True), truth.at(targets, noise=False)
        exact = truth.covariance, truth.sill, truth.ranges, (truth.bearing, 0.0, 0.0)
        best = kriged(points, values, holes, targets, exact)
        for way, how in ways.items():
            start = time.process_time()
            fitted = fit_variogram(points, values, holes=holes, **how)
            seconds = time.process_time() - start
            model = fitted.model
            got = kriged(points, values, holes, targets, by_model(model))
            errors = [float(np.sqrt(((e - true) ** 2).mean())) for e in (best, got)]
            rows.append({
                "set": number, "space": space, "way": way, "body": name, "kind": truth.kind,
                "nugget": truth.nugget, "lognormal": truth.lognormal, "spacing": spacing,
                "along": truth.ranges[0], "ratio": truth.ranges[0] / truth.ranges[1],
                "across": truth.ranges[2], "samples": len(values), "holes": int(holes.max()) + 1,
                "rmse_true": errors[0], "rmse_fit": errors[1], "share": errors[0] / errors[1],
                "fitted": "+".join(s.kind for s in model.structures),
                "anisotropy": fitted.anisotropy, "fitted_nugget": model.nugget / model.sill,
                "fitted_along": model.ranges[0], "fitted_across": model.ranges[2],
                "bounds": len(fitted.bounds), "seconds": seconds,
            })  # fmt: skip
    return rows


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Return median, mean and worst share by way and space, and the share of all errors."""
    grouped = rows.groupby(["way", "space"], sort=False)
    out = grouped["share"].agg(["median", "mean", "min"])
    out["overall"] = grouped["rmse_true"].apply(lambda r: float(np.sqrt((r**2).mean())))
    out["overall"] /= grouped["rmse_fit"].apply(lambda r: float(np.sqrt((r**2).mean())))
    out["below .93"] = grouped["share"].apply(lambda s: int((s < 0.93).sum()))
    out["bounds hit"] = grouped["bounds"].sum()
    return out.reset_index()


def markdown(found: pd.DataFrame) -> list[str]:
    """Return the rows of `table` as lines of a page."""
    head = ["fit", "space", "median", "mean", "worst", "all errors", "sets below 0.93"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in found.itertuples(index=False):
        way, space, *shares, below, _ = row
        cells = [way, space, *(f"{share:.3f}" for share in shares), str(below)]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def main(argv=None) -> int:
    """Compute the sets that are not in the output."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--ways", nargs="+", default=list(WAYS), choices=list(WAYS))
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    args = parser.parse_args(argv)
    rows = pd.read_csv(args.output) if args.output.exists() else pd.DataFrame()
    done = set(rows["set"]) if len(rows) else set()
    ways = {way: WAYS[way] for way in args.ways}
    for number in range(args.first, args.first + args.sets):
        if number in done:
            continue
        rows = pd.concat([rows, pd.DataFrame(run(number, ways))], ignore_index=True)
        rows.to_csv(args.output, index=False, float_format="%.5g", lineterminator="\n")
        last = rows[(rows["set"] == number) & (rows["way"] == args.ways[0])]
        sys.stdout.write(f"{number}: {last['share'].round(3).tolist()}\n")
        sys.stdout.flush()
    sys.stdout.write("\n".join(markdown(table(rows))) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
