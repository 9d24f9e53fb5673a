"""Tables and figures of the study: gains of unfolding, with their intervals, and the forecast.

    python tests/study/tables.py [data/study.csv] [-o docs/study.md]
                                 [--figures docs/assets] [--link assets]

Gain over an arm: 1 - RMSE(geounfold) / RMSE(arm), of the mean logarithm over runs, so that grades
of every unit weigh alike. Between low and high lie 95 % of 2,000 such means over runs drawn with
replacement.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

RIVALS = ("isotropic", "plane", "plane_truth", "limbs", "stratigraphic")
FORETOLD = ("isotropic", "plane", "limbs", "stratigraphic")
KEY = ["body", "spacing", "range", "nugget", "seed"]
DRAWS = 2000
TURNS = (0, 10, 30, 180)  # degrees within the range
SHAPES = {
    "sim_case_1": "gently flexed",
    "recumbent": "tight",
    "refolded_tight": "doubly curved",
    "domino": "faulted",
}


def wide(table: pd.DataFrame, column: str = "rmse") -> pd.DataFrame:
    """Return a row for each run, with the errors of its arms as columns."""
    return table.pivot_table(index=KEY, columns="arm", values=column)


def ratios(errors: pd.DataFrame, arm: str = "geounfold") -> pd.DataFrame:
    """Return logarithms of an arm's error over those of all arms."""
    return np.log(errors[[arm]].to_numpy() / errors)


def gain(ratio: np.ndarray) -> float:
    """Return the gain of a mean logarithm; NaN is left out."""
    return float(1 - np.exp(np.nanmean(ratio)))


def interval(ratio: np.ndarray) -> tuple[float, float]:
    """Return the bounds between which 95 % of the gains over runs drawn again lie."""
    known = ratio[np.isfinite(ratio)]
    if len(known) < 2:
        return float("nan"), float("nan")
    draw = np.random.default_rng(0).integers(0, len(known), (DRAWS, len(known)))
    low, high = np.quantile(1 - np.exp(known[draw].mean(axis=1)), [0.025, 0.975])
    return float(low), float(high)


def overall(errors: pd.DataFrame) -> pd.DataFrame:
    """Return the gain over every rival with its interval."""
    ratio, rows = ratios(errors), {}
    for arm in (*RIVALS, "rebuilt", "truth"):
        if arm in ratio:
            one = ratio[arm].to_numpy()
            rows[arm] = (gain(one), *interval(one), int(np.isfinite(one).sum()))
    return pd.DataFrame.from_dict(rows, orient="index", columns=["gain", "low", "high", "runs"])


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return what is known of every run, one row each."""
    return table[table["arm"] == "geounfold"].set_index(KEY).sort_index()


def surface(errors: pd.DataFrame, about: pd.DataFrame, rival: str) -> pd.DataFrame:
    """Return the gain over a rival by turn within the range, nugget, and ranges per spacing."""
    ratio = ratios(errors)[rival]
    about = about.loc[ratio.index]
    turn = pd.cut(about["turn_in_range"], TURNS, right=False)
    words = [f"{int(t.left)} to {int(t.right)}" for t in turn.cat.categories]
    words[-1] = f"{TURNS[-2]} and more"
    per = ratio.index.get_level_values("range") / ratio.index.get_level_values("spacing")
    reach = pd.cut(pd.Series(per, index=ratio.index), (0, 1.3, 3.5, 100))
    names = ["below 1.3", "1.3 to 3.5", "above 3.5"]
    rows = {}
    for k, word in enumerate(words):
        for j, name in enumerate(names):
            here = (turn.cat.codes == k).to_numpy() & (reach.cat.codes == j).to_numpy()
            row = {}
            for nugget in sorted(set(ratio.index.get_level_values("nugget"))):
                some = here & (ratio.index.get_level_values("nugget") == nugget)
                row[f"nugget {nugget:.0%}"] = gain(ratio[some]) if some.any() else np.nan
            if here.any():
                rows[f"turns {word} degrees; {name} ranges a spacing"] = row
    return pd.DataFrame(rows).T


def by(errors: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return the gain over each rival by one property of the runs."""
    ratio = ratios(errors)
    groups = ratio.groupby(level=column) if column in KEY else None
    assert groups is not None
    rows = {}
    for value, part in groups:
        name = SHAPES.get(value, value) if isinstance(value, str) else f"{value:g}"
        rows[f"{column} {name}"] = {arm: gain(part[arm]) for arm in RIVALS}
    return pd.DataFrame(rows).T


def forecast(errors: pd.DataFrame, about: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return foretold and realised gains by rival."""
    ratio = ratios(errors)
    return {
        arm: pd.DataFrame(
            {
                "foretold": about.loc[ratio.index, f"foretold_{arm}"],
                "realised": 1 - np.exp(ratio[arm]),
            }
        ).dropna()
        for arm in FORETOLD
    }


def calibration(told: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Return how well the forecast holds: correlation, bias, and where nine of ten runs fall."""
    rows = {}
    whole = pd.concat(told, names=["arm"])
    means = whole.groupby(level=["arm", "body", "spacing", "range"]).mean()
    named = {**told, "all": whole, "all, means over nuggets and seeds": means}
    for arm, frame in named.items():
        off = frame["realised"] - frame["foretold"]
        low, high = np.quantile(off, [0.05, 0.95])
        rows[arm] = {
            "correlation": frame["foretold"].corr(frame["realised"]),
            "realised less foretold": off.mean(),
            "5 % below": low,
            "5 % above": high,
            "runs": len(frame),
        }
    return pd.DataFrame(rows).T


def repeated(told: dict[str, pd.DataFrame]) -> tuple[float, int]:
    """Return the correlation of the gains of two draws of one cell, and the number of pairs."""
    whole = pd.concat(told, names=["arm"])["realised"]
    pairs = whole.unstack("seed").dropna()
    if pairs.shape[1] < 2 or len(pairs) < 3:
        return float("nan"), 0
    return float(pairs.iloc[:, 0].corr(pairs.iloc[:, 1])), len(pairs)


def with_left_out(told: dict[str, pd.DataFrame], left_out: pd.DataFrame) -> float:
    """Return the correlation of realised gains with those told by the forecast and left-out holes.

    The gains are a sum of both, with weights fitted to a half of the runs that is drawn; the
    correlation is that of the other half, a mean over 100 draws.
    """
    frame = pd.concat(told, names=["arm"])
    back = 1 - np.exp(ratios(left_out))
    at = frame.index.droplevel("arm")
    arms = frame.index.get_level_values("arm")
    own = np.array([back.loc[run, arm] for run, arm in zip(at, arms, strict=True)])
    A, y = np.column_stack([frame["foretold"], own]), frame["realised"].to_numpy()
    runs, number = np.unique(at, return_inverse=True)
    rng, found = np.random.default_rng(0), []
    for _ in range(100):
        half = (rng.permutation(len(runs)) < len(runs) // 2)[number]
        weights = np.linalg.lstsq(A[half], y[half])[0]
        found.append(np.corrcoef(A[~half] @ weights, y[~half])[0, 1])
    return float(np.mean(found))


def markdown(frame: pd.DataFrame, form: str = ".3f", whole: tuple[str, ...] = ("runs",)) -> str:
    """Return a table in Markdown."""
    head = ["", *map(str, frame.columns)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for name, row in frame.iterrows():
        values = [f"{v:.0f}" if c in whole else f"{v:{form}}" for c, v in row.items()]
        lines.append("| " + " | ".join([str(name), *values]).replace("nan", "") + " |")
    return "\n".join(lines) + "\n"


INTRODUCTION = Path(__file__).with_name("introduction.md")


def report(table: pd.DataFrame, link: str | None = None) -> str:
    """Return all tables as one text."""
    errors, about = wide(table), cells(table)
    left_out = wide(table, "cv_rmse")
    told = forecast(errors, about)
    text = [
        INTRODUCTION.read_text(encoding="utf-8"),
        f"`make study` makes this page: {len(errors)} runs of the 216 that it makes when it is "
        f"not stopped, {_lognormal(errors)} of them of lognormal grades. Gain over an arm is 1 - "
        "RMSE(geounfold) / RMSE(arm), of the mean logarithm over runs; 95 % of the means over runs "
        "drawn with replacement lie between low and high.\n",
        "## All runs\n",
        markdown(overall(errors)),
        "## Gain as a surface\n",
        "Over one plane (plane_truth), by how much the layer turns within the range, how many "
        "ranges there are to a spacing, and nugget:\n",
        markdown(surface(errors, about, "plane_truth")),
        "Over limb domains:\n",
        markdown(surface(errors, about, "limbs")),
        *([] if link is None else [f"![Gain by turn and nugget]({link}/study.png)\n"]),
        "## By body, range, nugget and spacing\n",
        markdown(pd.concat([by(errors, c) for c in ("body", "range", "nugget", "spacing")])),
        "## At left-out holes\n",
        "The gain that whole-hole cross-validation shows, at samples with their nugget, beside "
        "that at blocks:\n",
        markdown(_beside(errors, left_out)),
        "## The forecast of `assess`\n",
        "`foretold` is the gain that `gu.assess` tells from the samples of a run, `realised` that "
        "of the run: of one draw of the grades and 300 blocks, so that single runs scatter, and "
        "means over the nuggets and seeds of one body, spacing and range less. Nine of ten runs "
        "lie between the two bounds, which are those that `assess` prints.\n",
        markdown(calibration(told)),
        *_limits(told, left_out),
        *([] if link is None else [f"![Foretold and realised gains]({link}/assess.png)\n"]),
    ]
    return "\n".join(text)


def _limits(told: dict[str, pd.DataFrame], left_out: pd.DataFrame) -> list[str]:
    """Return what limits the forecast of single runs; nothing if no cell was drawn twice."""
    again, count = repeated(told)
    if not count or not again > 0:
        return []
    return [
        f"A forecast that does not see the draw cannot follow its scatter: the gains of two draws "
        f"of one cell correlate by {again:.2f} ({count} pairs), so that the best such forecast "
        f"would correlate by {np.sqrt(again):.2f} with single runs. The gain at left-out holes of "
        "the same draw (150 samples) knows more: the forecast and that gain, with weights fitted "
        f"to half of the runs, correlate by {with_left_out(told, left_out):.2f} with the other "
        "half. `study-holes` shows both side by side.\n"
    ]


def _lognormal(errors: pd.DataFrame) -> int:
    """Return the number of runs of lognormal grades: those of odd seeds."""
    return int((errors.index.get_level_values("seed") % 2 == 1).sum())


def _beside(errors: pd.DataFrame, left_out: pd.DataFrame) -> pd.DataFrame:
    """Return gains at blocks and at left-out samples by nugget."""
    at, back = ratios(errors), ratios(left_out)
    rows = {}
    for nugget, part in at.groupby(level="nugget"):
        own = back.loc[part.index]
        rows[f"nugget {nugget:.0%}"] = {
            "plane, blocks": gain(part["plane"]),
            "plane, left-out samples": gain(own["plane"]),
            "limbs, blocks": gain(part["limbs"]),
            "limbs, left-out samples": gain(own["limbs"]),
        }
    return pd.DataFrame(rows).T


def draw(table: pd.DataFrame, folder: Path) -> None:
    """Draw the gain by turn and nugget, and the forecast against what came."""
    from matplotlib.figure import Figure

    errors, about = wide(table), cells(table)
    ratio = ratios(errors)
    colours = {0.0: "#0072B2", 0.3: "#E69F00", 0.6: "#999999"}
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    for axes, rival in zip(
        figure.subplots(1, 2, sharey=True), ("plane_truth", "limbs"), strict=True
    ):
        for nugget, part in ratio.groupby(level="nugget"):
            turn = about.loc[part.index, "turn_in_range"]
            axes.plot(
                turn, 100 * (1 - np.exp(part[rival])), "o", ms=4, alpha=0.7,
                color=colours.get(nugget, "k"), label=f"nugget {nugget:.0%}",
            )  # fmt: skip
        axes.axhline(0, color="k", lw=0.6)
        axes.set(title=f"over {rival}", xlabel="turn of the layer within the range, degrees")
    figure.axes[0].set_ylabel("gain of unfolding, %")
    figure.axes[0].legend(frameon=False, fontsize="small")
    figure.savefig(folder / "study.png", dpi=120)
    told = forecast(errors, about)
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    limit = 100 * max(float(frame.abs().to_numpy().max()) for frame in told.values())
    for axes, (arm, frame) in zip(figure.subplots(1, 4, sharey=True), told.items(), strict=True):
        nugget = frame.index.get_level_values("nugget")
        for value, colour in colours.items():
            some = nugget == value
            axes.plot(100 * frame["foretold"][some], 100 * frame["realised"][some], "o", ms=3,
                      alpha=0.7, color=colour)  # fmt: skip
        axes.plot([-10, limit], [-10, limit], color="k", lw=0.6)
        own = frame["foretold"].corr(frame["realised"])
        axes.set(xlabel="foretold gain, %")
        axes.set_title(f"over {arm}: r = {own:.2f}", fontsize="medium")
    figure.axes[0].set_ylabel("realised gain, %")
    figure.savefig(folder / "assess.png", dpi=120)


def main(argv=None) -> int:
    """Write the tables and the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", type=Path, nargs="?", default=Path("data/study.csv"))
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--figures", type=Path, help="folder of the two figures")
    parser.add_argument("--link", help="how the text names that folder")
    args = parser.parse_args(argv)
    table = pd.read_csv(args.study)
    text = report(table, args.link)
    if args.output:
        args.output.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)
    if args.figures:
        draw(table, args.figures)
    return 0


if __name__ == "__main__":
    sys.exit(main())
