"""Blocks of a field body, and the lattice that they are taken from."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import scipy.ndimage as ndi

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic.fold_spec import FoldSpec
from geounfold.synthetic.sampling import sample

UTM = (452_300.0, 6_851_700.0, 310.0)
"""A national grid's size of coordinates: easting, northing, elevation."""

_Triple = tuple[float, float, float]
_Layer = tuple[Bools, Floats | float]


@dataclass(frozen=True, eq=False)
class FieldBlocks:
    """Blocks of a field body and what is true of each.

    Attributes
    ----------
    points : (n, 3) float
        Block centroids, world coordinates.
    level : (n,) float
        True stratigraphic coordinate in the block's own part: 0 at the bottom, 1 at the top. NaN
        if the block has none (a pipe, a pillar, a stray).
    part : (n,) int
        True part (sheet, ply or fault block), 0 for the first; -1 if the block is in none.
    cells : (n, 3) int
        Lattice indices of the blocks.
    steps : (3,) float
        Block sides along the lattice's axes.
    thinnest : float
        Blocks across the thinnest ply; infinite if all plies are at least five blocks thick.
    others : tuple of (n,) float
        Other levels that are as right as ``level``, such as that of a split seam without its
        parting.
    """

    points: Floats
    level: Floats
    part: Ints
    cells: Ints
    steps: Floats
    thinnest: float = np.inf
    others: tuple[Floats, ...] = ()


Builder = Callable[[np.random.Generator], FieldBlocks]


@dataclass(frozen=True, kw_only=True)
class FieldBody:
    """A body as mines have them, drawn from a seed.

    Parameters
    ----------
    name, family : str
        Names in FIELD_BODIES.
    builder : callable
        Draws the body from a random generator.
    expects : {'right', 'told'}
        What a user expects: an answer that is near the truth, or, if coordinates do not decide, at
        least to be told (a refusal or a warning that gives the reason).
    about : str
        One line for tables.
    """

    name: str
    family: str
    builder: Builder = field(repr=False)
    expects: str = "right"
    about: str = ""

    def blocks(self, seed: int = 0) -> FieldBlocks:
        """Return the body that a seed draws; equal seeds give equal bodies, bit for bit.

        Raises
        ------
        OptionError
            The seed is no whole number from 0 up.
        """
        if not isinstance(seed, int) or seed < 0:
            raise OptionError(f"seed must be a whole number from 0 up, not {seed!r}")
        return self.builder(np.random.default_rng([seed, zlib.crc32(self.name.encode())]))


class Space:
    """Cells of a lattice around a box, and their centres in the body's own axes.

    Parameters
    ----------
    low, high : (float, float, float)
        The box's corners in the body's own axes x, y, z. Nothing outside it belongs to the body.
    steps : (float, float, float)
        Block sides along the lattice's axes.
    turn : (float, float, float)
        Angles of the body's own axes against the lattice, degrees: bearing, plunge and dip of
        ``rotation_from_angles``.
    bearing : float
        Angle of the lattice in the world about the vertical, degrees.
    offset : (float, float, float)
        World coordinates of the lattice's origin.

    Attributes
    ----------
    x, y, z : (i, j, k) float
        Centres in the body's own axes.
    """

    def __init__(
        self,
        low: _Triple,
        high: _Triple,
        steps: _Triple = (5.0, 5.0, 5.0),
        turn: _Triple = (0.0, 0.0, 0.0),
        bearing: float = 0.0,
        offset: _Triple = (0.0, 0.0, 0.0),
    ) -> None:
        axes = rotation_from_angles(*turn)
        self.steps = np.array(steps, float)
        corners = np.array(list(product(*zip(low, high, strict=True)))) @ axes
        first = np.floor(corners.min(axis=0) / self.steps + 1e-9)
        last = np.ceil(corners.max(axis=0) / self.steps - 1e-9)
        lines = [
            (np.arange(a, b) + 0.5) * h for a, b, h in zip(first, last, self.steps, strict=True)
        ]
        self.centres: Floats = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
        own = self.centres @ axes.T
        self.x, self.y, self.z = own[..., 0], own[..., 1], own[..., 2]
        self.inside: Bools = np.all((own >= low) & (own <= high), axis=-1)
        self._place = rotation_from_angles(bearing, 0.0, 0.0), np.array(offset, float)

    def body(
        self,
        *layers: _Layer,
        without: Bools | None = None,
        beside: Bools | None = None,
        loose: Bools | bool = False,
        thinnest: float = np.inf,
        others: tuple[Floats, ...] = (),
    ) -> FieldBlocks:
        """Return the largest face-connected body of the layers.

        Parameters
        ----------
        *layers : (mask, level)
            Parts in order of priority: a cell belongs to the first that holds it.
        without : mask, optional
            Cells taken out (waste).
        beside : mask, optional
            Cells added that have neither part nor level (pipes, pillars, bridges).
        loose : mask or bool
            Cells added that need not touch the body; True keeps every component.
        thinnest : float
            Blocks across the thinnest ply.
        others : tuple of arrays
            Other levels that are as right, over all cells.
        """
        part = np.full(self.x.shape, -1)
        level = np.full(self.x.shape, np.nan)
        kept = np.zeros(self.x.shape, bool)
        for k, (mask, value) in enumerate(layers):
            new = mask & self.inside & ~kept
            part[new], level[new] = k, np.broadcast_to(value, new.shape)[new]
            kept |= new
        if without is not None:
            kept &= ~without
        if beside is not None:
            kept |= beside & self.inside
        if loose is not True:
            kept = largest(kept)
        if not isinstance(loose, bool):
            kept |= loose
        turn, offset = self._place
        return FieldBlocks(
            self.centres[kept] @ turn + offset,
            level[kept],
            part[kept],
            np.argwhere(kept),
            self.steps,
            thinnest,
            tuple(other[kept] for other in others),
        )

    def waste(self, rng: np.random.Generator, height: Floats, room: _Triple, count: int) -> Bools:
        """Return the cells of ``count`` lenses of waste inside a layer.

        Parameters
        ----------
        height : (i, j, k) float
            Height above the layer's bottom.
        room : (float, float, float)
            Half extents along x and y, and the layer's thickness, in which lenses are centred.
            Lenses stay a block away from top and bottom.
        """
        out = np.zeros(self.x.shape, bool)
        thick = room[2]
        for _ in range(count):
            a, b = rng.uniform(-0.8, 0.8, 2) * room[:2]
            half = float(rng.uniform(1.2, 1.8) * self.steps[2])
            c = rng.uniform(half + self.steps[2], thick - half - self.steps[2])
            r = rng.uniform(3, 7) * self.steps[0]
            flat = ((self.x - a) ** 2 + (self.y - b) ** 2) / r**2
            out |= flat + ((height - c) / half) ** 2 < 1
        return out

    def noise(self, rng: np.random.Generator, reach: _Triple) -> Floats:
        """Return a smooth Gaussian random field of mean 0 and variance 1 over the cells.

        Parameters
        ----------
        reach : (float, float, float)
            Standard deviation of the smoothing kernel along the lattice's axes, in blocks.
        """
        white = rng.standard_normal(self.x.shape)
        smooth = ndi.gaussian_filter(white, reach, mode="nearest", truncate=3.0)
        out: Floats = (smooth - smooth.mean()) / smooth.std()
        return out


def largest(kept: Bools) -> Bools:
    """Return the largest face-connected component of a mask."""
    labels, count = ndi.label(kept)
    if count < 2:
        return kept
    out: Bools = labels == 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    return out


def folded(spec: FoldSpec) -> FieldBlocks:
    """Return the blocks of a body of one sheet folded by flexural slip (class 1B)."""
    body = sample("field", spec)
    place = (body.folded - np.asarray(spec.offset)) @ body.sheet.lattice_axes.T / body.steps
    cells = np.rint(place - 0.5).astype(int)
    cells -= cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) + 1, bool)
    grid[tuple(cells.T)] = True
    kept = largest(grid)[tuple(cells.T)]  # a turned lattice leaves single blocks at the corners
    points, level = body.folded[kept], body.stratigraphic[kept]
    return FieldBlocks(points, level, np.zeros(len(points), int), cells[kept], body.steps)


def relief(rng: np.random.Generator, x: Floats, y: Floats, slope: float = 0.2) -> Floats:
    """Return heights of a gently folded surface; the steepest dip is atan(1.3 slope)."""
    along, across = rng.uniform(500, 900), rng.uniform(700, 1200)
    phase = rng.uniform(0, 2 * np.pi, 2)
    main = slope * along / (2 * np.pi) * np.sin(2 * np.pi * x / along + phase[0])
    cross = 0.3 * slope * across / (2 * np.pi) * np.sin(2 * np.pi * y / across + phase[1])
    out: Floats = main + cross
    return out


def waves(rng: np.random.Generator, x: Floats, y: Floats, length: float) -> Floats:
    """Return a random surface of mean 0 and variance 1: 30 plane waves of about that length."""
    out: Floats = np.zeros(x.shape)
    for _ in range(30):
        a, b = rng.normal(size=2) * 2 * np.pi / length / np.sqrt(2)
        out += np.cos(a * x + b * y + rng.uniform(0, 2 * np.pi))
    out /= np.sqrt(15)
    return out
