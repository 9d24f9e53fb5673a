"""Bodies of several sheets, blocks of 5 m, with their true parts and the place where they meet."""

from dataclasses import dataclass

import numpy as np

from tests.shapes import grid_cells

SIDE = 5.0


@dataclass(frozen=True)
class Parted:
    """Blocks, their sheets by number, and the true distance of places from a junction."""

    points: np.ndarray
    part: np.ndarray
    kind: str
    off: object


def _grid(x, y, z):
    low = np.array([x[0], y[0], z[0]])
    count = ((np.array([x[1], y[1], z[1]]) - low) / SIDE).astype(int)
    return low + (grid_cells(*count) + 0.5) * SIDE


def _made(points, layers, kind, off):
    """Keep the points in any layer, each in the first that holds it."""
    part = np.full(len(points), -1)
    for number, held in enumerate(layers):
        part[held & (part < 0)] = number
    return Parted(points[part >= 0], part[part >= 0], kind, off)


def y_branch(angle=60.0):
    """A folded sheet 30 m thick, and one of 20 m that leaves its top at x = 0."""
    P = _grid((-200, 200), (-60, 60), (-50, 130))
    x, _, z = P.T
    t, a = z - 10 * np.sin(x / 100), np.radians(angle)
    u = x * np.sin(a) - t * np.cos(a)
    foot = 15 / np.tan(a)
    layers = [np.abs(t) < 15, (np.abs(u) < 10) & (t > 0)]
    return _made(P, layers, "branch", lambda q: np.hypot(q[0] - foot, q[2] - 15) - 12)


def x_crossing():
    """A sheet 30 m thick crossed at 70 degrees by one of 20 m, which it cuts in two."""
    P = _grid((-200, 200), (-60, 60), (-120, 120))
    x, _, z = P.T
    a = np.radians(70)
    u = x * np.sin(a) - z * np.cos(a)
    layers = [np.abs(z) < 15, (np.abs(u) < 10) & (z > 0), (np.abs(u) < 10) & (z < 0)]
    return _made(P, layers, "branch", lambda q: np.hypot(q[0], np.abs(q[2]) - 15) - 12)


def split_seam(lower=21.0, upper=13.0, opening=0.21):
    """A seam that a parting splits from x = -60 on; it is a block wide 5 m / opening farther."""
    P = _grid((-250, 250), (-60, 60), (-30, 130))
    x, _, z = P.T
    t, gap = z - 12 * np.sin(x / 110), np.clip(x + 60, 0, None) * opening
    layers = [(t > 0) & (t < lower), (t > lower + gap) & (t < lower + upper + gap)]
    ends = (-60.0, -60 + SIDE / opening)
    return _made(P, layers, "split", lambda q: max(ends[0] - q[0], q[0] - ends[1], 0.0))


def thrust(thick=30.0):
    """A sheet thrust over itself: both lie upon each other between x = -75 and 75."""
    P = _grid((-250, 250), (-60, 60), (-40, 100))
    x, _, z = P.T
    t, lift = z - 12 * np.sin(x / 110), thick * np.clip((150 - x) / 75, 0, 1)
    layers = [(t > lift) & (t < lift + thick) & (x > -75), (t > 0) & (t < thick) & (x < 75)]

    def off(q):
        return max(abs(q[0]) - 75, abs(q[2] - 12 * np.sin(q[0] / 110) - thick), 0.0)

    return _made(P, layers, "repeat", off)


def fault(thick=30.0, throw=0.8):
    """A sheet cut by a fault without drag, throw in thicknesses; its halves touch."""
    P = _grid((-200, 200), (-60, 60), (-60, 70))
    x, _, z = P.T
    d = x + z / np.tan(np.radians(60))
    s = z - 12 * np.sin(x / 110) + np.where(d > 0, throw * thick, 0)
    inside = (s > 0) & (s < thick)
    layers = [inside & (d <= 0), inside & (d > 0)]
    return _made(P, layers, "step", lambda q: abs(q[0] + q[2] / np.tan(np.radians(60))))


BODIES = {
    "y": y_branch,
    "x": x_crossing,
    "split": split_seam,
    "thrust": thrust,
    "fault": fault,
}
