"""What the viewer draws, as one JSON object of quantised arrays.

``blocks`` holds, for the blocks drawn:

- ``folded`` and ``unfolded``: centroids, 16 bits per coordinate;
- ``sides``: sides of a block, or ``sizes``: sides of every block if they differ;
- ``axes``: directions of the sides, as columns, in the space in which blocks are drawn as boxes
  (the folded one on lattices, else the unfolded one);
- ``bent``: the other space, and ``gradients``: the deformation gradients times the axes there,
  16 bits per entry, GRADIENT_STEP each;
- ``outer``: whether each block lies outside, and ``rows``: its data row.

``columns`` holds the blocks' values, ``holes`` traces and samples in float32, ``faults`` the fault
surfaces of the folded space and the cut-offs in both, and ``palettes`` the colour maps, 256 colours
of three bytes each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.report.arrays import encoded, floating_points, quantised_points
from geounfold.report.blocks import Shape, block_shape, chosen_blocks, gradients, outer_blocks
from geounfold.report.body import ReportBody
from geounfold.report.columns import Column, read_columns
from geounfold.report.faults import CarriedFaults, cutoff_lines, joined_surfaces
from geounfold.report.horizons import Horizons, horizons_data
from geounfold.report.plots.rendering import block_sides
from geounfold.report.plots.style import ViewOptions, require

if TYPE_CHECKING:
    from numpy.typing import NDArray

GRADIENT_STEP = 1 / 4096
"""Change of a gradient's entry per unit of its code."""

MOST_POINTS = 20_000
"""Points that a report holds at most, of traces and of samples each."""

MOST_TRIANGLES = 60_000
"""Triangles of fault surfaces that a report holds at most."""

_NEAR = 3.0  # diagonals of a block from the body up to which a fault surface is drawn

_ROOM = 3_600_000  # bytes for the values of columns, before base64
_SAMPLE_COLUMNS = 12  # columns of samples at most
_SEED = 20_261_125
_RESULTS = "Results"
_INPUT = "Input"
_PALETTES = {"viridis": "viridis", "cividis": "cividis", "diverging": "RdYlBu_r"}

# Okabe and Ito's colours, distinct for colour-blind readers; black is kept for outlines.
CATEGORIES = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    "#D55E00",
    "#F0E442",
    "#999999",
)


@dataclass(frozen=True, eq=False)
class CarriedPoints:
    """Points of drill-holes in both spaces.

    Attributes
    ----------
    hole : (m,) of str or None
        The hole of each point; points of one hole are consecutive.  None if holes are unknown.
    folded, unfolded : (m, 3) float
        Points in both spaces; NaN in the unfolded space for a point beyond the map's reach.
    columns : mapping of str to (m,)
        Values of the points.
    """

    hole: ArrayLike | None
    folded: Floats
    unfolded: Floats
    columns: Mapping[str, ArrayLike] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class CarriedHoles:
    """Drill-holes carried with a body; either may be absent.

    Attributes
    ----------
    traces : CarriedPoints or None
        Points along the holes, drawn as lines.
    samples : CarriedPoints or None
        Samples or composites, drawn as dots.
    """

    traces: CarriedPoints | None = None
    samples: CarriedPoints | None = None


@dataclass(frozen=True, eq=False)
class Payload:
    """The viewer's data, and notes about what it leaves out.

    Attributes
    ----------
    content : dict
        The data, ready for JSON.
    notes : tuple of str
        One sentence for each kind of thing left out.
    """

    content: dict[str, Any]
    notes: tuple[str, ...]


def payload(
    body: ReportBody,
    *,
    holes: CarriedHoles | None = None,
    faults: CarriedFaults | None = None,
    horizons: Horizons | None = None,
    view: ViewOptions | None = None,
    unit: str = "",
) -> Payload:
    """Return what the viewer draws.

    Parameters
    ----------
    body : ReportBody
        The blocks and their columns.
    holes : CarriedHoles, optional
        Drill-holes carried with the body.
    faults : CarriedFaults, optional
        Faults between the body's fault blocks.
    horizons : Horizons, optional
        Top and bottom surfaces.
    view : ViewOptions, optional
        The viewer's direction at the start.
    unit : str, optional
        The coordinates' unit.
    """
    view = view or ViewOptions()
    shape = block_shape(body.folded, body.columns)
    outer = outer_blocks(body.folded, shape)
    chosen = chosen_blocks(outer)
    columns, column_notes = _block_columns(body, chosen)
    corners = body.folded.min(axis=0), body.unfolded.min(axis=0)
    carried, hole_notes = _holes(holes, *corners)
    torn, fault_notes = _faults(faults, body.folded, *corners)
    content = {
        "blocks": _blocks(body, shape, outer, chosen),
        "columns": columns,
        "holes": carried,
        "faults": torn,
        "horizons": horizons_data(horizons, *corners),
        "palettes": palettes(),
        "categories": list(CATEGORIES),
        "view": {"azimuth": view.azimuth, "elevation": view.elevation},
        "unit": unit,
        "start": _start(columns),
    }
    notes = (*_block_notes(body, outer, chosen), *column_notes, *hole_notes, *fault_notes)
    return Payload(content, notes)


def _blocks(body: ReportBody, shape: Shape | None, outer: Bools, chosen: Ints) -> dict[str, Any]:
    """Return the blocks drawn: positions, shapes and rows."""
    straight, bent = body.folded, body.unfolded
    if shape is None:
        straight, bent = bent, straight
    axes = np.eye(3) if shape is None else shape.axes
    turned = (
        np.broadcast_to(np.eye(3), (len(chosen), 3, 3))
        if body.neighbours is None
        else gradients(straight, bent, body.neighbours, chosen)
    )
    sizes = None if shape is None else shape.sizes
    return {
        "count": len(chosen),
        "rows": encoded(body.rows[chosen], "u4"),
        "folded": quantised_points(body.folded[chosen]),
        "unfolded": quantised_points(body.unfolded[chosen]),
        "gradients": {"step": GRADIENT_STEP, **encoded(_gradient_codes(turned @ axes.T), "i2")},
        "sides": (block_sides(body.unfolded) if shape is None else shape.sides).tolist(),
        "sizes": None if sizes is None else quantised_points(sizes[chosen]),
        "axes": axes.T.ravel().tolist(),
        "bent": "folded" if shape is None else "unfolded",
        "grow": math.sqrt(np.count_nonzero(outer) / np.count_nonzero(outer[chosen])),
        "outer": encoded(outer[chosen], "u1"),
    }


def _block_notes(body: ReportBody, outer: Bools, chosen: Ints) -> list[str]:
    """Return one sentence for each kind of block that is not drawn."""
    notes = []
    count, drawn = int(np.count_nonzero(outer)), int(np.count_nonzero(outer[chosen]))
    if len(chosen) < len(body.folded):
        larger = ", drawn larger to fill the gaps" if drawn < count else ""
        notes.append(
            f"The 3-D views hold {len(chosen):,} of {len(body.folded):,} blocks, a random choice "
            f"that is the same each time and prefers outer blocks: {drawn:,} of {count:,} outer "
            f"blocks are held{larger}. Figures and distributions cover all blocks."
        )
    without = body.total - len(body.folded)
    if without:
        notes.append(f"{without:,} blocks without an image are not drawn.")
    return notes


def _block_columns(body: ReportBody, chosen: Ints) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the columns of the blocks drawn, results first, and what was left out."""
    read, left = read_columns(body.columns, len(body.folded), _INPUT, _RESULTS)
    read.sort(key=lambda column: column.group != _RESULTS)
    packed, coarse, dropped = _packed([column.taken(chosen) for column in read], len(chosen))
    left += dropped
    notes = []
    if left:
        notes.append(
            "Columns left out, for lack of room or because they hold too many different texts: "
            f"{', '.join(left)}."
        )
    return packed, [*notes, coarse] if coarse else notes


def _gradient_codes(matrices: Floats) -> Floats:
    """Return matrices (k, 3, 3) as whole multiples of GRADIENT_STEP, row by row, (k, 9)."""
    return np.clip(np.rint(matrices.reshape(-1, 9) / GRADIENT_STEP), -32767, 32767)


def _start(packed: list[dict[str, Any]]) -> str:
    """Return the column that colours the blocks at the start."""
    names = [column["name"] for column in packed]
    kinds = {column["name"]: column.get("categories", ()) for column in packed}
    if len(kinds.get("fault_block", ())) > 1:
        return "fault_block"
    for name in ("stratigraphic", "nmd_error"):
        if name in names:
            return name
    return ""


def palettes() -> dict[str, str]:
    """Return the colour maps, 256 colours of three bytes each, as base64."""
    maps = require("matplotlib").colormaps
    at = np.linspace(0, 1, 256)
    return {
        name: encoded(_bytes(maps[known](at)[:, :3]), "u1")["data"]
        for name, known in _PALETTES.items()
    }


def _bytes(colours: Floats) -> NDArray[np.uint8]:
    """Return colours from 0 to 1 as bytes."""
    return np.rint(255 * np.asarray(colours)).astype(np.uint8)


def _packed(columns: list[Column], count: int) -> tuple[list[dict[str, Any]], str, list[str]]:
    """Return the columns that fit, a note if values are rounded, and the names that do not fit."""
    short = 4 * count * len(columns) > _ROOM
    most = _ROOM // (2 * count) if short else len(columns)
    form = ""
    if short:
        form = "There are many columns, so their values are rounded to 1/65,534 of their range."
    kept, rest = columns[:most], columns[most:]
    return [c.packed(short=short) for c in kept], form, [c.name for c in rest]


def _holes(
    holes: CarriedHoles | None, folded: Floats, unfolded: Floats
) -> tuple[dict[str, Any], list[str]]:
    """Return traces and samples relative to the body's corners, and notes on what is left out."""
    out: dict[str, Any] = {}
    notes: list[str] = []
    given = {} if holes is None else {"traces": holes.traces, "samples": holes.samples}
    for name, points in given.items():
        if points is None or not len(points.folded):
            continue
        codes, names = _hole_codes(points)
        rows = _kept_points(codes, traces=name == "traces")
        if len(rows) < len(codes):
            notes.append(f"{len(rows):,} of {len(codes):,} points of the {name} are drawn.")
        read, left = read_columns(points.columns, len(codes), "Samples", "")
        read, dropped = read[:_SAMPLE_COLUMNS], read[_SAMPLE_COLUMNS:]
        if name == "samples" and (left or dropped):
            words = ", ".join([*left, *(c.name for c in dropped)])
            notes.append(f"Columns of the samples left out: {words}.")
        out[name] = {
            "count": len(rows),
            "names": names,
            "hole": encoded(codes[rows], "u4"),
            "folded": floating_points(points.folded[rows], folded),
            "unfolded": floating_points(points.unfolded[rows], unfolded),
            "columns": [c.taken(rows).packed(short=False) for c in read],
        }
    return out, notes


def _faults(
    faults: CarriedFaults | None, points: Floats, folded: Floats, unfolded: Floats
) -> tuple[dict[str, Any], list[str]]:
    """Return fault surfaces and cut-offs relative to the body's corners, and notes."""
    if faults is None:
        return {}, []
    reach = _NEAR * float(np.linalg.norm(block_sides(points)))
    V, F = joined_surfaces(faults, points, reach)
    notes = []
    if len(F) > MOST_TRIANGLES:
        notes.append(f"The fault surfaces have {len(F):,} triangles, too many to be drawn.")
        V, F = V[:0], F[:0]
    lines = {space: cutoff_lines(faults, space) for space in ("folded", "unfolded")}
    step = -(-len(lines["folded"]) // MOST_POINTS) or 1
    return {
        "vertices": floating_points(V, folded),
        "triangles": encoded(F, "u4"),
        "folded": floating_points(lines["folded"][::step].reshape(-1, 3), folded),
        "unfolded": floating_points(lines["unfolded"][::step].reshape(-1, 3), unfolded),
    }, notes


def _hole_codes(points: CarriedPoints) -> tuple[Ints, list[str]]:
    """Return a number per hole, in order of appearance, and the holes' names."""
    if points.hole is None:
        return np.zeros(len(points.folded), dtype=np.int64), [""]
    names, first, codes = np.unique(
        np.asarray(points.hole).astype(str), return_index=True, return_inverse=True
    )
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[codes.ravel()], [str(name) for name in names[order]]


def _kept_points(codes: Ints, *, traces: bool) -> Ints:
    """Return the points drawn: of too many trace points, every k-th one and the holes' ends."""
    n = len(codes)
    if n <= MOST_POINTS:
        return np.arange(n)
    if not traces:
        return np.sort(np.random.default_rng(_SEED).permutation(n)[:MOST_POINTS])
    change = codes[1:] != codes[:-1]
    keep = np.r_[True, change] | np.r_[change, True]
    keep[:: -(-n // MOST_POINTS)] = True
    return np.flatnonzero(keep)
