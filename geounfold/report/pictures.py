"""Still pictures of a body in both spaces, for print and for browsers without WebGL."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.report.blocks import block_shape, level_sides
from geounfold.report.body import ReportBody
from geounfold.report.columns import MEANINGS
from geounfold.report.html_text import text
from geounfold.report.plots.bodies import draw_bodies
from geounfold.report.plots.figures import png, ratio_limits
from geounfold.report.plots.style import ViewOptions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURED = ("nmd_error", "volume_ratio", "shear")


def pictures(body: ReportBody, view: ViewOptions | None) -> Iterator[str]:
    """Yield figures as HTML: layers, neighbour mean distances, and the main distortions.

    Parameters
    ----------
    body : ReportBody
        The blocks and their columns.
    view : ViewOptions, optional
        Direction from which the body is viewed.
    """
    X, Y, results = body.folded, body.unfolded, body.results
    sides = level_sides(block_shape(X, body.columns))
    common: dict[str, Any] = {"sides": sides, "options": view}
    if "fault_block" in body.columns:
        yield from _fault_blocks(body, common)
    if "stratigraphic" in results:
        layers: dict[str, Any] = {"limits": (0.0, 1.0), "bands": 8, **common}
        figure = draw_bodies(X, Y, results["stratigraphic"], "stratigraphic coordinate", **layers)
        yield _figure(
            figure, "Stratigraphic coordinate: 0 at the bottom surface, 1 at the top. True scale."
        )
    if body.distances is not None:
        label = "neighbour mean distance"
        figure = draw_bodies(X, Y, body.distances, label, colours="cividis", **common)
        yield _figure(
            figure, "Mean distance of each block to its neighbours in the folded body, both spaces."
        )
    for name in _PICTURED:
        if name in results:
            label, meaning, _ = MEANINGS[name]
            look: dict[str, Any] = {"colours": "cividis", **common}
            if name == "volume_ratio":
                look |= {"colours": "RdYlBu_r", "limits": ratio_limits(results[name])}
            figure = draw_bodies(X, Y, results[name], label, **look)
            yield _figure(figure, f"{name}: {meaning}.")


def _fault_blocks(body: ReportBody, common: dict[str, Any]) -> Iterator[str]:
    """Yield a figure of the fault blocks, numbered in order, if there are several."""
    _, codes = np.unique(np.asarray(body.columns["fault_block"]), return_inverse=True)
    count = int(codes.max()) + 1
    if count < 2:
        return
    colours = "tab10" if count <= 10 else "tab20" if count <= 20 else "viridis"
    # A colour of a list of so many belongs to each number.
    last = {"tab10": 10, "tab20": 20}.get(colours, count) - 0.5
    look: dict[str, Any] = {"colours": colours, "limits": (-0.5, last), **common}
    figure = draw_bodies(
        *(body.folded, body.unfolded, codes.ravel().astype(float), "fault block"), **look
    )
    yield _figure(figure, "Fault blocks: each was unfolded by itself, and all were joined.")


def _figure(figure: Figure, caption: str) -> str:
    """Return a figure with its caption as HTML."""
    data = base64.b64encode(png(figure)).decode("ascii")
    words = text(caption)
    return (
        f'<figure><div class="wide" tabindex="0"><img alt="{words}" '
        f'src="data:image/png;base64,{data}"></div><figcaption>{words}</figcaption></figure>'
    )
