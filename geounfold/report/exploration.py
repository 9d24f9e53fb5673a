"""Exploratory data analysis of one grade: figures with captions, and their tables."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.report.html_text import number, table, text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from geounfold.estimation import Exploration, FittedVariogram

_STATISTICS = ("count", "mean", "std", "cv", "min", "p10", "p25", "p50", "p75", "p90", "max")
_BY_LAYER = ("layer", "from", "to", "count", "mean", "std", "min", "p50", "max")


def exploration_html(exploration: Exploration) -> str:
    """Return figures and tables of an exploration as HTML, without a title.

    Parameters
    ----------
    exploration : Exploration
        Exploration of samples that were carried with the body.
    """
    from geounfold.estimation.exploration import statistics
    from geounfold.report.plots.grades import charts

    told = _told(exploration)
    pictures = {name: drawn(figure, told[name]) for name, figure in charts(exploration).items()}
    layers = exploration.layers
    parts = [
        f'<p class="soft">{text(_samples(exploration))}</p>',
        "<h3>Histogram and statistics</h3>",
        pictures["histogram"],
        table([_row(statistics(exploration.samples.grades), _STATISTICS)]),
        "<h3>By layer</h3>",
        pictures["layers"],
        table([_row(r, _BY_LAYER) for r in layers.to_dict("records")]),
        "<h3>Variograms in both spaces</h3>",
        '<p class="soft">Along is the horizontal plane and across the vertical, of either space: '
        "only in the unfolded one these are the layers' own. Lines are the fitted models, points "
        "larger the more pairs they have; distances are in the blocks' unit.</p>",
        pictures["variograms"],
        table([_model(space, fitted) for space, fitted in exploration.models.items()]),
        "<h3>Swaths along the unfolded axes</h3>",
        pictures["swaths"],
        "<h3>Contacts</h3>",
        pictures["contacts"],
    ]
    return "\n".join(parts)


def _samples(exploration: Exploration) -> str:
    """Return a sentence on the samples used, and on why others are not."""
    facts = exploration.samples.facts()
    used, given = facts["used"], facts["given"]
    if used == given:
        return f"All {given:,} samples are used."
    return (
        f"{used:,} of {given:,} samples are used: {facts['without_grade']:,} have no value of "
        f"{exploration.grade} or no place, {facts['outside_map']:,} lie outside the map."
    )


def _told(exploration: Exploration) -> dict[str, str]:
    """Return the caption of each figure, in words."""
    e, grade, v = exploration, exploration.grade, exploration.samples.grades
    models = "; ".join(f"{space}: {_ranges(m)}" for space, m in e.models.items())
    swaths = "; ".join(f"along {name} {_spread(t)}" for name, t in e.swaths.items())
    contacts = "; ".join(f"{name}: {_sides(t)}" for name, t in e.contacts.items())
    return {
        "histogram": (
            f"Histogram of {grade} with its cumulative share: {len(v):,} samples from "
            f"{number(float(v.min()))} to {number(float(v.max()))}, "
            f"median {number(float(np.median(v)))}."
        ),
        "layers": (
            f"{grade} by layer, from the bottom up, with counts at the right: "
            f"means {_spread(e.layers)}."
        ),
        "variograms": f"Variograms of {grade} with fitted models. {models}.",
        "swaths": f"Mean {grade} with its standard error in slices, over counts: {swaths}.",
        "contacts": f"Mean {grade} by distance from the bottom and the top, over counts: "
        f"{contacts}.",
    }


def _ranges(fitted: FittedVariogram) -> str:
    along, _, across = fitted.model.ranges
    if not fitted.model.structures:
        return "pure nugget"
    return f"range {number(along)} along, {number(across)} across"


def _spread(profile: pd.DataFrame) -> str:
    means = profile["mean"].dropna()
    if not len(means):
        return "of no sample"
    return f"{number(float(means.min()))} to {number(float(means.max()))}"


def _sides(profile: pd.DataFrame) -> str:
    """Return the mean grade on either side of a contact, as a phrase."""
    said = []
    for side, some in (("inside", profile["low"] >= 0), ("outside", profile["low"] < 0)):
        count = profile.loc[some, "count"].to_numpy()
        sums = count * profile.loc[some, "mean"].fillna(0.0).to_numpy()
        total = int(count.sum())
        mean = f"{number(float(sums.sum() / total))} of {total:,}" if total else "no sample"
        said.append(f"{side} {mean}")
    return ", ".join(said)


def _row(values: Mapping[Any, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return the named values; a dash for those that are no number."""
    return {n: "–" if values[n] != values[n] else values[n] for n in names}


def _model(space: str, fitted: FittedVariogram) -> dict[str, Any]:
    model = fitted.model
    along, _, across = model.ranges
    return {
        "space": space,
        "model": ", ".join(s.kind for s in model.structures) or "nugget",
        "nugget": model.nugget,
        "sill": model.sill,
        "range along": along,
        "range across": across,
        "misfit": fitted.misfit,
    }


def drawn(figure: Figure, caption: str) -> str:
    """Return a figure with its caption as HTML."""
    from geounfold.report.plots.figures import svg

    data, words = base64.b64encode(svg(figure)).decode("ascii"), text(caption)
    return (
        f'<figure class="drawn"><div class="wide" tabindex="0"><img alt="{words}" '
        f'src="data:image/svg+xml;base64,{data}"></div><figcaption>{words}</figcaption></figure>'
    )
