"""Pictures: bodies in both spaces, the split of the hull, the control mesh, distributions.

Every ``draw_`` function returns a matplotlib Figure that belongs to no window; `png` turns one
into bytes.  Three-dimensional views are rendered off screen by VTK and set into the figure, at
true scale, in parallel projection.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
import io
import subprocess
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from geounfold.control import ControlMesh
from geounfold.errors import InputError, MissingDependencyError, OptionError
from geounfold.mesh import Bools, Floats, Ints, TriMesh
from geounfold.threads import cores

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Image = NDArray[np.uint8]
Limits = tuple[float, float]

# Okabe and Ito's colours, which stay apart for colour-blind readers.
TOP, BOTTOM, RIM, UNDECIDED = "#0072B2", "#E69F00", "#999999", "#CC79A7"

_LIBRARIES = ("libX11.so.6", "libGL.so.1", "libEGL.so.1")
_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkRenderingCore import vtkRenderWindow
vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.Render()
raise SystemExit(0 if window.SupportsOpenGL() else 3)
"""

# A box's corners, and its faces by axis and side (0 low, 1 high).
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_QUADS = np.array(
    [[[0, 1, 3, 2], [4, 6, 7, 5]], [[0, 4, 5, 1], [2, 3, 7, 6]], [[0, 2, 6, 4], [1, 5, 7, 3]]]
)
_LIT: dict[str, Any] = {
    "show_edges": True,
    "edge_opacity": 0.25,
    "line_width": 0.5,
    "ambient": 0.35,
    "diffuse": 0.65,
}
_SHADE = np.array([0.74, 0.86, 1.0])  # brightness of faces across x, y and z
_MAX_CELLS = 30_000_000  # of the grid that hidden blocks are found with: 30 MB


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """How bodies are looked at.

    Parameters
    ----------
    azimuth : float
        Degrees anticlockwise from east to where the viewer stands.
    elevation : float
        Degrees above the horizon, -90 to 90.
    size : (int, int)
        Width and height of each three-dimensional view, pixels.
    max_blocks : int
        Blocks drawn at most; of more that can be seen, every second, third ... is drawn.
    """

    azimuth: float = -65.0
    elevation: float = 24.0
    size: tuple[int, int] = (900, 620)
    max_blocks: int = 200_000

    def __post_init__(self) -> None:
        if not -90 <= self.elevation <= 90:
            raise OptionError(f"elevation must be -90 to 90 degrees, but is {self.elevation}")
        if min(self.size) < 16 or max(self.size) > 8192:
            raise OptionError(f"size must be 16 to 8192 pixels a side, but is {self.size}")
        if self.max_blocks < 1:
            raise OptionError(f"max_blocks must be at least 1, but is {self.max_blocks}")


# --------------------------------------------------------------------------------- what it needs


def require(name: str) -> Any:
    """Import an optional library, or raise MissingDependencyError saying how to get it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingDependencyError(
            f"pictures need {name.partition('.')[0]}, which cannot be imported ({error}): "
            "pip install matplotlib pyvista"
        ) from error


@functools.cache
def check_rendering() -> None:
    """Make sure that VTK can draw off screen.

    VTK ends the whole process where OpenGL is missing, so another process tries first.

    Raises
    ------
    MissingDependencyError
        A Python library or a system library is missing; the message names it and its cure.
    """
    require("matplotlib")
    require("pyvista")
    probe = subprocess.run(
        [sys.executable, "-c", _PROBE], capture_output=True, check=False, timeout=120
    )
    if probe.returncode:
        missing = ", ".join(name for name in _LIBRARIES if not _loads(name))
        reason = f"{missing} missing" if missing else f"VTK's trial ended with {probe.returncode}"
        raise MissingDependencyError(
            f"cannot draw in three dimensions: {reason}; install OpenGL "
            "(Debian and Ubuntu: apt-get install libgl1 libegl1)"
        )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


@contextmanager
def _quiet_vtk() -> Iterator[None]:
    """Keep VTK from telling standard error that there is no X server."""
    logger = require("vtkmodules.vtkCommonCore").vtkLogger
    before = logger.GetCurrentVerbosityCutoff()
    logger.SetStderrVerbosity(logger.VERBOSITY_OFF)
    try:
        yield
    finally:
        logger.SetStderrVerbosity(before)


# -------------------------------------------------------------------------------------- rendering


def _render(mesh: Any, options: ViewOptions, **look: Any) -> Image:
    """Return a picture (height, width, 3) of a pyvista mesh; `look` goes to add_mesh."""
    check_rendering()
    pv = require("pyvista")
    with _quiet_vtk():
        plotter = pv.Plotter(off_screen=True, window_size=list(options.size), lighting="light kit")
        try:
            plotter.background_color = "white"
            plotter.add_mesh(mesh, show_scalar_bar=False, **look)
            plotter.enable_parallel_projection()
            _aim(plotter, np.asarray(mesh.points), options)
            plotter.add_axes(line_width=3, color="black", viewport=(0, 0, 0.17, 0.24))
            return np.array(plotter.screenshot(return_img=True), dtype=np.uint8)[..., :3]
        finally:
            plotter.close()


def _view_axes(options: ViewOptions) -> Floats:
    """Return unit vectors to the right, up, and towards the viewer, as rows."""
    a, e = np.deg2rad(options.azimuth), np.deg2rad(options.elevation)
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(back, right), back])


def _aim(plotter: Any, points: Floats, options: ViewOptions) -> None:
    """Point the camera and fit the view to the points themselves, not to their bounding ball."""
    axes = _view_axes(options)
    seen = np.asarray(points, dtype=np.float64) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    centre = (low + high) / 2 @ axes
    _, up, back = axes
    span = np.maximum(high - low, 1e-12 + 1e-6 * np.abs(high - low).max())
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + back * 2 * np.linalg.norm(span)
    plotter.camera.up = up
    width, height = options.size
    plotter.camera.parallel_scale = 0.54 * max(span[1], span[0] * height / width)
    plotter.renderer.ResetCameraClippingRange()


def block_sides(points: Floats) -> Floats:
    """Return the sides of boxes to draw blocks with, (3,), in the points' unit.

    The lattice's, where the coordinates along each axis are levels at equal steps; otherwise
    cubes of the typical distance to the six nearest neighbours.
    """
    if len(points) < 2:
        return np.ones(3)
    steps = [level_step(column) for column in points.T]
    known = np.array([step for step in steps if step is not None])
    if len(known) == 3:
        return known
    sample = points[:: max(1, len(points) // 4000)]
    nearest = cKDTree(points).query(sample, k=min(7, len(points)), workers=cores())[0]
    spacing = float(np.median(np.asarray(nearest)[:, 1:].mean(axis=1)))
    return np.full(3, 1.08 * spacing if spacing > 0 else 1.0)  # no slits between turned cubes


def level_step(column: Floats) -> float | None:
    """Return the step of coordinates that lie on equally spaced levels, else None."""
    levels = np.unique(column)
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-6 * np.ptp(column)]
    if not gaps.size or len(gaps) > len(column) ** 0.75:
        return None
    step = float(np.median(gaps))
    whole = np.abs(gaps / step - np.round(gaps / step)) < 0.02
    return step if whole.mean() > 0.97 else None


def _seen(points: Floats, sides: Floats, towards: Floats) -> Bools:
    """Tell which blocks can be seen: those without two layers of others before them.

    Counted on a grid of the blocks' size, whose holes are closed, so that bodies off the lattice
    keep their outer layers whole.
    """
    cell = np.floor((points - points.min(axis=0)) / sides + 0.5).astype(np.int64) + 3
    shape = cell.max(axis=0) + 4
    if shape.prod() > _MAX_CELLS:
        return np.ones(len(points), dtype=np.bool_)
    full = np.zeros(shape, dtype=np.bool_)
    full[tuple(cell.T)] = True
    full = ndimage.binary_closing(full, np.ones((3, 3, 3), dtype=np.bool_))
    before = np.zeros((5, 5, 5), dtype=np.bool_)
    before[tuple(slice(2, 5) if t >= 0 else slice(0, 3) for t in towards)] = True
    hidden = ndimage.binary_erosion(full, before)
    seen: Bools = ~hidden[tuple(cell.T)]
    return seen


def _boxes(points: Floats, sides: Floats, colours: Floats, towards: Floats) -> Any:
    """Return a pyvista mesh of the faces of boxes that look towards the viewer, shaded.

    Boxes along the axes need no light: in parallel projection each shows three faces at most,
    always the same ones, with a brightness of their own.
    """
    pv = require("pyvista")
    quads = _QUADS[np.arange(3), (towards >= 0).astype(np.int64)]
    corners = (points[:, None] + _CORNERS * np.atleast_2d(sides)[:, None]).reshape(-1, 3)
    faces = (8 * np.arange(len(points))[:, None, None] + quads).reshape(-1, 4)
    mesh = pv.PolyData(corners, np.column_stack([np.full(len(faces), 4), faces]).ravel())
    shaded = colours[:, None, :] * _SHADE[:, None]
    mesh.cell_data["colour"] = np.round(255 * shaded.reshape(-1, 3)).astype(np.uint8)
    return mesh


def render_body(
    points: Floats,
    values: Floats,
    limits: Limits,
    *,
    colours: str = "viridis",
    bands: int = 256,
    sides: Floats | None = None,
    options: ViewOptions | None = None,
) -> Image:
    """Return a picture of blocks coloured by value.

    Parameters
    ----------
    points : (n, 3) float
        Centroids, in any length unit.
    values : (n,) float
        What to colour by.
    limits : (float, float)
        Values of the first and the last colour; values beyond take these.
    colours : str
        Matplotlib's name of the colour map.
    bands : int
        Number of distinct colours.
    sides : (3,) or (n, 3) float, optional
        Sides of the boxes drawn, of all or of each; found from the points by default (see
        `block_sides`).
    options : ViewOptions, optional
        Where to look from, and the size.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    InputError
        Shapes that do not agree, values that are not finite, or limits that do not rise.
    MissingDependencyError
        Nothing can be drawn here; the message says what to install.
    """
    options = options or ViewOptions()
    P, v = check_body(points, values)
    if not limits[0] < limits[1]:
        raise InputError(f"limits must rise, but are {limits}")
    check_rendering()
    P = P - P.mean(axis=0)  # graphics cards count in single precision
    box = block_sides(P) if sides is None else np.asarray(sides, dtype=np.float64)
    if box.shape not in ((3,), P.shape) or not (box > 0).all():
        raise InputError(f"sides must be positive and of shape (3,) or {P.shape}")
    towards = _view_axes(options)[2]
    shown = np.flatnonzero(_seen(P, np.atleast_2d(box).min(axis=0), towards))
    shown = shown[:: -(-len(shown) // options.max_blocks)]
    palette = require("matplotlib").colormaps[colours].resampled(bands)
    rgb = palette((v[shown] - limits[0]) / (limits[1] - limits[0]))[:, :3]
    boxes = _boxes(P[shown], box if box.ndim == 1 else box[shown], rgb, towards)
    return _render(boxes, options, scalars="colour", rgb=True, lighting=False)


def check_body(points: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return points (n, 3) and values (n,) as floats, or raise InputError."""
    P, v = np.asarray(points, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or not len(P):
        raise InputError(f"points must have shape (n, 3) with n > 0, but have {P.shape}")
    if v.shape != (len(P),):
        raise InputError(f"{len(P)} points need as many values, but there are {v.shape}")
    for name, array in (("points", P), ("values", v)):
        if not np.isfinite(array).all():
            raise InputError(f"{np.count_nonzero(~np.isfinite(array))} {name} are not finite")
    return P, v


# ---------------------------------------------------------------------------------------- figures


def _figure(width: float, height: float) -> Figure:
    figure: Figure = require("matplotlib.figure").Figure(
        figsize=(width, height), dpi=100, layout="constrained"
    )
    return figure


def png(figure: Figure) -> bytes:
    """Return a figure as PNG bytes, the same for the same figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", facecolor="white", metadata={"Software": None})
    return buffer.getvalue()


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG bytes, the same for the same figure; letters are left to the reader.

    What the drawing library has no letters for, the reader's fonts may have: it does not warn.
    """
    buffer = io.BytesIO()
    how = {"svg.hashsalt": "geounfold", "svg.fonttype": "none"}
    with require("matplotlib").rc_context(how), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        figure.savefig(buffer, format="svg", facecolor="white", metadata={"Date": None})
    return buffer.getvalue()


def _show(ax: Axes, image: Image, title: str) -> None:
    ax.imshow(image, interpolation="none")
    ax.set_title(title, fontsize=11)
    ax.set_axis_off()


def _colour_bar(
    figure: Figure, axes: Sequence[Axes], limits: Limits, colours: str, bands: int, label: str
) -> None:
    colormaps = require("matplotlib").colormaps
    norm = require("matplotlib.colors").Normalize(*limits)
    mappable = require("matplotlib.cm").ScalarMappable(norm, colormaps[colours].resampled(bands))
    bar = figure.colorbar(mappable, ax=list(axes), label=label, shrink=0.8, aspect=30)
    bar.ax.ticklabel_format(axis="y", useOffset=False)


def colour_limits(*values: Floats) -> Limits:
    """Return the 1st and 99th percentile of values, drawn apart where they are one."""
    low, high = np.percentile(np.concatenate([np.ravel(v) for v in values]), [1, 99])
    room = 1e-6 * max(abs(low), abs(high), 1e-6)
    return (float(low), float(high)) if high - low > room else (float(low), float(low + 2 * room))


def ratio_limits(ratios: Floats, least: float = 0.02) -> Limits:
    """Return limits as far below 1 as above: the 99th percentile of |ratio - 1|, or `least`.

    So 1 takes the middle colour, and changes too small to matter stay pale.

    Examples
    --------
    >>> ratio_limits(np.array([1.0001, 0.9999]))
    (0.98, 1.02)
    """
    room = max(float(np.percentile(np.abs(np.ravel(ratios) - 1), 99)), least)
    return 1 - room, 1 + room


def extents(points: Floats) -> str:
    """Return the extents of points, such as ``600 x 600 x 90``, to three figures or the unit."""
    size = np.ptp(np.asarray(points), axis=0)
    return " × ".join(f"{s:.0f}" if s >= 100 else f"{s:.3g}" for s in size)


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
    figure = _figure(9, 8.2 * options.size[1] / options.size[0] + 0.3)
    ax = figure.subplots()
    image = render_body(P, v, limits, colours=colours, bands=bands, sides=sides, options=options)
    _show(ax, image, extents(P))
    _colour_bar(figure, [ax], limits, colours, bands, label)
    return figure


def draw_bodies(
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
        What to colour by; a pair where the spaces differ in it.
    label : str
        What the values are, with their unit.
    limits : (float, float), optional
        Values of the first and last colour; 1st and 99th percentile by default.
    titles : (str, str)
        What the two spaces are called.
    colours, bands, sides, options
        See `render_body`; by default both spaces have the sides found in the folded one.
    """
    options = options or ViewOptions()
    pair = values if isinstance(values, tuple) else (values, values)
    checked = [check_body(P, v) for P, v in zip((folded, unfolded), pair, strict=True)]
    limits = limits or colour_limits(*(v for _, v in checked))
    figure = _figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    if sides is None:
        sides = block_sides(checked[0][0])
    look: dict[str, Any] = {"colours": colours, "bands": bands, "sides": sides}
    for ax, (P, v), title in zip(axes, checked, titles, strict=True):
        image = render_body(P, v, limits, options=options, **look)
        _show(ax, image, f"{title}: {extents(P)}")
    _colour_bar(figure, list(axes), limits, colours, bands, label)
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
        What to colour by, per vertex or per face.
    label, limits, colours, options
        See `draw_bodies`.

    Raises
    ------
    InputError
        As many values as there are neither vertices nor faces.
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
    figure = _figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    look = {"scalars": "value", "clim": list(limits), "cmap": colours}
    for ax, mesh, space in zip(axes, (folded, unfolded), ("folded", "unfolded"), strict=True):
        surface = _polydata(mesh)
        data = surface.point_data if len(v) == len(mesh.V) else surface.cell_data
        data["value"] = v
        _show(ax, _render(surface, options, **_LIT, **look), f"{space}: {extents(mesh.V)}")
    _colour_bar(figure, list(axes), limits, colours, 256, label)
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
        +1 on the top's half, -1 on the bottom's, 0 undecided.
    rim : (m,) bool
        True on the rim.
    options : ViewOptions, optional
        Where to look from; the second view has the opposite elevation.
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
    figure = _figure(12.5, 12.5 * 0.5 * options.size[1] / options.size[0] + 0.6)
    for ax, view, title in zip(
        figure.subplots(1, 2), (options, below), ("from above", "from below"), strict=True
    ):
        look = {"scalars": "part", "cmap": colours, "clim": [-0.5, 3.5], "n_colors": 4}
        _show(ax, _render(surface, view, **_LIT, **look), title)
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
    """Return the faces of tetrahedra that belong to one only, (m, 3), outward."""
    F = np.concatenate([T[:, [0, 2, 1]], T[:, [0, 1, 3]], T[:, [1, 2, 3]], T[:, [0, 3, 2]]])
    _, first, count = np.unique(np.sort(F, axis=1), axis=0, return_index=True, return_counts=True)
    border: Ints = F[np.sort(first[count == 1])]
    return border


def draw_control(control: ControlMesh, *, options: ViewOptions | None = None) -> Figure:
    """Draw the border of a control mesh in both spaces, coloured by stratigraphic coordinate."""
    options = options or ViewOptions()
    F = _tet_faces(control.folded.T)
    limits = colour_limits(control.stratigraphic)
    figure = _figure(12.5, 12.5 * 0.46 * options.size[1] / options.size[0] + 0.3)
    axes = figure.subplots(1, 2)
    spaces = {"folded": control.folded, "unfolded": control.unfolded}
    for ax, (title, mesh) in zip(axes, spaces.items(), strict=True):
        surface = _polydata(TriMesh(mesh.V, F))
        surface.point_data["value"] = control.stratigraphic
        look = {"scalars": "value", "clim": list(limits), "cmap": "viridis"}
        _show(ax, _render(surface, options, **_LIT, **look), title)
    _colour_bar(figure, list(axes), limits, "viridis", 256, "stratigraphic coordinate")
    return figure


def draw_distribution(values: Floats, label: str) -> Figure:
    """Draw a histogram and the cumulative curve of values (thesis, figure 3.16).

    Parameters
    ----------
    values : (n,) float
        One value per block.
    label : str
        What they are.
    """
    v = np.ravel(np.asarray(values, dtype=np.float64))
    if not v.size or not np.isfinite(v).all():
        raise InputError(f"{label}: needs finite values, and at least one")
    figure = _figure(12.5, 3.4)
    left, right = figure.subplots(1, 2)
    low, high = colour_limits(v)
    left.hist(np.clip(v, low, high), bins=60, color=TOP)
    left.set(xlabel=f"{label} (the outermost 1 % are in the end bars)", ylabel="blocks")
    ordered = np.sort(v)
    share = np.arange(1, len(v) + 1) / len(v)
    keep = np.unique(np.linspace(0, len(v) - 1, min(len(v), 2000)).astype(int))
    right.step(ordered[keep], share[keep], where="post", color=TOP)
    quantiles = [0.5, 0.9, 0.95]
    at = np.quantile(v, quantiles)
    right.plot(at, quantiles, "o", color=BOTTOM)
    notes = [f"{q:.0%} at or below {x:.5g}" for q, x in zip(quantiles, at, strict=True)]
    right.text(0.97, 0.06, "\n".join(notes), transform=right.transAxes, ha="right", fontsize=10)
    right.set(xlabel=label, ylabel="share of blocks", ylim=(0, 1.02))
    for ax in (left, right):
        ax.ticklabel_format(axis="x", useOffset=False)
        ax.locator_params(axis="x", nbins=6)
        ax.grid(alpha=0.3)
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def draw_curves(
    curves: Mapping[str, Floats], xlabel: str, ylabel: str, *, logarithmic: bool = False
) -> Figure:
    """Draw named curves of one value per step, such as a flattener's energy.

    Parameters
    ----------
    curves : mapping of str to (k,) float
        One curve per name.
    xlabel, ylabel : str
        What the axes show.
    logarithmic : bool
        Whether the values' axis is logarithmic.
    """
    figure = _figure(8, 3.4)
    ax = figure.subplots()
    for (name, values), style in zip(curves.items(), _styles(len(curves)), strict=True):
        ax.plot(np.asarray(values), style, label=name)
    ax.set(xlabel=xlabel, ylabel=ylabel)
    if logarithmic:
        ax.set_yscale("log")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return figure


def _styles(n: int) -> list[str]:
    """Return n line styles that do not rest on colour alone."""
    return [f"{('-', '--', ':', '-.')[i % 4]}C{i % 10}" for i in range(n)]
