"""Exploratory data analysis of samples: the tables that `report.plots.grades` draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError
from geounfold.estimation.experimental import directional
from geounfold.estimation.fit import FittedVariogram, fit_variogram
from geounfold.estimation.flat_samples import FlatSamples, flat_samples
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.grade_values import GradeRules, grade_rules


@dataclass(frozen=True, eq=False)
class Exploration:
    """The tables of exploratory data analysis of one grade.

    Attributes
    ----------
    grade : str
        Column of the samples.
    samples : FlatSamples
        The samples used.
    histogram : DataFrame
        Counts by grade, as `histogram` returns them.
    layers : DataFrame
        Statistics by layer from the bottom up, as `by_layer` returns them.
    variograms : dict of DataFrame
        Experimental variograms by space (folded, unfolded) along the axes of the models, as
        `directional` returns them.
    models : dict of FittedVariogram
        Models fitted in each space (`fit_variogram`).
    swaths : dict of DataFrame
        Means along x, y and the stratigraphic coordinate, as `swath` returns them.
    contacts : dict of DataFrame
        Means by distance from the bottom and the top, as `contact` returns them. Distances are
        in thicknesses of the layer.
    """

    grade: str
    samples: FlatSamples
    histogram: pd.DataFrame
    layers: pd.DataFrame
    variograms: Mapping[str, pd.DataFrame]
    models: Mapping[str, FittedVariogram]
    swaths: Mapping[str, pd.DataFrame]
    contacts: Mapping[str, pd.DataFrame]

    def summary(self) -> dict[str, Any]:
        """Return every table as plain numbers by column, for JSON; NaN becomes None."""
        models = {
            space: {**fitted.model.facts(), "misfit": fitted.misfit}
            for space, fitted in self.models.items()
        }
        several = ("variograms", "swaths", "contacts")
        return {
            "grade": self.grade,
            "samples": self.samples.facts(),
            "statistics": {k: _number(v) for k, v in statistics(self.samples.grades).items()},
            "histogram": _lists(self.histogram),
            "layers": _lists(self.layers),
            "models": models,
            **{
                name: {key: _lists(table) for key, table in getattr(self, name).items()}
                for name in several
            },
        }


def explore(
    unfolding: Any,
    samples: pd.DataFrame,
    *,
    grade: str,
    hole: str | None = None,
    layers: int = 10,
    bins: int = 30,
    values: GradeRules | Mapping[str, Any] | None = None,
) -> Exploration:
    """Return the tables of exploratory data analysis of one grade, in both spaces.

    Parameters
    ----------
    unfolding : Unfolding or UnfoldingMap
        The map from the folded to the unfolded space.
    samples : DataFrame
        Folded coordinates, the grade and, if known, the hole, as `estimate` takes them.
    grade : str
        Column of the grade.
    hole : str, optional
        Column of the hole's name.
    layers : int
        Number of slices of equal stratigraphic height from bottom to top.
    bins : int
        Number of bins of the histogram and of each swath.
    values : GradeRules or mapping, optional
        How the grade's values are read, as `estimate` takes it.

    Raises
    ------
    InputError
        A column is missing or has no usable value, or a variogram has fewer than 20 samples.
    OptionError
        A number of layers or bins is not a whole number of 1 or more.
    """
    for name, value in (("layers", layers), ("bins", bins)):
        if not isinstance(value, int) or value < 1:
            raise OptionError(f"{name} must be a whole number of 1 or more, not {value!r}")
    carrier = getattr(unfolding, "map", unfolding)
    flat = flat_samples(carrier, samples, grade=grade, hole=hole, rules=grade_rules(values))
    s, v = flat.stratigraphic, flat.grades
    places = {"x": flat.points[:, 0], "y": flat.points[:, 1], "stratigraphic": s}
    places_of = {"folded": flat.folded, "unfolded": flat.points}
    models = {space: fit_variogram(P, v, holes=flat.holes) for space, P in places_of.items()}
    return Exploration(
        grade=grade,
        samples=flat,
        histogram=histogram(v, bins),
        layers=by_layer(s, v, layers),
        variograms={
            space: directional(P, v, rotation=models[space].model.rotation)
            for space, P in places_of.items()
        },
        models=models,
        swaths={name: swath(place, v, bins) for name, place in places.items()},
        contacts={"bottom": contact(s, v, 0.05), "top": contact(1 - s, v, 0.05)},
    )


def statistics(values: Floats) -> dict[str, float]:
    """Return count, mean, std, cv, min, p10, p25, p50, p75, p90 and max of values (n,)."""
    v = np.asarray(values, dtype=np.float64)
    v = v[np.isfinite(v)]
    names = ("min", "p10", "p25", "p50", "p75", "p90", "max")
    if not len(v):
        return {"count": 0, **dict.fromkeys(("mean", "std", "cv", *names), float("nan"))}
    mean, std = float(v.mean()), float(v.std(ddof=1)) if len(v) > 1 else float("nan")
    quantiles = np.quantile(v, (0, 0.1, 0.25, 0.5, 0.75, 0.9, 1)).tolist()
    return {
        "count": len(v),
        "mean": mean,
        "std": std,
        "cv": std / mean if mean else float("nan"),
        **dict(zip(names, quantiles, strict=True)),
    }


def histogram(values: Floats, bins: int = 30) -> pd.DataFrame:
    """Return a histogram: columns low, high, count, share and cumulative (share up to high)."""
    v = _known(values)
    count, edges = np.histogram(v, bins)
    share = count / len(v)
    return pd.DataFrame(
        {
            "low": edges[:-1],
            "high": edges[1:],
            "count": count,
            "share": share,
            "cumulative": np.cumsum(share),
        }
    )


def by_layer(stratigraphic: Floats, values: Floats, layers: int = 10) -> pd.DataFrame:
    """Return statistics by layer: columns layer (1 is the lowest), from, to and `statistics`.

    Parameters
    ----------
    stratigraphic : (n,) float
        Stratigraphic height: 0 at the bottom, 1 at the top. Samples beyond belong to no layer.
    values : (n,) float
        Grades.
    layers : int
        Number of layers of equal stratigraphic height.
    """
    s, v = np.asarray(stratigraphic), np.asarray(values)
    layer = np.floor(s * layers)
    layer[s == 1] = layers - 1
    rows = [
        {"layer": k + 1, "from": k / layers, "to": (k + 1) / layers, **statistics(v[layer == k])}
        for k in range(layers)
    ]
    return pd.DataFrame(rows)


def swath(place: Floats, values: Floats, bins: int = 30) -> pd.DataFrame:
    """Return mean values in slices: columns low, high, count, mean, std; NaN where empty.

    Parameters
    ----------
    place : (n,) float
        Coordinate along the swath.
    values : (n,) float
        Grades.
    bins : int
        Number of slices of equal width.
    """
    place = np.asarray(place, dtype=np.float64)
    good = np.isfinite(place) & np.isfinite(np.asarray(values, dtype=np.float64))
    _known(np.asarray(values, dtype=np.float64)[good])
    edges = np.linspace(float(place[good].min()), float(place[good].max()), bins + 1)
    return swath_between(place, values, edges)


def swath_between(place: Floats, values: Floats, edges: Floats) -> pd.DataFrame:
    """Return mean values in the slices between edges, with the columns of `swath`."""
    place, v = np.asarray(place, dtype=np.float64), np.asarray(values, dtype=np.float64)
    good = np.isfinite(place) & np.isfinite(v)
    index = np.clip(np.searchsorted(edges, place[good], side="right") - 1, 0, len(edges) - 2)
    return _binned(index, v[good], edges)


def contact(
    distance: Floats, values: Floats, width: float, reach: float | None = None
) -> pd.DataFrame:
    """Return mean values by distance from a contact, with the columns of `swath`.

    Parameters
    ----------
    distance : (n,) float
        Signed distance: above 0 inside, below 0 outside.
    values : (n,) float
        Grades.
    width : float
        Width of the slices, in the unit of distance. One slice begins at the contact.
    reach : float, optional
        Largest distance on either side; the default is ten slices.

    Raises
    ------
    OptionError
        The width or reach is not above 0.
    """
    reach = 10 * width if reach is None else reach
    if not (width > 0 and reach > 0):
        raise OptionError(f"width and reach must be above 0, not {width} and {reach}")
    d, v = np.asarray(distance, dtype=np.float64), np.asarray(values, dtype=np.float64)
    side = max(1, round(reach / width))
    edges = width * np.arange(-side, side + 1)
    index = np.floor(d / width) + side
    good = np.isfinite(d) & np.isfinite(v) & (index >= 0) & (index < 2 * side)
    return _binned(index[good].astype(np.int64), v[good], edges)


def _binned(index: Ints, v: Floats, edges: np.ndarray) -> pd.DataFrame:
    bins = len(edges) - 1
    count = np.bincount(index, minlength=bins)
    some = np.where(count > 0, count, 1)
    mean = np.where(count > 0, np.bincount(index, v, bins) / some, np.nan)
    square = np.bincount(index, (v - np.where(count > 0, mean, 0.0)[index]) ** 2, bins)
    std = np.where(count > 1, np.sqrt(square / np.maximum(count - 1, 1)), np.nan)
    return pd.DataFrame(
        {"low": edges[:-1], "high": edges[1:], "count": count, "mean": mean, "std": std}
    )


def _known(values: Floats) -> Floats:
    v = np.asarray(values, dtype=np.float64)
    v = v[np.isfinite(v)]
    if not len(v):
        raise InputError("there are no values")
    return v


def _lists(table: pd.DataFrame) -> dict[str, list[Any]]:
    """Return a table's columns as lists."""
    return {str(n): [_number(v) for v in table[n].tolist()] for n in table.columns}


def _number(value: Any) -> Any:
    """Return None for a float that is not finite, and any other value unchanged."""
    return None if isinstance(value, float) and not np.isfinite(value) else value
