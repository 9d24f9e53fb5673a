"""Variogram models fitted to bins of pairs by weighted least squares.

With weights *near*, a bin's weight is its number of pairs over the square of the model and over the
square of the distance in ranges, because the nearest samples have most weight in kriging; with
*cressie* it is the number of pairs over the square of the model (Cressie 1985, Mathematical Geology
17: 563-586). `likelihood` is the better way on simulated and real sets; these serve comparisons.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.optimize import least_squares, nnls

from geounfold.estimation.variogram import Triple, correlation
from geounfold.geometry.mesh import Floats

_NUGGET = 1e-3  # smallest nugget beside a gaussian structure, as a share of the sill
_STARTS = (0.15, 0.5)  # starting ranges, as shares of the longest lags
_NEAR = 0.1  # squared ranges, added to a bin's squared distance to limit the weight of near bins
_ROUNDS = 3  # fits: one with equal weights, the others with weights of the last model


def three(ranges: Floats, anisotropy: str) -> Triple:
    """Return one range per axis."""
    which = {"isotropic": [0, 0, 0], "transverse": [0, 0, 1], "orthotropic": [0, 1, 2]}[anisotropy]
    a, b, c = np.asarray(ranges)[which].tolist()
    return a, b, c


def fitted_cells(
    cells: pd.DataFrame, kind: str, anisotropy: str, v: Floats, *, near: bool
) -> tuple[float, str, float, float, Floats]:
    """Return misfit, kind, nugget, sill and ranges of the best model of a kind."""
    H = cells[["h1", "h2", "h3"]].to_numpy()
    gamma, pairs = cells["gamma"].to_numpy(), cells["pairs"].to_numpy(dtype=np.float64)
    used = {"isotropic": [0], "transverse": [0, 2], "orthotropic": [0, 1, 2]}[anisotropy]
    longest = H[:, used].max(axis=0)
    longest = np.where(longest > 0, longest, 1.0)
    low, high = np.log(0.02 * longest), np.log(3.0 * longest)
    tries = []
    for start in _STARTS:
        x = np.log(start * longest)
        root = np.sqrt(pairs / _fading(H, _STARTS[0] * np.maximum(H.max(axis=0), 1e-300), near))
        for _ in range(_ROUNDS):

            def residual(x: Floats, root: Floats = root) -> Floats:
                model = _best_sills(H, gamma, root, kind, x, anisotropy)[2]
                return np.asarray(root * (model - gamma) / gamma.mean())

            x = least_squares(residual, x, bounds=(low, high), diff_step=[1e-4]).x
            nugget, sill, model = _best_sills(H, gamma, root, kind, x, anisotropy)
            model = np.maximum(model, 1e-3 * gamma.mean())
            root = (
                np.sqrt(pairs / _fading(H, three(np.exp(x), anisotropy), near))
                * gamma.mean()
                / model
            )
        misfit = float(np.sqrt((pairs * (gamma / model - 1) ** 2).sum() / pairs.sum()))
        tries.append((misfit, nugget, sill, x))
    misfit, nugget, sill, x = min(tries, key=lambda t: t[0])
    if kind == "gaussian" and nugget < _NUGGET * (nugget + sill):
        nugget = _NUGGET * (nugget + sill)
    if nugget + sill <= 0:
        nugget = float(v.var())
    return misfit, kind, nugget, sill, np.exp(x)


def _fading(H: Floats, ranges: Floats | Triple, near: bool) -> Floats:
    """Return the divisors of the bins' weights: squared distances in ranges, plus `_NEAR`."""
    if not near:
        return np.ones(len(H))
    return np.asarray(_NEAR + ((H / np.asarray(ranges)) ** 2).sum(axis=1))


def _best_sills(
    H: Floats, gamma: Floats, root: Floats, kind: str, x: Floats, anisotropy: str
) -> tuple[float, float, Floats]:
    """Return the nugget and sill by least squares for given ranges, and the model's gamma."""
    ranges = np.asarray(three(np.exp(x), anisotropy))
    shape = 1 - correlation(kind, np.linalg.norm(H / ranges, axis=1))
    A = np.column_stack([np.ones(len(shape)), shape])
    (nugget, sill), _ = nnls(A * root[:, None], gamma * root)
    return float(nugget), float(sill), np.asarray(nugget + sill * shape)
