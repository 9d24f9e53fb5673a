"""A body from drill-holes: all stages, in order."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.body.fill.filled import block_sides
from geounfold.drillholes import DrillHoles, joined, read_drillholes
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats, TriMesh
from geounfold.io.messages import counted
from geounfold.modelling.blocks import Slab, blocks_of
from geounfold.modelling.extent import covered, grid_over, spacing_of
from geounfold.modelling.intercepts import Intercepts, in_body, intercepts_of
from geounfold.modelling.options import BodyOptions
from geounfold.modelling.outline import in_polygon
from geounfold.modelling.reference import Reference, fold_of, mean_plane
from geounfold.modelling.sheet import (
    Sheet,
    barren,
    crossings,
    fit_sheet,
    foretold,
    one_each_place,
)
from geounfold.modelling.traced import Traced, traced

_NODES = 0.5  # of a block's smallest side: distance of the walls' nodes
_TRACE = 0.125  # of the median intercept: distance of points along holes
_BODY = "body"
_GOOD = 0.02  # the same length, below which a plane is good: a slab has 0, an open fold 0.03
_TURN = 360.0  # degrees by which a layer may turn: simulated sheets by 230 at most, a tube by 360
_POOR = 0.5  # the same length, above which no fold is chosen and the user is warned


@dataclass(frozen=True, eq=False)
class HolesBody:
    """A body made from drill-holes.

    Attributes
    ----------
    points : (n, 3) float
        Centroids of the blocks, in lexicographic order.
    block_size : (3,) float
        Sides of a block.
    hanging_wall, footwall : TriMesh
        The walls, through the contacts.
    holes : DrillHoles
        As read.
    intercepts : DataFrame
        A row for each intercept: hole, from, to, length, waste (in it), thickness (across the
        layer), contact_above and contact_below (false where the hole's record ends).
    inside : (k,) bool
        Which intervals of the holes are the body's.
    column : str
        Column of the codes, or of the grade that has a cut-off.
    barren : int
        Number of places where a hole crosses the layer without an intercept.
    spacing : float
        Spacing of the holes along the layer.
    extent : float or None
        How far the body reaches beyond its outermost intercepts; None in a polygon.
    error : float or None
        Length of hole that is foretold wrongly over length of ore, when holes are left out by
        tenths; None if the holes are too few for that.
    told : tuple of str
        What was chosen and left out, one sentence each.
    """

    points: Floats
    block_size: Floats
    hanging_wall: TriMesh
    footwall: TriMesh
    holes: DrillHoles
    intercepts: pd.DataFrame
    inside: Bools
    column: str
    barren: int
    spacing: float
    extent: float | None
    error: float | None
    told: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        """Return one line: blocks, their size, intercepts."""
        sides = " x ".join(f"{s:.6g}" for s in self.block_size)
        count = len(self.intercepts)
        return f"<HolesBody of {len(self)} blocks of {sides} from {count} intercepts>"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the body, one sentence each."""
        if self.error is None or self.error <= _POOR:
            return ()
        return (
            f"holes that are left out are foretold badly: {self.error:.0%} of their length in the "
            "body is wrong; the layer is folded otherwise, or the holes are too far apart",
        )

    @property
    def waste(self) -> float:
        """Share of the intercepts' length that is waste between coded intervals."""
        within = self.intercepts["to"] - self.intercepts["from"]
        return float(self.intercepts["waste"].sum() / within.sum())

    @property
    def volume(self) -> float:
        """Volume of the blocks."""
        return float(len(self) * np.prod(self.block_size))

    @property
    def table(self) -> pd.DataFrame:
        """The blocks: x, y, z of the centroids, and their sides dx, dy, dz."""
        columns = dict(zip("xyz", self.points.T, strict=True))
        return pd.DataFrame(columns | dict(zip(("dx", "dy", "dz"), self.block_size, strict=True)))

    def samples(
        self, length: float | None = None, assays: DrillHoles | None = None
    ) -> pd.DataFrame:
        """Return the samples in the body's intervals, as `DrillHoles.samples`.

        Parameters
        ----------
        length : float, optional
            Length of composites. They begin anew at every change of code, so that none crosses a
            contact.
        assays : DrillHoles, optional
            The same holes with grades, which are cut where the codes change; by default the
            intervals' own columns.

        Raises
        ------
        InputError
            No assay lies in the body.
        """
        own = self.holes.intervals.kept(self.inside)
        holes = replace(
            self.holes,
            intervals=own,
            grades={name: v[self.inside] for name, v in self.holes.grades.items()},
            words={name: v[self.inside] for name, v in self.holes.words.items()},
        )
        by = self.column if self.column in self.holes.words else None
        if assays is not None:
            column = self.column if by else _BODY
            if not by:
                holes = replace(holes, words={_BODY: np.full(len(own.start), _BODY, dtype=object)})
            cut = joined(assays, holes, (column,))
            there = cut.words[column] != ""
            if not there.any():
                raise InputError(f"{assays.sources['assay']}: no assay lies in the body")
            holes = replace(
                cut,
                intervals=cut.intervals.kept(there),
                grades={name: v[there] for name, v in cut.grades.items()},
                words={name: v[there] for name, v in cut.words.items()},
            )
            by = column
        return holes.samples(length, by=by)

    def facts(self) -> dict[str, Any]:
        """Return the figures for a summary."""
        thickness = self.intercepts["thickness"]
        return {
            "blocks": len(self),
            "block_size": self.block_size.tolist(),
            "volume": self.volume,
            "intercepts": len(self.intercepts),
            "holes_with_intercepts": int(self.intercepts["hole"].nunique()),
            "barren_crossings": self.barren,
            "spacing": self.spacing,
            "extent": self.extent,
            "thickness": {
                "mean": float(thickness.mean()),
                "least": float(thickness.min()),
                "greatest": float(thickness.max()),
            },
            "foretold_wrongly": self.error,
            "told": list(self.told),
            "warnings": list(self.warnings),
            "drillholes": self.holes.facts(),
        }


def body_from_holes(
    collar: str | Path | pd.DataFrame | DrillHoles,
    survey: str | Path | pd.DataFrame | None = None,
    intervals: str | Path | pd.DataFrame | None = None,
    options: BodyOptions | None = None,
    *,
    drillholes: dict[str, Any] | None = None,
    **changes: Any,
) -> HolesBody:
    """Make a body of blocks from coded intervals of drill-holes.

    Parameters
    ----------
    collar, survey, intervals : path or DataFrame
        The three tables, as for `read_drillholes`; or the first a DrillHoles alone. The intervals
        hold codes or grades. Ground without an interval is waste.
    options : BodyOptions, optional
        The rules; or give its fields by name.
    drillholes : dict, optional
        Further arguments of `read_drillholes`, such as ``dip_positive_down``.
    **changes
        Fields of `BodyOptions`: ``code`` or ``cut_off``, ``extent``, ``block_size`` and others.

    Returns
    -------
    HolesBody
        Blocks between a hanging wall and a footwall that pass through all contacts.

    Raises
    ------
    InputError
        A table cannot be used, there are fewer than four intercepts, they lie on one line, a wall
        has too few contacts, or no block lies inside.
    OptionError
        A code, column or value does not fit.

    Examples
    --------
    >>> import pandas as pd
    >>> at = [(x, y) for x in (0.0, 50.0, 100.0) for y in (0.0, 50.0, 100.0)]
    >>> names = [f"H{k}" for k in range(9)]
    >>> collar = pd.DataFrame(at, columns=["x", "y"]).assign(hole=names, z=0.0, depth=60.0)
    >>> survey = pd.DataFrame({"hole": names, "at": 0.0, "azimuth": 0.0, "dip": 90.0})
    >>> lith = pd.DataFrame({"hole": names, "from": 20.0, "to": 40.0, "lith": "ORE"})
    >>> body_from_holes(collar, survey, lith, code="ORE", block_size=10)
    <HolesBody of 404 blocks of 10 x 10 x 10 from 9 intercepts>
    """
    if options is not None and changes:
        raise OptionError("give options or its fields by name, not both")
    options = BodyOptions(**changes) if options is None else options
    if isinstance(collar, DrillHoles):
        holes = collar
    elif survey is None or intervals is None:
        raise InputError("body_from_holes takes three tables: collar, survey and intervals")
    else:
        holes = read_drillholes(collar, survey, intervals, **(drillholes or {}))
    inside, column = in_body(holes, options)
    found = intercepts_of(holes, inside, options)
    if len(found) < 4:
        raise InputError(
            f"{holes.sources['assay']}: {counted(len(found), 'intercept')} of the body; a body "
            "needs four or more"
        )
    trace = traced(holes, found, _TRACE * float(np.median(found.end - found.start)))
    reference, error, told = _reference(found, trace, options)
    found, more = one_each_place(found, reference)
    sheet = fit_sheet(found, reference)
    return _built(holes, found, sheet, trace, options, (inside, column), error, (*told, *more))


def _reference(
    found: Intercepts, trace: Traced, options: BodyOptions
) -> tuple[Reference, float | None, tuple[str, ...]]:
    """Return the surface over which the walls are drawn, its error, and what the user is told.

    Of a plane and a fold that one is taken whose walls foretell holes better that are left out. If
    those over the plane foretell well, no fold is tried. A fold that foretells badly is not taken:
    it has more freedom than the plane, and its turns are then those of single holes.
    """
    plane = None
    if options.shape != "fold" and options.axis is None:
        plane = mean_plane(found)
    plain = None if plane is None else _error(found, plane, trace)
    if plane is not None and (options.shape == "plane" or (plain is not None and plain <= _GOOD)):
        return plane, plain, (plane.told(),)
    try:
        fold = fold_of(found, trace, options.axis)
    except InputError:
        if plane is None:
            raise
        return plane, plain, (plane.told(),)
    error = _error(found, fold, trace)
    better = error is not None and (plain is None or error < min(plain, _POOR))
    if plane is None or (better and fold.turn <= _TURN):
        return fold, error, (fold.told(),)
    return plane, plain, (plane.told(),)


def _error(found: Intercepts, reference: Reference, trace: Traced) -> float | None:
    """Return how badly left-out holes are foretold; None if too few are left.

    A fold of all holes has seen the left-out ones, and one drawn without them may differ from it:
    the larger of both errors counts.
    """
    try:
        seen = foretold(found, reference, trace)
        if not reference.follows:
            return seen
        return max(seen, foretold(found, reference, trace, redrawn=True))
    except InputError:
        return None


def _built(  # what the stages before have found
    holes: DrillHoles,
    found: Intercepts,
    sheet: Sheet,
    trace: Traced,
    options: BodyOptions,
    inside: tuple[Bools, str],
    error: float | None,
    told: tuple[str, ...],
) -> HolesBody:
    """Return the body between the walls."""
    if options.polygon is not None:
        _check_polygon(options, found)
    crossed, at, depths = crossings(sheet, trace)
    none = crossed[barren(found, at, depths)]
    spacing = spacing_of(sheet.places)
    extent = options.extent or 0.5 * spacing
    half = sheet.walls.at(sheet.places)[1]
    thick = np.maximum(2 * half, options.least_thickness)
    if not (thick > 0).any():
        raise InputError("hanging wall and footwall cross at every intercept; the codes are mixed")
    typical = float(np.median(thick))
    area = len(found) * spacing**2
    sides, told_sides = block_sides(options.block_size, typical, area * typical)
    slab = _slab(sheet, none, spacing, extent, float(sides.min()), options)
    points = blocks_of(slab, sides)
    if options.polygon is not None:
        points = points[in_polygon(points[:, :2], np.asarray(options.polygon, dtype=np.float64))]
    if not len(points):
        raise InputError("the polygon holds no block of the body; check its coordinates")
    waste = float(found.waste.sum())
    if waste > 0:
        share = waste / float((found.end - found.start).sum())
        told = (*told, f"{share:.1%} of the intercepts' length is waste between them")
    return HolesBody(
        points=points,
        block_size=sides,
        hanging_wall=slab.wall(1.0),
        footwall=slab.wall(-1.0),
        holes=holes,
        intercepts=_table(holes, found, thick),
        inside=inside[0],
        column=inside[1],
        barren=len(none),
        spacing=spacing,
        extent=None if options.polygon is not None else extent,
        error=error,
        told=(*told, *told_sides),
    )


def _check_polygon(options: BodyOptions, found: Intercepts) -> None:
    """Raise InputError if no intercept lies in the polygon."""
    corners = np.asarray(options.polygon, dtype=np.float64)
    middles = 0.5 * (found.upper + found.lower)
    if not in_polygon(middles[:, :2], corners).any():
        low, high = corners.min(axis=0), corners.max(axis=0)
        raise InputError(
            f"no intercept lies in the polygon, x {low[0]:g} to {high[0]:g}, y {low[1]:g} to "
            f"{high[1]:g}; check its coordinates"
        )


def _slab(
    sheet: Sheet,
    none: Floats,
    spacing: float,
    extent: float,
    side: float,
    options: BodyOptions,
) -> Slab:
    """Return the walls on a grid, and which nodes the body covers."""
    margin = 1.05 * extent + side
    corners = None if options.polygon is None else np.asarray(options.polygon, dtype=np.float64)
    if corners is not None:
        level = sheet.reference.world(np.column_stack([sheet.places, np.zeros(len(sheet.places))]))
        away = np.linalg.norm(corners[:, None] - level[None, :, :2], axis=2).min(axis=1)
        margin = max(margin, 2 * float(away.max()))
    grid = grid_over(sheet.places, margin, _NODES * side)
    middle, half = sheet.walls.at(grid.places)
    half = np.maximum(half, 0.5 * options.least_thickness)
    if corners is None:
        there = covered(grid, sheet.places, none, spacing, extent)
    else:
        world = sheet.reference.world(np.column_stack([grid.places, middle]))
        there = in_polygon(world[:, :2], corners)
        there &= covered(grid, sheet.places, none, spacing, margin)
    return Slab(sheet, grid, middle, half, there & (half > 0))


def _table(holes: DrillHoles, found: Intercepts, thickness: Floats) -> pd.DataFrame:
    """Return a row for each intercept."""
    return pd.DataFrame(
        {
            "hole": holes.collars.names[found.hole],
            "from": found.start,
            "to": found.end,
            "length": found.end - found.start,
            "waste": found.waste,
            "thickness": thickness,
            "contact_above": ~found.open_above,
            "contact_below": ~found.open_below,
        }
    )
