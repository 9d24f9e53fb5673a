"""Surfaces as heights over a plane, and maps by vertical coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geounfold.backends.igl import SurfaceIndex
from geounfold.errors import SplitError, check_one_of
from geounfold.geometry.measures import unit
from geounfold.geometry.mesh import Bools, Floats, TriMesh
from geounfold.mapping.control_mesh import Datum
from geounfold.methods.contract import Placed, PreparedBody, mean_top_normal
from geounfold.methods.sheet.result import SheetResult

_STEEPEST = 3.0  # rise over run beyond which a border is continued level (72 degrees)
_STANDING = 0.05  # |cosine| of the top's mean normal and up below which a sheet is vertical
_SAME = 1e-6  # blocks: two heights closer than this are one
_CLEAR = 1.0  # blocks: distance from the surface at which rays start


@dataclass(frozen=True, kw_only=True)
class VerticalOptions:
    """Options of ``shear`` and ``stratigraphic``.

    Parameters
    ----------
    axis : str
        Vertical direction: ``up``, the direction given as up, or ``across``, the lattice axis
        across the body (the principal axis for scattered points).

    Raises
    ------
    OptionError
        Another name.
    """

    axis: str = "up"

    def __post_init__(self) -> None:
        check_one_of("vertical_options.axis", self.axis, ("up", "across"))


class Heights(NamedTuple):
    """Heights of a surface: ``z`` (n,), whether it was met (n,), met more than once (n,)."""

    z: Floats
    met: Bools
    several: Bools


class HeightField:
    """A surface as a height over a plane: the outermost height if a vertical meets it repeatedly.

    Parameters
    ----------
    mesh : TriMesh
        The surface; vertical is z.
    side : int
        +1 to take the highest of several heights, -1 the lowest.
    """

    def __init__(self, mesh: TriMesh, side: int) -> None:
        V = mesh.V
        self._side, self._F = side, mesh.F
        self._V = V
        self._low, self._high = float(V[:, 2].min()), float(V[:, 2].max())
        self._index = SurfaceIndex(V, mesh.F)
        self._plan = SurfaceIndex(V * np.array([1.0, 1.0, 0.0]), mesh.F)

    def at(self, xy: Floats) -> Heights:
        """Return the heights at places (n, 2).

        Past its border the surface is continued by the plane of the nearest triangle, or
        horizontally if that is steep.
        """
        outer, inner = (self._first(xy, side) for side in (self._side, -self._side))
        met = np.isfinite(outer)
        several = met & (np.abs(outer - inner) > _SAME)
        z = np.where(met, outer, 0.0)
        if not met.all():
            z[~met] = self._continued(xy[~met])
        return Heights(z, met, several)

    def _first(self, xy: Floats, side: int) -> Floats:
        """Return the height met first from above (+1) or below (-1), (n,); infinite for none."""
        start = self._high + _CLEAR if side > 0 else self._low - _CLEAR
        origins = np.column_stack([xy, np.full(len(xy), start)])
        way = np.tile([0.0, 0.0, -float(side)], (len(xy), 1))
        return np.asarray(start - side * self._index.first_hit(origins, way)[1])

    def _continued(self, xy: Floats) -> Floats:
        flat = np.column_stack([xy, np.zeros(len(xy))])
        _, face, foot = self._plan.closest(flat)
        a, b, c = (self._V[self._F[face, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        upright = np.abs(normal[:, 2])
        gentle = np.hypot(normal[:, 0], normal[:, 1]) <= _STEEPEST * upright
        rise = -normal[:, :2] / np.where(gentle, normal[:, 2], 1.0)[:, None]
        beyond = np.einsum("ij,ij->i", rise, xy - foot[:, :2])
        at_foot = a[:, 2] + np.einsum("ij,ij->i", rise, foot[:, :2] - a[:, :2])
        middle = (a[:, 2] + b[:, 2] + c[:, 2]) / 3
        return np.asarray(np.where(gentle, at_foot + beyond, middle))


class VerticalColumn(NamedTuple):
    """Bottom and top over places, (n,) each; whether both were met, either more than once."""

    bottom: Floats
    top: Floats
    met: Bools
    several: Bools


@dataclass(frozen=True, eq=False)
class VerticalRule:
    """A map that keeps x and y and computes z from the heights of top and bottom.

    Attributes
    ----------
    turn : (3, 3) float
        Rows are the map's axes in the working frame, the last one vertical.
    bottom, top : HeightField
        The surfaces, turned.
    datum : Datum
        How z follows from the height over the middle.
    """

    turn: Floats
    bottom: HeightField
    top: HeightField
    datum: Datum

    way_back = True

    def column(self, xy: Floats) -> VerticalColumn:
        """Return bottom and top over places (n, 2)."""
        low, high = self.bottom.at(xy), self.top.at(xy)
        return VerticalColumn(low.z, high.z, low.met & high.met, low.several | high.several)

    def to_flat(self, points: Floats) -> Placed:
        """Place folded points; no image if the top does not lie over the bottom."""
        P = points @ self.turn.T
        at = self.column(P[:, :2])
        half = (at.top - at.bottom) / 2
        good = half > _SAME
        half = np.where(good, half, np.nan)
        height = P[:, 2] - (at.top + at.bottom) / 2
        z = self.datum.z(height, -half, half)
        out = np.column_stack([P[:, :2], z])
        out[~good] = np.nan
        return Placed(out, (height / half + 1) / 2, at.met & good)

    def to_folded(self, points: Floats) -> Floats:
        """Return flat points in the folded space."""
        at = self.column(points[:, :2])
        half, middle = (at.top - at.bottom) / 2, (at.top + at.bottom) / 2
        half = np.where(half > _SAME, half, np.nan)
        height = _height(self.datum, points[:, 2], half)
        out: Floats = np.column_stack([points[:, :2], height + middle]) @ self.turn
        return out


def _height(datum: Datum, z: Floats, half: Floats) -> Floats:
    """Return the heights over the middle from which the datum computes z."""
    if datum.name == "top":
        return z + half - datum.top
    if datum.name == "bottom":
        return z - half - datum.bottom
    if datum.name == "proportional":
        return 2 * half * z / (datum.top - datum.bottom)
    return z + 0 * half


def vertical_rule(
    body: PreparedBody, sheet: SheetResult, datum: str
) -> tuple[VerticalRule, VerticalColumn]:
    """Return the map of a body by its top and bottom, and the vertical columns of its blocks.

    Parameters
    ----------
    body : PreparedBody
        ``options`` are VerticalOptions.
    sheet : SheetResult
        Source of top and bottom.
    datum : str
        Surface that becomes flat (see Datum); the mean half thickness over the blocks is used on
        both sides.

    Raises
    ------
    SplitError
        The sheet is vertical, or its top lies over its bottom nowhere.
    """
    turn = _upright(body)
    fields = []
    for name, side in (("bottom", -1), ("top", 1)):
        mesh = sheet.mesh.surfaces[name][0]
        fields.append(HeightField(mesh.with_vertices(mesh.V @ turn.T), side))
    rule = VerticalRule(turn, fields[0], fields[1], Datum("mid", -1.0, 1.0))
    at = rule.column((body.blocks @ turn.T)[:, :2])
    good = at.met & (at.top - at.bottom > _SAME)
    if not good.any():
        raise SplitError(
            "the top lies vertically over the bottom nowhere; turn --up across the body, or use "
            "--method sheet"
        )
    half = float((at.top - at.bottom)[good].mean()) / 2
    return VerticalRule(turn, fields[0], fields[1], Datum(datum, -half, half)), at


def _upright(body: PreparedBody) -> Floats:
    """Return the axes (3, 3) with the last one vertical, towards the split's top."""
    normal = unit(mean_top_normal(body.split)[None])[0]
    axis = body.up if body.options.axis == "up" else np.array([0.0, 0.0, 1.0])
    cosine = float(axis @ normal)
    if not abs(cosine) > _STANDING:
        raise SplitError(
            "the sheet stands on end, so that no vertical line leads from its bottom to its top; "
            "turn --up across it, or use --method sheet"
        )
    z = axis if cosine > 0 else -axis
    along = np.array([1.0, 0.0, 0.0]) - z[0] * z
    if np.linalg.norm(along) < 0.5:
        along = np.array([0.0, 1.0, 0.0]) - z[1] * z
    x = unit(along[None])[0]
    return np.stack([x, np.cross(z, x), z])


def vertical_warnings(at: VerticalColumn, blocks: int) -> tuple[tuple[str, ...], dict[str, object]]:
    """Return warnings about ambiguous columns of a body, and their counts."""
    counts = {
        "ambiguous": int(at.several.sum()),
        "crossed": int((at.met & (at.top - at.bottom <= _SAME)).sum()),
        "continued": int((~at.met).sum()),
    }
    said = {
        "ambiguous": "stand where a vertical line meets the top or the bottom more than once; the "
        "outermost was taken, so overhanging limbs fall together",
        "crossed": "stand where the bottom lies over the top; they were left empty",
    }
    out = tuple(f"{counts[k]} of {blocks} blocks {words}" for k, words in said.items() if counts[k])
    return out, dict(counts)
