"""Still pictures of a body in both spaces, for print and for browsers that cannot draw it."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from geounfold.geometry.mesh import Floats
from geounfold.report.columns import MEANINGS
from geounfold.report.html_text import text
from geounfold.report.plots.bodies import draw_bodies
from geounfold.report.plots.figures import png, ratio_limits
from geounfold.report.plots.style import ViewOptions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURED = ("nmd_error", "volume_ratio", "shear")


def pictures(
    X: Floats,
    Y: Floats,
    drawn: Mapping[str, Floats],
    distances: tuple[Floats, Floats] | None,
    sides: Floats | None,
    view: ViewOptions | None,
) -> Iterator[str]:
    """Yield figures as HTML: layers, neighbour mean distances, and the main distortions.

    Parameters
    ----------
    X, Y : (n, 3) float
        The blocks in both spaces.
    drawn : mapping of str to (n,)
        Columns of the result.
    distances : two of (n,), optional
        Neighbour mean distances in both spaces.
    sides : (n, 3), optional
        Of the boxes drawn, where blocks differ in theirs.
    view : ViewOptions, optional
        Where to look from.
    """
    common: dict[str, Any] = {"sides": sides, "options": view}
    if "stratigraphic" in drawn:
        layers: dict[str, Any] = {"limits": (0.0, 1.0), "bands": 8, **common}
        figure = draw_bodies(X, Y, drawn["stratigraphic"], "stratigraphic", **layers)
        yield _figure(figure, "Layers: 0 at the bottom surface, 1 at the top. True to scale.")
    if distances is not None:
        label = "neighbour mean distance"
        figure = draw_bodies(X, Y, distances, label, colours="cividis", **common)
        yield _figure(figure, "Mean distance to the neighbours in the folded body.")
    for name in _PICTURED:
        if name in drawn:
            label, meaning, _ = MEANINGS[name]
            look: dict[str, Any] = {"colours": "cividis", **common}
            if name == "volume_ratio":
                look |= {"colours": "RdYlBu_r", "limits": ratio_limits(drawn[name])}
            figure = draw_bodies(X, Y, drawn[name], label, **look)
            yield _figure(figure, f"{name}: {meaning}.")


def _figure(figure: Figure, caption: str) -> str:
    data = base64.b64encode(png(figure)).decode("ascii")
    words = text(caption)
    return (
        f'<figure><div class="wide" tabindex="0"><img alt="{words}" '
        f'src="data:image/png;base64,{data}"></div><figcaption>{words}</figcaption></figure>'
    )
