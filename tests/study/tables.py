"""Tables and figure of the study: errors by arm, gains and shares with their intervals.

    python tests/study/tables.py [data/study.csv] [-o docs/study.md]
                                 [--figure docs/assets/study.png] [--link assets/study.png]

Gain: 1 - RMSE(arm) / RMSE(folded_best). Share of the possible gain: what of the difference between
folded_best and truth an arm reaches. RMSEs are means over runs; between low and high lie 95 % of
2,000 means over seeds drawn with replacement (bootstrap over seeds, bodies and spacings kept).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

ARMS = ("folded_isotropic", "folded_best", "stratigraphic", "geounfold", "truth")
DRAWS = 2000
FIGURES = (
    *("rmse", "bias", "slope", "correlation", "cv_rmse", "cv_slope"),
    *("range_along", "range_across"),
)


def shares(rmse: dict[str, Any]) -> dict[str, Any]:
    """Return gain and share of the possible gain of arms, from mean RMSEs: numbers or arrays."""
    best, ceiling = rmse["folded_best"], rmse["truth"]
    out = {f"gain {arm}": 1 - rmse[arm] / best for arm in ("stratigraphic", "geounfold", "truth")}
    for arm in ("stratigraphic", "geounfold"):
        out[f"share {arm}"] = (best - rmse[arm]) / (best - ceiling)
    return out


def means(table: pd.DataFrame) -> dict[str, float]:
    """Return the mean RMSE of each arm."""
    return {arm: float(table.loc[table.arm == arm, "rmse"].mean()) for arm in ARMS}


def intervals(table: pd.DataFrame) -> pd.DataFrame:
    """Return each of `shares` with the bounds between which 95 % of its bootstrap draws lie."""
    sums = table.pivot_table(index="seed", columns="arm", values="rmse", aggfunc="sum")
    counts = table[table.arm == "truth"].groupby("seed").size().to_numpy()
    draw = np.random.default_rng(0).integers(0, len(sums), (DRAWS, len(sums)))
    drawn = {arm: sums[arm].to_numpy()[draw].sum(axis=1) / counts[draw].sum(axis=1) for arm in ARMS}
    rows = {
        name: (value, *np.quantile(shares(drawn)[name], [0.025, 0.975]))
        for name, value in shares(means(table)).items()
    }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "low", "high"])


def by_arm(table: pd.DataFrame) -> pd.DataFrame:
    """Return mean figures by field and arm; of errors of tonnage and metal the mean sizes."""
    frame = table.copy()
    errors = [c for c in frame if c.startswith(("tonnage_", "metal_"))]
    frame[errors] = frame[errors].abs()
    mean = frame.groupby(["field", "arm"])[[*FIGURES, *errors]].mean()
    return mean.reindex(pd.MultiIndex.from_product([sorted(frame.field.unique()), ARMS]))


def markdown(frame: pd.DataFrame, form: str = ".3f") -> str:
    """Return a table in Markdown."""
    head = ["", *map(str, frame.columns)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for name, row in frame.iterrows():
        label = ", ".join(map(str, name)) if isinstance(name, tuple) else str(name)
        lines.append("| " + " | ".join([label, *(f"{v:{form}}" for v in row)]) + " |")
    return "\n".join(lines) + "\n"


INTRODUCTION = """# Does it pay?

The study simulates grades in the true flat space of simulated bodies. It drills them in the
folded space (vertical, inclined and fanned holes), and kriges at blocks drawn from the body. The
arms differ by the coordinates only: each has the same samples, the same automatic fit of a
variogram, and the 24 nearest samples, no more than 6 of a hole.

| arm | coordinates |
|---|---|
| folded_isotropic | folded, one range |
| folded_best | folded, the best of nine settings (isotropic, and planes through the true \
fold axis of five dips, with two or three ranges), chosen by the truth, which no user knows |
| stratigraphic | x, y, and the true height between bottom and top times the mean thickness |
| geounfold | unfolded from the blocks, defaults |
| truth | the true flat coordinates: the ceiling |

Rough fields are spherical or exponential (some lognormal, some layered); smooth fields are
gaussian. The ranges are 200 m along the layer and 25 m across. There is no arm of locally varying
anisotropy, because no maintained library uses it in the search for samples.
""".replace("\\\n", "")


def report(table: pd.DataFrame, figure: str | None = None) -> str:
    """Return all tables as one text."""
    runs = table[["body", "spacing", "seed"]].drop_duplicates()
    text = [
        INTRODUCTION,
        "`make study` makes this page: "
        f"{len(runs)} runs of {table.body.nunique()} bodies, spacings "
        f"of {', '.join(map(str, sorted(table.spacing.unique())))} m and {table.seed.nunique()} "
        "seeds. Grades have a mean of 1 and a standard deviation of 0.4. Lengths are in metres.\n",
        *([] if figure is None else [f"![RMSE by arm and spacing]({figure})\n"]),
        "## Gain over the best folded setting, and share of the possible gain\n",
        "Gain is 1 - RMSE / RMSE of folded_best. Share is the part of the difference between "
        "folded_best and truth that an arm reaches. 95 % of the means over seeds drawn with "
        "replacement lie between low and high.\n",
    ]
    groups = {"all": table} | {f"{f} fields": t for f, t in table.groupby("field")}
    for name, part in groups.items():
        text += [f"### {name}\n", markdown(intervals(part))]
    text += ["## Figures by arm\n", markdown(by_arm(table))]
    rows = {}
    for key, part in table.groupby(["field", "body", "spacing"]):
        rows[key] = {
            **shares(means(part)),
            "rmse folded_best": part[part.arm == "folded_best"].rmse.mean(),
        }
    text += ["## By body and spacing\n", markdown(pd.DataFrame(rows).T)]
    return "\n".join(text)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw mean RMSE by arm and spacing, for rough and smooth fields."""
    from matplotlib.figure import Figure

    colours = ("#999999", "#000000", "#E69F00", "#0072B2", "#009E73")
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    names = sorted(table.field.unique())
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        part = table[table.field == name]
        for arm, colour in zip(ARMS, colours, strict=True):
            mean = part[part.arm == arm].groupby("spacing")["rmse"].mean()
            style = "--" if arm == "truth" else "-"
            axes.plot(mean.index, mean, style, marker="o", color=colour, label=arm)
        axes.set(title=f"{name} fields", xlabel="spacing of holes, m", ylim=(0, None))
        axes.set_ylabel("RMSE at unsampled blocks")
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=120)


def main(argv=None) -> int:
    """Write the tables and the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", type=Path, nargs="?", default=Path("data/study.csv"))
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--link", help="how the text names the figure")
    args = parser.parse_args(argv)
    table = pd.read_csv(args.study)
    text = report(table, args.link)
    if args.output:
        args.output.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)
    if args.figure:
        draw(table, args.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
