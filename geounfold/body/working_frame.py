"""The working frame: an invertible similarity between the data's coordinates and working units.

The thesis (section 3.2.1) scales the points by one factor, into [0, 1], and turns them so that
their third principal direction z_p points along z: an axis-angle rotation by
``theta = arccos(z_p . z)`` about ``n_z = z_p x z``. Here the factor makes a block (or the typical
spacing) one unit, so that tolerances are in blocks for bodies of every size. The rotation is the
thesis's, followed by a turn about z that brings the first principal direction (or lattice axis)
onto x. The rotation axis is normalised; the thesis's own code leaves ``n_z`` at its length
sin(theta), and so turns by theta sin(theta) instead of theta.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.backends.threads import over_slices
from geounfold.body.lattice import (
    TOLERANCE,
    Lattice,
    lattice_indices,
    point_spacing,
    proper_permutations,
)
from geounfold.body.scattered import scattered, scattered_spacing
from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.rotations import rotate

DECISIVE = 1e-11
"""Difference of moments (of unit variance along each axis) below which they count as equal.

Rounding moves them by 1e-14 to 1e-12, at UTM offsets of 1e7 m too. A symmetric body whose
coordinates are written to four decimals, as in tables, is asymmetric by 1e-10 to 1e-8.
"""

_LEANING = np.array([[1.0, 0.141, 0.058], [0.173, 0.9, 0.031], [0.062, 0.027, 0.8]])
"""World axes with which a symmetric body's axes are compared; they lean, so that nothing ties."""

_ORDER = 5  # highest order of the moments that choose between axes and signs
_CHUNK = 4096  # points per pass over the moments
_SLICE = 1 << 14  # points moved onto the lattice at once
_CLEAR = 0.01  # least moment that fixes the in-plane direction
_IN_PLANE = ((2, 0, 0), (1, 2, 0), (1, 0, 2), (2, 0, 1), (1, 0, 1), (3, 0, 0), (4, 0, 0))  # m, a, b
_SIGNS = np.array([np.diag(s) for s in ((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1))])


@dataclass(frozen=True, eq=False)
class Frame:
    """A similarity: ``work = (world - origin) @ rotation.T / scale``.

    In the working frame one unit is one block: the geometric mean of the block's sides, or the
    typical spacing of points without a lattice. The points' mean is near the origin. The axes are
    the lattice's, or the principal axes without a lattice; the third one points across the body.
    The frame does not decide which of its two directions is up.

    Attributes
    ----------
    origin : (3,) float
        World coordinates of the frame's origin: a lattice position, or the points' mean.
    rotation : (3, 3) float
        Proper rotation; rows are the frame's axes in world coordinates.
    scale : float
        Length of one working unit in the input's unit.
    steps : (3,) float or None
        Block sides along the frame's axes in working units (product 1), if blocks lie at whole
        multiples of them; None without a lattice, or if noise has moved the blocks off it.
    sides : (3,) float or None
        Block sides, known on a lattice and around one; None if unknown.
    """

    origin: Floats
    rotation: Floats
    scale: float
    steps: Floats | None
    sides: Floats | None = None

    def to_work(self, points: Floats) -> Floats:
        """Return world points (n, 3) in the working frame."""
        return np.stack(self.work_columns(points), axis=1)

    def work_columns(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return x, y and z in the working frame, (n,) each, of world points (n, 3).

        A point's coordinates do not depend, bit for bit, on the other points of the call.
        """
        return rotate(points - self.origin, self.rotation / self.scale)

    def to_world(self, points: Floats) -> Floats:
        """Return working points (n, 3) in world coordinates."""
        return np.stack(rotate(points, self.rotation.T * self.scale), axis=1) + self.origin

    def snap(self, points_work: Floats) -> Floats:
        """Return working points (n, 3) moved onto the lattice, exactly ``k * steps``.

        Lattice points that differ by rounding (another offset, orientation or unit) become the
        same numbers, so that they lead to the same decisions. Points farther than ``TOLERANCE``
        steps from a lattice position are not moved, and without a lattice none is.
        """
        if self.steps is None:
            return points_work
        steps, out = self.steps, np.empty((len(points_work), 3))

        def work(rows: slice) -> None:
            cells = points_work[rows] / steps
            whole = np.rint(cells)
            cells -= whole
            on = np.logical_and(cells < TOLERANCE, cells > -TOLERANCE).all(axis=1, keepdims=True)
            out[rows] = np.where(on, whole * steps + 0.0, points_work[rows])

        over_slices(work, len(points_work), _SLICE)
        return out

    def cells(self, points_work: Floats) -> Ints | None:
        """Return the lattice cell of every working point, (n, 3).

        None without a lattice, or if a point lies off it (see ``snap``).
        """
        if self.steps is None:
            return None
        steps, out = self.steps, np.empty((len(points_work), 3), np.int64)

        def work(rows: slice) -> bool:
            cells = points_work[rows] / steps
            out[rows] = whole = np.rint(cells)
            cells -= whole
            return bool(-TOLERANCE < cells.min() <= cells.max() < TOLERANCE)

        return out if all(over_slices(work, len(out), _SLICE)) else None

    def nearest_cells(self, points_work: Floats) -> Ints:
        """Return the lattice cell nearest to every working point, (n, 3).

        Raises
        ------
        ValueError
            There is no lattice.
        """
        if self.steps is None:
            raise ValueError("the frame has no lattice")
        steps, out = self.steps, np.empty((len(points_work), 3), np.int64)

        def work(rows: slice) -> None:
            out[rows] = np.rint(points_work[rows] / steps)

        over_slices(work, len(out), _SLICE)
        return out

    def middles(self, cells: Ints) -> Floats:
        """Return the middles of lattice cells (n, 3) in world coordinates.

        Raises
        ------
        ValueError
            There is no lattice.
        """
        if self.steps is None:
            raise ValueError("the frame has no lattice")
        return self.to_world(cells * self.steps)

    def up_in_work(self, world_up: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Floats:
        """Return the unit vector (3,) of a world direction in the working frame.

        Raises
        ------
        OptionError
            The direction is zero or not finite.
        """
        up = np.asarray(world_up, dtype=np.float64)
        length = float(np.linalg.norm(up))
        if up.shape != (3,) or not np.isfinite(length) or length == 0:
            raise OptionError(f"up must be three finite numbers, not all zero, but is {world_up}")
        out: Floats = self.rotation @ (up / length)
        return out


@dataclass(frozen=True, eq=False)
class CellSums:
    """Sums over the cells of a lattice that fix its working frame.

    Attributes
    ----------
    count : int
        Number of cells.
    total : (3,) int
        Sum of the cells' indices.
    variance : (3,) float
        Sum of the squared distances from their mean along each axis, working units.
    moments : (6, 6, 6) float
        Means of products of powers (see `_moments`).
    """

    count: int
    total: Ints
    variance: Floats
    moments: Floats

    @classmethod
    def of(
        cls,
        count: int,
        total: Ints,
        variance: Floats,
        along: list[Floats],
        product_sums: Callable[[list[Floats]], Floats],
    ) -> CellSums:
        """Return the sums of cells whose moments are summed elsewhere.

        Parameters
        ----------
        count, total, variance
            As the attributes.
        along : list of (n,) float
            Distances of the layers of cells from the mean along each axis, working units.
        product_sums : callable
            Returns the sums over the cells of products of powers, (6, 6, 6), from the powers of
            the layers along each axis, (6, n) each.
        """
        sigma = np.sqrt(variance / count)
        sigma = np.where(sigma > 0, sigma, 1.0)
        powers = [_powers(x / s) for x, s in zip(along, sigma, strict=True)]
        return cls(count, total, variance, _low_orders(product_sums(powers) / count))


def working_frame(points: Floats, lattice: Lattice | None, *, exact: bool = True) -> Frame:
    """Return the canonical working frame of points (see Frame).

    Canonical means that a rigid motion, another unit or another order of the rows gives the same
    set of working coordinates, except for rounding. With a lattice the axes are the lattice's, in
    decreasing order of the points' variance; otherwise they are the principal axes. Signs, and the
    order of axes of equal variance, make the body's moments greatest. The moments are taken one
    after the other until one decides: the cubic ones first (<x^3>, then <y^3>, <z^3>, each of unit
    variance, so that the body's long tail lies on the positive side), the mixed third moments, and
    those of order two, four and five. A body for which all of them tie is symmetric, so every
    choice gives the same set; the one nearest to the world's axes is taken. If the two longest
    principal axes of scattered points have variances within 1 %, higher moments fix their
    direction.

    Parameters
    ----------
    points : (n, 3) float
        World coordinates, not all in one plane.
    lattice : Lattice or None
        The points' lattice.
    exact : bool
        True if the points lie on the lattice; False if they scatter around it.

    Raises
    ------
    InputError
        There is no lattice, and there are fewer than two distinct points.
    """
    if lattice is not None:
        frame = _lattice_frame(points, lattice)
        return frame if exact else replace(frame, steps=None)
    return _scattered_frame(points)


def _lattice_frame(points: Floats, lattice: Lattice) -> Frame:
    """Return the frame of a lattice, decided on whole cells, which rounding does not change."""
    cells = lattice_indices(points, lattice)
    scale = float(np.cbrt(lattice.steps.prod()))
    X = (cells - cells.mean(axis=0)) * (lattice.steps / scale)
    sums = CellSums(len(cells), cells.sum(axis=0), np.einsum("ij,ij->j", X, X), _moments(X))
    return frame_of_sums(sums, lattice)


def frame_of_sums(sums: CellSums, lattice: Lattice) -> Frame:
    """Return the working frame of the cells of a lattice, from sums over them."""
    scale = float(np.cbrt(lattice.steps.prod()))
    turns = _by_variance(sums.variance, proper_permutations())
    tables = np.array([_turned(sums.moments, turn) for turn in turns])
    turn = _greatest(turns, tables, lattice.axes)
    rotation = turn @ lattice.axes
    steps = (turn * turn) @ lattice.steps
    sides = np.array([float(f"{step:.10g}") for step in steps / scale])
    total = turn.astype(np.int64) @ sums.total
    middle = (2 * total + sums.count) // (2 * sums.count)
    return Frame(
        origin=lattice.origin + (middle * steps) @ rotation,
        rotation=rotation,
        scale=scale,
        steps=sides,
        sides=sides,
    )


def _scattered_frame(points: Floats) -> Frame:
    """Return the frame of principal axes, with its origin at the mean and the spacing as unit."""
    scale = scattered_spacing(points) if scattered(points) else point_spacing(points)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    origin = middle + (points - middle).mean(axis=0)
    X = points - origin
    X = X - X.mean(axis=0)
    axes = np.linalg.eigh(X.T @ X)[1].T[::-1]
    axes = axes * np.sign(np.linalg.det(axes))
    X = X @ axes.T
    turns, tables = [], []
    for in_plane in _in_plane_turns(X):
        table = _moments(X @ in_plane.T)
        turns += [sign @ in_plane for sign in _SIGNS]
        tables += [_turned(table, sign) for sign in _SIGNS]
    turn = _greatest(np.array(turns), np.array(tables), axes)
    return Frame(origin=origin, rotation=turn @ axes, scale=scale, steps=None)


def _by_variance(variance: Floats, turns: Floats) -> Floats:
    """Return the turns that leave the variances (3,) in decreasing order, all of equal order."""
    rotate = (turns * turns) @ (variance / variance.sum())
    for axis in range(2):
        kept = rotate[:, axis] >= rotate[:, axis].max() - DECISIVE
        turns, rotate = turns[kept], rotate[kept]
    return turns


def _in_plane_turns(X: Floats) -> Floats:
    """Return candidate turns about z, (c, 3, 3), each along the body's in-plane direction.

    The direction is the phase of the first clear moment ``<z^m |z|^a w^b>``, with z = x + iy and w
    the third coordinate; m equal directions follow from it. The second moment (m = 2) comes first
    and gives the principal axes; the others decide if the two variances are equal.
    """
    z = (X[:, 0] + 1j * X[:, 1]) / np.sqrt(np.einsum("ij,ij->", X[:, :2], X[:, :2]) / len(X))
    w = X[:, 2] / max(float(X[:, 2].std()), np.finfo(float).tiny)
    size = (z * z.conj()).real
    moments = [complex((z**m * size ** (a / 2) * w**b).mean()) for m, a, b in _IN_PLANE]
    clear = next(
        (i for i, moment in enumerate(moments) if abs(moment) > _CLEAR),
        int(np.abs(moments).argmax()),
    )
    m = _IN_PLANE[clear][0]
    apart = m // 2 if m % 2 == 0 else m  # the choice of signs covers the opposite direction
    angle = (np.angle(moments[clear]) + 2 * np.pi * np.arange(apart)) / m
    cos, sin, zero = np.cos(angle), np.sin(angle), np.zeros(apart)
    rows = [[cos, sin, zero], [-sin, cos, zero], [zero, zero, zero + 1]]
    out: Floats = np.moveaxis(np.array(rows), 2, 0)
    return out


def _greatest(turns: Floats, tables: Floats, axes: Floats) -> Floats:
    """Return the turn of the greatest moments; of equal ones, the nearest to the world's axes.

    ``tables`` are the moments after each turn, ``axes`` the directions in the world before it.
    """
    alive = np.arange(len(turns))
    for exponents in _exponents():
        value = tables[(alive, *exponents)]
        alive = alive[value >= value.max() - DECISIVE]
        if len(alive) == 1:
            break
    nearness = np.einsum("aij,jk,ik->a", turns[alive], axes, _LEANING)
    out: Floats = turns[alive[nearness.argmax()]]
    return out


def _turned(table: Floats, turn: Floats) -> Floats:
    """Return a table of moments after a turn that maps axes onto axes, exactly."""
    source = (turn * turn).argmax(axis=1)
    sign = turn[np.arange(3), source]
    power = np.arange(_ORDER + 1)
    factor = np.multiply.outer(
        np.multiply.outer(sign[0] ** power, sign[1] ** power), sign[2] ** power
    )
    out: Floats = table.transpose(source) * factor
    return out


def _exponents() -> list[tuple[int, int, int]]:
    """Return the moments' exponents in deciding order: cubic, mixed third, 2nd, 4th, 5th."""
    every = [(i, j, k) for i in range(6) for j in range(6) for k in range(6)]
    order = {3: 0, 2: 1, 4: 2, 5: 3}
    ranked = [(order[sum(e)], -max(e), tuple(-i for i in e), e) for e in every if sum(e) in order]
    return [entry[-1] for entry in sorted(ranked)]


def _moments(X: Floats) -> Floats:
    """Return <x^i y^j z^k>, (6, 6, 6), of X scaled to unit variance along each axis.

    Entries of an order above five are zero.
    """
    sigma = np.sqrt(np.einsum("ij,ij->j", X, X) / len(X))
    scaled = X / np.where(sigma > 0, sigma, 1.0)
    table = np.zeros((_ORDER + 1,) * 3)
    for start in range(0, len(X), _CHUNK):
        x, y, z = (_powers(column) for column in scaled[start : start + _CHUNK].T)
        for i in range(_ORDER + 1):
            left = _ORDER + 1 - i
            table[i, :left, :left] += (x[i] * y[:left]) @ z[:left].T
    return _low_orders(table / len(X))


def _low_orders(table: Floats) -> Floats:
    """Return a table of moments with zeros for those of an order above five."""
    total = np.add.outer(np.add.outer(*[np.arange(_ORDER + 1)] * 2), np.arange(_ORDER + 1))
    return np.where(total <= _ORDER, table, 0.0)


def _powers(column: Floats) -> Floats:
    """Return 1, x, x^2, ... x^5 as rows."""
    out = np.ones((_ORDER + 1, len(column)))
    for i in range(_ORDER):
        out[i + 1] = out[i] * column
    return out
