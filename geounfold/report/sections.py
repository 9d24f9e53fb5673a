"""The sections of the report, in the order of the page.

Each ``*_section`` function returns one section as HTML, or an empty text if it has no content.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

from geounfold.geometry.mesh import Floats
from geounfold.report.charts import distribution
from geounfold.report.columns import DISTRIBUTED, MEANINGS
from geounfold.report.estimation import estimation_html
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
from geounfold.report.verdict import Verdict

if TYPE_CHECKING:
    from geounfold.estimation import Exploration
    from geounfold.estimation.checks import EstimationChecks


@cache
def asset(name: str) -> str:
    """Return the text of a file in the folder ``assets``."""
    return files("geounfold.report").joinpath("assets", name).read_text(encoding="utf-8")


def verdict_section(verdict: Verdict, warnings: object) -> str:
    """Return the verdict, its reasons and the warnings."""
    listed = bullets(warnings if isinstance(warnings, list | tuple) else [])
    checked, doubtful = bullets(verdict.reasons), bullets(verdict.distrust)
    parts = [
        f'<section class="verdict {verdict.level}" aria-label="Verdict">',
        f'<p class="headline"><strong>{text(verdict.headline)}</strong></p>',
        '<div class="columns">',
        f"<div><h2>What was checked</h2>{checked}</div>" if checked else "",
        f"<div><h2>What to check yourself</h2>{doubtful}</div>" if doubtful else "",
        f"</div><h2>Warnings</h2>{listed or '<p>None.</p>'}</section>",
    ]
    return "".join(parts)


def warnings_section(summary: Mapping[str, Any]) -> str:
    """Return the warnings of a page without a verdict."""
    warnings = summary.get("warnings", [])
    return section("Warnings", bullets(warnings if isinstance(warnings, list | tuple) else []))


def views_section(notes: tuple[str, ...], *, with_holes: bool, with_faults: bool) -> str:
    """Return the 3-D views, with notes on what they leave out."""
    return Template(asset("viewer.html")).substitute(
        notes="".join(f'<p class="soft">{text(note)}</p>' for note in notes),
        holes="" if with_holes else "hidden",
        faults="" if with_faults else "hidden",
    )


def stills_section(pictures: Iterable[str]) -> str:
    """Return the still pictures, folded up."""
    return folded_up("Still pictures", "\n".join(pictures), "stills")


def _percent(share: float) -> str:
    """Return a share in percent with four significant digits, so that a small one is not 0."""
    return f"{100 * share:.4g}%"


_FIGURES: tuple[tuple[str, str, Callable[[Any], str]], ...] = (
    ("inverted_folded", "cells of the map inside out, folded", number),
    ("inverted_unfolded", "cells of the map inside out, unfolded", number),
    ("injective", "proved one-to-one", number),
    ("outside_share", "blocks outside the map's cells", lambda v: f"{v:.3%}"),
    ("round_trip_max", "largest miss, unfolded and folded again", number),
    ("nmd.mean", "change of neighbour distances, mean", _percent),
    ("nmd.p95", "change of neighbour distances, 95th percentile", _percent),
    ("volume_change.mean", "change of volume, mean", _percent),
    ("edge_change.mean", "change of lengths in the map, mean", _percent),
    ("shear.max", "shear, largest", number),
    ("peak_memory_mb", "peak memory, MiB", lambda v: f"{v:,.0f}"),
)


def figures_section(summary: Mapping[str, Any]) -> str:
    """Return the main figures as a row of tiles."""
    values = flat(summary)
    tiles = [
        f'<div class="tile"><b>{text(write(values[key]))}</b>{text(label)}</div>'
        for key, label, write in _FIGURES
        if values.get(key) is not None
    ]
    seconds = [v for v in flat(summary.get("seconds", {})).values() if isinstance(v, int | float)]
    if seconds:
        tiles.append(f'<div class="tile"><b>{sum(seconds):.2f}</b>seconds, all stages</div>')
    return section("Figures", f'<div class="tiles">{"".join(tiles)}</div>' if tiles else "")


def distributions_section(results: Mapping[str, Floats]) -> str:
    """Return the distribution of each distortion over the blocks."""
    parts = []
    for name in DISTRIBUTED:
        if name in results:
            label, meaning, _ = MEANINGS[name]
            charts = distribution(results[name], label)
            parts.append(f'<h3>{text(name)}</h3><p class="soft">{text(meaning)}</p>{charts}')
    return section("Distributions over the blocks", "\n".join(parts))


def estimation_section(checks: EstimationChecks | None) -> str:
    """Return the checks of an estimation: settings, variograms, swaths, grade and tonnage."""
    if checks is None:
        return ""
    return section(f"Estimation of {checks.grade}", estimation_html(checks))


def exploration_section(exploration: Exploration | None) -> str:
    """Return the exploratory data analysis of the samples' grade."""
    if exploration is None:
        return ""
    title = f"Exploratory data analysis of {exploration.grade}"
    return section(title, exploration_html(exploration))


def flaws_section(summary: Mapping[str, Any]) -> str:
    """Return one row per tetrahedron that keeps the map from being proved."""
    rows = [
        {
            "tetrahedron": flaw["element"],
            "blocks": flaw["blocks"],
            "folded": ", ".join(number(x) for x in flaw["folded"]),
            "unfolded": ", ".join(number(x) for x in flaw["unfolded"]),
        }
        for flaw in mapping(summary.get("certificate")).get("flaws") or []
    ]
    return section("Tetrahedra at fault", table(rows))


_CROSSCHECK = (
    "The control mesh of prisms beside other meshes of its border; lengths in blocks. Each mesh is "
    "unfolded by its border alone: the border follows the map, and the inside is harmonic or as "
    "rigid as possible. The columns rms, p95 and max give the distance of the blocks from where "
    "the map puts them; rms_same_interior gives their distance from where the control mesh, "
    "unfolded by the same rule, puts them."
)


def crosscheck_section(summary: Mapping[str, Any]) -> str:
    """Return figures of other meshes of the control mesh's border."""
    found = mapping(summary.get("crosscheck"))
    meshes = [_without(row, ("boundary_volume",)) for row in found.get("meshes") or []]
    places = [_without(row, ("worst", "seconds")) for row in found.get("places") or []]
    tables = table(meshes) + table(places)
    words = f'<p class="soft">{_CROSSCHECK}</p>\n{tables}' if tables else ""
    return section("Cross-check of meshes", words)


def _without(row: Mapping[str, Any], left_out: tuple[str, ...]) -> dict[str, Any]:
    """Return a row without some columns and without missing values."""
    return {k: v for k, v in row.items() if k not in left_out and v is not None and v != ""}


_CERTIFICATE = {
    "injective": "proved one-to-one",
    "tetrahedra": "cells of the map checked",
    "boundary_faces": "border faces checked",
    "glued": "cells joined face to face",
    "inverted_folded": "cells inside out or flat, folded",
    "inverted_unfolded": "cells inside out or flat, unfolded",
    "crossing_folded": "pairs of border faces that cross, folded",
    "crossing_unfolded": "pairs of border faces that cross, unfolded",
    "nested_folded": "parts of the border inside out, folded",
    "nested_unfolded": "parts of the border inside out, unfolded",
    "faulty_elements": "cells at fault",
    "blocks_in_faulty_elements": "blocks in cells at fault",
    "theorem": "theorem",
}


def certificate_section(summary: Mapping[str, Any]) -> str:
    """Return what was checked to prove the map one-to-one."""
    known = mapping(summary.get("certificate"))
    rows = {label: known[key] for key, label in _CERTIFICATE.items() if key in known}
    return section("Certificate", pairs(rows))


_MADE = {
    "lattice.steps": "sides of the blocks",
    "lattice.spacing": "working unit",
    "bodies": "bodies",
    "hull.method": "hull",
    "hull.reason": "why this hull",
    "body_volume.folded": "volume of the blocks",
    "body_volume.unfolded": "volume of the blocks, unfolded",
    "hull.volume": "volume of the hull of the largest body",
    "hull.blocks_volume": "volume of that body's blocks",
    "control_mesh.vertices": "corners of the map's cells",
    "control_mesh.tetrahedra": "cells of the map",
    "control_mesh.volume_folded": "volume of the map's cells, which reach past the blocks",
    "control_mesh.volume_unfolded": "the same, unfolded",
    "outside.reach": "extrapolation reaches from the map's cells",
}
_METHOD = {
    "merged": "blocks merged along each axis",
    "rung": "repair of the map used",
    "rungs": "repairs of the map tried",
    "roughness": "roughness of the mid surface",
    "smoothing": "smoothing of the mid surface",
    "accepted_samples": "share of samples that the mid surface fits",
    "sharpened": "top and bottom sharpened by",
    "layers_follow": "layers parallel to",
}


def making_section(summary: Mapping[str, Any]) -> str:
    """Return the figures of the stages; lengths in the input's unit."""
    known = flat(summary)
    out = {label: known[key] for key, label in _MADE.items() if known.get(key) is not None}
    for key, value in mapping(summary.get("method")).items():
        if isinstance(value, list | tuple):
            value = ", ".join(str(mapping(one).get("name", one)) for one in value)
        if value not in ("", None):
            out[_METHOD.get(key, key.replace("_", " "))] = value
    return section("How it was made", pairs(out))


def drillholes_section(summary: Mapping[str, Any]) -> str:
    """Return the counts of drill-holes and the findings in their tables."""
    holes = mapping(summary.get("drillholes"))
    counts = {k.replace("_", " "): v for k, v in holes.items() if not isinstance(v, list | Mapping)}
    for name in ("samples", "traces"):
        counts |= {f"{name}, {k}": v for k, v in mapping(holes.get(name)).items()}
    counts.pop("findings total", None)
    findings = [dict(found) for found in holes.get("findings") or [] if isinstance(found, Mapping)]
    listed = f"<h3>Findings in the tables</h3>{table(findings)}" if findings else ""
    return section("Drill-holes", pairs(counts) + listed)


def seconds_section(summary: Mapping[str, Any]) -> str:
    """Return the seconds of each stage."""
    times = flat(summary.get("seconds", {}))
    known = {k: float(v) for k, v in times.items() if isinstance(v, int | float)}
    return section("Seconds per stage", bars(known, "seconds"))


def surfaces_section(summary: Mapping[str, Any]) -> str:
    """Return one row per flattened surface: its size and its flattening."""
    rows = []
    for name, how in mapping(summary.get("flattening")).items():
        size = mapping(summary.get(name))
        rows.append({"surface": name, **size, **{k: v for k, v in mapping(how).items() if v}})
        rows[-1].update({k: mapping(how).get(k) for k in ("flips", "overlaps")})
    return section("Flattened surfaces", table(rows))


def repeat_section(summary: Mapping[str, Any]) -> str:
    """Return the command line and the options that repeat the run."""
    command, config = summary.get("command"), summary.get("config")
    parts = [
        copyable("command", "Command line (files without their folders)", str(command or "")),
        copyable("config", "All options, as a file for --config", str(config or "")),
        folded_up("Options as a table", pairs(flat(mapping(summary.get("options"))))),
    ]
    return section("Repeat this run", "".join(parts))


def everything_section(summary: Mapping[str, Any]) -> str:
    """Return the whole summary as JSON, folded up."""
    shown = json.dumps(summary, indent=1, default=str)
    return folded_up("The whole summary, as JSON", f'<pre tabindex="0">{text(shown)}</pre>')
