"""The sections of the report's page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

from geounfold.geometry.mesh import Floats
from geounfold.report.charts import distribution
from geounfold.report.columns import MEANINGS
from geounfold.report.exploration import exploration_html
from geounfold.report.html_text import (
    bars,
    bullets,
    copyable,
    flat,
    folded_up,
    mapping,
    number,
    pairs,
    section,
    table,
    text,
)
from geounfold.report.payload import CarriedHoles
from geounfold.report.verdict import Verdict

if TYPE_CHECKING:
    from geounfold.estimation import Exploration


DISTRIBUTED = ("nmd_error", "volume_ratio", "shear", "stretch_max", "stretch_min")


@cache
def asset(name: str) -> str:
    """Return the text of a file in the folder ``assets``."""
    return files("geounfold.report").joinpath("assets", name).read_text(encoding="utf-8")


def verdict_section(said: Verdict, warnings: object) -> str:
    """Return the verdict and the warnings as HTML."""
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


def views_section(notes: tuple[str, ...], holes: CarriedHoles | None) -> str:
    """Return the section that holds the 3-D views."""
    return Template(asset("viewer.html")).substitute(
        notes="".join(f'<p class="soft">{text(note)}</p>' for note in notes),
        holes="" if holes is not None else "hidden",
    )


def distributions_section(drawn: Mapping[str, Floats]) -> Iterator[str]:
    """Yield the sections that show how the distortion figures are distributed."""
    for name in DISTRIBUTED:
        if name in drawn:
            label, meaning, _ = MEANINGS[name]
            charts = distribution(drawn[name], label)
            yield f'<h3>{text(name)}</h3><p class="soft">{text(meaning)}</p>{charts}'


def explored_section(exploration: Exploration | None) -> str:
    """Return the section about the samples' grades; empty if there are none."""
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


def certificate_section(summary: Mapping[str, Any]) -> str:
    """Return what the certificate proves, as HTML."""
    known = mapping(summary.get("certificate"))
    return pairs({label: known[key] for key, label in _CERTIFIED.items() if key in known})


def flaws_section(summary: Mapping[str, Any]) -> str:
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


def crosscheck_section(summary: Mapping[str, Any]) -> str:
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


def drillholes_section(summary: Mapping[str, Any]) -> str:
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


def making_section(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is known of the stages, by plain names; lengths in the input's unit."""
    known = flat(summary)
    out = {label: known[key] for key, label in _MADE.items() if known.get(key) is not None}
    method = {k.replace("_", " "): v for k, v in mapping(summary.get("method")).items()}
    rungs = method.pop("rungs", None)
    if isinstance(rungs, list | tuple):
        method["rungs tried"] = ", ".join(str(mapping(rung).get("name", rung)) for rung in rungs)
    return out | {k: v for k, v in method.items() if v not in ("", None)}


def surfaces_section(summary: Mapping[str, Any]) -> str:
    """Return one row per flattened surface: its size, and how its flattening went."""
    rows = []
    for name, how in mapping(summary.get("flattening")).items():
        size = mapping(summary.get(name))
        rows.append({"surface": name, **size, **{k: v for k, v in mapping(how).items() if v}})
        rows[-1].update({k: mapping(how).get(k) for k in ("flips", "overlaps")})
    return table(rows)


def seconds_section(summary: Mapping[str, Any]) -> str:
    """Return the seconds per stage as a table."""
    times = flat(summary.get("seconds", {}))
    return bars({k: float(v) for k, v in times.items() if isinstance(v, int | float)}, "seconds")


def repeat_section(summary: Mapping[str, Any]) -> str:
    """Return the command and the options that repeat a run; else the options alone."""
    command, config = summary.get("command"), summary.get("config")
    parts = [
        copyable("command", "Command line (files without their folders)", str(command or "")),
        copyable("config", "All options, for --config", str(config or "")),
    ]
    options = flat(mapping(summary.get("options")))
    parts.append(folded_up("Options as a table", pairs(options)))
    return "".join(parts)


def everything_section(summary: Mapping[str, Any]) -> str:
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


def tiles_section(summary: Mapping[str, Any]) -> str:
    """Return the row of headline figures."""
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
