"""The axis of a fold, found from body and waste along holes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.modelling.traced import Traced

_MOST = 2000  # points that tell; more do not change the answer
_NEIGHBOURS = 16  # nearest points among which one of another hole is sought
_DIRECTIONS = 160  # first tries over the half sphere: 11 degrees apart
_ROUNDS = 3  # of refinement, each with a third of the width


def axis_from_angles(trend: float, plunge: float) -> Floats:
    """Return the unit vector (3,) of a trend and a plunge below the horizontal, degrees.

    >>> axis_from_angles(90.0, 0.0).round(9).tolist()
    [1.0, 0.0, -0.0]
    """
    t, p = np.radians([trend, plunge])
    return np.array([np.sin(t) * np.cos(p), np.cos(t) * np.cos(p), -np.sin(p)])


def angles_of_axis(axis: Floats) -> tuple[float, float]:
    """Return trend and plunge, degrees, of an axis turned downwards."""
    x, y, z = axis if axis[2] <= 0 else -axis
    return float(np.degrees(np.arctan2(x, y)) % 360), float(np.degrees(np.arcsin(min(-z, 1.0))))


def across(axis: Floats) -> Floats:
    """Return two unit vectors (2, 3) across an axis; the second is the one nearer to up."""
    up = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    second = up - axis * (up @ axis)
    second /= np.linalg.norm(second)
    return np.stack([np.cross(second, axis), second])


def found_axis(trace: Traced) -> Floats:
    """Return the direction along which the body looks most alike from hole to hole.

    All points are moved along a direction into one plane. If the layer is a curve moved along that
    direction, body lies on body there and waste on waste, so that the nearest point of another hole
    foretells a point. The direction with the fewest wrong ones is the axis. Rows of holes that fall
    together in a regular grid do not mislead it: their points agree only if the layer does.
    """
    if len(trace.ore) > _MOST:
        some = np.sort(np.random.default_rng(0).choice(len(trace.ore), _MOST, replace=False))
        trace = trace.kept(np.isin(np.arange(len(trace.ore)), some))
    tries = _half_sphere(_DIRECTIONS)
    width = np.sqrt(2 * np.pi / _DIRECTIONS)
    best = _best(tries, trace)
    for _ in range(_ROUNDS):
        best = _best(_around(best, width), trace)
        width /= 3
    return best if best[2] <= 0 else -best


def _best(tries: Floats, trace: Traced) -> Floats:
    """Return the direction with the fewest points foretold wrongly."""
    wrong = [_wrong(trace.points @ across(axis).T, trace.hole, trace.ore) for axis in tries]
    return np.asarray(tries[int(np.argmin(wrong))])


def _wrong(flat: Floats, hole: Ints, ore: Bools) -> float:
    """Return the share of points that the nearest ones of other holes foretell wrongly."""
    _, near = cKDTree(flat).query(flat, k=min(_NEIGHBOURS, len(flat)))
    near = np.asarray(near)
    other = hole[near] != hole[:, None]
    # The three nearest of other holes vote, the nearest twice.
    rank = np.cumsum(other, axis=1)
    weight = np.where(other & (rank <= 3), np.where(rank == 1, 1.5, 1.0), 0.0)
    votes = (weight * ore[near]).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
    share = np.where(weight.sum(axis=1) > 0, votes, 0.5)
    return float(np.abs(share - ore).mean())


def _half_sphere(count: int) -> Floats:
    """Return unit vectors (count, 3) that are evenly spread over the lower half sphere."""
    k = np.arange(count) + 0.5
    z = -k / count
    turn = np.pi * (1 + np.sqrt(5.0)) * k
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])


def _around(axis: Floats, width: float) -> Floats:
    """Return unit vectors around one, on three rings within a width in radians, and itself."""
    a, b = across(axis)
    out = [axis]
    for ring in (1 / 3, 2 / 3, 1.0):
        for turn in np.arange(8) * np.pi / 4:
            off = ring * width * (np.cos(turn) * a + np.sin(turn) * b)
            out.append((axis + off) / np.linalg.norm(axis + off))
    return np.asarray(out)
