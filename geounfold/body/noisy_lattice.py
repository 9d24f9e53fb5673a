"""The lattice of centroids that noise has moved off it.

Noise of a fifth of a block leaves no point on its lattice. But the mean of ``exp(2 pi i q.x)`` over
the points still peaks at the lattice's wave vectors q, at exp(-2 pi^2 0.2^2) = 0.45 of its value
without noise; points at random give one over the root of their number. A Fourier transform of the
points around one centre finds two peaks; the third lies in the direction across both. A fit to the
nearest lattice positions then grows from there to all points.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from geounfold.body.lattice import Fit, Lattice, distinct, named, refit
from geounfold.geometry.mesh import Floats

CLEAR = 0.3
"""Least coherence of all points along each axis; noise of 0.25 steps gives it."""

_PEAK = 0.12  # least coherence of the first points; 4,000 points at random reach 0.07
_BALL = 4000  # points around the centre from which the search starts
_NODES = 128  # per axis of the transform's grid
_HALVINGS = 12  # of the step towards a peak, to 1/4000 of its width
_TRIED = 2000  # nodes of the transform, at most, whose coherence is computed from the points
_LONGEST = 0.45  # longest step, as a share of the ball's radius
_SQUARE = 0.12  # largest cosine between wave vectors
_HARMONIC = 0.6  # least share of the peak at which a shorter wave vector on its line counts
_ROUNDS = 20  # of the last fit, at most, until no point changes its position
_GROWTH = 2.0  # of the number of points from fit to fit


def disturbed_lattice(points: Floats) -> Lattice | None:
    """Return the lattice around which noisy centroids scatter; None if they have none.

    Parameters
    ----------
    points : (n, 3) float
        Centroids in world coordinates.

    Returns
    -------
    Lattice or None
        Its ``share`` is the least coherence along an axis: 1 without noise, 0.45 with noise of a
        standard deviation of 0.2 steps.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    X = distinct(points) - middle
    place = X[((X - X.mean(axis=0)) ** 2).sum(axis=1).argmin()]
    centre, X = middle + place, X - place
    X = X[np.argsort((X * X).sum(axis=1), kind="stable")]
    waves = _waves(X[:_BALL])
    if waves is None:
        return None
    size = np.linalg.norm(waves, axis=1)
    axes = _square(waves / size[:, None])
    fit: Fit | None = Fit(axes, 1 / size, np.zeros(3))
    count = 60.0
    while fit is not None:
        part = X[: int(count)]
        fit = refit(part, _shifted(part, fit), 0.5)
        if count >= len(X):
            break
        count *= _GROWTH
    for _ in range(_ROUNDS):
        if fit is None:
            return None
        before, fit = fit, refit(X, fit, 0.5)
        if fit is not None and np.array_equal(np.rint(before.cells(X)), np.rint(fit.cells(X))):
            break
    if fit is None:
        return None
    share = float(np.abs(_phases(X, fit).mean(axis=0)).min())
    if share < CLEAR:
        return None
    axes, steps = named(fit.axes, fit.steps)
    origin = centre + fit.origin
    return Lattice(axes=axes, steps=steps, share=share, origin=origin)


def _phases(X: Floats, fit: Fit) -> NDArray[np.complex128]:
    out: NDArray[np.complex128] = np.exp(2j * np.pi * fit.cells(X))
    return out


def _shifted(X: Floats, fit: Fit) -> Fit:
    """Return the fit with its origin moved so that the points' mean phase is zero."""
    phase = np.angle(_phases(X, fit).mean(axis=0)) / (2 * np.pi)
    return Fit(fit.axes, fit.steps, fit.origin + (phase * fit.steps) @ fit.axes)


def _square(axes: Floats) -> Floats:
    """Return the right-handed rotation nearest to nearly orthogonal rows."""
    u, _, vt = np.linalg.svd(axes)
    out: Floats = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return out


def _waves(ball: Floats) -> Floats | None:
    """Return three wave vectors at right angles, (3, 3), that a ball's points share, or None."""
    radius = float(np.linalg.norm(ball[-1]))
    taper = np.exp(-2 * (ball * ball).sum(axis=1) / radius**2)
    taper = taper / taper.sum()
    cell = 2 * radius / _NODES
    grid = np.zeros((_NODES,) * 3, np.float32)
    node = np.minimum((ball / cell + _NODES / 2).astype(np.int64), _NODES - 1)
    np.add.at(grid, tuple(node.T), taper.astype(np.float32))
    power = np.abs(scipy.fft.rfftn(grid, overwrite_x=True))
    q = [np.fft.fftfreq(_NODES, cell), np.fft.fftfreq(_NODES, cell), np.fft.rfftfreq(_NODES, cell)]
    least = 1 / (_LONGEST * radius)
    size = np.sqrt(sum(np.square(a) for a in np.ix_(*q)))
    candidates = np.argwhere((power > _PEAK) & (size > least))
    strongest = np.argsort(-power[tuple(candidates.T)], kind="stable")[:_TRIED]
    Q = np.stack([q[axis][candidates[strongest, axis]] for axis in range(3)], axis=1)
    # Of the points themselves: on the grid, waves too short for it look like long ones.
    value = _coherence(ball, taper, Q)
    Q, value = Q[value > _PEAK], value[value > _PEAK]
    first = _shortest_peak(Q, value)
    if first is None:
        return None
    first = _climbed(ball, taper, first, 0.5 / radius)
    across = np.abs(Q @ first) < _SQUARE * np.linalg.norm(Q, axis=1) * np.linalg.norm(first)
    second = _shortest_peak(Q[across], value[across])
    if second is None:
        return None
    second = _climbed(ball, taper, second, 0.5 / radius)
    third = np.cross(first, second)
    third = third / np.linalg.norm(third)
    scan = np.arange(least, 4 / cell, 0.25 / radius)
    lean = _coherence(ball, taper, scan[:, None] * third)
    best = _shortest_peak(scan[:, None] * third, np.where(lean > _PEAK, lean, 0.0))
    if best is None:
        return None
    return np.array([first, second, _climbed(ball, taper, best, 0.5 / radius)])


def _climbed(ball: Floats, taper: Floats, wave: Floats, step: float) -> Floats:
    """Return the wave vector of greatest coherence near one, by steps that are halved."""
    around = np.stack(np.meshgrid(*[(0.0, -1.0, 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    for _ in range(_HALVINGS):
        tried = wave + step * around
        wave, step = tried[_coherence(ball, taper, tried).argmax()], step / 2
    return wave


def _coherence(ball: Floats, taper: Floats, waves: Floats) -> Floats:
    out: Floats = np.abs(np.exp(2j * np.pi * (waves @ ball.T)) @ taper)
    return out


def _shortest_peak(Q: Floats, value: Floats) -> Floats | None:
    """Return the strongest wave vector, or the shortest along its line that is nearly as strong."""
    if not len(Q) or value.max() <= 0:
        return None
    peak = Q[value.argmax()]
    size = np.linalg.norm(Q, axis=1)
    line = np.abs(Q @ peak) > 0.98 * size * np.linalg.norm(peak)
    strong = line & (value > _HARMONIC * value.max())
    out: Floats = Q[np.flatnonzero(strong)[size[strong].argmin()]]
    near = np.linalg.norm(Q - out, axis=1) < 0.3 * np.linalg.norm(out)
    best: Floats = Q[np.flatnonzero(near)[value[near].argmax()]]
    return best
