"""What the viewer draws, as one JSON object of quantised arrays.

Form: ``blocks`` holds the places in both spaces (16 bits per coordinate), the sides of a block (of
every one, ``sizes``, where they differ) and the axes along which they lie (as columns) in the space
where it is drawn as a box (the folded one on lattices, else the unfolded one), the gradients times
these axes for the other, ``bent`` one (16 bits per entry, GRADIENT_STEP each), which blocks lie
outside, and the rows they come from; ``columns`` their values; ``holes`` traces and samples in
float32; ``palettes`` the colour maps, 256 colours of three bytes each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Floats, Ints
from geounfold.report.arrays import encoded, floating_points, quantised_points
from geounfold.report.blocks import block_shape, chosen_blocks, gradients, outer_blocks
from geounfold.report.columns import Column, read_columns
from geounfold.report.plots.rendering import block_sides
from geounfold.report.plots.style import ViewOptions, require

if TYPE_CHECKING:
    from numpy.typing import NDArray

GRADIENT_STEP = 1 / 4096
"""What one unit of a gradient's code stands for."""

MOST_POINTS = 20_000
"""Points of traces, and of samples, that a report holds at most."""

_ROOM = 3_600_000  # bytes for the values of columns, before base64
_SAMPLE_COLUMNS = 12
_SEED = 20_261_125
_RESULTS = "Results"
_INPUT = "Input"
_PALETTES = {"viridis": "viridis", "cividis": "cividis", "diverging": "RdYlBu_r"}

# Okabe and Ito's colours, which stay apart for colour-blind readers; black is the outlines'.
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
        Which hole each belongs to; points of one hole follow each other.  None of loose samples.
    folded, unfolded : (m, 3) float
        NaN in the unfolded space where the map does not reach.
    columns : mapping of str to (m,)
        What is known of them.
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
    traces, samples : CarriedPoints or None
        Points along the holes that are joined by lines; samples or composites.
    """

    traces: CarriedPoints | None = None
    samples: CarriedPoints | None = None


@dataclass(frozen=True, eq=False)
class Payload:
    """What a page's viewer needs.

    Attributes
    ----------
    content : dict
        For JSON.
    notes : tuple of str
        What was left out, in sentences.
    """

    content: dict[str, Any]
    notes: tuple[str, ...]


def payload(
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    rows: Ints,
    neighbours: Ints | None,
    holes: CarriedHoles | None = None,
    view: ViewOptions | None = None,
    unit: str = "",
    total: int | None = None,
) -> Payload:
    """Return what the viewer draws.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The blocks in both spaces; finite.
    columns : mapping of str to (n,)
        Everything that is known of them.
    rows : (n,) int
        Their data rows in the input, from 1.
    neighbours : (n, m) int, optional
        Rows of each block's neighbours, which shape the unfolded blocks.
    holes : CarriedHoles, optional
        Drill-holes carried with the body.
    view : ViewOptions, optional
        Where the body is looked at from at first.
    unit : str, optional
        The coordinates' unit.
    total : int, optional
        Blocks of the body, those without an image included.
    """
    view = view or ViewOptions()
    form = block_shape(folded, columns)
    outer = outer_blocks(folded, form)
    chosen = chosen_blocks(outer)
    notes = []
    shown, drawn = int(np.count_nonzero(outer)), int(np.count_nonzero(outer[chosen]))
    if len(chosen) < len(folded):
        notes.append(
            f"{len(chosen):,} of {len(folded):,} blocks are held for the turning views, chosen at "
            "random (the same ones each time), outer ones before inner ones: "
            f"{drawn:,} of {shown:,} outer blocks"
            f"{', drawn larger as others are missing' if drawn < shown else ''}. "
            "Figures and distributions are of all."
        )
    total = len(folded) if total is None else total
    if total > len(folded):
        notes.append(f"{total - len(folded):,} blocks without an image are not drawn.")
    read, left = read_columns(columns, len(folded), _INPUT, _RESULTS)
    read.sort(key=lambda column: column.group != _RESULTS)
    packed, coarse, dropped = _packed([column.taken(chosen) for column in read], len(chosen))
    left += dropped
    if left:
        notes.append(
            f"Columns left out, for want of room or as texts of too many kinds: {', '.join(left)}."
        )
    if coarse:
        notes.append(coarse)
    carried, told = _holes(holes, folded.min(axis=0), unfolded.min(axis=0))
    straight, bent = (unfolded, folded) if form is None else (folded, unfolded)
    axes = np.eye(3) if form is None else form.axes
    turned = (
        np.broadcast_to(np.eye(3), (len(chosen), 3, 3))
        if neighbours is None
        else gradients(straight, bent, neighbours, chosen)
    )
    content = {
        "blocks": {
            "count": len(chosen),
            "rows": encoded(rows[chosen], "u4"),
            "folded": quantised_points(folded[chosen]),
            "unfolded": quantised_points(unfolded[chosen]),
            "gradients": {
                "step": GRADIENT_STEP,
                **encoded(_gradient_codes(turned @ axes.T), "i2"),
            },
            "sides": (block_sides(unfolded) if form is None else form.sides).tolist(),
            "sizes": None
            if form is None or form.sizes is None
            else quantised_points(form.sizes[chosen]),
            "axes": axes.T.ravel().tolist(),
            "bent": "folded" if form is None else "unfolded",
            "grow": math.sqrt(shown / drawn),
            "outer": encoded(outer[chosen], "u1"),
        },
        "columns": packed,
        "holes": carried,
        "palettes": palettes(),
        "categories": list(CATEGORIES),
        "view": {"azimuth": view.azimuth, "elevation": view.elevation},
        "unit": unit,
        "start": _start(packed),
    }
    return Payload(content, (*notes, *told))


def _gradient_codes(matrices: Floats) -> Floats:
    """Return matrices (k, 3, 3) as whole multiples of GRADIENT_STEP, row by row, (k, 9)."""
    return np.clip(np.rint(matrices.reshape(-1, 9) / GRADIENT_STEP), -32767, 32767)


def _start(packed: list[dict[str, Any]]) -> str:
    """Return the column to colour by at first."""
    names = [column["name"] for column in packed]
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
    return np.rint(255 * np.asarray(colours)).astype(np.uint8)


def _packed(columns: list[Column], count: int) -> tuple[list[dict[str, Any]], str, list[str]]:
    """Return columns that fit into the room, a sentence where they are coarse, what did not fit."""
    short = 4 * count * len(columns) > _ROOM
    most = _ROOM // (2 * count) if short else len(columns)
    form = ""
    if short:
        form = "Values of columns are kept to 1/65,534 of their range, as there are many columns."
    kept, rest = columns[:most], columns[most:]
    return [c.packed(short=short) for c in kept], form, [c.name for c in rest]


def _holes(
    holes: CarriedHoles | None, folded: Floats, unfolded: Floats
) -> tuple[dict[str, Any], list[str]]:
    """Return traces and samples relative to the bodies' corners, and what was left out."""
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
    """Return which points are drawn: of too many traces every second, third ... and the ends."""
    n = len(codes)
    if n <= MOST_POINTS:
        return np.arange(n)
    if not traces:
        return np.sort(np.random.default_rng(_SEED).permutation(n)[:MOST_POINTS])
    change = codes[1:] != codes[:-1]
    keep = np.r_[True, change] | np.r_[change, True]
    keep[:: -(-n // MOST_POINTS)] = True
    return np.flatnonzero(keep)
