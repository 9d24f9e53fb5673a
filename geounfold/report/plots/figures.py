"""Figures drawn with matplotlib: colour limits, distributions, curves."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.report.plots.style import BOTTOM, TOP, Image, Limits, require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a width and height in inches."""
    figure: Figure = require("matplotlib.figure").Figure(
        figsize=(width, height), dpi=100, layout="constrained"
    )
    return figure


def png(figure: Figure) -> bytes:
    """Return a figure as PNG bytes, the same for the same figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", facecolor="white", metadata={"Software": None})
    return buffer.getvalue()


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG bytes, the same for the same figure; letters stay text.

    The reader's fonts draw the letters, so matplotlib's warnings of missing ones are suppressed.
    """
    buffer = io.BytesIO()
    how = {"svg.hashsalt": "geounfold", "svg.fonttype": "none"}
    with require("matplotlib").rc_context(how), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        figure.savefig(buffer, format="svg", facecolor="white", metadata={"Date": None})
    return buffer.getvalue()


def show_figure(ax: Axes, image: Image, title: str) -> None:
    """Show an image on axes, with a title and no ticks."""
    ax.imshow(image, interpolation="none")
    ax.set_title(title, fontsize=11)
    ax.set_axis_off()


def colour_bar(
    figure: Figure, axes: Sequence[Axes], limits: Limits, colours: str, bands: int, label: str
) -> None:
    """Draw a colour bar beside axes."""
    colormaps = require("matplotlib").colormaps
    norm = require("matplotlib.colors").Normalize(*limits)
    mappable = require("matplotlib.cm").ScalarMappable(norm, colormaps[colours].resampled(bands))
    bar = figure.colorbar(mappable, ax=list(axes), label=label, shrink=0.8, aspect=30)
    bar.ax.ticklabel_format(axis="y", useOffset=False)


def colour_limits(*values: Floats) -> Limits:
    """Return the 1st and 99th percentile of values, spread if they are equal."""
    low, high = np.percentile(np.concatenate([np.ravel(v) for v in values]), [1, 99])
    room = 1e-6 * max(abs(low), abs(high), 1e-6)
    return (float(low), float(high)) if high - low > room else (float(low), float(low + 2 * room))


def ratio_limits(ratios: Floats, least: float = 0.02) -> Limits:
    """Return limits symmetric about 1: the 99th percentile of |ratio - 1|, at least `least`.

    So 1 has the middle colour, and changes too small to matter stay pale.

    Examples
    --------
    >>> ratio_limits(np.array([1.0001, 0.9999]))
    (0.98, 1.02)
    """
    room = max(float(np.percentile(np.abs(np.ravel(ratios) - 1), 99)), least)
    return 1 - room, 1 + room


def extents(points: Floats) -> str:
    """Return the extents of points, such as ``600 x 600 x 90``, in three digits or whole units."""
    size = np.ptp(np.asarray(points), axis=0)
    return " × ".join(f"{s:.0f}" if s >= 100 else f"{s:.3g}" for s in size)


def draw_distribution(values: Floats, label: str) -> Figure:
    """Draw a histogram and the cumulative curve of values (thesis, figure 3.16).

    Parameters
    ----------
    values : (n,) float
        One value per block.
    label : str
        Name of the values, shown on the axis.
    """
    v = np.ravel(np.asarray(values, dtype=np.float64))
    if not v.size or not np.isfinite(v).all():
        raise InputError(f"{label}: needs finite values, and at least one")
    figure = new_figure(12.5, 3.4)
    left, right = figure.subplots(1, 2)
    low, high = colour_limits(v)
    left.hist(np.clip(v, low, high), bins=60, color=TOP)
    left.set(xlabel=f"{label} (the outermost 1 % are in the end bars)", ylabel="blocks")
    ordered = np.sort(v)
    share = np.arange(1, len(v) + 1) / len(v)
    keep = np.unique(np.linspace(0, len(v) - 1, min(len(v), 2000)).astype(int))
    right.step(ordered[keep], share[keep], where="post", color=TOP)
    quantiles = [0.5, 0.9, 0.95]
    at = np.quantile(v, quantiles)
    right.plot(at, quantiles, "o", color=BOTTOM)
    notes = [f"{q:.0%} at or below {x:.5g}" for q, x in zip(quantiles, at, strict=True)]
    right.text(0.97, 0.06, "\n".join(notes), transform=right.transAxes, ha="right", fontsize=10)
    right.set(xlabel=label, ylabel="share of blocks", ylim=(0, 1.02))
    for ax in (left, right):
        ax.ticklabel_format(axis="x", useOffset=False)
        ax.locator_params(axis="x", nbins=6)
        ax.grid(alpha=0.3)
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def draw_curves(
    curves: Mapping[str, Floats], xlabel: str, ylabel: str, *, logarithmic: bool = False
) -> Figure:
    """Draw named curves of one value per step, such as a flattener's energy.

    Parameters
    ----------
    curves : mapping of str to (k,) float
        One curve per name.
    xlabel, ylabel : str
        Labels of the axes.
    logarithmic : bool
        Whether the axis of the values is logarithmic.
    """
    figure = new_figure(8, 3.4)
    ax = figure.subplots()
    for (name, values), style in zip(curves.items(), _styles(len(curves)), strict=True):
        ax.plot(np.asarray(values), style, label=name)
    ax.set(xlabel=xlabel, ylabel=ylabel)
    if logarithmic:
        ax.set_yscale("log")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return figure


def _styles(n: int) -> list[str]:
    """Return n line styles that differ in more than colour."""
    return [f"{('-', '--', ':', '-.')[i % 4]}C{i % 10}" for i in range(n)]
