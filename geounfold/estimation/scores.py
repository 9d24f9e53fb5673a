"""How good estimates are: against true values, and as tonnes and metal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats


@dataclass(frozen=True)
class Scores:
    """Estimates against true values.

    Attributes
    ----------
    count : int
        Of targets with an estimate.
    missing : int
        Of those without one, which are not counted in the others.
    rmse : float
        Root mean square error.
    bias : float
        Mean error, estimate less truth.
    slope : float
        Of the regression of truth on estimate: 1 without conditional bias.
    correlation : float
    """

    count: int
    missing: int
    rmse: float
    bias: float
    slope: float
    correlation: float


def score(truth: Floats, estimate: Floats) -> Scores:
    """Return how estimates (n,) compare with true values (n,).

    Raises
    ------
    InputError
        Unequal lengths, or fewer than two estimates.

    Examples
    --------
    >>> score(np.array([0.0, 2.0, 4.0]), np.array([1.0, 2.0, 3.0])).slope
    2.0
    """
    t, e = np.asarray(truth, dtype=np.float64), np.asarray(estimate, dtype=np.float64)
    if t.shape != e.shape:
        raise InputError(f"{len(t)} true values, but {len(e)} estimates")
    there = np.isfinite(t) & np.isfinite(e)
    missing = int(np.count_nonzero(~there))
    t, e = t[there], e[there]
    if len(t) < 2:
        raise InputError(f"only {len(t)} estimates to compare with true values")
    error = e - t
    spread = float(e.var())
    together = float(((t - t.mean()) * (e - e.mean())).mean())
    varied = spread > 0 and t.var() > 0
    return Scores(
        count=len(t),
        missing=missing,
        rmse=float(np.sqrt((error**2).mean())),
        bias=float(error.mean()),
        slope=together / spread if spread > 0 else float("nan"),
        correlation=together / float(np.sqrt(spread * t.var())) if varied else float("nan"),
    )


def grade_tonnage(
    values: Floats, cutoffs: Sequence[float], volumes: Floats | None = None
) -> pd.DataFrame:
    """Return what lies at or above cut-offs.

    Parameters
    ----------
    values : (n,) float
        Grades; those that are NaN are left out.
    cutoffs : floats
    volumes : (n,) float, optional
        Of the blocks; 1 each without.

    Returns
    -------
    DataFrame
        Columns cutoff, tonnage (share of the volume), grade (mean above, NaN where nothing is),
        metal (volume times grade).
    """
    v = np.asarray(values, dtype=np.float64)
    size = np.ones(len(v)) if volumes is None else np.asarray(volumes, dtype=np.float64)
    there = np.isfinite(v)
    v, size = v[there], size[there]
    rows = []
    for cutoff in cutoffs:
        above = v >= cutoff
        volume, metal = float(size[above].sum()), float((size * v)[above].sum())
        rows.append(
            {
                "cutoff": float(cutoff),
                "tonnage": volume / float(size.sum()) if len(v) else float("nan"),
                "grade": metal / volume if volume > 0 else float("nan"),
                "metal": metal,
            }
        )
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Conservation:
    """Metal of the same estimates in both spaces.

    Attributes
    ----------
    folded, unfolded : float
        Sums of volume times grade.
    metal_change, volume_change : float
        Unfolded over folded, less 1.
    blocks : int
        With an estimate and a volume in both spaces.
    """

    folded: float
    unfolded: float
    metal_change: float
    volume_change: float
    blocks: int


def conservation(values: Floats, volumes: Floats, volume_ratio: Floats) -> Conservation:
    """Return the metal of estimates in the folded and the unfolded space.

    Parameters
    ----------
    values : (n,) float
        Grades; blocks without one are left out.
    volumes : (n,) float
        Of the folded blocks.
    volume_ratio : (n,) float
        Unfolded over folded, as `unfold` reports it.

    Raises
    ------
    InputError
        No block has all three, or the folded sum is 0.
    """
    v, size, ratio = (np.asarray(a, dtype=np.float64) for a in (values, volumes, volume_ratio))
    there = np.isfinite(v) & np.isfinite(size) & np.isfinite(ratio)
    v, size, ratio = v[there], size[there], ratio[there]
    folded, unfolded = float((size * v).sum()), float((size * ratio * v).sum())
    if not len(v) or folded == 0:
        raise InputError("no block has an estimate, a volume and a volume ratio")
    return Conservation(
        folded,
        unfolded,
        unfolded / folded - 1,
        float((size * ratio).sum() / size.sum()) - 1,
        len(v),
    )
