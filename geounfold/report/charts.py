"""Distributions as SVG in the page's colours: violin, histogram, cumulative curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.report.html_text import text
from geounfold.report.plots.figures import colour_limits

_WIDTH, _HEIGHT = 400, 250
_LEFT, _RIGHT, _TOP, _BOTTOM = 54, 14, 12, 46
_BINS = 60
_FINE = 512  # bins of the violin's density
_CURVE = 400  # points of the cumulative curve
_QUANTILES = (0.5, 0.9, 0.95)
_DIGITS = 12  # most digits of a number; smaller differences are rounding
_LETTER = 7.0  # width of a digit at the page's 12 px, so that no label leaves the picture


def distribution(values: Floats, label: str) -> str:
    """Return violin, histogram and cumulative curve of one column (thesis, figures 3.16 and 4.5).

    Each is an SVG with a text alternative.

    Parameters
    ----------
    values : (n,) float
        One value per block.
    label : str
        Name of the values, shown on the axis.

    Raises
    ------
    InputError
        There are no values, or some are not finite.
    """
    v = np.ravel(np.asarray(values, dtype=np.float64))
    if not v.size or not np.isfinite(v).all():
        raise InputError(f"{label}: needs finite values, and at least one")
    charts = (_violin(v, label), _histogram(v, label), _cumulative(v, label))
    return f'<div class="charts">{"".join(charts)}</div>'


def dot_chart(
    dots: tuple[Floats, Floats],
    line: tuple[Floats, Floats],
    labels: tuple[str, str],
    words: tuple[str, str],
) -> str:
    """Return dots and a line over one axis as an SVG with a text alternative.

    Parameters
    ----------
    dots, line : ((n,) float, (n,) float)
        Places across and values; the line's places rise.
    labels : (str, str)
        Names of the axes, across and up.
    words : (str, str)
        Title of the chart, and its description.
    """
    x, y = dots
    low, high = min(0.0, float(y.min())), max(0.0, float(y.max()))
    room = 0.05 * (high - low) or 1.0
    axes = _Axes((0.0, float(x.max()) or 1.0), (low - room, high + room))
    points = "".join(
        f'<circle class="faint" r="2" cx="{axes.px(a):.1f}" cy="{axes.py(b):.1f}"/>'
        for a, b in zip(x.tolist(), y.tolist(), strict=True)
    )
    content = axes.frame(labels[0], labels[1], nice_ticks(low - room, high + room)) + points
    content += f'<path class="line" d="M{axes.path(*line)}"/>'
    return _svg(*words, content)


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return at most `most` round numbers from `low` to `high`, in steps of 1, 2 or 5.

    Examples
    --------
    >>> nice_ticks(0.0, 0.093)
    [0.0, 0.02, 0.04, 0.06, 0.08]
    """
    if not high > low:
        return [low]
    rough = (high - low) / max(1, most - 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s * power for s in (1.0, 2.0, 5.0, 10.0) if s * power >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    digits = max(0, 1 - math.floor(math.log10(step)))
    return [round(k * step, digits) + 0.0 for k in range(first, last + 1)]


@dataclass(frozen=True)
class _Axes:
    """Axes of a chart: values to picture coordinates."""

    x: tuple[float, float]
    y: tuple[float, float]

    def px(self, value: float) -> float:
        low, high = self.x
        return _LEFT + (value - low) / (high - low) * (_WIDTH - _LEFT - _RIGHT)

    def py(self, value: float) -> float:
        low, high = self.y
        return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)

    def path(self, x: Floats, y: Floats) -> str:
        return "L".join(f"{self.px(a):.1f} {self.py(b):.1f}" for a, b in zip(x, y, strict=True))

    def frame(self, xlabel: str, ylabel: str, yticks: Sequence[float]) -> str:
        """Return grid, ticks and labels."""
        base, right = _HEIGHT - _BOTTOM, _WIDTH - _RIGHT
        parts = []
        for tick in yticks:
            y = self.py(tick)
            parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{right}"/>')
            parts.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" class="end">{_tick(tick)}</text>')
        for tick in nice_ticks(*self.x):
            x, label = self.px(tick), _tick(tick)
            parts.append(f'<path class="grid" d="M{x:.1f} {_TOP}V{base}"/>')
            x = min(x, _WIDTH - _LETTER * len(label) / 2)
            parts.append(f'<text x="{x:.1f}" y="{base + 16}" class="mid">{label}</text>')
        parts.append(f'<path class="axis" d="M{_LEFT} {base}H{right}"/>')
        middle = (_LEFT + right) / 2
        parts.append(f'<text x="{middle}" y="{_HEIGHT - 10}" class="mid">{text(xlabel)}</text>')
        upright = f'transform="translate(12 {(_TOP + base) / 2}) rotate(-90)"'
        parts.append(f'<text class="mid" {upright}>{text(ylabel)}</text>')
        return "".join(parts)


def _tick(value: float) -> str:
    if value != 0 and (abs(value) >= 1e6 or abs(value) < 1e-4):
        return f"{value:.0e}"
    return f"{value:,.10g}"


def _svg(title: str, told: str, content: str) -> str:
    return (
        f'<figure class="chart"><svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        f'aria-label="{text(f"{title}. {told}")}">{content}</svg>'
        f"<figcaption>{text(told)}</figcaption></figure>"
    )


def _limits(v: Floats) -> tuple[float, float]:
    """Return the limits of an axis: 1st and 99th percentile, spread if equal; 0 if that is near."""
    low, high = colour_limits(v)
    if v.min() >= 0 and low < 0.25 * high:
        low = 0.0
    return low, high


def significant(*values: float) -> list[str]:
    """Return numbers with four significant digits, or more if their span is small beside them.

    Examples
    --------
    >>> significant(0.1234567, 12.0), significant(0.99999912, 1.0000008)
    (['0.1235', '12'], ['0.99999912', '1.0000008'])
    """
    span, largest = max(values) - min(values), max(map(abs, values))
    digits = 4
    if span > 0:
        digits = max(4, 2 + math.floor(math.log10(largest)) - math.floor(math.log10(span)))
    return [f"{value:.{min(digits, _DIGITS)}g}" for value in values]


def _quartiles(v: Floats) -> str:
    q1, q2, q3 = significant(*np.quantile(v, [0.25, 0.5, 0.75]).tolist())
    return f"Median {q2}, middle half {q1} to {q3}"


def _violin(v: Floats, label: str) -> str:
    low, high = _limits(v)
    counts, edges = np.histogram(np.clip(v, low, high), bins=_FINE, range=(low, high))
    spread = min(float(v.std()), float(np.subtract(*np.quantile(v, [0.75, 0.25]))) / 1.349)
    width = 0.9 * spread * len(v) ** -0.2 / (edges[1] - edges[0])  # Silverman's bandwidth
    density = ndimage.gaussian_filter1d(counts.astype(np.float64), max(width, 1.5), mode="reflect")
    at = (edges[:-1] + edges[1:]) / 2
    half = density / density.max()
    axes = _Axes((low, high), (-1.15, 1.15))
    outline = axes.path(np.r_[at, at[::-1]], np.r_[half, -half[::-1]])
    q1, q2, q3 = (axes.px(float(np.clip(q, low, high))) for q in np.quantile(v, [0.25, 0.5, 0.75]))
    y = axes.py(0.0)
    content = (
        axes.frame(label, "density", [])
        + f'<path class="fill" d="M{outline}Z"/>'
        + f'<path class="box" d="M{q1:.1f} {y - 7}H{q3:.1f}V{y + 7}H{q1:.1f}Z"/>'
        + f'<path class="median" d="M{q2:.1f} {y - 14}V{y + 14}"/>'
    )
    told = f"Violin: density of the blocks; box the middle half, line the median. {_quartiles(v)}."
    return _svg(f"Violin of {label}", told, content)


def _histogram(v: Floats, label: str) -> str:
    low, high = _limits(v)
    counts, edges = np.histogram(np.clip(v, low, high), bins=_BINS, range=(low, high))
    axes = _Axes((low, high), (0.0, 1.05 * float(counts.max())))
    base, x = axes.py(0.0), [axes.px(float(edge)) for edge in edges]
    bars = "".join(
        f"M{a:.1f} {base:.1f}V{axes.py(float(n)):.1f}H{b:.1f}V{base:.1f}Z"
        for n, a, b in zip(counts, x[:-1], x[1:], strict=True)
        if n
    )
    content = axes.frame(label, "blocks", nice_ticks(*axes.y, most=5))
    least, most = significant(float(v.min()), float(v.max()))
    told = (
        f"Histogram: {len(v):,} blocks from {least} to {most}; the end bars include values beyond "
        "the 1st and 99th percentile."
    )
    return _svg(f"Histogram of {label}", told, f'{content}<path class="bars" d="{bars}"/>')


def _cumulative(v: Floats, label: str) -> str:
    low, high = _limits(v)
    ordered = np.sort(v)
    at = np.linspace(low, high, _CURVE)
    share = np.searchsorted(ordered, at, side="right") / len(v)
    axes = _Axes((low, high), (0.0, 1.03))
    content = axes.frame(label, "share of blocks", [0.0, 0.25, 0.5, 0.75, 1.0])
    content += f'<path class="line" d="M{axes.path(at, share)}"/>'
    notes = []
    quantiles = np.quantile(v, _QUANTILES).tolist()
    for q, x, word in zip(_QUANTILES, quantiles, significant(*quantiles), strict=True):
        place = float(np.clip(x, low, high))
        content += f'<circle class="dot" r="4" cx="{axes.px(place):.1f}" cy="{axes.py(q):.1f}"/>'
        notes.append(f"{q:.0%} at or below {word}")
    return _svg(f"Cumulative share of {label}", f"Cumulative: {', '.join(notes)}.", content)
