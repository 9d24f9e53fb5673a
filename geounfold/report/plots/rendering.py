"""Bodies rendered off screen with pyvista."""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from geounfold.backends.system.libraries import missing_for_drawing
from geounfold.backends.threads import cores
from geounfold.errors import InputError, MissingDependencyError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.report.plots.style import Image, Limits, ViewOptions, require

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

LIT: dict[str, Any] = {
    "show_edges": True,
    "edge_opacity": 0.25,
    "line_width": 0.5,
    "ambient": 0.35,
    "diffuse": 0.65,
}

_SHADE = np.array([0.74, 0.86, 1.0])  # brightness of faces across x, y and z

_MAX_CELLS = 30_000_000  # largest grid in which hidden blocks are found: 30 MB


@functools.cache
def check_rendering() -> None:
    """Check that VTK can draw off screen.

    VTK ends the whole process if OpenGL is missing, so another process tries first.

    Raises
    ------
    MissingDependencyError
        A Python library or a system library is missing; the message names it and how to install it.
    """
    require("matplotlib")
    require("pyvista")
    probe = subprocess.run(
        [sys.executable, "-c", _PROBE], capture_output=True, check=False, timeout=120
    )
    if probe.returncode:
        missing = ", ".join(missing_for_drawing())
        reason = f"{missing} missing" if missing else f"VTK's trial ended with {probe.returncode}"
        raise MissingDependencyError(
            f"cannot draw in three dimensions: {reason}; install OpenGL "
            "(Debian and Ubuntu: apt-get install libgl1 libegl1; Windows and macOS: its own driver)"
        )


@contextmanager
def _quiet_vtk() -> Iterator[None]:
    """Suppress VTK's message on standard error that there is no X server."""
    logger = require("vtkmodules.vtkCommonCore").vtkLogger
    before = logger.GetCurrentVerbosityCutoff()
    logger.SetStderrVerbosity(logger.VERBOSITY_OFF)
    try:
        yield
    finally:
        logger.SetStderrVerbosity(before)


def render_scene(mesh: Any, options: ViewOptions, **look: Any) -> Image:
    """Return a picture (height, width, 3) of a pyvista mesh; `look` is passed to add_mesh."""
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
    """Return the sides of the boxes drawn for blocks, (3,), in the points' unit.

    The lattice's steps if the coordinates along each axis are equally spaced levels; otherwise
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
    return np.full(3, 1.08 * spacing if spacing > 0 else 1.0)  # no gaps between rotated cubes


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
    """Return which blocks are visible: those without two layers of others in front of them.

    Layers are counted on a grid of the blocks' size with closed holes, so that the outer layers of
    bodies off the lattice have no gaps.
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
    """Return a pyvista mesh of the shaded faces of boxes that face the viewer.

    Boxes along the axes need no light: in parallel projection at most three faces of each are
    visible, the same for all boxes, and each direction has its own brightness.
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
        Values to colour by.
    limits : (float, float)
        Values of the first and the last colour; values beyond have these colours.
    colours : str
        Name of the colour map in Matplotlib.
    bands : int
        Number of distinct colours.
    sides : (3,) or (n, 3) float, optional
        Sides of the boxes, for all or for each; by default found from the points (`block_sides`).
    options : ViewOptions, optional
        Direction of view, and size.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    InputError
        Shapes that do not agree, values that are not finite, or limits that do not increase.
    MissingDependencyError
        Nothing can be drawn here; the message says what to install.
    """
    options = options or ViewOptions()
    P, v = check_body(points, values)
    if not limits[0] < limits[1]:
        raise InputError(f"limits must rise, but are {limits}")
    check_rendering()
    P = P - P.mean(axis=0)  # graphics cards compute in single precision
    box = block_sides(P) if sides is None else np.asarray(sides, dtype=np.float64)
    if box.shape not in ((3,), P.shape) or not (box > 0).all():
        raise InputError(f"sides must be positive and of shape (3,) or {P.shape}")
    towards = _view_axes(options)[2]
    shown = np.flatnonzero(_seen(P, np.atleast_2d(box).min(axis=0), towards))
    shown = shown[:: -(-len(shown) // options.max_blocks)]
    palette = require("matplotlib").colormaps[colours].resampled(bands)
    rgb = palette((v[shown] - limits[0]) / (limits[1] - limits[0]))[:, :3]
    boxes = _boxes(P[shown], box if box.ndim == 1 else box[shown], rgb, towards)
    return render_scene(boxes, options, scalars="colour", rgb=True, lighting=False)


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
