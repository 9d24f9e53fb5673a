"""Variogram models fitted to samples automatically.

The model is fitted to normal scores of the grades by restricted maximum likelihood on subsets of
holes, and carried back to the grades (`likelihood`, `normal_scores`). A second direction in the
layer, or a second structure, is kept if the likelihood grows by more than the parameters that it
adds would by chance (Schwarz 1978, Annals of Statistics 6: 461-464). If it grows by less, a second
direction is kept if it lowers the error of whole-hole cross-validation of the scores by two
standard errors (`left_out`). A second structure must in any case lower that of the grades by two:
real grades are not stationary, and likelihood alone prefers two structures that estimate worse
(docs/results/variograms.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import pandas as pd

from geounfold.backends.blas import one_thread
from geounfold.errors import InputError, OptionError
from geounfold.estimation.experimental import (
    PAIRS,
    cells_of,
    checked,
    down_hole,
    down_hole_nugget,
    thinned,
)
from geounfold.estimation.least_squares import fitted_cells, three
from geounfold.estimation.left_out import LeftOut
from geounfold.estimation.likelihood import AXES, Shape, Subsets, first_shape, packed, turned_start
from geounfold.estimation.normal_scores import hermite_shares, normal_scores, shape_of_grades
from geounfold.estimation.variogram import (
    KINDS,
    LEAST_NUGGET,
    Structure,
    Triple,
    Variogram,
    numbers,
)
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.rotations import angles_of
from geounfold.geometry.rotations import rotation_from_angles as turned

Anisotropy = Literal["auto", "isotropic", "transverse", "orthotropic"]
Weights = Literal["likelihood", "near", "cressie"]
WEIGHTS: tuple[str, ...] = get_args(Weights)
"""Ways of fitting: restricted maximum likelihood, or least squares with two kinds of weights."""

_BOUNDS = 0.005, 3.0  # shortest and longest range, as shares of the samples' extent
_NORMAL = 0.95  # share of the grades' variance in line with their scores, from which scores are
# not needed: normal samples have 0.987 and more, lognormal ones of deviation 0.8 up to 0.78
_LEAST_SHARE = 0.05  # smallest share of the sill of a second structure
_MUCH_NUGGET = 0.7  # share of the sill above which a warning is due


@dataclass(frozen=True, eq=False)
class FittedVariogram:
    """A fitted model and the bins that it is compared with.

    Attributes
    ----------
    model : Variogram
        The fitted model.
    cells : DataFrame
        The bins: columns h1, h2, h3, gamma, pairs and model. h1 to h3 are mean distances along
        the axes. With transverse anisotropy h1 is the distance in the plane; with none it is the
        whole distance.
    misfit : float
        Root mean square of gamma over the model's gamma, less 1, weighted by pairs.
    anisotropy : str
        isotropic, transverse or orthotropic.
    weights : str
        likelihood, near or cressie.
    value : float
        Minus the logarithm of the restricted likelihood, but for a constant: of fits to the same
        samples with other rotations, the smallest is the best. NaN with other weights.
    down_hole : DataFrame or None
        The variogram along the holes (`experimental.down_hole`); None if the holes are not known.
    spacing : float
        Median distance in the layer between a hole and the nearest other hole; between a sample
        and the nearest other one if the holes are not known.
    extent : (float, float, float)
        Lengths of the samples' extent along the axes.
    bounds : tuple of str
        Names of the parameters that ended on a bound of the fit.
    """

    model: Variogram
    cells: pd.DataFrame
    misfit: float
    anisotropy: str
    weights: str = "likelihood"
    value: float = float("nan")
    down_hole: pd.DataFrame | None = None
    spacing: float = float("nan")
    extent: Triple = (float("inf"), float("inf"), float("inf"))
    bounds: tuple[str, ...] = ()

    def facts(self) -> dict[str, object]:
        """Return how the model was fitted, for a summary."""
        nugget = None if self.down_hole is None else down_hole_nugget(self.down_hole)
        return {
            "weights": self.weights,
            "anisotropy": self.anisotropy,
            "misfit": self.misfit,
            "down_hole_nugget": nugget,
            "hole_spacing": self.spacing if np.isfinite(self.spacing) else None,
            "bounds_hit": list(self.bounds),
        }

    def warnings(self) -> list[str]:
        """Return one line for each sign that the model should be looked at."""
        model, lines = self.model, []
        for name in self.bounds:
            lines.append(
                f"the fitted variogram's {name} lies on a bound of the fit: the samples do not "
                "show it; give a model by --variogram"
            )
        if not model.structures:
            return [*lines, "the fitted variogram is a pure nugget: estimates are local means"]
        if model.nugget > _MUCH_NUGGET * model.sill:
            lines.append(
                f"the fitted variogram's nugget is {model.nugget / model.sill:.0%} of its sill: "
                "estimates will be close to local means; check composites, outliers and domains"
            )
        names = ("along axis 1", "along axis 2", "across the layer (axis 3)")
        for name, length, extent in zip(names, model.ranges, self.extent, strict=True):
            if length > extent > 0:
                lines.append(
                    f"the fitted variogram's range {name}, {length:.4g}, is longer than the "
                    f"samples' extent, {extent:.4g}: grades may trend, or need domains"
                )
        if max(model.ranges[:2]) < self.spacing:
            lines.append(
                f"the fitted variogram's range along the layer, {max(model.ranges[:2]):.4g}, is "
                f"shorter than the spacing of the holes, {self.spacing:.4g}: between holes "
                "estimates will be close to the local mean"
            )
        return lines


def fit_variogram(  # 9 arguments: a public name; seven of them are choices by keyword
    points: Floats,
    values: Floats,
    *,
    holes: Ints | None = None,
    anisotropy: Anisotropy = "auto",
    rotation: Triple = (0.0, 0.0, 0.0),
    kinds: Sequence[str] = KINDS,
    structures: int = 2,
    weights: Weights = "likelihood",
    scores: bool = True,
) -> FittedVariogram:
    """Fit a nugget and one or two structures to samples.

    Parameters
    ----------
    points : (n, 3) float
        Samples in the unfolded space.
    values : (n,) float
        Grades.
    holes : (n,) int, optional
        Number of each sample's hole: down-hole lags then show the nugget.
    anisotropy : {"auto", "isotropic", "transverse", "orthotropic"}
        Transverse: one range along the layer (the first two axes) and one across it. Orthotropic:
        two along the layer, in directions that are found. Auto: transverse or orthotropic.
    rotation : (float, float, float)
        Bearing, plunge and dip of the axes, degrees, as in `Variogram`.
    kinds : names
        Structures to try: spherical, exponential, gaussian, matern (of smoothness 1.5).
    structures : int
        Most structures, 1 or 2.
    weights : {"likelihood", "near", "cressie"}
        Restricted maximum likelihood on subsets of holes, or least squares on bins of pairs that
        weighs near lags, or all lags by Cressie's weights. Least squares fits one structure, and
        turns no axes.
    scores : bool
        Whether the structure is that of the grades' normal scores, carried back to the grades.
        Grades of which 95 % of the variance is in line with their scores are used as they are.

    Returns
    -------
    FittedVariogram
        The model of the largest likelihood (least squares: of the smallest misfit), with bins.

    Raises
    ------
    InputError
        There are fewer than 20 samples or too few pairs, or all values are equal.
    OptionError
        The anisotropy, a kind, the weights or the number of structures is not a valid one.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> fitted = fit_variogram(rng.random((500, 3)), rng.normal(size=500))
    >>> fitted.model.nugget > 0.7  # noise has no correlation
    True
    """
    P, v, own = checked(points, values, holes, anisotropy, kinds)
    if weights not in WEIGHTS:
        raise OptionError(f"weights {weights!r} are not one of: {', '.join(WEIGHTS)}")
    if structures not in (1, 2):
        raise OptionError(f"structures must be 1 or 2, not {structures!r}")
    rotation = numbers("the rotation", rotation, 3)
    local = P @ turned(*rotation).T
    extent = _extent(local)
    bounds: tuple[str, ...] = ()
    value = float("nan")
    with one_thread():
        if weights == "likelihood":
            shape, variance, used = _likeliest(
                local, v, own, (anisotropy, tuple(kinds), structures, scores)
            )
            model = _model_of(shape, variance, rotation)
            bounds, value = shape.bounds, shape.value
        else:
            used = "transverse" if anisotropy == "auto" else anisotropy
            model = _least_squares(local, v, used, kinds, near=weights == "near")
            model = replace(model, rotation=rotation)
    cells = _compared(P, v, model, used)
    ratio = cells["gamma"] / cells["model"].clip(lower=1e-3 * float(cells["gamma"].mean())) - 1
    misfit = float(np.sqrt((cells["pairs"] * ratio**2).sum() / cells["pairs"].sum()))
    return FittedVariogram(
        model, cells, misfit, used, weights, value,
        None if own is None else down_hole(P, v, own), hole_spacing(local, own), extent, bounds,
    )  # fmt: skip


def hole_spacing(local: Floats, holes: Ints | None) -> float:
    """Return the median distance in the plane of axes 1 and 2 from a hole to the nearest other.

    Parameters
    ----------
    local : (n, 3) float
        Samples along the axes.
    holes : (n,) int or None
        Number of each sample's hole; without, each place in the plane counts as one.
    """
    from scipy.spatial import cKDTree

    flat = local[:, :2]
    if holes is None:
        centres = np.unique(flat, axis=0)
    else:
        _, place, count = np.unique(holes, return_inverse=True, return_counts=True)
        sums = [np.bincount(place.ravel(), flat[:, k]) for k in range(2)]
        centres = np.column_stack(sums) / count[:, None]
    if len(centres) < 2:
        return float("nan")
    return float(np.median(np.asarray(cKDTree(centres).query(centres, k=2)[0])[:, 1]))


def _extent(local: Floats) -> Triple:
    """Return the samples' extent along the axes: its diagonal in the plane, and across."""
    x, y, z = np.ptp(local, axis=0).tolist()
    flat = float(np.hypot(x, y))
    return flat, flat, z


def _likeliest(
    local: Floats,
    v: Floats,
    holes: Ints | None,
    how: tuple[str, tuple[str, ...], int, bool],
) -> tuple[Shape, float, str]:
    """Return the shape of the largest likelihood, its variance and its anisotropy."""
    anisotropy, kinds, structures, scores = how
    P, v, holes = _one_each(local, v, holes)
    shares = hermite_shares(v) if scores else None
    if shares is not None and shares[0] > _NORMAL:
        shares = None
    y = (v - v.mean()) / v.std() if shares is None else normal_scores(v)
    subsets = Subsets(P, y, holes)
    extent = np.array(_extent(P))
    if anisotropy == "isotropic":
        extent[:] = np.linalg.norm(np.ptp(P, axis=0))
    extent = np.where(extent > 0, extent, 1.0)
    low, high = _BOUNDS[0] * extent, _BOUNDS[1] * extent
    penalty = 0.5 * np.log(len(P))
    plain = "transverse" if anisotropy == "auto" else anisotropy
    tried = _of_kinds(subsets, kinds, plain, _wide_start(P, holes, plain), (low, high))
    best, found = min(tried, key=lambda shape: shape.value), plain

    if anisotropy == "auto":
        other = _turned(subsets, tried, best, low, high)
        gain = best.value - other.value
        if not other.bounds and (
            gain > 2 * penalty or (gain > 0 and _estimates_better((P, y, holes), other, best))
        ):
            best, found = other, "orthotropic"
    if structures == 2:
        nested = _nested(subsets, best, found, low, high)
        count = 2 + max(AXES[found])
        likely = nested.value + count * penalty < best.value and _plausible(nested, extent)
        if likely and _estimates_better(
            (P, v, holes), _of_grades(nested, shares), _of_grades(best, shares)
        ):
            best = nested
    variance = float(v.var()) * subsets.variance(best, found) / float(y.var())
    return _of_grades(best, shares), variance, found


def _estimates_better(samples: tuple[Floats, Floats, Ints | None], new: Shape, old: Shape) -> bool:
    """Return whether a model has smaller errors at left-out holes, by two standard errors."""
    left_out = LeftOut(*samples)
    errors = [left_out.errors(_model_of(shape, 1.0, (0.0, 0.0, 0.0))) for shape in (new, old)]
    return left_out.better(*errors)


def _of_kinds(
    subsets: Subsets,
    kinds: Sequence[str],
    anisotropy: str,
    wide: Floats,
    limits: tuple[Floats, Floats],
) -> list[Shape]:
    """Return the best model of each kind, all of one structure."""
    low, high = limits
    start, _ = first_shape(subsets, anisotropy, low, high)
    tried: list[Shape] = []
    for kind in kinds:
        shape = subsets.fit((kind,), anisotropy, start, low, high)
        if shape.bounds:  # of a rough kind's many maxima perhaps not the highest
            other = subsets.fit((kind,), anisotropy, wide, low, high)
            shape = min(shape, other, key=lambda one: one.value)
        tried.append(shape)
        start = tried[0].vector
    return tried


def _wide_start(P: Floats, holes: Ints | None, anisotropy: str) -> Floats:
    """Return a start of ranges twice the spacing of holes, and a quarter of the height."""
    spacing = hole_spacing(P, holes)
    flat = 2 * spacing if spacing > 0 else 1.0
    ranges = np.array([[flat, flat, 0.25 * float(np.ptp(P[:, 2])) or flat]])
    return packed(np.array([0.3, 0.7]), ranges, 0.0, anisotropy)


def _of_grades(shape: Shape, shares: Floats | None) -> Shape:
    """Return the model of the grades; without Hermite shares it is the shape itself."""
    return shape if shares is None else shape_of_grades(shape, shares)


def _turned(
    subsets: Subsets, level: Sequence[Shape], best: Shape, low: Floats, high: Floats
) -> Shape:
    """Return the best model with two directions in the plane.

    The likelihood of rough kinds has many maxima, so the second start is the model of the smoothest
    kind that was tried but the gaussian: its likelihood has few.
    """
    smooth = next((shape for shape in level if shape.kinds == ("matern",)), best)
    found = []
    for one in {id(best): best, id(smooth): smooth}.values():
        start = turned_start(subsets, one, low, high)
        found.append(subsets.fit(one.kinds, "orthotropic", start, low, high))
    if smooth is not best:
        found.append(subsets.fit(best.kinds, "orthotropic", found[-1].vector, low, high))
    return min(found, key=lambda shape: shape.value)


def _nested(subsets: Subsets, one: Shape, anisotropy: str, low: Floats, high: Floats) -> Shape:
    """Return the best model of two structures of a kind, one shorter and one longer than one."""
    nugget, sill = one.shares
    shares = np.array([nugget, sill / 2, sill / 2])
    ranges = np.clip(one.ranges * np.array([[0.4], [1.6]]), 1.01 * low, 0.99 * high)
    start = packed(shares, ranges, one.turn, anisotropy)
    return subsets.fit(one.kinds * 2, anisotropy, start, low, high)


def _plausible(shape: Shape, extent: Floats) -> bool:
    """Return whether no structure is negligible, on a bound, or longer than the samples reach."""
    inside = (shape.ranges <= extent).all()
    return bool(inside and shape.shares[1:].min() >= _LEAST_SHARE and not shape.bounds)


def _one_each(P: Floats, v: Floats, holes: Ints | None) -> tuple[Floats, Floats, Ints | None]:
    """Return samples of which those in one place are one, of their mean."""
    new = np.concatenate([[True], (np.diff(P, axis=0) != 0).any(axis=1)])
    first = np.flatnonzero(new)
    count = np.diff(np.append(first, len(P)))
    return P[new], np.add.reduceat(v, first) / count, None if holes is None else holes[new]


def _model_of(shape: Shape, variance: float, rotation: Triple) -> Variogram:
    """Return the variogram of a shape; of two axes in the plane the first is the longer one."""
    ranges, turn = shape.ranges, shape.turn
    if ranges[:, 0].sum() < ranges[:, 1].sum():
        ranges, turn = ranges[:, [1, 0, 2]], turn + np.pi / 2
    nugget, *sills = (variance * shape.shares).tolist()
    parts = [
        Structure(kind, sill, (float(a), float(b), float(c)))
        for kind, sill, (a, b, c) in zip(shape.kinds, sills, ranges, strict=True)
        if sill > 1e-3 * variance
    ]
    if parts and {p.kind for p in parts} == {"gaussian"}:
        nugget = max(nugget, 1.01 * LEAST_NUGGET * variance)
    if not parts:
        nugget = variance
    if (ranges[:, 0] != ranges[:, 1]).any():
        c, s = np.cos(turn), np.sin(turn)
        axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ turned(*rotation)
        bearing, plunge, dip = angles_of(axes)
        rotation = bearing, plunge + 0.0, dip + 0.0  # no -0
    return Variogram(nugget, tuple(parts), rotation)


def _least_squares(
    local: Floats, v: Floats, anisotropy: str, kinds: Sequence[str], *, near: bool
) -> Variogram:
    """Return the model of the smallest misfit to bins of pairs."""
    cells = _binned(*thinned(local, v), anisotropy)
    found = (fitted_cells(cells, kind, anisotropy, v, near=near) for kind in kinds)
    _, kind, nugget, sill, ranges = min(found, key=lambda f: f[0])
    return Variogram(
        nugget, (Structure(kind, sill, three(ranges, anisotropy)),) if sill > 0 else ()
    )


def _binned(local: Floats, v: Floats, anisotropy: str) -> pd.DataFrame:
    cells = cells_of(local, v, anisotropy)
    if len(cells) < 6:
        raise InputError(
            f"only {len(cells)} bins of {PAIRS} pairs or more: too few samples for a variogram; "
            "give a variogram model"
        )
    return cells


def _compared(P: Floats, v: Floats, model: Variogram, anisotropy: str) -> pd.DataFrame:
    """Return the bins along the model's axes, with the model's semivariance."""
    P, v = thinned(P, v)
    cells = _binned(P @ model.axes.T, v, anisotropy)
    unturned = replace(model, rotation=(0.0, 0.0, 0.0))
    return cells.assign(model=unturned.gamma(cells[["h1", "h2", "h3"]].to_numpy()))
