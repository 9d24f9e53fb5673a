"""Medial points: midpoints of rays that cross a body from one face to the opposite one.

The idea is the shape diameter (Shapira et al., 2008), measured on lattice cells: from each cell at
the body's surface a ray runs inward along the normal of the blurred body until it leaves the
cells. It counts if the surface there faces the other way. Its midpoint is a point of the mid
surface, its length the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from geounfold.body.parts.voxels import Voxels
from geounfold.geometry.mesh import Bools, Floats, Ints

_BLUR = 1.4
"""Width of the blur, in working units: less leaves the lattice's stairs in the normals."""

_WEAK = 0.08
"""Slope of the blurred body, per unit, below which a cell lies amid a sheet one cell thick."""

_STEP = 0.34
"""Step along a ray, in the shortest side of a cell."""

_EDGE = 0.8
"""Width of the blur, in cells, whose half level is the surface at a ray's ends.

The lattice's stairs leave whole cells between the thicknesses of neighbouring rays; with the half
level the spread is a third of a cell, and plies two to five cells thick stand out. At 1.0 one ray
in thirty finds no half level in a sheet of two cells, at 0.6 the spread is half a cell.
"""

_SAMPLES = np.arange(-0.75, 0.8, 0.25)
"""Places around a ray's last place inside at which the half level is looked for, in cells."""

_FACING = 0.75
"""Least cosine between the two faces' normals, one of them reversed."""

_THIN = 2.2
"""Thickness in cells below which the faces' normals are not compared: the blur mixes them."""

_LONGER = 1.6
"""A cell is covered by a thinner ray if that ray is shorter by this factor."""

_COVERED = 0.4
"""Share of a ray's way through such cells from which the ray runs along a branch, not across."""


@dataclass(frozen=True, eq=False)
class MedialPoints:
    """Midpoints of rays, in the coordinates of the box of cells.

    Attributes
    ----------
    start, end : (k, 3) float
        First and last place of each ray in the body.
    normal : (k, 3) float
        Unit vectors along the rays; outward at the start, or turned as `regions` turns them.
    thickness : (k,) float
        Lengths of the rays.
    area : (k,) float
        Area of the surface that each ray starts from.
    cell : (k,) float
        Size of a cell along each ray.
    """

    start: Floats
    end: Floats
    normal: Floats
    thickness: Floats
    area: Floats
    cell: Floats

    @property
    def middle(self) -> Floats:
        """The medial points, (k, 3)."""
        out: Floats = (self.start + self.end) / 2
        return out

    def at(self, rows: Ints | Bools) -> MedialPoints:
        """Return some of the points."""
        return MedialPoints(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def medial_points(body: Voxels) -> MedialPoints:
    """Return the medial points of a body."""
    occupied, steps = body.occupied, body.steps
    sigma = np.clip(_BLUR / steps, 0.8, 3.0)
    blurred = ndimage.gaussian_filter(occupied.astype(np.float32), sigma, truncate=3.0)
    flat_body, flat_blur = occupied.ravel(), blurred.ravel()
    inside = np.flatnonzero(flat_body)
    around = [int(s) for s in (*body.stride, *-body.stride)]
    inner = np.ones(len(inside), dtype=bool)
    for step in around:
        inner &= flat_body[inside + step]
    at = inside[~inner]
    normal = _normals(at, flat_blur, body, weak=True)
    centre = np.stack(np.unravel_index(at, occupied.shape), axis=1) * steps
    ds = _STEP * float(steps.min())
    out = _way(centre, normal, ds, 3 * float(steps.max()), body)
    most = float(np.linalg.norm(np.array(occupied.shape) * steps))
    into = _way(centre, -normal, ds, most, body)
    start, end = centre + out[:, None] * normal, centre - into[:, None] * normal
    cell = np.linalg.norm(normal * steps, axis=1)
    faces = -(_normals(body.flat(end), flat_blur, body) * normal).sum(axis=1) > _FACING
    area = np.zeros(len(at))
    for axis in range(3):
        for step in (around[axis], around[axis + 3]):
            area += np.where(flat_body[at + step], 0.0, np.abs(normal[:, axis]) / steps[axis])
    area *= float(steps.prod())
    edge = ndimage.gaussian_filter(occupied.astype(np.float32), _EDGE / steps, truncate=3.0)
    start += _to_surface(start, normal, ds, edge, body)[:, None] * normal
    end -= _to_surface(end, -normal, ds, edge, body)[:, None] * normal
    thickness = np.maximum(((start - end) * normal).sum(axis=1), ds)
    rays = MedialPoints(start, end, normal, thickness, area, cell)
    return _across(rays.at(faces | (thickness < _THIN * cell)), body)


def _normals(at: Ints, blurred: np.ndarray, body: Voxels, *, weak: bool = False) -> Floats:
    """Return the outward unit normals of the blurred body at cells of flat index (k,).

    With ``weak``, a cell amid a sheet of one cell takes the normal of its emptiest neighbour.
    """
    g = np.empty((len(at), 3))
    for axis, step in enumerate(body.stride.tolist()):
        g[:, axis] = (blurred[at - step] - blurred[at + step]) / (2 * body.steps[axis])
    size = np.linalg.norm(g, axis=1)
    if weak:
        low = np.flatnonzero(size < _WEAK)
        if len(low):
            beside = at[low, None] + np.concatenate([body.stride, -body.stride])
            emptiest = blurred[beside].argmin(axis=1)
            g[low] = _normals(beside[np.arange(len(low)), emptiest], blurred, body)
            size[low] = np.linalg.norm(g[low], axis=1)
    out: Floats = g / np.maximum(size, 1e-12)[:, None]
    return out


def _way(start: Floats, direction: Floats, ds: float, most: float, body: Voxels) -> Floats:
    """Return how far rays run before they leave the body, (k,), ``most`` at the farthest."""
    far = np.zeros(len(start))
    live = np.arange(len(start))
    occupied = body.occupied.ravel()
    way, place, step = 0.0, start, direction * ds
    while len(live) and way < most:
        way += ds
        place = place + step
        inside = occupied[body.flat(place)]
        live, place, step = live[inside], place[inside], step[inside]
        far[live] = way
    return far


def _to_surface(last: Floats, outward: Floats, ds: float, edge: np.ndarray, body: Voxels) -> Floats:
    """Return the distance from the last place of rays in the body to its half level, (k,).

    If there is none, which happens in sheets one cell thick, it is half a step of the ray.
    """
    place = last[:, None] + _SAMPLES[:, None] * outward[:, None]
    value = ndimage.map_coordinates(edge, (place / body.steps).reshape(-1, 3).T, order=1)
    value = value.reshape(len(last), -1)
    rows, k = np.arange(len(last)), (value < 0.5).argmax(axis=1)
    before = np.maximum(k - 1, 0)
    high, low = value[rows, before], value[rows, k]
    part = (high - 0.5) / np.maximum(high - low, 1e-6)
    return np.where(k > 0, _SAMPLES[before] + (_SAMPLES[1] - _SAMPLES[0]) * part, ds / 2)


def cells_along(rays: MedialPoints, body: Voxels, per: float = 0.6) -> tuple[Ints, Ints, Floats]:
    """Return the cells along every ray: flat index, number of the ray, fraction from its start."""
    count = np.maximum(np.ceil(rays.thickness / (per * body.steps.min())).astype(np.int64), 2)
    ray = np.repeat(np.arange(len(count)), count)
    first = np.cumsum(count) - count
    fraction = (np.arange(len(ray)) - first[ray] + 0.5) / count[ray]
    place = rays.start[ray] + fraction[:, None] * (rays.end - rays.start)[ray]
    return body.flat(place), ray, fraction


def _across(rays: MedialPoints, body: Voxels) -> MedialPoints:
    """Return the rays that cross a sheet, without those that run along one.

    Most of the way of the latter lies in cells that much thinner rays cover.
    """
    if rays.thickness.max(initial=0.0) < _LONGER * rays.thickness.min(initial=0.0):
        return rays
    cell, ray, _ = cells_along(rays, body)
    thinnest = np.full(body.occupied.size, np.inf)
    np.minimum.at(thinnest, cell, rays.thickness[ray])
    covered = thinnest[cell] * _LONGER < rays.thickness[ray]
    count = np.bincount(ray, minlength=len(rays.thickness))
    share = np.bincount(ray, covered, len(rays.thickness)) / np.maximum(count, 1)
    return rays.at(share < _COVERED)
