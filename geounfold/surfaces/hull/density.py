"""Hull as a level set of the blurred block density, on sparse bricks of a regular grid.

The centroids are splatted trilinearly on a grid of half a block, blurred by a Gaussian of
``sigma`` blocks, divided by the density inside the body, and the 0.5 level is taken.  On a
plane face the blurred density is the normal distribution of the depth, so its quantile
function makes it linear in the depth: marching cubes on a grid of one block then places the
surface as well as on half a block, with a quarter of the triangles.  After remeshing the
vertices are moved on to the level set of the half-block grid by Newton steps.

A sheet of one or two blocks is thinner than the blur: its density stays far below that of solid
blocks.  Its blur is wider and marching cubes run on the half-block grid, so that blocks that touch
only along edges stay connected.  The surface then runs outside the sheet, at a distance that
follows from the density.

Only bricks near the blocks are stored, so time and memory grow with the number of blocks, not with
the bounding box, of which a wide folded sheet fills little.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from geounfold.backends import igl as _igl
from geounfold.body.scattered import local_spacing
from geounfold.geometry.measures import unit
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull._finish import finish, smoothed
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import UNEQUAL, Hull

BRICK = 16  # grid nodes per brick and axis, at half a block
NODE = 0.5  # node spacing of the splat, block sides
RADIUS = 3.0  # reach of the blur, standard deviations
CHUNK = 256  # bricks blurred at a time, to limit temporary memory
TIE_BREAK = 1e-4  # amplitude of the displacement that breaks exact ties, block sides
THIN = (0.3, 0.7)
"""Share of a solid's density inside a sheet of one or two blocks.

Measured: 0.48 to 0.59 for one block, 0.71 to 0.78 for two; below, the lattice is mostly empty.
"""
THIN_BLUR = 1.0
"""Standard deviation of the blur of a thin sheet, in the longest block side."""
LOOSE = 1.25  # standard deviation of the blur of scattered points, in their spacing
_CLIP = 1e-4  # the quantile function is clipped to this share of the density
_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)


@dataclass(frozen=True, eq=False)
class _Bricks:
    """Values on the occupied bricks of a regular grid.

    ``slot`` (bx, by, bz) is each brick's row in ``values`` (k + 1, s, s, s), or k if there
    is none; row k is zero.  ``index`` (k, 3) is each row's brick.
    """

    slot: Ints
    index: Ints
    values: Floats

    def neighbour(self, offset: Ints) -> Ints:
        """Return the row of the brick at an offset (3,) from each row's own, (k,)."""
        i, j, k = (self.index + offset).T
        out: Ints = self.slot[i, j, k]
        return out

    def at(self, node: Ints) -> Floats:
        """Return the values at grid nodes (n, 3)."""
        brick, local = np.divmod(node, self.values.shape[1])
        row = self.slot[brick[:, 0], brick[:, 1], brick[:, 2]]
        out: Floats = self.values[row, local[:, 0], local[:, 1], local[:, 2]]
        return out


@dataclass(frozen=True, eq=False)
class DensityField:
    """Blurred density of points spaced about one unit apart, on a grid of one unit.

    Attributes
    ----------
    origin : (3,) float
        Position of the grid's node (0, 0, 0).
    inner : float
        Density inside the body: its 85th percentile at the points.
    share : (n,) float
        Density at each point, as a share of ``inner``: near 1 inside, 0.75 at the centroids
        of an outermost plane layer, less on edges and corners.
    blur : float
        Standard deviation of splat and blur together, in the points' unit.
    """

    origin: Floats
    inner: float
    share: Floats
    blur: float
    _bricks: _Bricks

    @property
    def filling(self) -> float:
        """The inner density in points per cubic unit: 1 inside a solid lattice of one unit."""
        return self.inner / NODE**3

    def level_set(self, level: float, fine: bool = False) -> tuple[Floats, Ints]:
        """Return the surface (V, F), outward, on which the share is ``level``; all components.

        Marched on a grid of one unit, or, ``fine``, on the field's own of half a unit.
        """
        grid, node = self._bricks, NODE
        if not fine:
            grid, node = _Bricks(grid.slot, grid.index, grid.values[:, ::2, ::2, ::2]), 2 * NODE
        V, F = _marching_cubes(grid, level * self.inner, self.inner)
        V = V * node + self.origin
        return V + tie_break(V), F

    def inset(self, level: float, solid: float) -> float:
        """Return the depth of the surface at a level below a thin sheet's faces (< 0: outside).

        A sheet of thickness T and density ``solid`` has, blurred by a Gaussian of deviation b,
        the density ``solid (2 Phi(T / 2b) - 1)`` in its middle, and ``solid (Phi((t + T/2) / b)
        - Phi((t - T/2) / b))`` at the offset t; Phi is the normal distribution.
        """
        middle = self.inner * float(np.median(self.share)) / NODE**3 / solid
        half = float(ndtri((1 + min(middle, 0.99)) / 2))
        drop = level * self.filling / solid

        def lack(t: float) -> float:
            return float(ndtr(t + half) - ndtr(t - half)) - drop

        at = brentq(lack, 0.0, half + 4) if lack(0.0) > 0 else 0.0
        return self.blur * (half - float(at))

    def project(self, points: Floats, level: float, steps: int = 3) -> Floats:
        """Return points near the surface on which the share is ``level``, moved on to it.

        Each moves along its own gradient, at most half a unit per Newton step.
        """
        target = float(ndtri(level))
        slope = self._slope(points)
        steep = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 0.3)
        for _ in range(steps):
            lack = (target - self._depth(points))[:, None] / steep
            points = points + np.clip(lack, -0.5, 0.5) * (slope / steep)
        return points

    def outward(self, points: Floats) -> Floats:
        """Return the direction in which the density falls, unit vectors (n, 3)."""
        return unit(-self._slope(points))

    def _depth(self, points: Floats) -> Floats:
        """Return the normal quantile of the share: depth below the 0.5 level, in blurs."""
        share = _trilinear(self._bricks, (points - self.origin) / NODE) / self.inner
        out: Floats = ndtri(np.clip(share, _CLIP, 1 - _CLIP))
        return out

    def _slope(self, points: Floats) -> Floats:
        """Return the gradient of the depth, (n, 3), by central differences over half a block."""
        steps = 0.25 * np.eye(3)
        slope = [self._depth(points + d) - self._depth(points - d) for d in steps]
        return np.stack(slope, axis=1) * 2


def density_hull(
    points: Floats, sides: Floats, options: HullOptions, weights: Floats | None = None
) -> Hull:
    """Return the hull on which the blurred block density is half its inner value.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, working units.
    sides : (3,) float
        Block sides along the axes, working units; density and blur are isotropic in
        ``points / sides``.
    options : HullOptions
        ``blur``, ``level`` and ``edge`` are used.
    weights : (n,) float, optional
        Volume of each block, 1 by default.

    Raises
    ------
    HullError
        The points are too sparse for any part of the grid to reach the level.
    """
    field = density_field(points / sides, options.blur, weights)
    thin = THIN[0] < field.filling < THIN[1]
    flat = sides.max() > UNEQUAL * sides.min()
    blur, inset = field.blur, 0.0
    if thin:
        solid = float(sides.max() ** 3 / sides.prod())
        sides = np.full(3, sides.max())  # flat blocks of a thin sheet may not touch
        field = density_field(points / sides, THIN_BLUR, weights)
        inset = field.inset(options.level, solid) * float(sides[0])
        blur = field.blur * float(sides[0])
    volume = len(points) if weights is None else float(weights.sum())
    hull = _finished(field, sides, volume, blur, options, inset=inset, fine=thin)
    # On a slope, flat blocks form stairs wider than the blur; unsmoothed, stairs count as rims (rms
    # 3.5 blocks instead of 0.06 on blocks 20 x 20 x 5 at 48 degrees).
    return smoothed(hull) if flat else hull


def scattered_hull(points: Floats, sides: Floats, options: HullOptions) -> Hull:
    """Return the density hull of scattered points, each weighted by the volume around it.

    The density of random points is uneven, so it is blurred more.  The volume enclosed without a
    blur counts as the blocks' volume.
    """
    coarse = LOOSE / options.blur
    weights = local_spacing(points) ** 3
    field = density_field(points / coarse, options.blur, weights)
    volume = float(weights.sum()) / field.inner * (NODE * coarse) ** 3
    return _finished(field, np.full(3, coarse), volume, field.blur * coarse, options)


def _finished(
    field: DensityField,
    sides: Floats,
    volume: float,
    blur: float,
    options: HullOptions,
    *,
    inset: float = 0.0,
    fine: bool = False,
) -> Hull:
    """Return the level set of a field of points / sides as a hull."""
    V, F = field.level_set(options.level, fine=fine)
    hull = finish(
        V * sides,
        F,
        method="density",
        blocks=volume,
        edge=options.edge,
        project=lambda x: field.project(x / sides, options.level) * sides,
    )
    return replace(hull, inset=inset, blur=blur, even=fine)


def density_field(
    points: Floats, sigma: float = 0.8, weights: Floats | None = None
) -> DensityField:
    """Return the density of points (n, 3), blurred by a Gaussian of standard deviation sigma."""
    origin = points.min(axis=0) - 2 * BRICK * NODE
    q = (points - origin) / NODE
    reach = math.ceil(RADIUS * sigma / NODE)
    splat, variance = _splat(q, reach, weights)
    kernel = _kernel(sigma / NODE, reach)
    bricks = _blur(splat, kernel)
    density = _trilinear(bricks, q)
    inner = float(np.percentile(density, 85))
    blur = NODE * math.sqrt(variance + float(kernel @ np.arange(-reach, reach + 1) ** 2))
    return DensityField(origin, inner, density / inner, blur, bricks)


def tie_break(V: Floats) -> Floats:
    """Return a smooth displacement (n, 3) that leaves no two edges of equal length.

    On a lattice many lengths are exactly equal, so the last bit would decide which edge a remesher
    collapses or swaps.  Wave numbers are incommensurable with the lattice and with each other.
    """
    waves = np.array([[1.931, 0.857, 1.409], [1.183, 2.087, 0.761], [0.911, 1.277, 1.787]])
    out: Floats = TIE_BREAK * np.sin(V @ waves + np.array([0.3, 1.1, 2.3]))
    return out


def _occupied(cell: Ints, reach: int) -> _Bricks:
    """Return empty bricks up to ``reach`` nodes from the given cells (n, 3) of points."""
    shape = tuple(cell.max(axis=0) // BRICK + 3)
    mask = np.zeros(shape, dtype=bool)
    for offset in product((-reach, reach + 1), repeat=3):
        brick = (cell + np.array(offset)) // BRICK
        mask[brick[:, 0], brick[:, 1], brick[:, 2]] = True
    index = np.argwhere(mask)
    slot = np.full(shape, len(index))
    slot[mask] = np.arange(len(index))
    return _Bricks(slot, index, np.zeros((len(index) + 1, BRICK, BRICK, BRICK)))


def _splat(q: Floats, reach: int, weights: Floats | None) -> tuple[_Bricks, float]:
    """Spread each point over the eight nodes around it; also return the mean variance added.

    The bricks leave room for a blur of ``reach`` nodes.
    """
    cell = np.floor(q).astype(np.int64)
    f = q - cell
    bricks = _occupied(cell, reach)
    flat = bricks.values.reshape(-1)
    for corner in product((0, 1), repeat=3):
        brick, local = np.divmod(cell + np.array(corner), BRICK)
        row = bricks.slot[brick[:, 0], brick[:, 1], brick[:, 2]]
        at = ((row * BRICK + local[:, 0]) * BRICK + local[:, 1]) * BRICK + local[:, 2]
        part = np.where(corner, f, 1 - f).prod(axis=1)
        np.add.at(flat, at, part if weights is None else part * weights)
    return bricks, float((f * (1 - f)).mean())


def _kernel(sigma: float, reach: int) -> Floats:
    """Return the weights of a Gaussian of sigma nodes, cut at ``reach`` nodes."""
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    out: Floats = bell / bell.sum()
    return out


def _blur(bricks: _Bricks, kernel: Floats) -> _Bricks:
    """Blur along each axis, across brick borders."""
    reach = len(kernel) // 2
    weights = np.zeros((BRICK + 2 * reach, BRICK))
    for column in range(BRICK):
        weights[column : column + len(kernel), column] = kernel
    values = bricks.values
    for axis in (2, 1, 0):
        values = _blur_last(bricks, values, weights, axis)
    return _Bricks(bricks.slot, bricks.index, values)


def _blur_last(bricks: _Bricks, values: Floats, weights: Floats, axis: int) -> Floats:
    """Apply weights (s + 2 reach, s) along the last axis, which is the grid's ``axis``.

    The axes are returned rotated by one, so that three calls restore their order.
    """
    step = np.zeros(3, dtype=np.int64)
    step[axis] = 1
    reach = (len(weights) - BRICK) // 2
    before, after = bricks.neighbour(-step), bricks.neighbour(step)
    out = np.zeros_like(values)
    for start in range(0, len(before), CHUNK):
        part = slice(start, min(start + CHUNK, len(before)))
        padded = np.concatenate(
            [values[before[part], ..., -reach:], values[part], values[after[part], ..., :reach]],
            axis=-1,
        )
        blurred = padded.reshape(-1, len(weights)) @ weights
        out[part] = np.moveaxis(blurred.reshape(-1, BRICK, BRICK, BRICK), -1, 1)
    return out


def _trilinear(field: _Bricks, q: Floats) -> Floats:
    """Return the field at positions (n, 3) in grid units."""
    cell = np.floor(q).astype(np.int64)
    f = q - cell
    out = np.zeros(len(q))
    for corner in product((0, 1), repeat=3):
        out += np.where(corner, f, 1 - f).prod(axis=1) * field.at(cell + np.array(corner))
    return out


def _crossing_cubes(field: _Bricks, level: float) -> tuple[Ints, Floats]:
    """Return the cubes (c, 3) that the level crosses and their values (c, 8), ordered by place."""
    size = field.values.shape[1]
    inside: NDArray[np.bool_] = np.zeros((len(field.index),) + (size + 1,) * 3, dtype=bool)
    for offset in product((0, 1), repeat=3):
        x, y, z = (slice(size, size + 1) if o else slice(0, size) for o in offset)
        first = field.values[field.neighbour(np.array(offset))]
        i, j, k = (slice(0, 1) if o else slice(0, size) for o in offset)
        inside[:, x, y, z] = first[:, i, j, k] >= level
    low, high = slice(0, size), slice(1, size + 1)
    parts = [inside[:, x, y, z] for x, y, z in product((low, high), repeat=3)]
    crossed = np.logical_or.reduce(parts) & ~np.logical_and.reduce(parts)
    row, *local = np.nonzero(crossed)
    cubes = field.index[row] * size + np.stack(local, axis=1)
    cubes = cubes[np.lexsort(cubes.T[::-1])]
    values = np.stack([field.at(cubes + corner) for corner in _CORNERS], axis=1)
    return cubes, values


def _marching_cubes(field: _Bricks, level: float, inner: float) -> tuple[Floats, Ints]:
    """Return the level surface (V, F) in grid units, outward."""
    cubes, values = _crossing_cubes(field, level)
    if not len(cubes):
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    nodes = cubes[:, None] + _CORNERS
    extent = nodes.max(axis=(0, 1)) + 1
    key = (nodes[..., 0] * extent[1] + nodes[..., 1]) * extent[2] + nodes[..., 2]
    _, first, corner = np.unique(key.ravel(), return_index=True, return_inverse=True)
    depth = ndtri(np.clip(values.ravel()[first] / inner, _CLIP, 1 - _CLIP))
    positions = nodes.reshape(-1, 3)[first].astype(np.float64)
    threshold = float(ndtri(level / inner))
    return _igl.marching_cubes_sparse(depth, positions, corner.reshape(-1, 8), threshold)
