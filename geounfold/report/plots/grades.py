"""Figures of exploratory data analysis: one function for each table of `geounfold.estimation`.

Every ``chart_`` function returns a matplotlib Figure that belongs to no window.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from geounfold.estimation import Exploration, FittedVariogram, Variogram

# Okabe and Ito's colours, which colour-blind readers can distinguish.
ALONG, ACROSS, BARS, MEAN = "#0072B2", "#E69F00", "#999999", "#D55E00"
SECOND = "#009E73"

_CURVE = 100  # points of a model's curve


def charts(exploration: Exploration) -> dict[str, Figure]:
    """Return every figure of an exploration by name, in the order of the page."""
    e = exploration
    return {
        "histogram": chart_histogram(e.histogram, e.grade),
        "layers": chart_layers(e.layers, e.grade),
        "variograms": chart_variograms(e.variograms, e.models),
        "swaths": chart_swaths(e.swaths, e.grade),
        "contacts": chart_contacts(e.contacts, e.grade),
    }


def chart_histogram(table: pd.DataFrame, grade: str) -> Figure:
    """Draw a histogram with the cumulative share (see `estimation.histogram`)."""
    figure, (axes,) = _figure(1, (5.0, 3.4))
    low, high = table["low"].to_numpy(), table["high"].to_numpy()
    axes.bar(low, table["share"], width=high - low, align="edge", color=BARS, edgecolor="white")
    axes.set(xlabel=_plain(grade), ylabel="share of samples")
    right = axes.twinx()
    right.step(high, table["cumulative"], where="pre", color=MEAN)
    right.set(ylim=(0, 1.02), ylabel="cumulative share")
    return figure


def chart_layers(table: pd.DataFrame, grade: str) -> Figure:
    """Draw means, quartiles and deciles by layer (see `estimation.exploration.by_layer`)."""
    figure, (axes,) = _figure(1, (5.0, 4.0))
    some = table[table["count"] > 0]
    height = 0.5 * (some["from"] + some["to"]).to_numpy()
    thick = (some["to"] - some["from"]).to_numpy()
    axes.hlines(height, some["p10"], some["p90"], color=BARS, label="10 to 90 %")
    axes.barh(
        height, some["p75"] - some["p25"], 0.6 * thick, some["p25"], color=BARS, label="quartiles"
    )
    axes.plot(some["mean"], height, "o-", color=MEAN, label="mean")
    for where, count in zip(height, some["count"], strict=True):
        axes.annotate(
            f"{count}", (1.01, where), xycoords=("axes fraction", "data"), fontsize=7, va="center"
        )
    axes.set(xlabel=_plain(grade), ylabel="stratigraphic height (0 bottom, 1 top)", ylim=(0, 1))
    axes.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize="small"
    )
    return figure


def chart_variograms(
    tables: Mapping[str, pd.DataFrame], models: Mapping[str, FittedVariogram | Variogram]
) -> Figure:
    """Draw experimental variograms along and across with their models, a panel for each space.

    Models with two ranges in the plane have a curve along either axis.

    Parameters
    ----------
    tables : mapping of DataFrame
        Results of `estimation.directional`, by space, along the models' axes.
    models : mapping of FittedVariogram or Variogram
        Models, by space.
    """
    figure, panels = _figure(len(tables), (4.4 * len(tables), 3.6))
    for axes, (space, table) in zip(panels, tables.items(), strict=True):
        found = models.get(space)
        model: Any = getattr(found, "model", found)  # a fitted one holds its model
        level = [("along", ALONG, (1, 0, 0))]
        if model is not None and model.ranges[0] != model.ranges[1]:
            level = [("axis_1", ALONG, (1, 0, 0)), ("axis_2", SECOND, (0, 1, 0))]
        for name, colour, unit in (*level, ("across", ACROSS, (0, 0, 1))):
            part = table[table["direction"] == name]
            if not len(part):
                continue
            size = 5 + 40 * part["pairs"] / part["pairs"].max()
            label = name.replace("_", " ")
            axes.scatter(part["distance"], part["gamma"], size, color=colour, label=label)
            if model is not None:
                h = np.linspace(0, float(part["distance"].max()), _CURVE)[1:]
                way = model.axes.T @ np.asarray(unit, dtype=np.float64)
                axes.plot(h, model.gamma(h[:, None] * way), color=colour)
        axes.set(title=space, xlabel="distance", ylabel="semivariance", xlim=(0, None))
        axes.set_ylim(0, None)
        axes.legend(frameon=False, fontsize="small")
    return figure


def chart_beside(tables: Mapping[str, pd.DataFrame], grade: str) -> Figure:
    """Draw mean grades of blocks and samples in the same slices, a panel for each axis."""
    figure, panels = _figure(len(tables), (3.8 * len(tables), 3.4))
    for axes, (name, table) in zip(panels, tables.items(), strict=True):
        low, high = table["low"].to_numpy(), table["high"].to_numpy()
        count = table["count_samples"].to_numpy()
        right = axes.twinx()
        right.bar(low, count, width=high - low, align="edge", color=BARS, alpha=0.35)
        right.set(ylabel="samples", ylim=(0, 3 * max(int(count.max()), 1)))
        middle = 0.5 * (low + high)
        axes.plot(middle, table["mean_samples"], "o", color=MEAN, markersize=4, label="samples")
        axes.plot(middle, table["mean_blocks"], "-", color=ALONG, label="blocks")
        axes.set(xlabel=name, ylabel=f"mean {_plain(grade)}")
        axes.legend(frameon=False, fontsize="small")
        axes.set_zorder(right.get_zorder() + 1)
        axes.patch.set_visible(False)
    return figure


def chart_tonnage(table: pd.DataFrame, grade: str) -> Figure:
    """Draw tonnage and mean grade above cut-offs, of blocks and of samples."""
    figure, (left, right) = _figure(2, (8.4, 3.4))
    for axes, name in ((left, "tonnage"), (right, "grade")):
        axes.plot(table["cutoff"], table[f"{name}_blocks"], "-", color=ALONG, label="blocks")
        axes.plot(table["cutoff"], table[f"{name}_samples"], "--", color=MEAN, label="samples")
        axes.set_xlabel(f"cut-off {_plain(grade)}")
        axes.legend(frameon=False, fontsize="small")
    left.set(ylabel="share above the cut-off", ylim=(0, 1.02))
    right.set_ylabel(f"mean {_plain(grade)} above it")
    return figure


def chart_swaths(tables: Mapping[str, pd.DataFrame], grade: str) -> Figure:
    """Draw mean grades in slices with their counts, a panel for each axis."""
    figure, panels = _figure(len(tables), (3.6 * len(tables), 3.2))
    for axes, (name, table) in zip(panels, tables.items(), strict=True):
        _profile(axes, table, grade)
        axes.set_xlabel(name)
    return figure


def chart_contacts(tables: Mapping[str, pd.DataFrame], grade: str) -> Figure:
    """Draw mean grades by distance from contacts: outside on the left, inside on the right."""
    figure, panels = _figure(len(tables), (4.2 * len(tables), 3.2))
    for axes, (name, table) in zip(panels, tables.items(), strict=True):
        _profile(axes, table, grade)
        axes.axvline(0.0, color="black", linewidth=1)
        axes.set(title=name, xlabel="distance inside the contact, thicknesses")
    return figure


def _profile(axes: Axes, table: pd.DataFrame, grade: str) -> None:
    """Draw mean and standard error over bars of counts."""
    low, high = table["low"].to_numpy(), table["high"].to_numpy()
    count = table["count"].to_numpy()
    right = axes.twinx()
    right.bar(low, count, width=high - low, align="edge", color=BARS, alpha=0.35)
    right.set_ylabel("samples")
    right.set_ylim(0, 3 * max(int(count.max()), 1))
    error = (table["std"] / np.sqrt(np.maximum(count, 1))).fillna(0.0)
    axes.errorbar(0.5 * (low + high), table["mean"], error, fmt="o-", color=MEAN, markersize=3)
    axes.set_ylabel(f"mean {_plain(grade)}")
    axes.set_zorder(right.get_zorder() + 1)
    axes.patch.set_visible(False)


def _plain(name: str) -> str:
    """Return a column's name escaped, so that matplotlib reads no formula in it."""
    return name.replace("$", r"\$")


def _figure(panels: int, size: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, list(figure.subplots(1, panels, squeeze=False)[0])
