"""Regions: medial points joined with neighbours of like normal, height and thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from geounfold.body.parts.rays import MedialPoints
from geounfold.geometry.mesh import Bools, Floats, Ints

_REACH = 2.3
"""Distance in cells up to which medial points are compared: two rings of neighbours."""

_LIKE = 0.75
"""Least cosine between the normals of joined points: a hinge turns by 40 degrees in two cells."""

_FIRM = 0.7
"""Least share of one direction among the normals around a point that joins: 1 in a plane.

It is a half in pillars and at corners, whose points join none of a sheet.
"""

_OFFSET = (0.75, 0.2)
"""Largest step of the mid surface between joined points: cells, and share of the thickness."""

_JUMP = (0.4, 0.1)
"""Largest step of the thickness between joined points: cells, and share of the thickness.

With 0.5 and 0.12, a sheet of 4.5 cells stays one with the doubled zone of 7.1 beside it.
"""

_TYPICAL = (0.3, 0.06)
"""Largest difference of a joining point's thickness from its neighbours' median: cells, and share.

A point in the middle of a step is like both sides and would join two sheets that only touch.
"""

_LEAST_POINTS, _LEAST_SQUARE, _LEAST_SHARE = 12, 0.5, 0.002
"""Least size of a region: points, area in thicknesses squared, share of the whole medial area."""

_MOST = 60
"""Number of regions considered, the largest first."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Medial points in regions.

    Attributes
    ----------
    rays : MedialPoints
        With normals turned to one side within each region.
    label : (k,) int
        Region of each point; -1 for one that is in no region considered.
    area : (r,) float
        Area of each region's sheet, the largest first.
    thickness : (r,) float
        Mean thickness of each.
    firm : (k,) bool
        Whether each point may join a sheet.
    total : float
        Area of all medial points, also those in no region.
    cell : float
        Longest side of a cell: how far a mid surface may be off between cells.
    """

    rays: MedialPoints
    label: Ints
    area: Floats
    thickness: Floats
    firm: Bools
    total: float
    cell: float

    @property
    def count(self) -> int:
        """Number of regions."""
        return len(self.area)

    def rows(self, region: int) -> Ints:
        """Return the points of a region."""
        return np.flatnonzero(self.label == region)


def find_regions(rays: MedialPoints, steps: Floats) -> Regions:
    """Return the regions of medial points."""
    middle, n = rays.middle, len(rays.thickness)
    first, second, firm = _joined(rays, middle, steps)
    found = connected_components(
        coo_array((np.ones(len(first), np.int8), (first, second)), (n, n)), directed=False
    )[1]
    area = np.bincount(found, rays.area) / 2
    mean = np.bincount(found, rays.area * rays.thickness) / np.maximum(2 * area, 1e-9)
    total = float(area.sum())
    large = (np.bincount(found) >= _LEAST_POINTS) & (area > _LEAST_SHARE * total)
    large &= area > _LEAST_SQUARE * mean**2
    ids = np.flatnonzero(large)
    ids = ids[np.argsort(-area[ids], kind="stable")][:_MOST]
    number = np.full(len(area), -1)
    number[ids] = np.arange(len(ids))
    label = number[found]
    if len(ids) > 1:
        rays = _turned(rays, label, first, second)
    return Regions(rays, label, area[ids], mean[ids], firm, total, float(steps.max()))


def _joined(rays: MedialPoints, middle: Floats, steps: Floats) -> tuple[Ints, Ints, Bools]:
    """Return the pairs of joined points, (p,) each, and which points may join a sheet, (k,)."""
    n = len(middle)
    pairs = cKDTree(middle / steps).query_pairs(_REACH, output_type="ndarray")
    first, second = np.asarray(pairs, dtype=np.int64).T
    near = csr_array((np.ones(len(first)), (first, second)), shape=(n, n))
    N = rays.normal
    products = (N[:, [0, 0, 0, 1, 1, 2]] * N[:, [0, 1, 2, 1, 2, 2]]).astype(np.float64)
    sums = products + near @ products + near.T @ products
    tensor = sums[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    firm = np.linalg.eigvalsh(tensor)[:, 2] > _FIRM * np.trace(tensor, axis1=1, axis2=2)
    thickness, cell = rays.thickness, rays.cell
    thin = np.minimum(thickness[first], thickness[second])
    size = np.maximum(cell[first], cell[second])
    alike = np.abs(thickness[first] - thickness[second]) < _JUMP[0] * size + _JUMP[1] * thin
    cosine = (N[first] * N[second]).sum(axis=1)
    across = N[first] + np.sign(cosine)[:, None] * N[second]
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    offset = np.abs(((middle[first] - middle[second]) * across).sum(axis=1))
    like = np.abs(cosine) > _LIKE
    good = like & alike & (offset < _OFFSET[0] * size + _OFFSET[1] * thin)
    usual = _median_around(thickness, first[like], second[like])
    firm &= np.abs(thickness - usual) < _TYPICAL[0] * cell + _TYPICAL[1] * usual
    both = firm[first] & firm[second]
    rods = ~firm[first] & ~firm[second] & alike
    keep = (good & both) | rods
    return first[keep], second[keep], firm


def _median_around(values: Floats, first: Ints, second: Ints) -> Floats:
    """Return the median of each point's value and those of the points paired with it, (k,)."""
    own, n = np.arange(len(values)), len(values)
    order = np.argsort(values, kind="stable")
    rank = np.empty(n, np.int64)
    rank[order] = own
    point = np.concatenate([first, second, own])
    key = np.sort(point * n + rank[np.concatenate([second, first, own])])
    count = np.bincount(point, minlength=n)
    start = np.cumsum(count) - count
    low, high = (order[key[at] - own * n] for at in (start + (count - 1) // 2, start + count // 2))
    out: Floats = (values[low] + values[high]) / 2
    return out


def _turned(rays: MedialPoints, label: Ints, first: Ints, second: Ints) -> MedialPoints:
    """Return the rays with normals turned to one side within each region, from pair to pair."""
    n = len(label)
    inside = label[first] >= 0
    graph = csr_array(
        (np.ones(int(inside.sum()), np.int8), (first[inside], second[inside])), shape=(n, n)
    )
    sign = np.ones(n)
    for region in range(int(label.max()) + 1):
        start = int(np.argmax(label == region))
        order, before = breadth_first_order(graph, start, directed=False)
        child, parent = order[1:], before[order[1:]]
        same = (rays.normal[child] * rays.normal[parent]).sum(axis=1) >= 0
        for c, p, keep in zip(child.tolist(), parent.tolist(), same.tolist(), strict=True):
            sign[c] = sign[p] if keep else -sign[p]
    return MedialPoints(
        rays.start,
        rays.end,
        rays.normal * sign[:, None],
        rays.thickness,
        rays.area,
        rays.cell,
    )
