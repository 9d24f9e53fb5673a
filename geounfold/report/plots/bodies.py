"""Pictures: bodies and surfaces in both spaces, the split of the hull, the control mesh.

Every ``draw_`` function returns a matplotlib Figure that belongs to no window; `png` turns one
into bytes.  Three-dimensional views are rendered off screen by VTK and set into the figure, at
true scale, in parallel projection.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.report.plots.figures import (
    colour_bar,
    colour_limits,
    extents,
    new_figure,
    show_figure,
)
from geounfold.report.plots.rendering import LIT, block_sides, check_body, render_body, render_scene
from geounfold.report.plots.style import BOTTOM, RIM, TOP, UNDECIDED, Limits, ViewOptions, require

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_body(
    points: Floats,
    values: Floats,
    label: str,
    *,
    limits: Limits | None = None,
    colours: str = "viridis",
    bands: int = 256,
    sides: Floats | None = None,
    options: ViewOptions | None = None,
) -> Figure:
    """Draw one body; for the parameters see `draw_bodies`."""
    options = options or ViewOptions()
    P, v = check_body(points, values)
    limits = limits or colour_limits(v)
    figure = new_figure(9, 8.2 * options.size[1] / options.size[0] + 0.3)
    ax = figure.subplots()
    image = render_body(P, v, limits, colours=colours, bands=bands, sides=sides, options=options)
    show_figure(ax, image, extents(P))
    colour_bar(figure, [ax], limits, colours, bands, label)
    return figure


def draw_bodies(  # 10 arguments: what is drawn, and its look by keyword as in matplotlib
    folded: Floats,
    unfolded: Floats,
    values: Floats | tuple[Floats, Floats],
    label: str,
    *,
    limits: Limits | None = None,
    colours: str = "viridis",
    bands: int = 256,
    sides: Floats | None = None,
    titles: tuple[str, str] = ("folded", "unfolded"),
    options: ViewOptions | None = None,
) -> Figure:
    """Draw a body folded and unfolded, side by side, in the same colours.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The blocks in both spaces.
    values : (n,) float, or two of these
        Values to colour by; a pair if they differ between the spaces.
    label : str
        Name of the values, with their unit.
    limits : (float, float), optional
        Values of the first and last colour; 1st and 99th percentile by default.
    titles : (str, str)
        Titles of the two spaces.
    colours, bands, sides, options
        As in `render_body`; by default both spaces have the sides found in the folded one.
    """
    options = options or ViewOptions()
    pair = values if isinstance(values, tuple) else (values, values)
    checked = [check_body(P, v) for P, v in zip((folded, unfolded), pair, strict=True)]
    limits = limits or colour_limits(*(v for _, v in checked))
    figure = new_figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    if sides is None:
        sides = block_sides(checked[0][0])
    look: dict[str, Any] = {"colours": colours, "bands": bands, "sides": sides}
    for ax, (P, v), title in zip(axes, checked, titles, strict=True):
        image = render_body(P, v, limits, options=options, **look)
        show_figure(ax, image, f"{title}: {extents(P)}")
    colour_bar(figure, list(axes), limits, colours, bands, label)
    return figure


def _polydata(mesh: TriMesh) -> Any:
    V = np.column_stack([mesh.V, np.zeros(len(mesh.V))]) if mesh.V.shape[1] == 2 else mesh.V
    faces = np.column_stack([np.full(len(mesh.F), 3), mesh.F]).ravel()
    return require("pyvista").PolyData(V - V.mean(axis=0), faces)


def draw_surface(
    folded: TriMesh,
    unfolded: TriMesh,
    values: Floats,
    label: str,
    *,
    limits: Limits | None = None,
    colours: str = "viridis",
    options: ViewOptions | None = None,
) -> Figure:
    """Draw a surface folded and unfolded, side by side, in the same colours.

    Parameters
    ----------
    folded, unfolded : TriMesh
        The same faces in both spaces.
    values : (n,) or (m,) float
        Values to colour by, per vertex or per face.
    label, limits, colours, options
        As in `draw_bodies`.

    Raises
    ------
    InputError
        The number of values is neither that of the vertices nor that of the faces.
    MissingDependencyError
        Nothing can be drawn here; the message says what to install.
    """
    options = options or ViewOptions()
    v = np.asarray(values, dtype=np.float64)
    if v.shape not in ((len(folded.V),), (len(folded.F),)):
        raise InputError(
            f"{len(folded.V)} vertices or {len(folded.F)} faces need as many values, "
            f"but there are {v.shape}"
        )
    limits = limits or colour_limits(v)
    figure = new_figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    look = {"scalars": "value", "clim": list(limits), "cmap": colours}
    for ax, mesh, space in zip(axes, (folded, unfolded), ("folded", "unfolded"), strict=True):
        surface = _polydata(mesh)
        data = surface.point_data if len(v) == len(mesh.V) else surface.cell_data
        data["value"] = v
        show_figure(
            ax, render_scene(surface, options, **LIT, **look), f"{space}: {extents(mesh.V)}"
        )
    colour_bar(figure, list(axes), limits, colours, 256, label)
    return figure


def draw_split(
    mesh: TriMesh, side: Ints, rim: Bools, *, options: ViewOptions | None = None
) -> Figure:
    """Draw a hull with its top, bottom and rim, from above and from below.

    Parameters
    ----------
    mesh : TriMesh
        The hull.
    side : (m,) int
        +1 on the side of the top, -1 on that of the bottom, 0 undecided.
    rim : (m,) bool
        True on the rim.
    options : ViewOptions, optional
        Direction of view; the second view has the opposite elevation.
    """
    options = options or ViewOptions()
    if not len(mesh.F) == len(side) == len(rim):
        raise InputError(
            f"side and rim need one value for each of {len(mesh.F)} faces, "
            f"but have {len(side)} and {len(rim)}"
        )
    kind = np.where(np.asarray(rim), 2, np.select([side > 0, side < 0], [0, 1], default=3))
    surface, colours = _polydata(mesh), [TOP, BOTTOM, RIM, UNDECIDED]
    surface.cell_data["part"] = kind
    below = ViewOptions(azimuth=options.azimuth, elevation=-options.elevation, size=options.size)
    figure = new_figure(12.5, 12.5 * 0.5 * options.size[1] / options.size[0] + 0.6)
    for ax, view, title in zip(
        figure.subplots(1, 2), (options, below), ("from above", "from below"), strict=True
    ):
        look = {"scalars": "part", "cmap": colours, "clim": [-0.5, 3.5], "n_colors": 4}
        show_figure(ax, render_scene(surface, view, **LIT, **look), title)
    names = ("top (hanging wall)", "bottom (footwall)", "rim", "undecided")
    patch = require("matplotlib.patches").Patch
    shown = [i for i in range(4) if (kind == i).any()]
    figure.legend(
        handles=[patch(color=colours[i], label=names[i]) for i in shown],
        loc="outside lower center",
        ncols=len(shown),
        frameon=False,
    )
    return figure


def _tet_faces(T: Ints) -> Ints:
    """Return the faces that belong to one tetrahedron only, (m, 3), outward."""
    F = np.concatenate([T[:, [0, 2, 1]], T[:, [0, 1, 3]], T[:, [1, 2, 3]], T[:, [0, 3, 2]]])
    _, first, count = np.unique(np.sort(F, axis=1), axis=0, return_index=True, return_counts=True)
    border: Ints = F[np.sort(first[count == 1])]
    return border


def draw_control(control: ControlMesh, *, options: ViewOptions | None = None) -> Figure:
    """Draw the border of a control mesh in both spaces, coloured by stratigraphic coordinate."""
    options = options or ViewOptions()
    F = _tet_faces(control.folded.T)
    limits = colour_limits(control.stratigraphic)
    figure = new_figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    spaces = {"folded": control.folded, "unfolded": control.unfolded}
    for ax, (title, mesh) in zip(axes, spaces.items(), strict=True):
        surface = _polydata(TriMesh(mesh.V, F))
        surface.point_data["value"] = control.stratigraphic
        look = {"scalars": "value", "clim": list(limits), "cmap": "viridis"}
        show_figure(ax, render_scene(surface, options, **LIT, **look), title)
    colour_bar(figure, list(axes), limits, "viridis", 256, "stratigraphic coordinate")
    return figure
