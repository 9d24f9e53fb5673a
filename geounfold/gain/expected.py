r"""The error that kriging is to be expected to make in some coordinates, without its grades.

A kriging estimate is a weighted sum of samples. If the true covariance C of the grades is known,
the mean square error of any such sum with weights w is

    C(0) - 2 w c + w C w

with c between samples and target (Chiles and Delfiner 2012, section 3.1; Journel and Huijbregts
1978, V.A). The weights may come from another model, in other coordinates: here the true covariance
is the variogram that was fitted in the unfolded space, and the weights are those of ordinary
kriging of the nearest samples in folded, stratigraphic or unfolded coordinates. The error is that
of the grade without its nugget: of a block, in which nugget averages out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.estimation import Variogram
from geounfold.geometry.mesh import Bools, Floats, Ints

_NEAREST, _PER_HOLE, _LOOK = 24, 6, 160
_JITTER = 1e-8  # of the sill, on the diagonal of the systems


@dataclass(frozen=True, eq=False)
class Truth:
    """The grades' covariance, in the unfolded space.

    Attributes
    ----------
    model : Variogram
    samples, targets : (n, 3), (m, 3) float
        Flat places.
    holes : (n,) int
        Hole of each sample.
    """

    model: Variogram
    samples: Floats
    targets: Floats
    holes: Ints

    @property
    def structured(self) -> float:
        """The sill without the nugget."""
        return self.model.sill - self.model.nugget


def expected_error(truth: Truth, samples: Floats, targets: Floats, model: Variogram) -> float:
    """Return the root mean square error of ordinary kriging in some coordinates.

    Parameters
    ----------
    truth : Truth
        What holds for the grades.
    samples, targets : (n, 3), (m, 3) float
        Places in the coordinates of the kriging.
    model : Variogram
        The kriging's own model there.
    """
    rows, used = _nearest(samples, targets, truth.holes, model)
    weights = _weights(samples[rows], targets, used, model)
    return float(np.sqrt(np.maximum(_errors(truth, rows, weights, used), 0.0).mean()))


def _nearest(samples: Floats, targets: Floats, holes: Ints, model: Variogram) -> tuple[Ints, Bools]:
    """Return rows (m, k) of the nearest samples in units of the ranges, six of a hole at most."""
    ranges = np.array(model.ranges) if model.structures else np.ones(3)
    S, T = samples @ model.axes.T / ranges, targets @ model.axes.T / ranges
    count = min(_LOOK, len(S))
    rows = np.asarray(cKDTree(S).query(T, k=count)[1]).reshape(len(T), -1)
    own = holes[rows]
    # The rank of each sample among the nearer ones of its hole.
    order = np.argsort(own, axis=1, kind="stable")
    sorted_holes = np.take_along_axis(own, order, axis=1)
    place = np.arange(count)
    first = np.where(np.diff(sorted_holes, axis=1, prepend=-1) != 0, place, 0)
    rank = np.empty_like(order)
    within = place - np.maximum.accumulate(first, axis=1)
    np.put_along_axis(rank, order, within, axis=1)
    few = rank < _PER_HOLE
    # The nearest that may be used come first.
    front = np.argsort(~few, axis=1, kind="stable")[:, : min(_NEAREST, count)]
    return np.take_along_axis(rows, front, axis=1), np.take_along_axis(few, front, axis=1)


def _weights(near: Floats, targets: Floats, used: Bools, model: Variogram) -> Floats:
    """Return the weights (m, k) of ordinary kriging; 0 for samples that are not used."""
    m, k = used.shape
    sill = model.sill
    left = sill - _gamma(model, near[:, :, None] - near[:, None])
    left += (_JITTER * sill) * np.eye(k)
    right = sill - _gamma(model, near - targets[:, None])
    at_zero = (near == targets[:, None]).all(axis=2)
    right -= np.where(at_zero, model.nugget, 0.0)  # the target has no nugget of its own
    both = used[:, :, None] & used[:, None]
    left = np.where(both, left, np.eye(k) * sill)
    system = np.zeros((m, k + 1, k + 1))
    system[:, :k, :k] = left
    system[:, :k, k] = system[:, k, :k] = used * sill
    vector = np.concatenate([np.where(used, right, 0.0), np.full((m, 1), sill)], axis=1)
    return np.asarray(np.linalg.solve(system, vector[..., None])[:, :k, 0])


def _errors(truth: Truth, rows: Ints, weights: Floats, used: Bools) -> Floats:
    """Return the mean square error of each target (m,), in the grades' unit squared."""
    near = truth.samples[rows]
    model = truth.model
    whole = model.sill - _gamma(model, near[:, :, None] - near[:, None])
    cross = model.sill - _gamma(model, near - truth.targets[:, None])
    at_zero = (near == truth.targets[:, None]).all(axis=2)
    cross -= np.where(at_zero, model.nugget, 0.0)
    w = np.where(used, weights, 0.0)
    linear = (w * cross).sum(axis=1)
    square = np.einsum("mi,mij,mj->m", w, whole, w)
    return np.asarray(truth.structured - 2 * linear + square)


def _gamma(model: Variogram, separation: Floats) -> Floats:
    """Return the semivariance of separations (..., 3)."""
    flat = separation.reshape(-1, 3)
    return model.gamma(flat).reshape(separation.shape[:-1])
