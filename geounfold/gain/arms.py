"""The coordinates in which a grade may be estimated: folded, by limbs, stratigraphic, unfolded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.geometry.mesh import Bools, Floats, Ints

ARMS = ("isotropic", "plane", "limbs", "stratigraphic", "unfolded")
"""Isotropic and plane are folded; limbs has one plane for each of some domains of like dip."""

WORDS = {
    "isotropic": "one range, folded",
    "plane": "one best plane of anisotropy, folded",
    "limbs": "a domain with its own plane for each limb",
    "stratigraphic": "x, y and height between bottom and top",
    "unfolded": "unfolded",
}

_STEP = 0.02  # of the thickness: step along the layer by which its normal is measured
_TOLERANCE = 20.0  # degrees off their mean that normals of one limb may be, on average
_MOST_LIMBS = 4
_ROUNDS = 20
_FEWEST = 60  # samples of a limb with a model of its own
_DIRECTIONS = 40  # planes tried: 17 degrees apart
_THIN = 8.0  # range along a tried plane over that across it
_MOST = 600  # samples that choose the plane


@dataclass(frozen=True, eq=False)
class Places:
    """Samples or targets in both spaces.

    Attributes
    ----------
    folded, flat : (n, 3) float
    level : (n,) float
        Height in the layer: 0 at the bottom, 1 at the top.
    normal : (n, 3) float
        Unit normal of the layer, towards its top.
    """

    folded: Floats
    flat: Floats
    level: Floats
    normal: Floats

    def __len__(self) -> int:
        return len(self.folded)

    def kept(self, keep: Bools | Ints) -> Places:
        """Return the places to keep."""
        return Places(self.folded[keep], self.flat[keep], self.level[keep], self.normal[keep])

    def stratigraphic(self, thickness: float) -> Floats:
        """Return x, y and the height in the layer times a thickness, (n, 3)."""
        return np.column_stack([self.folded[:, :2], thickness * self.level])


def places_of(carrier: Any, folded: Floats) -> tuple[Places, Bools]:
    """Return the places of folded points that a map reaches, and which these are.

    Parameters
    ----------
    carrier : UnfoldingMap
        The map; it is evaluated a step along the layer for the normals.
    folded : (n, 3) float
    """
    carried = carrier.carry(folded)
    there = carried.placed & np.isfinite(carried.points).all(axis=1)
    flat, level = carried.points[there], carried.stratigraphic[there]
    thickness = _thickness(flat[:, 2], level)
    own = folded[there]
    first, second = (_image(carrier, own, flat, axis, _STEP * thickness) for axis in range(2))
    normal = np.cross(first, second)
    length = np.linalg.norm(normal, axis=1)
    good = np.isfinite(length) & (length > 0)
    places = np.flatnonzero(there)[good]
    there = np.zeros(len(folded), dtype=bool)
    there[places] = True
    return Places(own[good], flat[good], level[good], normal[good] / length[good, None]), there


def _image(carrier: Any, own: Floats, flat: Floats, axis: int, step: float) -> Floats:
    """Return the folded image (n, 3) of a step along an axis of the layer."""
    move = np.zeros(3)
    move[axis] = step
    ahead = carrier.carry(flat + move, inverse=True).points
    behind = carrier.carry(flat - move, inverse=True).points
    # At the body's border one of the two may leave the map; the other one is enough.
    ahead = np.where(np.isfinite(ahead), ahead, own)
    behind = np.where(np.isfinite(behind), behind, own)
    return np.asarray(ahead - behind)


def _thickness(height: Floats, level: Floats) -> float:
    """Return the thickness of the layer, by the heights of its levels."""
    away = level - level.mean()
    spread = float((away**2).sum())
    slope = float((away * (height - height.mean())).sum()) / spread if spread > 0 else 0.0
    return slope if slope > 0 else max(float(np.ptp(height)), 1.0)


def thickness_of(places: Places) -> float:
    """Return the mean thickness of the layer."""
    return _thickness(places.flat[:, 2], places.level)


def rotation_of(normal: Floats) -> tuple[float, float, float]:
    """Return bearing, plunge and dip of axes whose third is a normal (3,) or its opposite.

    >>> rotation_of(np.array([0.5, 0.0, np.sqrt(0.75)]))
    (0.0, 0.0, 30.000000000000004)
    """
    x, y, z = normal if normal[2] >= 0 else -normal
    dip = float(np.degrees(np.arctan2(np.hypot(x, y), z)))
    # The first axis points down the dip, the second along the strike, which has no plunge.
    bearing = float(np.degrees(np.arctan2(x, y))) - 90.0 if dip > 0 else 0.0
    return bearing, 0.0, dip


def half_sphere(count: int = _DIRECTIONS) -> Floats:
    """Return unit vectors (count, 3) spread over the upper half sphere, straight up first."""
    k = np.arange(count)
    z = 1 - k / count
    turn = np.pi * (1 + np.sqrt(5.0)) * k
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])


def best_planes(points: Floats, values: Floats, spacing: float, count: int = 2) -> Floats:
    """Return the normals (count, 3) of the planes along which grades are most alike.

    Squared differences of pairs are averaged with weights that fall off with distance, eight times
    faster across the plane than along it; the planes of the least averages are returned. The
    answer needs samples alone.

    Parameters
    ----------
    points : (n, 3) float
        Folded samples.
    values : (n,) float
        Grades.
    spacing : float
        Spacing of the holes, over which weights fall along the plane.
    count : int
        Number of planes.
    """
    if len(values) > _MOST:
        some = np.sort(np.random.default_rng(0).choice(len(values), _MOST, replace=False))
        points, values = points[some], values[some]
    ranks = np.argsort(np.argsort(values, kind="stable"), kind="stable") / len(values)
    i, j = np.triu_indices(len(ranks), 1)
    away, square = points[i] - points[j], (ranks[i] - ranks[j]) ** 2
    length = (away**2).sum(axis=1)
    tries = half_sphere()
    mean = []
    for normal in tries:
        across = (away @ normal) ** 2
        weight = np.exp(-((length - across) + _THIN**2 * across) / spacing**2)
        mean.append(float((weight * square).sum() / max(weight.sum(), 1e-300)))
    return tries[np.argsort(mean, kind="stable")[:count]]


def mean_normal(normals: Floats) -> Floats:
    """Return the direction (3,) nearest to normals (n, 3), whichever way each points."""
    _, axes = np.linalg.eigh(normals.T @ normals)
    axis = axes[:, 2]
    return axis if axis[2] >= 0 else -axis


@dataclass(frozen=True, eq=False)
class Limbs:
    """Domains of like dip.

    Attributes
    ----------
    axes : (k, 3) float
        Mean normal of each.
    """

    axes: Floats

    def of(self, normals: Floats) -> Ints:
        """Return the domain of each normal (n, 3)."""
        return np.asarray(np.argmax(np.abs(normals @ self.axes.T), axis=1))


def limbs_of(normals: Floats) -> Limbs:
    """Return domains within which normals (n, 3) are 20 degrees off their mean on average or less.

    The fewest that do, four at most: what a geologist draws by hand, from layers that are known.
    """
    axes = mean_normal(normals)[None]
    while True:
        limbs = Limbs(axes)
        for _ in range(_ROUNDS):
            own = limbs.of(normals)
            axes = np.array(
                [mean_normal(normals[own == k]) if (own == k).any() else a
                 for k, a in enumerate(limbs.axes)]
            )  # fmt: skip
            limbs = Limbs(axes)
        nearest = np.abs(normals @ axes.T).max(axis=1)
        off = np.degrees(np.arccos(np.clip(nearest, -1, 1)))
        if off.mean() <= _TOLERANCE or len(axes) == _MOST_LIMBS:
            return limbs
        axes = np.concatenate([axes, normals[[int(np.argmax(off))]]])


def turn_between(places: Places, distance: float, *, most: int = 400) -> float:
    """Return by how much the layer turns over a distance along it, degrees on average.

    Pairs of places that are the distance apart in the unfolded space, within a quarter, and in the
    same half of the layer.
    """
    rng = np.random.default_rng(0)
    some = places.kept(np.sort(rng.permutation(len(places))[: 3 * most]))
    i, j = np.triu_indices(len(some), 1)
    along = np.linalg.norm(some.flat[i, :2] - some.flat[j, :2], axis=1)
    near = (np.abs(along / distance - 1) < 0.25) & (np.abs(some.level[i] - some.level[j]) < 0.5)
    if not near.any():
        return float("nan")
    cosine = (some.normal[i[near]] * some.normal[j[near]]).sum(axis=1)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())


def described(arms: Mapping[str, float]) -> list[str]:
    """Return a line for each arm with its figure."""
    return [f"{name} ({WORDS[name]}): {value:.3g}" for name, value in arms.items()]
