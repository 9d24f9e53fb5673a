"""The page: its parts in their order, and the assets that stand in it."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.errors import InputError
from geounfold.mesh import Bools, Floats, Ints
from geounfold.plotting import ViewOptions, check_rendering
from geounfold.quality import NEIGHBOURS, neighbours, nmd
from geounfold.report.blocks import block_shape, level_sides
from geounfold.report.charts import distribution
from geounfold.report.columns import MEANINGS
from geounfold.report.exploration import exploration_html
from geounfold.report.payload import CarriedHoles, payload
from geounfold.report.pictures import pictures
from geounfold.report.private import without_folders
from geounfold.report.verdict import Verdict, verdict
from geounfold.report.words import (
    bars,
    bullets,
    copyable,
    flat,
    folded_up,
    json_for_script,
    mapping,
    number,
    pairs,
    section,
    table,
    text,
)

if TYPE_CHECKING:
    from geounfold.estimation import Exploration

_SCRIPTS = ("decode", "colour", "camera", "renderer", "view", "inspect", "controls", "main")
_PLACES = ("unfolded_x", "unfolded_y", "unfolded_z")  # told by the blocks' places themselves
_DISTRIBUTED = ("nmd_error", "volume_ratio", "shear", "stretch_max", "stretch_min")


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
        _verdict_html(verdict(summary), summary.get("warnings", [])),
        _section_of_views(viewer.notes, holes),
        folded_up("Still pictures", "\n".join(stills), "stills"),
        section("Figures", _tiles(summary)),
        section("Distributions over the blocks", "\n".join(_distributions(body.results))),
        _explored(exploration),
        section("Elements at fault", _flaws(summary)),
        section("Cross-check of meshes", _crosscheck(summary)),
        '<div class="duo">',
        section("Certificate", _certificate(summary)),
        section("How it was made", pairs(_making(summary))),
        section("Drill-holes", _drillholes(summary)),
        section("Seconds per stage", _seconds(summary)),
        "</div>",
        section("Flattened surfaces", _surfaces(summary)),
        section("Repeat this run", _repeat(summary)),
        folded_up("Everything, as JSON", _everything(summary)),
    ]
    script = _script()
    return Template(_asset("page.html")).substitute(
        title=text(title),
        digest=_digest(script),
        style=_asset("style.css"),
        about=f"{body.total:,} blocks, geounfold {text(summary.get('version', ''))}",
        body="\n".join(part for part in parts if part),
        data=json_for_script(viewer.content),
        script=script,
    )


# ------------------------------------------------------------------------------------------ inputs


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
    results = {n: _finite(n, known[n]) for n in ("stratigraphic", *_DISTRIBUTED) if n in known}
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


# ------------------------------------------------------------------------------------------ assets


@cache
def _asset(name: str) -> str:
    return files("geounfold.report").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _script() -> str:
    """Return the viewer's script: its parts in one closed function."""
    parts = "\n".join(_asset(f"{name}.js") for name in _SCRIPTS)
    return f'(function () {{\n"use strict";\n{parts}\n}})();'


def _digest(script: str) -> str:
    """Return the hash by which the page's policy knows its script, and runs no other."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")


# ----------------------------------------------------------------------------------------- sections


def _verdict_html(said: Verdict, warnings: object) -> str:
    told = bullets(warnings if isinstance(warnings, list | tuple) else [])
    parts = [
        f'<section class="verdict {said.level}" aria-label="Verdict">',
        f'<p class="headline"><strong>{text(said.headline)}</strong></p>',
        '<div class="columns">',
        f"<div><h2>What was checked</h2>{bullets(said.reasons)}</div>" if said.reasons else "",
        f"<div><h2>What to distrust</h2>{bullets(said.distrust)}</div>" if said.distrust else "",
        f"</div><h2>Warnings</h2>{told or '<p>None.</p>'}</section>",
    ]
    return "".join(parts)


def _section_of_views(notes: tuple[str, ...], holes: CarriedHoles | None) -> str:
    return Template(_asset("viewer.html")).substitute(
        notes="".join(f'<p class="soft">{text(note)}</p>' for note in notes),
        holes="" if holes is not None else "hidden",
    )


def _distributions(drawn: Mapping[str, Floats]) -> Iterator[str]:
    for name in _DISTRIBUTED:
        if name in drawn:
            label, meaning, _ = MEANINGS[name]
            charts = distribution(drawn[name], label)
            yield f'<h3>{text(name)}</h3><p class="soft">{text(meaning)}</p>{charts}'


def _explored(exploration: Exploration | None) -> str:
    if exploration is None:
        return ""
    return section(
        f"Exploratory data analysis of {exploration.grade}", exploration_html(exploration)
    )


_CERTIFIED = {
    "injective": "proved one to one",
    "tetrahedra": "tetrahedra examined",
    "boundary_faces": "faces of the border",
    "glued": "glued face to face",
    "inverted_folded": "inverted or flat, folded",
    "inverted_unfolded": "inverted or flat, unfolded",
    "crossing_folded": "crossing border faces, folded",
    "crossing_unfolded": "crossing border faces, unfolded",
    "nested_folded": "shells within shells, folded",
    "nested_unfolded": "shells within shells, unfolded",
    "faulty_elements": "elements at fault",
    "blocks_in_faulty_elements": "blocks in them",
    "theorem": "by the theorem",
}


def _certificate(summary: Mapping[str, Any]) -> str:
    known = mapping(summary.get("certificate"))
    return pairs({label: known[key] for key, label in _CERTIFIED.items() if key in known})


def _flaws(summary: Mapping[str, Any]) -> str:
    """Return one row per element that keeps the map from being proved, those with blocks first."""
    flaws = mapping(summary.get("certificate")).get("flaws") or []
    rows = [
        {
            "element": flaw["element"],
            "blocks": flaw["blocks"],
            "folded": ", ".join(number(x) for x in flaw["folded"]),
            "unfolded": ", ".join(number(x) for x in flaw["unfolded"]),
        }
        for flaw in flaws
    ]
    return table(rows) if rows else ""


def _crosscheck(summary: Mapping[str, Any]) -> str:
    """Return other meshes of the control mesh's border, and where they place the blocks."""
    found = mapping(summary.get("crosscheck"))
    meshes, places = (
        [_told(row, left_out) for row in found.get(key) or []]
        for key, left_out in (("meshes", ("boundary_volume",)), ("places", ("worst", "seconds")))
    )
    tables = table(meshes) + table(places)
    words = (
        "The control mesh of prisms against other meshes of its border; lengths in blocks. Where "
        "the border alone follows the map and the inside is harmonic or as rigid as possible, "
        "blocks lie rms, p95 and max from where the map places them, and rms_same_interior from "
        "where the control mesh with such an inside does."
    )
    return f'<p class="soft">{words}</p>\n{tables}' if tables else ""


def _told(row: Mapping[str, Any], left_out: tuple[str, ...]) -> dict[str, Any]:
    """Return a row without columns that say nothing."""
    return {k: v for k, v in row.items() if k not in left_out and v is not None and v != ""}


def _drillholes(summary: Mapping[str, Any]) -> str:
    """Return what was read of drill-holes, and what was found in their tables."""
    holes = mapping(summary.get("drillholes"))
    plain = {k.replace("_", " "): v for k, v in holes.items() if not isinstance(v, list | Mapping)}
    for name in ("samples", "traces"):
        counts = {f"{name}, {k}": v for k, v in mapping(holes.get(name)).items()}
        plain |= counts
    plain.pop("findings total", None)
    findings = [dict(found) for found in holes.get("findings") or [] if isinstance(found, Mapping)]
    return pairs(plain) + (f"<h3>Found in the tables</h3>{table(findings)}" if findings else "")


_MADE = {
    "lattice.steps": "sides of the blocks",
    "lattice.spacing": "working unit",
    "bodies": "bodies",
    "hull.method": "hull",
    "hull.reason": "why this hull",
    "hull.volume": "volume of the hull",
    "hull.blocks_volume": "volume of the blocks",
    "control_mesh.vertices": "vertices of the control mesh",
    "control_mesh.tetrahedra": "tetrahedra of the control mesh",
    "control_mesh.volume_folded": "its volume, folded",
    "control_mesh.volume_unfolded": "its volume, unfolded",
    "outside.reach": "reach around the control mesh",
}


def _making(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is known of the stages, by plain names; lengths in the input's unit."""
    known = flat(summary)
    out = {label: known[key] for key, label in _MADE.items() if known.get(key) is not None}
    method = {k.replace("_", " "): v for k, v in mapping(summary.get("method")).items()}
    rungs = method.pop("rungs", None)
    if isinstance(rungs, list | tuple):
        method["rungs tried"] = ", ".join(str(mapping(rung).get("name", rung)) for rung in rungs)
    return out | {k: v for k, v in method.items() if v not in ("", None)}


def _surfaces(summary: Mapping[str, Any]) -> str:
    """Return one row per flattened surface: its size, and how its flattening went."""
    rows = []
    for name, how in mapping(summary.get("flattening")).items():
        size = mapping(summary.get(name))
        rows.append({"surface": name, **size, **{k: v for k, v in mapping(how).items() if v}})
        rows[-1].update({k: mapping(how).get(k) for k in ("flips", "overlaps")})
    return table(rows)


def _seconds(summary: Mapping[str, Any]) -> str:
    times = flat(summary.get("seconds", {}))
    return bars({k: float(v) for k, v in times.items() if isinstance(v, int | float)}, "seconds")


def _repeat(summary: Mapping[str, Any]) -> str:
    """Return the command and the options that repeat a run; else the options alone."""
    command, config = summary.get("command"), summary.get("config")
    parts = [
        copyable("command", "Command line (files without their folders)", str(command or "")),
        copyable("config", "All options, for --config", str(config or "")),
    ]
    options = flat(mapping(summary.get("options")))
    parts.append(folded_up("Options as a table", pairs(options)))
    return "".join(parts)


def _everything(summary: Mapping[str, Any]) -> str:
    """Return the summary as JSON; nothing that a report holds is kept from being read."""
    shown = json.dumps(summary, indent=1, default=str)
    return f'<pre tabindex="0">{text(shown)}</pre>'


_TILES: tuple[tuple[str, str, Callable[[Any], str]], ...] = (
    ("inverted_folded", "inverted, folded", number),
    ("inverted_unfolded", "inverted, unfolded", number),
    ("injective", "proved one to one", number),
    ("outside_share", "blocks outside", lambda v: f"{v:.3%}"),
    ("round_trip_max", "round trip, largest", number),
    ("nmd.mean", "epsilon(X, Y), mean", number),
    ("nmd.p95", "epsilon(X, Y), 95\u00a0%", number),
    ("volume_change.mean", "volume change, mean", number),
    ("edge_change.mean", "edge change, mean", number),
    ("shear.max", "shear, largest", number),
    ("peak_memory_mb", "peak memory, MiB", lambda v: f"{v:,.0f}"),
)


def _tiles(summary: Mapping[str, Any]) -> str:
    values = flat(summary)
    tiles = [
        f'<div class="tile"><b>{text(write(values[key]))}</b>{text(label)}</div>'
        for key, label, write in _TILES
        if values.get(key) is not None
    ]
    seconds = [v for v in flat(summary.get("seconds", {})).values() if isinstance(v, int | float)]
    if seconds:
        tiles.append(f'<div class="tile"><b>{sum(seconds):.2f}</b>seconds, all stages</div>')
    return f'<div class="tiles">{"".join(tiles)}</div>' if tiles else ""
