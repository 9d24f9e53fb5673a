"""Pictures of a cross-check: cuts through meshes of tetrahedra, and figures side by side.

Flat drawings by matplotlib, which need no rendering.  Every ``draw_`` function returns a Figure
that belongs to no window.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, TetMesh
from geounfold.geometry.tet_shapes import radius_ratios
from geounfold.report.plots.style import BOTTOM, RIM, TOP, UNDECIDED, require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = (TOP, BOTTOM, UNDECIDED, RIM)


def cut_polygons(mesh: TetMesh, axis: int, at: float) -> tuple[Floats, np.ndarray]:
    """Return the polygons in which a plane across an axis cuts tetrahedra.

    Parameters
    ----------
    mesh : TetMesh
        The tetrahedra.
    axis : int
        0, 1 or 2: x, y or z is constant on the plane.
    at : float
        Coordinate of the plane; tetrahedra that only touch the plane are not cut.

    Returns
    -------
    polygons : (m, 4, 2) float
        Corners in the other two coordinates, in order; the last corner of a triangle twice.
    element : (m,) int
        The tetrahedron of each polygon.
    """
    height = mesh.V[mesh.T, axis] - at
    # Corners above the plane come first: one, two or three of them.
    order = np.argsort(-height, axis=1, kind="stable")
    sorted_height = np.take_along_axis(height, order, axis=1)
    above = (sorted_height > 0).sum(axis=1)
    cut = np.flatnonzero((above > 0) & (sorted_height[:, 3] < 0) & (above < 4))
    pairs = np.array([[[0, 1], [0, 2], [0, 3], [0, 3]], [[0, 2], [0, 3], [1, 3], [1, 2]]])
    three = np.array([[0, 3], [1, 3], [2, 3], [2, 3]])
    edges = np.concatenate([pairs, three[None]])[above[cut] - 1]
    T = np.take_along_axis(mesh.T[cut], order[cut], axis=1)
    h = sorted_height[cut]
    ends = [np.take_along_axis(T, edges[..., k], axis=1) for k in (0, 1)]
    heights = [np.take_along_axis(h, edges[..., k], axis=1) for k in (0, 1)]
    share = (heights[0] / (heights[0] - heights[1]))[..., None]
    points = (1 - share) * mesh.V[ends[0]] + share * mesh.V[ends[1]]
    return np.delete(points, axis, axis=2), cut


def draw_cuts(meshes: Mapping[str, TetMesh], axis: int, at: float) -> Figure:
    """Draw the same cut through several meshes, tetrahedra coloured by their radius ratio.

    Parameters
    ----------
    meshes : mapping of str to TetMesh
        Meshes by title, in the same coordinates.
    axis, at
        The plane, as in `cut_polygons`.

    Raises
    ------
    InputError
        The plane cuts nothing.
    """
    figure: Figure = require("matplotlib.figure").Figure(
        figsize=(12.5, 5.5), dpi=100, layout="constrained"
    )
    collection = require("matplotlib.collections").PolyCollection
    colours: dict[str, Any] = {"cmap": "cividis", "clim": (0.0, 1.0)}
    names = [name for k, name in enumerate("xyz") if k != axis]
    axes = np.ravel(figure.subplots(1, len(meshes), sharey=True, squeeze=False))
    for ax, (title, mesh) in zip(axes, meshes.items(), strict=True):
        polygons, element = cut_polygons(mesh, axis, at)
        if not len(element):
            raise InputError(f"{title}: the plane {'xyz'[axis]} = {at:g} cuts no tetrahedron")
        ratio = radius_ratios(mesh.V, mesh.T[element])
        ax.add_collection(
            collection(
                polygons,
                array=ratio,
                edgecolors="white",
                linewidths=0.4,
                **colours,
            )
        )
        ax.autoscale_view()
        ax.set_aspect("equal")
        ax.set(title=f"{title}, cut at {'xyz'[axis]} = {at:g}", xlabel=names[0])
    axes[0].set_ylabel(names[1])
    figure.colorbar(
        axes[0].collections[0], ax=list(axes), label="radius ratio (1 regular, 0 flat)", shrink=0.6
    )
    return figure


def draw_histograms(values: Mapping[str, Mapping[str, Floats]]) -> Figure:
    """Draw histograms of the same quantities for several meshes, as shares.

    Parameters
    ----------
    values : mapping of str to mapping of str to array
        Values by quantity, then by mesh.

    Raises
    ------
    InputError
        There are no values, or some are not finite.
    """
    figure: Figure = require("matplotlib.figure").Figure(
        figsize=(12.5, 3.6), dpi=100, layout="constrained"
    )
    axes = np.ravel(figure.subplots(1, len(values), squeeze=False))
    for ax, (label, group) in zip(axes, values.items(), strict=True):
        flat = {name: np.ravel(v) for name, v in group.items()}
        together = np.concatenate([*flat.values(), np.empty(0)])
        if not together.size or not np.isfinite(together).all():
            raise InputError(f"{label}: needs finite values, and at least one")
        bins = np.linspace(together.min(), together.max(), 61)
        for k, (name, each) in enumerate(flat.items()):
            weights = np.full(len(each), 1 / max(len(each), 1))
            style = {"histtype": "step", "linestyle": ("-", "--", ":")[k % 3], "linewidth": 1.6}
            ax.hist(each, bins, weights=weights, label=name, color=_COLOURS[k % 4], **style)
        ax.set(xlabel=label, ylabel="share")
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    return figure
