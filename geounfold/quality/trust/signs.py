"""Signs that a finished unfolding is wrong, measured on the hull that the map carries."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy import ndimage

from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.quality.trust.carried_hull import CarriedHull, carry_hull
from geounfold.quality.trust.flat_columns import FlatColumns, flat_columns

_LEVEL = 0.85
"""Vertical component of the flat normal (32 degrees) from which a face is a horizon's."""

_OBLIQUE = 0.7
"""The same (45 degrees) with oblique ends among them."""

_OFF = (1.0, 0.25)
"""Blocks, and share of the thickness, by the larger of which a face misses its level."""

_STRETCHED = 0.3
"""|log| of a principal stretch above which a length is not kept."""

_INSIDE = 3.0
"""Blocks inside the outline from which faces count; half a thickness if that is more."""

_ENOUGH = 0.3
"""Share of the outermost faces that must be left inside, or the distance is given up."""

_COLUMN = 1.5
"""Side of a column, in the longest side of a block: none is missed for want of a face."""

_BEYOND = 1.0
"""Blocks by which the mid surface must lie outside the body to count."""

_STEP = (2.0, 0.35)
"""Blocks, and share of the thickness, by the larger of which a horizon steps over two columns."""

_ROUGH = (1 / 3, 3.0)
"""Blocks by which top and bottom leave their levels in the mean, and thickness in blocks, from
which on they count as rough.

Lattices alone leave 0.02 to 0.24 blocks on 78 sound bodies, noisy indicators 0.22 to 0.61; hulls
of sheets one block thick miss by half a block.
"""

_THICKEST = 3.0
"""Median thicknesses above which a thickness is cut: feather edges of the map are no measure."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where a sign is found.

    Attributes
    ----------
    folded : (3,) float
        Centre of its largest patch, working units.
    volume : float
        Volume of the columns in which it is found, in blocks.
    """

    folded: Floats
    volume: float


@dataclass(frozen=True, eq=False)
class Signs:
    """What the hull shows of a finished unfolding.  Shares are of the hull's top and bottom.

    Attributes
    ----------
    off : float
        Share that looks up or down in the flat space and misses level 1 or 0.
    length : float
        Share of which a length changes by more than 30 %.
    ends : float
        As ``off``, faces of up to 45 degrees among them.
    level : float
        Share of the outline in which the mid surface lies outside the body.  NaN if heights are
        not those over the mid surface.
    step : float
        Length of the longest line along which the top or the bottom steps, over the width of the
        widest disc in the outline.  NaN as ``level``.
    breadth : float
        Widest disc in the outline over the median thickness.
    rough : float
        Mean difference of the top's and the bottom's levels from their medians; 0 if it is as
        small as a lattice makes it.
    thickness : float
        Median thickness, in blocks.
    lost : float
        Share of the hull's area that the map does not carry.
    strays : float
        Share of the blocks more than a block outside of the smooth hull that they do not fit.
    places : dict of Place
        Where the signs are found, by their names.
    """

    off: float
    length: float
    ends: float
    level: float
    step: float
    breadth: float
    rough: float
    thickness: float
    lost: float
    places: dict[str, Place]
    strays: float = 0.0

    def figures(self) -> dict[str, float | None]:
        """Return the figures by name, for the summary; None if one was not measured."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "places"}
        return {name: value if np.isfinite(value) else None for name, value in values.items()}


_NOTHING_CARRIED = Signs(1.0, 1.0, 1.0, np.nan, np.nan, np.nan, np.nan, np.nan, 1.0, {})
"""The signs of a map that carries no face of the hull: no face lies where it should."""


def measure_signs(
    hull: TriMesh,
    mapping: UnfoldingMap,
    side: float,
    *,
    over_mid: bool = True,
    walls: Bools | None = None,
) -> Signs:
    """Return the signs of one body.

    Parameters
    ----------
    hull : TriMesh
        The closed surface around its blocks, working units.
    mapping : UnfoldingMap
        The finished map.
    side : float
        Longest side of a block, or of a cell of merged blocks, working units.
    over_mid : bool
        Whether the map's heights are those over the mid surface.
    walls : (m,) bool, optional
        Which of the hull's faces are at fault walls, and so are neither top nor bottom.
    """
    side = max(1.0, side)
    faces = carry_hull(hull, mapping)
    if not len(faces.level):
        return _NOTHING_CARRIED
    own = None if walls is None else walls[faces.face]
    columns = flat_columns(faces, _COLUMN * side, own)
    ends, _, _ = _off(faces, columns, _OBLIQUE, own)
    off, thickness, rough = _off(faces, columns, _LEVEL, own)
    stretch, area = faces.stretch(ends.rows)
    length = _Share(ends.rows, stretch > _STRETCHED, area)
    within = columns.within(thickness / 2)
    left = within & ((columns.lowest > _BEYOND) | (columns.highest < -_BEYOND))
    stepped, longest = _stepped(columns, within, side)
    width = float(2 * columns.depth.max() - columns.side)
    at = columns.of(faces.flat_centre)
    bad = {
        "off": off.rows[off.bad],
        "length": length.rows[length.bad],
        "ends": ends.rows[ends.bad],
        "level": np.flatnonzero(left[at] & over_mid),
        "step": np.flatnonzero(stepped[at] & over_mid),
    }
    return Signs(
        off=off.value,
        length=length.value,
        ends=ends.value,
        level=float(left.sum() / max(within.sum(), 1)) if over_mid else np.nan,
        step=longest / max(width, columns.side) if over_mid else np.nan,
        breadth=width / thickness,
        rough=rough.levels if rough.counts(side, thickness) else 0.0,
        thickness=thickness,
        lost=faces.lost,
        places={name: _place(faces, columns, rows) for name, rows in bad.items() if len(rows)},
    )


@dataclass(frozen=True, eq=False)
class _Share:
    """Faces (k,), which of them are bad, and what each weighs."""

    rows: Ints
    bad: Bools
    weight: Floats

    @property
    def value(self) -> float:
        return float(self.weight[self.bad].sum() / self.weight.sum()) if len(self.rows) else 1.0


@dataclass(frozen=True, eq=False)
class _Misses:
    """Mean distances of faces, each at most 1, in levels and in working units."""

    levels: float
    distance: float

    def counts(self, side: float, thickness: float) -> bool:
        """Return whether they are more than a lattice's; sides and thickness in working units."""
        return self.distance > _ROUGH[0] * side and thickness > _ROUGH[1] * side


def _off(
    faces: CarriedHull, columns: FlatColumns, least: float, walls: Bools | None = None
) -> tuple[_Share, float, _Misses]:
    """Return the outermost faces that look up or down and which miss their level.

    The median thickness and the mean misses come with them.
    """
    area, z = faces.flat_area, faces.flat_centre[:, 2]
    up, down = faces.up > least, faces.up < -least
    if walls is not None:
        up, down = up & ~walls, down & ~walls
    at = columns.of(faces.flat_centre)
    flat = up | down
    thickness = _median(faces.thickness[flat], area[flat])
    outer = (up & (z > columns.highest[at] - 1)) | (down & (z < columns.lowest[at] + 1))
    depth = columns.clear[at]
    use = outer
    for distance in (max(_INSIDE, thickness / 2), _INSIDE):
        inside = outer & (depth > distance)
        if area[inside].sum() > _ENOUGH * area[outer].sum():
            use = inside
            break
    rows = np.flatnonzero(use)
    own = faces.thickness[rows]
    levels = np.abs(np.where(up[rows], faces.level[rows] - 1, faces.level[rows]))
    miss = levels * np.minimum(own, _THICKEST * thickness)
    off = _Share(rows, miss > np.maximum(_OFF[0], _OFF[1] * own), area[rows])
    return off, thickness, _misses(faces, rows, up[rows], np.minimum(own, _THICKEST * thickness))


def _misses(faces: CarriedHull, rows: Ints, up: Bools, thickness: Floats) -> _Misses:
    """Return how far faces lie from the usual level of their side: top, ``up``, or bottom."""
    if not len(rows):
        return _Misses(np.nan, np.nan)
    level, area = faces.level[rows], faces.flat_area[rows]
    usual = np.where(up, _median(level[up], area[up]), _median(level[~up], area[~up]))
    off = np.abs(level - usual)
    means = [float(np.average(np.minimum(m, 1.0), weights=area)) for m in (off, off * thickness)]
    return _Misses(means[0], means[1])


def _stepped(columns: FlatColumns, within: Bools, side: float) -> tuple[Bools, float]:
    """Return the columns on the longest line along which top or bottom steps, and its length.

    The length is the larger extent of the line along the columns' axes, working units.
    """
    found, longest = np.zeros(within.shape, bool), 0
    high, low = (np.where(within, h, np.nan) for h in (columns.highest, columns.lowest))
    for horizon in (high, low):
        steps = np.zeros(within.shape, bool)
        for axis in (0, 1):
            rise = np.roll(horizon, -1, axis) - np.roll(horizon, 1, axis)
            thick = np.fmax(np.roll(high - low, -1, axis), np.roll(high - low, 1, axis))
            steps |= np.abs(rise) > np.maximum(_STEP[0] * side, _STEP[1] * thick)
        line, _ = ndimage.label(steps, np.ones((3, 3)))
        for number, box in enumerate(ndimage.find_objects(line), 1):
            extent = max(s.stop - s.start for s in box)
            if extent > longest:
                found, longest = line == number, extent
    return found, longest * columns.side


def _median(values: Floats, weights: Floats) -> float:
    """Return the weighted median; NaN of nothing."""
    if not len(values):
        return float("nan")
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])


def _place(faces: CarriedHull, columns: FlatColumns, bad: Ints) -> Place:
    """Return where bad faces are: the middle of their largest patch, and the volume beneath."""
    row, column = columns.of(faces.flat_centre[bad])
    mask = np.zeros(columns.depth.shape, bool)
    mask[row, column] = True
    patch, _ = ndimage.label(mask, np.ones((3, 3)))
    own = patch[row, column]
    weight = np.bincount(own, faces.flat_area[bad])
    mine = bad[own == int(weight.argmax())]
    middle = np.average(faces.folded_centre[mine], axis=0, weights=faces.flat_area[mine])
    nearest = np.linalg.norm(faces.folded_centre[mine] - middle, axis=1).argmin()
    high = (columns.highest - columns.lowest)[mask]
    return Place(faces.folded_centre[mine[nearest]], float(high.sum() * columns.side**2))
