"""The page: its parts in their order, and the assets that stand in it."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.quality.neighbour_distances import NEIGHBOURS, neighbours, nmd
from geounfold.report.blocks import block_shape, level_sides
from geounfold.report.html_text import folded_up, json_for_script, mapping, pairs, section, text
from geounfold.report.payload import CarriedHoles, payload
from geounfold.report.pictures import pictures
from geounfold.report.plots.rendering import check_rendering
from geounfold.report.plots.style import ViewOptions
from geounfold.report.sections import (
    DISTRIBUTED,
    asset,
    certificate_section,
    crosscheck_section,
    distributions_section,
    drillholes_section,
    everything_section,
    explored_section,
    flaws_section,
    making_section,
    repeat_section,
    seconds_section,
    surfaces_section,
    tiles_section,
    verdict_section,
    views_section,
)
from geounfold.report.verdict import verdict
from geounfold.report.without_folders import without_folders

if TYPE_CHECKING:
    from geounfold.estimation import Exploration


_SCRIPTS = ("decode", "colour", "camera", "renderer", "view", "inspect", "controls", "main")


_PLACES = ("unfolded_x", "unfolded_y", "unfolded_z")  # told by the blocks' places themselves


def write_report(
    path: str | Path,
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    holes: CarriedHoles | None = None,
    exploration: Exploration | None = None,
    view: ViewOptions | None = None,
) -> None:
    """Write the report of an unfolding; see `report_html` for parameters and errors.

    Parameters
    ----------
    path : path
        Where to write; an existing file is replaced.
    """
    page = report_html(
        summary, folded, unfolded, columns, holes=holes, exploration=exploration, view=view
    )
    Path(path).write_text(page, encoding="utf-8")


def report_html(
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    holes: CarriedHoles | None = None,
    exploration: Exploration | None = None,
    view: ViewOptions | None = None,
) -> str:
    """Return the report of an unfolding as one HTML page without outer references.

    The same arguments give the same page, byte for byte.

    Parameters
    ----------
    summary : mapping
        What ran and how good it is: the summary's keys.  What is absent is left out.
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit.  Blocks without an image, NaN in the unfolded
        space, are counted and not drawn.
    columns : mapping of str to (n,)
        What is known of the blocks, numbers or texts: the input's columns and the result's.
        Those of the result must be finite wherever there is an image.
    holes : CarriedHoles, optional
        Drill-holes carried with the body.
    exploration : Exploration, optional
        What a grade of the samples carried with the body tells in both spaces.
    view : ViewOptions, optional
        Where bodies are looked at from.

    Raises
    ------
    InputError
        Arrays that do not agree, or values that are not finite.
    MissingDependencyError
        Nothing can be drawn here; the message says what to install.
    """
    body = _body(folded, unfolded, columns)
    check_rendering()
    summary = without_folders(summary)
    viewer = payload(
        body.folded,
        body.unfolded,
        body.columns,
        rows=body.rows,
        neighbours=body.neighbours,
        holes=holes,
        view=view,
        unit=str(mapping(summary.get("input")).get("unit", "")),
        total=body.total,
    )
    spaces = body.folded, body.unfolded
    sides = level_sides(block_shape(body.folded, body.columns))
    stills = pictures(*spaces, body.results, body.distances, sides, view)
    title = _title(summary, body.total)
    parts = [
        verdict_section(verdict(summary), summary.get("warnings", [])),
        views_section(viewer.notes, holes),
        folded_up("Still pictures", "\n".join(stills), "stills"),
        section("Figures", tiles_section(summary)),
        section("Distributions over the blocks", "\n".join(distributions_section(body.results))),
        explored_section(exploration),
        section("Elements at fault", flaws_section(summary)),
        section("Cross-check of meshes", crosscheck_section(summary)),
        '<div class="duo">',
        section("Certificate", certificate_section(summary)),
        section("How it was made", pairs(making_section(summary))),
        section("Drill-holes", drillholes_section(summary)),
        section("Seconds per stage", seconds_section(summary)),
        "</div>",
        section("Flattened surfaces", surfaces_section(summary)),
        section("Repeat this run", repeat_section(summary)),
        folded_up("Everything, as JSON", everything_section(summary)),
    ]
    script = _script()
    return Template(asset("page.html")).substitute(
        title=text(title),
        digest=_digest(script),
        style=asset("style.css"),
        about=f"{body.total:,} blocks, geounfold {text(summary.get('version', ''))}",
        body="\n".join(part for part in parts if part),
        data=json_for_script(viewer.content),
        script=script,
    )


@dataclass(frozen=True, eq=False)
class _Body:
    """The blocks that have an image, with what is known of them.

    Attributes
    ----------
    folded, unfolded : (n, 3) float
        Places.
    rows : (n,) int
        Data rows, from 1.
    total : int
        Blocks, those without an image included.
    columns : dict of (n,)
        Everything that is known.
    results : dict of (n,) float
        The result's columns that still pictures and distributions show.
    neighbours : (n, k) int or None
        Of the folded blocks; None where there are too few.
    distances : two of (n,) float, or None
        Neighbour mean distances in both spaces.
    """

    folded: Floats
    unfolded: Floats
    rows: Ints
    total: int
    columns: dict[str, ArrayLike]
    results: dict[str, Floats]
    neighbours: Ints | None
    distances: tuple[Floats, Floats] | None


def _body(folded: Floats, unfolded: Floats, columns: Mapping[str, ArrayLike]) -> _Body:
    """Return what is drawn, once it is known to agree; or raise InputError."""
    X, Y = np.asarray(folded, dtype=np.float64), np.asarray(unfolded, dtype=np.float64)
    if X.shape != Y.shape or X.ndim != 2 or X.shape[1] != 3:
        raise InputError(f"folded {X.shape} and unfolded {Y.shape} must both be (n, 3)")
    if not np.isfinite(X).all():
        raise InputError(f"{np.count_nonzero(~np.isfinite(X))} folded coordinates are not finite")
    placed: Bools = np.asarray(np.isfinite(Y).all(axis=1))
    if not placed.any():
        raise InputError("no block has a finite unfolded place: there is nothing to draw")
    known = {n: _placed(n, values, placed) for n, values in columns.items() if n not in _PLACES}
    results = {n: _finite(n, known[n]) for n in ("stratigraphic", *DISTRIBUTED) if n in known}
    X, Y = X[placed], Y[placed]
    ids = neighbours(X) if len(X) > NEIGHBOURS else None
    distances = None if ids is None else (nmd(X, ids), nmd(Y, ids))
    if distances is not None:
        results.setdefault("nmd_error", np.abs(distances[0] - distances[1]) / distances[0])
        known |= {"nmd_error": results["nmd_error"]}
        known |= dict(zip(("nmd_folded", "nmd_unfolded"), distances, strict=True))
    rows = np.flatnonzero(placed) + 1
    return _Body(X, Y, rows, len(placed), known, results, ids, distances)


def _placed(name: str, values: ArrayLike, placed: Bools) -> ArrayLike:
    """Return a column's values of the blocks that have an image."""
    plain = np.asarray(values)
    if plain.shape != placed.shape:
        raise InputError(f"column {name} has shape {plain.shape}, but there are {len(placed)} rows")
    kept: ArrayLike = plain[placed]
    return kept


def _finite(name: str, values: ArrayLike) -> Floats:
    """Return a column of the result as floats."""
    v = np.asarray(values, dtype=np.float64)
    if not np.isfinite(v).all():
        raise InputError(f"column {name} has {(~np.isfinite(v)).sum()} values not finite")
    return v


def _title(summary: Mapping[str, Any], count: int) -> str:
    return f"Unfolding of {mapping(summary.get('input')).get('file') or f'{count:,} blocks'}"


@cache
def _script() -> str:
    """Return the viewer's script: its parts in one closed function."""
    parts = "\n".join(asset(f"{name}.js") for name in _SCRIPTS)
    return f'(function () {{\n"use strict";\n{parts}\n}})();'


def _digest(script: str) -> str:
    """Return the hash by which the page's policy knows its script, and runs no other."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
