# ---
# jupyter:
#   jupytext:
#     notebook_metadata_filter: kernelspec,jupytext,-jupytext.text_representation.jupytext_version
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # The thesis's results chapter, run again
#
# The thesis compares its method ("barycentric") with U-Fo on two simulated bodies and a field body.
# U-Fo flattens one reference surface and anchors the blocks to it. This notebook makes the thesis's
# tables 4.1 to 4.4 and figures 4.2 to 4.13 again with three methods of geounfold: `thesis` (the
# thesis's method as it is written), `ufo` (one reference surface, as the thesis describes U-Fo) and
# `sheet` (geounfold's own). The figures of the thesis are printed beside the new ones.
#
# The thesis's field body (6,510 points) was never published. If the data are at hand, a body
# between two real seismic horizons takes its place (Claudius survey, Carnarvon Basin).
#
# `GEOUNFOLD_RUNS` is the number of timed runs; the thesis timed 10.

# %%
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import Image, display
from scipy.interpolate import griddata

import geounfold as gu
from geounfold.report.plots.bodies import draw_bodies, draw_body
from geounfold.report.plots.figures import png

RUNS = int(os.environ.get("GEOUNFOLD_RUNS", "10"))
METHODS = ("thesis", "ufo", "sheet")
HORIZONS = Path("../../shared/data/claudius/claudius.csv")

# %% [markdown]
# ## Bodies (table 4.1, figure 4.2)
#
# The simulated bodies have the thesis's sizes and numbers of blocks; their truth W is known.


# %%
def field_body(path: Path) -> np.ndarray:
    """Return block centroids between the two uppermost horizons, blocks of 110 x 110 x 40 m."""
    table = pd.read_csv(path)
    table.columns = [str(name).strip().casefold() for name in table.columns]
    levels = sorted(table["val"].dropna().unique())
    upper, lower = (
        table[table["val"] == level][["x", "y", "z"]].to_numpy() for level in levels[:2]
    )
    low, high = upper.min(axis=0), upper.max(axis=0)
    x, y = (np.arange(low[k] + 55, high[k], 110.0) for k in (0, 1))
    z = np.arange(lower[:, 2].min(), upper[:, 2].max(), 40.0)
    X, Y = (axis.ravel() for axis in np.meshgrid(x, y, indexing="ij"))
    top = griddata(upper[:, :2], upper[:, 2], (X, Y))
    base = griddata(lower[:, :2], lower[:, 2], (X, Y))
    held = (z >= base[:, None]) & (z <= top[:, None])
    column, layer = np.nonzero(held)
    return np.column_stack([X[column], Y[column], z[layer]])


bodies: dict[str, tuple[np.ndarray, np.ndarray | None]] = {
    name: tuple(gu.simulate(name)) for name in ("sim_case_1", "sim_case_2")
}
if HORIZONS.is_file():
    bodies["field"] = (field_body(HORIZONS), None)
else:
    print(f"{HORIZONS} is absent: no field body")
table_4_1 = pd.DataFrame(
    {"points": {name: len(X) for name, (X, _) in bodies.items()}},
)
table_4_1["thesis"] = pd.Series({"sim_case_1": 21600, "sim_case_2": 21600, "field": 6510})
assert (table_4_1.loc[["sim_case_1", "sim_case_2"], "points"] == 21600).all()
table_4_1


# %%
def normalised(points: np.ndarray) -> np.ndarray:
    """Return NMD (n,) in the thesis's units: the body's largest side is 1."""
    return gu.nmd(points, gu.neighbours(points)) / np.ptp(points, axis=0).max()


for name, (X, _) in bodies.items():
    shown = normalised(X)
    print(f"{name}: NMD {shown.min():.3g} to {shown.max():.3g} of the largest side")
    if name != "field":
        # The thesis's colour bar runs from 0.02 to 0.038. Inside a cubic lattice of 60 blocks the
        # mean distance to 26 neighbours is 1.416 blocks. This is 0.0236 of 60 blocks, and 0.026 of
        # the folded length, which is shorter. At rims the distance is larger.
        assert 0.0236 < shown.min() < 0.026
        assert shown.max() < 0.045
    display(Image(png(draw_body(X, shown, f"NMD of {name}", colours="cividis"))))

# %% [markdown]
# ## Unfolding each body by each method
#
# The runs need `allow_uncertified`, because the thesis's method and U-Fo's do not prove their maps.

# %%
unfolded: dict[tuple[str, str], gu.Unfolding] = {}
seconds: dict[tuple[str, str], list[dict[str, float]]] = {}
failed: dict[tuple[str, str], str] = {}
for name, (X, _) in bodies.items():
    for method in METHODS:
        for _ in range(RUNS):
            try:
                u = gu.unfold(X, method=method, allow_uncertified=True)
            except gu.GeounfoldError as error:
                failed[name, method] = str(error)
                print(f"{method} on {name}: {error}")
                break
            unfolded[name, method] = u
            seconds.setdefault((name, method), []).append(u.seconds)
assert all(body == "field" for body, _ in failed)  # both simulated bodies by every method

# %% [markdown]
# ## Times (tables 4.2 and 4.3, figure 4.3)
#
# The table has geounfold's times by the steps of the thesis. The thesis took its times on another
# machine (Intel i7-8550U), so compare orders of magnitude only.

# %%
STEPS = {
    "preprocess": ("frame",),
    "surf_extraction": ("hull", "split"),
    "flattening and mesh": ("thesis", "sheet", "ufo"),
    "3d_unfolding": ("map",),
    "proof and figures": ("certificate", "quality"),
}
rows = {}
for key, runs in seconds.items():
    per_step = pd.DataFrame(
        [
            {step: sum(run.get(s, 0.0) for s in parts) for step, parts in STEPS.items()}
            for run in runs
        ]
    )
    per_step["total"] = per_step.sum(axis=1)
    for statistic in ("mean", "std"):
        rows[(*key, statistic)] = getattr(per_step, statistic)()
times = pd.DataFrame(rows).T
PRINTED_TIMES = pd.DataFrame(
    {
        "barycentric, total": {"sim_case_1": 49.0162, "sim_case_2": 49.7362, "field": 17.4334},
        "U-Fo, flattening + 3d": {
            "sim_case_1": 11.8733 + 10.7923,
            "sim_case_2": 16.8282 + 12.4462,
            "field": 7.3151 + 3.8131,
        },
    }
)
print(f"mean and standard deviation of {RUNS} runs, seconds")
print(times.to_string(float_format="{:.2f}".format))
print("\ntimes printed in the thesis")
print(PRINTED_TIMES.to_string())

# %%
figure, ax = plt.subplots(figsize=(9, 3.6), layout="constrained")
mean = times.xs("mean", level=2).drop(columns="total")
spread = times.xs("std", level=2)["total"].fillna(0)
left = np.zeros(len(mean))
labels = [f"{body}, {method}" for body, method in mean.index]
for k, step in enumerate(mean.columns):
    ax.barh(labels, mean[step], left=left, label=step, color=plt.get_cmap("cividis")(k / 4))
    left += mean[step].to_numpy()
ax.errorbar(left, labels, xerr=spread, fmt="none", ecolor="C3", capsize=3)
ax.set_xlabel(f"seconds, mean of {RUNS} runs; bars: standard deviation of the total")
ax.legend(frameon=False, fontsize=8)
ax.invert_yaxis()
plt.show()


# %% [markdown]
# ## Distributions of epsilon (figures 4.4 to 4.13)


# %%
def errors(name: str) -> dict[str, dict[str, np.ndarray]]:
    """Return epsilon(X, Y) and, with a truth, epsilon(W, Y) of each method."""
    X, W = bodies[name]
    out: dict[str, dict[str, np.ndarray]] = {"epsilon(X, Y)": {}, "epsilon(W, Y)": {}}
    for method in METHODS:
        if (name, method) not in unfolded:
            continue
        Y = unfolded[name, method].points
        there = np.isfinite(Y).all(axis=1)
        out["epsilon(X, Y)"][method] = gu.epsilon(X[there], Y[there])
        if W is not None:
            out["epsilon(W, Y)"][method] = gu.epsilon(W[there], Y[there])
    return {label: values for label, values in out.items() if values}


def draw_errors(name: str) -> None:
    """Draw violins, histograms and cumulative curves, a row for each epsilon."""
    found = errors(name)
    figure, axes = plt.subplots(
        len(found), 3, figsize=(13, 3.2 * len(found)), layout="constrained", squeeze=False
    )
    for (violin, histogram, cumulative), (label, values) in zip(axes, found.items(), strict=True):
        violin.violinplot([np.maximum(v, 1e-6) for v in values.values()], showmedians=True)
        violin.set_xticks(range(1, len(values) + 1), values)
        violin.set(ylabel=label, yscale="log")
        edge = max(np.quantile(v, 0.99) for v in values.values())
        for k, (method, v) in enumerate(values.items()):
            look = {"color": f"C{k}", "label": f"{method}, mean {v.mean():.4f}"}
            histogram.hist(np.clip(v, 0, edge), bins=60, histtype="step", **look)
            cumulative.plot(np.sort(v), np.linspace(0, 1, len(v)), ("-", "--", ":")[k], **look)
        histogram.set(xlabel=label, ylabel="blocks", yscale="log")
        cumulative.set(xlabel=label, ylabel="share of blocks", xlim=(0, edge))
        cumulative.legend(frameon=False, fontsize=8)
    figure.suptitle(name)
    plt.show()


for name in bodies:
    draw_errors(name)

# %% [markdown]
# The colours show NMD, all on one scale: truth and folded body (figures 4.4, 4.8), then the
# answers.

# %%
for name, (X, W) in bodies.items():
    size = np.ptp(X, axis=0).max()
    ids = gu.neighbours(X)
    clouds = {"folded": X, **({"truth": W} if W is not None else {})}
    clouds |= {m: unfolded[name, m].points for m in METHODS if (name, m) in unfolded}
    shown = {label: gu.nmd(P, ids) / size for label, P in clouds.items() if np.isfinite(P).all()}
    limits = (
        min(v.min() for v in shown.values()),
        float(np.quantile(np.concatenate(list(shown.values())), 0.99)),
    )
    labels = list(shown)
    for a, b in zip(labels[::2], labels[1::2], strict=False):
        picture = draw_bodies(
            clouds[a],
            clouds[b],
            (shown[a], shown[b]),
            f"NMD, {name}",
            titles=(a, b),
            limits=limits,
            colours="cividis",
        )
        display(Image(png(picture)))

# %% [markdown]
# ## Mean errors (table 4.4)
#
# This table adds the RMS, the distance from the truth after the best rigid motion, which epsilon
# does not show.

# %%
PRINTED = {
    ("sim_case_1", "thesis"): (0.0227, 0.0257),
    ("sim_case_1", "ufo"): (13.6475, 0.0905),
    ("sim_case_2", "thesis"): (0.0329, 0.0595),
    ("sim_case_2", "ufo"): (13.5871, 0.1225),
    ("field", "thesis"): (np.nan, 0.0115),
    ("field", "ufo"): (np.nan, 0.0022),
}
lines = {}
for name, (X, W) in bodies.items():
    found = errors(name)
    lines[name, "doing nothing"] = {
        "epsilon(W, Y)": np.nan if W is None else gu.epsilon(W, X).mean(),
        "epsilon(X, Y)": 0.0,
        "RMS": np.nan if W is None else gu.aligned_rms(X, W),
    }
    for method in found["epsilon(X, Y)"]:
        Y = unfolded[name, method].points
        printed = PRINTED.get((name, method), (np.nan, np.nan))
        there = np.isfinite(Y).all(axis=1)
        lines[name, method] = {
            "epsilon(W, Y)": np.nan if W is None else found["epsilon(W, Y)"][method].mean(),
            "thesis prints (W, Y)": printed[0],
            "epsilon(X, Y)": found["epsilon(X, Y)"][method].mean(),
            "thesis prints (X, Y)": printed[1],
            "RMS": np.nan if W is None else gu.aligned_rms(Y[there], W[there]),
        }
table_4_4 = pd.DataFrame(lines).T
print(table_4_4.to_string(float_format="{:.5f}".format, na_rep="-"))

# %%
for name in ("sim_case_1", "sim_case_2"):
    rms, eps = table_4_4.loc[name, "RMS"], table_4_4.loc[name, "epsilon(W, Y)"]
    for other in ("thesis", "ufo", "doing nothing"):
        assert rms["sheet"] < rms[other] / 5, (name, other)
        assert eps["sheet"] < eps[other] / 5, (name, other)
    # The thesis's figures for its own method depend on where its alpha shape happened to close, so
    # only their order of magnitude is asserted: a factor of 2.
    printed = table_4_4.loc[(name, "thesis"), "thesis prints (W, Y)"]
    assert printed / 2 < eps["thesis"] < printed * 2

# %% [markdown]
# ## Why U-Fo's 13.6 is a matter of units
#
# If all points are in one unit, NMD(Y) / NMD(W) is NMD(Y) / NMD(X) times NMD(X) / NMD(W). So
# epsilon(W, Y) at a block is at most (1 + epsilon(X, Y)) (1 + epsilon(W, X)) - 1, with the same
# neighbours throughout. The thesis's epsilon(X, Y) is 0.09 on average, and the folded body itself
# scores 0.017, so epsilon(W, Y) is about 0.11 at most. The thesis prints 13.65. A factor of 14.6
# between the units of Y and W gives exactly that. The colour bars of the thesis's figure 4.4 show
# the same: NMD(W) is 0.02 to 0.038, NMD(Y) of U-Fo 0.103 to 0.755. The thesis compared X and Y in
# one unit, W and Y in two.

# %%
X, W = bodies["sim_case_1"]
ids = gu.neighbours(W)
before, folded = gu.nmd(W, ids), gu.nmd(X, ids)
Y = unfolded["sim_case_1", "ufo"].points
after = gu.nmd(Y, ids)
one, two, three = (
    np.abs(after / before - 1),
    np.abs(after / folded - 1),
    np.abs(folded / before - 1),
)
bound = (1 + two) * (1 + three) - 1
print(f"epsilon(W, Y) {one.mean():.4f}, bound {bound.mean():.4f}, at most {bound.max():.3f}")
assert (one <= bound + 1e-12).all()
assert (1 + 0.0905) * (1 + 0.0172) - 1 < 0.12  # the bound by the thesis's own figures
factor = 14.6475  # 1 + 13.6475
in_two_units = gu.epsilon(W, factor * Y).mean()
print(f"epsilon(W, {factor} Y) = {in_two_units:.2f}; the thesis prints 13.65")
assert abs(in_two_units - 13.6475) < 0.5
assert np.allclose(np.abs(gu.nmd(factor * Y, ids) / gu.nmd(factor * X, ids) - 1), two)
