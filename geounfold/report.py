"""One self-contained HTML page about an unfolding: verdict, figures, pictures, options.

Takes plain arrays and the dict of the summary, so that it can be written again from files.  The
page loads nothing from elsewhere and follows the reader's light or dark setting.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.errors import InputError
from geounfold.mesh import Floats
from geounfold.plotting import (
    ViewOptions,
    check_rendering,
    draw_bodies,
    draw_distribution,
    png,
    ratio_limits,
)
from geounfold.quality import NEIGHBOURS, epsilon, neighbours, nmd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CARE = 0.001  # share of blocks outside the control mesh from which the verdict asks for care

# Column: what its axis is called, and what it means.
_DISTORTIONS = {
    "nmd_error": (
        "epsilon(X, Y)",
        "relative change of the neighbour mean distance, folded X to unfolded Y",
    ),
    "volume_ratio": ("volume ratio", "volume of the control tetrahedron, unfolded over folded"),
    "shear": ("shear", "layer-parallel shear, the slip of layers over one another"),
    "stretch_max": ("largest stretch", "largest principal stretch"),
    "stretch_min": ("smallest stretch", "smallest principal stretch"),
}
_PICTURED = ("nmd_error", "volume_ratio", "shear")

_STYLE = """
:root { color-scheme: light dark; --page: #ffffff; --ink: #1b1f24; --soft: #5a6470;
  --line: #d5dae0; --card: #f5f7f9; --good: #0b6e4f; --care: #8a5a00; --bad: #a3261b; }
@media (prefers-color-scheme: dark) { :root { --page: #14171b; --ink: #e8eaed; --soft: #a6b0bb;
  --line: #343b44; --card: #1e2329; --good: #5fd0a5; --care: #f0b64a; --bad: #ff8c7f; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 78rem; padding: 1.5rem; background: var(--page);
  color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
h1 { margin: 0 0 .2rem; font-size: 1.6rem; }
h2 { margin: 2.2rem 0 .6rem; font-size: 1.2rem; }
summary { margin: 1.4rem 0 .6rem; font-size: 1.2rem; font-weight: bold; cursor: pointer; }
.soft, figcaption { color: var(--soft); font-size: .9rem; }
.verdict { border-left: .4rem solid; border-radius: .2rem; background: var(--card);
  padding: .8rem 1.1rem; margin: 1.2rem 0; }
.verdict strong { font-size: 1.15rem; }
.verdict ul { margin: .4rem 0 0; padding-left: 1.2rem; }
.good { border-color: var(--good); } .good strong { color: var(--good); }
.care { border-color: var(--care); } .care strong { color: var(--care); }
.bad { border-color: var(--bad); } .bad strong { color: var(--bad); }
.tiles { display: grid; gap: .7rem;
  grid-template-columns: repeat(auto-fill, minmax(9.5rem, 1fr)); }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: .3rem;
  padding: .6rem .8rem; }
.tile b { display: block; font-size: 1.25rem; font-variant-numeric: tabular-nums; }
figure { margin: 0 0 1.2rem; }
figure img { display: block; width: 100%; height: auto; background: #ffffff;
  border: 1px solid var(--line); border-radius: .3rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th.number, td.number { text-align: right; font-variant-numeric: tabular-nums; }
td { overflow-wrap: anywhere; }
.across td { overflow-wrap: normal; }
@media (max-width: 44rem) { body { padding: 1rem; } .wide img { width: 44rem; } }
pre { overflow-x: auto; background: var(--card); padding: .8rem; font-size: .8rem; }
"""


def write_report(
    path: str | Path,
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    view: ViewOptions | None = None,
) -> None:
    """Write the report of an unfolding; see `report_html` for parameters and errors.

    Parameters
    ----------
    path : path
        Where to write; an existing file is replaced.
    """
    page = report_html(summary, folded, unfolded, columns, view=view)
    Path(path).write_text(page, encoding="utf-8")


def report_html(
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    view: ViewOptions | None = None,
) -> str:
    """Return the report of an unfolding as one HTML page without outer references.

    Parameters
    ----------
    summary : mapping
        What ran and how good it is: the summary's keys.  What is absent is left out.
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit.
    columns : mapping of str to (n,)
        Columns of the unfolded table; `stratigraphic` and those of distortion are drawn.
    view : ViewOptions, optional
        Where bodies are looked at from.

    Raises
    ------
    InputError
        Arrays that do not agree, or values that are not finite.
    MissingDependencyError
        Nothing can be drawn here; the message says what to install.
    """
    X, Y = np.asarray(folded, dtype=np.float64), np.asarray(unfolded, dtype=np.float64)
    drawn = _checked(X, Y, columns)
    check_rendering()
    summary = _without_folders(summary)
    title = _text(_title(summary, len(X)))
    options = _mapping(summary.get("options"))
    body = [
        f"<h1>{title}</h1>",
        f'<p class="soft">{len(X):,} blocks, geounfold {_text(summary.get("version", ""))}</p>',
        _verdict_html(verdict(summary)),
        _tiles(summary),
        "<h2>Warnings</h2>",
        _list(summary.get("warnings", [])) or "<p>None.</p>",
        _section("Elements at fault", _flaws(summary)),
        "<h2>Before and after</h2>",
        *_pictures(X, Y, drawn, view),
        "<h2>Distributions over the blocks</h2>",
        *_distributions(drawn),
        _section("How it was made", _pairs(_making(summary))),
        _section("Flattened surfaces", _surfaces(summary)),
        _section("Seconds per stage", _table([_flat(summary.get("seconds", {}))])),
        _section("Options", _pairs({k: v for k, v in options.items() if not _mapping(v)})),
        _folded_up(
            "Options of the stages",
            _pairs(_flat({k: v for k, v in options.items() if _mapping(v)})),
        ),
        _folded_up("Everything, as JSON", f"<pre>{_text(_json(summary))}</pre>"),
    ]
    return _PAGE.format(title=title, style=_STYLE, body="\n".join(body))


def _without_folders(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary with files named without their folders, fit to be passed on."""
    out = dict(summary)
    for key in ("input", "samples"):
        facts = _mapping(out.get(key))
        if "file" in facts:
            out[key] = {**facts, "file": Path(str(facts["file"])).name}
    return out


def _title(summary: Mapping[str, Any], count: int) -> str:
    return f"Unfolding of {_mapping(summary.get('input')).get('file') or f'{count:,} blocks'}"


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def _checked(X: Floats, Y: Floats, columns: Mapping[str, ArrayLike]) -> dict[str, Floats]:
    """Return the columns that are drawn, epsilon among them, or raise InputError."""
    if X.shape != Y.shape or X.ndim != 2 or X.shape[1] != 3:
        raise InputError(f"folded {X.shape} and unfolded {Y.shape} must both be (n, 3)")
    names = [name for name in ("stratigraphic", *_DISTORTIONS) if name in columns]
    out = {name: np.asarray(columns[name], dtype=np.float64) for name in names}
    for name, values in out.items():
        if values.shape != (len(X),):
            raise InputError(f"column {name} has shape {values.shape}, but there are {len(X)} rows")
        if not np.isfinite(values).all():
            raise InputError(f"column {name} has {(~np.isfinite(values)).sum()} values not finite")
    if "nmd_error" not in out and len(X) > NEIGHBOURS:
        out["nmd_error"] = epsilon(X, Y)
    return out


# ---------------------------------------------------------------------------------------- verdict


@dataclass(frozen=True)
class Verdict:
    """What a summary says, in words.

    Attributes
    ----------
    level : str
        ``good``, ``care`` or ``bad``.
    headline : str
        One sentence.
    reasons : tuple of str
        One sentence per thing that was checked.
    """

    level: str
    headline: str
    reasons: tuple[str, ...]


def verdict(summary: Mapping[str, Any]) -> Verdict:
    """Return a plain verdict on an unfolding from its summary; what is absent is not judged.

    Examples
    --------
    >>> verdict({"inverted_folded": 0, "inverted_unfolded": 2}).level
    'bad'
    """
    inverted = [summary.get("inverted_folded"), summary.get("inverted_unfolded")]
    outside, proved = summary.get("outside_share"), summary.get("injective")
    reasons = tuple(_reasons(summary))
    level, headline = "care", "Usable: nothing is inverted. That it is one to one is not proved."
    if any(inverted):
        level, headline = "bad", "The map folds over itself: do not use it as it is."
    elif proved is False and _mapping(summary.get("certificate")).get("injective") is True:
        headline = "Usable: the tetrahedra are one to one; between their corners it is not proved."
    elif proved is False:
        level, headline = "bad", "The map is not proved one to one: do not use it as it is."
    elif None in inverted:
        headline = "It is not known whether the map folds over itself."
    elif outside is not None and outside > _CARE:
        headline = f"Usable with care: {outside:.2%} of the blocks were extrapolated."
    elif proved is True:
        level, headline = "good", "Sound: the map is proved to be one to one."
    return Verdict(level, headline, reasons)


def _reasons(summary: Mapping[str, Any]) -> Iterable[str]:
    folded, unfolded = summary.get("inverted_folded"), summary.get("inverted_unfolded")
    if folded is not None and unfolded is not None:
        yield f"Inverted tetrahedra: {folded} in the folded space, {unfolded} in the unfolded one."
    certificate = _mapping(summary.get("certificate"))
    if certificate.get("injective") is True:
        yield (
            f"Proved: {certificate['tetrahedra']} tetrahedra, none inverted, and "
            f"{certificate['boundary_faces']} border faces, none crossing, in both spaces, by "
            "exact predicates; so their map is one to one (Lipman 2014)."
        )
        used = _mapping(summary.get("coordinates")).get("name", "tet")
        if used != "tet":
            yield (
                f"Not proved: inside the prisms points go by {used} coordinates of their corners, "
                "not by the tetrahedra's; the blocks were there and back, and none inside out."
            )
    elif certificate.get("reason"):
        yield f"Not proved: {certificate['reason']}."
    elif certificate:
        yield (
            f"Not proved: {_number(certificate['crossing_folded'])} pairs of border faces cross in "
            f"the folded space, {_number(certificate['crossing_unfolded'])} in the unfolded one; "
            f"{_number(certificate['blocks_in_faulty_elements'])} blocks lie in elements at fault "
            "(listed below, and marked in the mesh that --mesh writes)."
        )
    empty = _mapping(summary.get("outside")).get("empty")
    if empty:
        yield f"{_number(empty)} blocks lie beyond the map's reach and were left empty."
    outside = summary.get("outside_share")
    if outside is not None:
        share = "every block" if outside == 0 else f"all blocks but {outside:.3%}"
        yield f"The control mesh holds {share}."
    if summary.get("round_trip_max") is not None:
        yield (
            "There and back through the map, blocks inside move by at most "
            f"{_number(summary['round_trip_max'])} (input's unit)."
        )
    error = summary.get("nmd")
    if isinstance(error, Mapping) and "mean" in error:
        yield (
            f"Neighbour mean distances change by {error['mean']:.2%} on average, "
            f"{error.get('p95', float('nan')):.2%} at the 95th percentile. This measure hardly "
            "sees folds: leaving the body as it is would score 0, and a right unfolding changes "
            "it where layers slid over one another."
        )


def _verdict_html(said: Verdict) -> str:
    return (
        f'<div class="verdict {said.level}"><strong>{_text(said.headline)}</strong>'
        f"{_list(said.reasons)}</div>"
    )


# --------------------------------------------------------------------------------------- pictures


def _pictures(
    X: Floats, Y: Floats, drawn: Mapping[str, Floats], view: ViewOptions | None
) -> Iterable[str]:
    if "stratigraphic" in drawn:
        figure = draw_bodies(
            X, Y, drawn["stratigraphic"], "stratigraphic", limits=(0.0, 1.0), bands=8, options=view
        )
        yield _figure(figure, "Layers: 0 at the bottom surface, 1 at the top. True to scale.")
    if len(X) > NEIGHBOURS:
        ids = neighbours(X)
        distances = (nmd(X, ids), nmd(Y, ids))
        label = "neighbour mean distance"
        figure = draw_bodies(X, Y, distances, label, colours="cividis", options=view)
        yield _figure(figure, f"Mean distance to the {NEIGHBOURS} neighbours of the folded body.")
    for name in _PICTURED:
        if name in drawn:
            label, meaning = _DISTORTIONS[name]
            look: dict[str, Any] = {"colours": "cividis", "options": view}
            if name == "volume_ratio":
                look |= {"colours": "RdYlBu_r", "limits": ratio_limits(drawn[name])}
            figure = draw_bodies(X, Y, drawn[name], label, **look)
            yield _figure(figure, f"{name}: {meaning}.")


def _distributions(drawn: Mapping[str, Floats]) -> Iterable[str]:
    for name, (label, meaning) in _DISTORTIONS.items():
        if name in drawn:
            caption = f"{name}: {meaning}. Histogram and cumulative share."
            yield _figure(draw_distribution(drawn[name], label), caption)


def _figure(figure: Figure, caption: str) -> str:
    data = base64.b64encode(png(figure)).decode("ascii")
    text = _text(caption)
    return (
        f'<figure><div class="wide"><img alt="{text}" src="data:image/png;base64,{data}"></div>'
        f"<figcaption>{text}</figcaption></figure>"
    )


# ------------------------------------------------------------------------------------------ words


def _text(value: object) -> str:
    return html.escape(str(value), quote=True)


def _number(value: object) -> str:
    """Write a number as people read it; anything else as it is."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e5 else f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_number(v) for v in value)
    return str(value)


def _flat(nested: object, prefix: str = "") -> dict[str, Any]:
    """Return nested mappings as one, with dotted names."""
    if not isinstance(nested, Mapping):
        return {prefix: nested} if prefix else {}
    out: dict[str, Any] = {}
    for key, value in nested.items():
        out.update(_flat(value, f"{prefix}.{key}" if prefix else str(key)))
    return out


def _section(title: str, content: str) -> str:
    return f"<h2>{_text(title)}</h2>\n{content}" if content else ""


def _folded_up(title: str, content: str) -> str:
    """Return a section that opens on demand; nothing where there is no content."""
    return f"<details><summary>{_text(title)}</summary>\n{content}</details>" if content else ""


def _json(summary: Mapping[str, Any]) -> str:
    return json.dumps(summary, indent=1, default=str)


def _list(items: Iterable[object]) -> str:
    lines = "".join(f"<li>{_text(item)}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def _pairs(values: Mapping[str, Any]) -> str:
    rows = "".join(
        f"<tr><th>{_text(k)}</th><td>{_text(_number(v))}</td></tr>" for k, v in values.items()
    )
    return f'<div class="wide"><table>{rows}</table></div>' if rows else ""


def _table(rows: list[dict[str, Any]]) -> str:
    """Return rows of the same keys as a table; empty when there is nothing to show."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    if not names:
        return ""
    kinds = [' class="number"' if all(map(_is_number, _column(rows, n))) else "" for n in names]
    head = "".join(f"<th{k}>{_text(n)}</th>" for n, k in zip(names, kinds, strict=True))
    lines = []
    for row in rows:
        cells = (
            f"<td{kind}>{_text(_number(row[name]) if name in row else '')}</td>"
            for name, kind in zip(names, kinds, strict=True)
        )
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f'<div class="wide across"><table><tr>{head}</tr>{"".join(lines)}</table></div>'


def _column(rows: list[dict[str, Any]], name: str) -> list[Any]:
    return [row[name] for row in rows if name in row]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | list)


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
    "certificate.tetrahedra": "tetrahedra proved",
    "certificate.theorem": "by the theorem",
    "outside.reach": "reach around the control mesh",
}


def _making(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is known of the stages, by plain names; lengths in the input's unit."""
    known = _flat(summary)
    out = {label: known[key] for key, label in _MADE.items() if known.get(key) is not None}
    out.update({k.replace("_", " "): v for k, v in _mapping(summary.get("method")).items()})
    return out


def _flaws(summary: Mapping[str, Any]) -> str:
    """Return one row per element that keeps the map from being proved, those with blocks first."""
    flaws = _mapping(summary.get("certificate")).get("flaws") or []
    rows = [
        {
            "element": flaw["element"],
            "blocks": flaw["blocks"],
            "folded": ", ".join(_number(x) for x in flaw["folded"]),
            "unfolded": ", ".join(_number(x) for x in flaw["unfolded"]),
        }
        for flaw in flaws
    ]
    return _table(rows) if rows else ""


def _surfaces(summary: Mapping[str, Any]) -> str:
    """Return one row per flattened surface: its size, and how its flattening went."""
    rows = []
    for name, how in _mapping(summary.get("flattening")).items():
        size = _mapping(summary.get(name))
        rows.append({"surface": name, **size, **{k: v for k, v in _mapping(how).items() if v}})
        rows[-1].update({k: _mapping(how).get(k) for k in ("flips", "overlaps")})
    return _table(rows)


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


_TILES: tuple[tuple[str, str, Callable[[Any], str]], ...] = (
    ("inverted_folded", "inverted, folded", _number),
    ("inverted_unfolded", "inverted, unfolded", _number),
    ("injective", "proved one to one", _number),
    ("outside_share", "blocks outside", lambda v: f"{v:.3%}"),
    ("round_trip_max", "round trip, largest", _number),
    ("nmd.mean", "epsilon(X, Y), mean", _number),
    ("nmd.p95", "epsilon(X, Y), 95\u00a0%", _number),
    ("volume_change.mean", "volume change, mean", _number),
    ("edge_change.mean", "edge change, mean", _number),
    ("shear.max", "shear, largest", _number),
    ("peak_memory_mb", "peak memory, MiB", lambda v: f"{v:,.0f}"),
)


def _tiles(summary: Mapping[str, Any]) -> str:
    values = _flat(summary)
    tiles = [
        f'<div class="tile"><b>{_text(write(values[key]))}</b>{_text(label)}</div>'
        for key, label, write in _TILES
        if values.get(key) is not None
    ]
    seconds = [v for v in _flat(summary.get("seconds", {})).values() if isinstance(v, int | float)]
    if seconds:
        tiles.append(f'<div class="tile"><b>{sum(seconds):.2f}</b>seconds, all stages</div>')
    return f'<div class="tiles">{"".join(tiles)}</div>' if tiles else ""
