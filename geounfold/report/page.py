"""The report as one HTML page: its sections in order, its style and its script."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from geounfold.geometry.mesh import Floats
from geounfold.report.body import ReportBody, report_body
from geounfold.report.faults import CarriedFaults, faults_section
from geounfold.report.horizons import Horizons
from geounfold.report.html_text import json_for_script, mapping, text
from geounfold.report.payload import CATEGORIES, CarriedHoles, payload
from geounfold.report.pictures import pictures
from geounfold.report.plots.rendering import check_rendering
from geounfold.report.plots.style import ViewOptions
from geounfold.report.sections import (
    asset,
    certificate_section,
    crosscheck_section,
    distributions_section,
    drillholes_section,
    estimation_section,
    everything_section,
    exploration_section,
    figures_section,
    flaws_section,
    making_section,
    repeat_section,
    seconds_section,
    stills_section,
    surfaces_section,
    verdict_section,
    views_section,
    warnings_section,
)
from geounfold.report.verdict import verdict
from geounfold.report.without_folders import without_folders

if TYPE_CHECKING:
    from geounfold.estimation import Exploration
    from geounfold.estimation.checks import EstimationChecks

_SCRIPTS = ("decode", "colour", "camera", "renderer", "view", "inspect", "controls", "main")


def write_report(  # 11 arguments: the file, the body, and by keyword what was carried with it
    path: str | Path,
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    holes: CarriedHoles | None = None,
    faults: CarriedFaults | None = None,
    horizons: Horizons | None = None,
    exploration: Exploration | None = None,
    estimation: EstimationChecks | None = None,
    view: ViewOptions | None = None,
    start: str = "",
) -> None:
    """Write the report of an unfolding to a file.

    Parameters
    ----------
    path : path
        The file to write; an existing one is replaced.
    summary, folded, unfolded, columns, holes, faults, horizons, exploration, estimation, view
        As for `report_html`.
    start : str
        As for `report_html`.

    Raises
    ------
    InputError, MissingDependencyError
        As for `report_html`.
    """
    page = report_html(
        *(summary, folded, unfolded, columns),
        holes=holes,
        faults=faults,
        horizons=horizons,
        exploration=exploration,
        estimation=estimation,
        view=view,
        start=start,
    )
    Path(path).write_text(page, encoding="utf-8", newline="\n")


def report_html(  # as write_report, without the file
    summary: Mapping[str, Any],
    folded: Floats,
    unfolded: Floats,
    columns: Mapping[str, ArrayLike],
    *,
    holes: CarriedHoles | None = None,
    faults: CarriedFaults | None = None,
    horizons: Horizons | None = None,
    exploration: Exploration | None = None,
    estimation: EstimationChecks | None = None,
    view: ViewOptions | None = None,
    start: str = "",
) -> str:
    """Return the report of an unfolding as one HTML page that loads nothing from elsewhere.

    The same arguments give the same page, byte for byte.

    Parameters
    ----------
    summary : mapping
        The summary of the unfolding; sections whose keys are missing are left out.  With a key
        ``title`` the page is not about an unfolding, and has warnings in place of the verdict.
    folded, unfolded : (n, 3) float
        Block centroids in both spaces, in the same unit.  Blocks without an image are NaN in the
        unfolded space; they are counted but not drawn.
    columns : mapping of str to (n,)
        Columns of the input and of the result, numbers or texts.  Those of the result must be
        finite for each block with an image.
    holes : CarriedHoles, optional
        Drill-holes carried with the body.
    faults : CarriedFaults, optional
        Faults between the body's fault blocks.
    horizons : mapping of SurfacePair, optional
        Top and bottom surfaces in both spaces, by these names.
    exploration : Exploration, optional
        Exploratory data analysis of a grade of the samples carried with the body.
    estimation : EstimationChecks, optional
        Checks of an estimation on the blocks.
    view : ViewOptions, optional
        Direction from which bodies are viewed.
    start : str, optional
        Column that colours the blocks at the start; by default the height in the layer.

    Raises
    ------
    InputError
        Arrays do not agree, or values are not finite.
    MissingDependencyError
        A library for drawing is missing; the message says what to install.
    """
    body = report_body(folded, unfolded, columns)
    check_rendering()
    summary = without_folders(summary)
    unit = str(mapping(summary.get("input")).get("unit", ""))
    viewer = payload(body, holes=holes, faults=faults, horizons=horizons, view=view, unit=unit)
    if start:
        viewer.content["start"] = start
    script = _script()
    carried = _Carried(holes, faults, exploration, estimation)
    return Template(asset("page.html")).substitute(
        title=text(_title(summary, body.total)),
        digest=_digest(script),
        style=asset("style.css"),
        about=f"{body.total:,} blocks, geounfold {text(summary.get('version', ''))}",
        body=_sections(summary, body, viewer.notes, carried, view),
        data=json_for_script(viewer.content),
        script=script,
    )


@dataclass(frozen=True, eq=False)
class _Carried:
    """What was carried with a body."""

    holes: CarriedHoles | None
    faults: CarriedFaults | None
    exploration: Exploration | None
    estimation: EstimationChecks | None = None


def _sections(
    summary: Mapping[str, Any],
    body: ReportBody,
    notes: tuple[str, ...],
    carried: _Carried,
    view: ViewOptions | None,
) -> str:
    """Return the page's sections in order, without the empty ones."""
    parts = [
        views_section(
            notes, with_holes=carried.holes is not None, with_faults=carried.faults is not None
        ),
        warnings_section(summary)
        if "title" in summary
        else verdict_section(verdict(summary), summary.get("warnings", [])),
        faults_section(summary, carried.faults, body.unfolded, body.columns, CATEGORIES),
        stills_section(pictures(body, view)),
        figures_section(summary),
        distributions_section(body.results),
        exploration_section(carried.exploration),
        estimation_section(carried.estimation),
        flaws_section(summary),
        crosscheck_section(summary),
        '<div class="duo">',
        certificate_section(summary),
        making_section(summary),
        drillholes_section(summary),
        seconds_section(summary),
        "</div>",
        surfaces_section(summary),
        repeat_section(summary),
        everything_section(summary),
    ]
    return "\n".join(part for part in parts if part)


def _title(summary: Mapping[str, Any], count: int) -> str:
    """Return the page's title: its own, or that of an unfolding."""
    if "title" in summary:
        return str(summary["title"])
    return f"Unfolding of {mapping(summary.get('input')).get('file') or f'{count:,} blocks'}"


@cache
def _script() -> str:
    """Return the viewer's script: its files joined inside one function."""
    parts = "\n".join(asset(f"{name}.js") for name in _SCRIPTS)
    return f'(function () {{\n"use strict";\n{parts}\n}})();'


def _digest(script: str) -> str:
    """Return the script's SHA-256, by which the page's security policy allows no other script."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
