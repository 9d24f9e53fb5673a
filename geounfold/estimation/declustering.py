"""Weights of clustered samples: cell declustering.

Every sample shares its cell with others and gets the weight of one over their number, averaged over
several places of the cells, as in GSLIB's declus (Deutsch & Journel 1998, section VI.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.errors import InputError, OptionError, check_numbers
from geounfold.geometry.mesh import Floats, Ints

_OFFSETS = 8  # places of the cells over which weights are averaged
_SIZES = 24  # sizes that "auto" tries


@dataclass(frozen=True, eq=False)
class Declustering:
    """Weights of samples, and the statistics that they give.

    Attributes
    ----------
    weights : (n,) float
        Mean 1.
    cell : (float, float, float)
        Sides of the cells; infinite for one cell along an axis.
    mean, std : float
        Weighted, in the values' unit.
    plain_mean : float
        Without weights.
    """

    weights: Floats
    cell: tuple[float, float, float]
    mean: float
    std: float
    plain_mean: float

    def facts(self) -> dict[str, Any]:
        """Return the figures for a summary; an infinite side is None."""
        sides = [side if np.isfinite(side) else None for side in self.cell]
        return {"cell": sides, "mean": self.mean, "std": self.std, "plain_mean": self.plain_mean}


def decluster(points: Floats, values: Floats, cell: Any = "auto") -> Declustering:
    """Return the cell declustering of samples.

    Parameters
    ----------
    points : (n, 3) float
        Places of the samples; unfolded ones, so that cells follow the layers.
    values : (n,) float
        Their values.
    cell : (float, float, float) or "auto"
        Sides of the cells. ``auto``: squares along the layer, as high as all samples, of the side
        that gives the smallest mean; 24 sides from the samples' median spacing to a third of
        their extent are tried.

    Raises
    ------
    InputError
        There are no samples, or as many values.
    OptionError
        A side is not above 0.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [90, 0, 0]])
    >>> decluster(points, np.array([3.0, 3, 3, 1]), (10, 10, 10)).mean.__round__(1)
    2.1
    """
    P, v = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or v.shape != (len(P),) or not len(P):
        raise InputError(
            f"declustering needs points (n, 3) and values (n,), not {P.shape}, {v.shape}"
        )
    if isinstance(cell, str):
        if cell != "auto":
            raise OptionError(f"cells must be three sides or auto, not '{cell}'")
        tried = [_declustered(P, v, (side, side, np.inf)) for side in _sides(P)]
        return min(tried, key=lambda found: found.mean)
    check_numbers("cells", cell, 3)
    a, b, c = (float(side) for side in cell)
    if min(a, b, c) <= 0:
        raise OptionError(f"cells must have sides above 0, not {a:g}, {b:g}, {c:g}")
    return _declustered(P, v, (a, b, c))


def _declustered(points: Floats, values: Floats, cell: tuple[float, float, float]) -> Declustering:
    total = np.zeros(len(points))
    start = points.min(axis=0)
    sides = np.array(cell)
    for k in range(_OFFSETS):
        place = np.floor((points - start) / sides + k / _OFFSETS).astype(np.int64)
        total += 1.0 / _crowd(place)
    weights = total * (len(total) / _sum(total))
    mean = _sum(weights * values) / len(values)
    variance = _sum(weights * (values - mean) ** 2) / len(values)
    plain = _sum(values) / len(values)
    return Declustering(weights, cell, mean, float(np.sqrt(variance)), plain)


def _crowd(place: Ints) -> Ints:
    """Return how many samples share each one's cell, (n,)."""
    _, cell, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(count[cell.ravel()])


def _sum(values: Floats) -> float:
    """Return a sum that does not depend on the values' order."""
    return float(np.sort(values).sum())


def _sides(points: Floats) -> Floats:
    """Return the sides that ``auto`` tries, along the layer."""
    from scipy.spatial import cKDTree

    flat = np.unique(points[:, :2], axis=0)
    extent = float(np.ptp(flat, axis=0).max()) if len(flat) > 1 else 0.0
    if not extent > 0:
        return np.array([np.inf])
    near = np.asarray(cKDTree(flat).query(flat, k=2)[0])[:, 1]
    low = min(float(np.median(near)), extent / 3)
    return np.geomspace(low, extent / 3, _SIZES)
