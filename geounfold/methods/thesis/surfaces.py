"""Top and bottom of the thesis's method: two height fields from the orientation filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from geounfold.backends.igl import SurfaceIndex, boundary_loops, face_components
from geounfold.errors import NoSheetError, SplitError
from geounfold.geometry.measures import lengths, triangle_areas
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh
from geounfold.surfaces.split import split

LIFT = 1e-6  # start of a ray above its face, working units
HIDDEN = 0.05  # largest share of a side that may lie behind itself
TORN = 0.1  # largest share of a side that steep slopes may tear off
STEEP = 0.1
"""Largest share of the hull, away from its rim, that the filter may miss or put on the wrong side.

Measured: at most 0.08 on bodies that the method could unfold, 0.18 on the next.
"""
LIMITATION = "the thesis's method pairs top and bottom vertically and cannot hold an overhang"
CURE = "use --method sheet"


@dataclass(frozen=True, eq=False)
class Side:
    """One side of the hull as a height field.

    Attributes
    ----------
    mesh : TriMesh
        Its largest piece, vertical coordinate third.  Its faces point up, for the bottom too, and
        no vertical line meets it twice.
    height : float
        Mean height by area (on an even mesh that of the vertices), before the border was trimmed.
    hidden : float
        Share of the side's plan area that lay behind another part of the same side.
    pieces : float
        Share of the remaining plan area that lay in smaller pieces, which are dropped.
    """

    mesh: TriMesh
    height: float
    hidden: float
    pieces: float


def upright_frame(points: Floats, up: Floats | None, axis: str) -> Floats:
    """Return the axes along which surfaces are paired, as the rows of a proper rotation.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    up : (3,) float or None
        Direction towards the top; None for the working frame's third axis.
    axis : str
        ``principal``: the principal axes (section 3.2.1), the one of least extent third and
        pointing along ``up``.  ``up``: ``up`` itself third, and the principal axes across it.
    """
    direction = np.array([0.0, 0.0, 1.0]) if up is None else up / np.linalg.norm(up)
    q = points - points.mean(axis=0)
    if axis == "up":
        q = q - np.outer(q @ direction, direction)
    axes = np.asarray(np.linalg.eigh(q.T @ q)[1]).T[::-1].copy()
    looks = float(axes[2] @ direction) or float(axes[2, np.argmax(np.abs(axes[2]))])
    if looks < 0:
        axes[2] = -axes[2]
    if np.linalg.det(axes) < 0:
        axes[1] = -axes[1]
    return axes


def two_sides(hull: TriMesh, trim: int) -> tuple[Side, Side, float]:
    """Return top and bottom of a closed, outward hull with a vertical third coordinate.

    The third value is the share of the hull, away from its rim, that the filter missed or put on
    the wrong side.

    Raises
    ------
    SplitError
        A side is missing or overhangs itself, or slopes are too steep for the filter.
    NoSheetError
        The body has no two opposite surfaces.
    """
    side, steep = _filter(hull)
    if steep > STEEP:
        raise SplitError(
            f"{steep:.0%} of the surface is too steep or overturned: {LIMITATION}; {CURE}"
        )
    top = _one_side(hull, side == 1, 1.0, trim)
    return top, _one_side(hull, side == -1, -1.0, trim), steep


def _filter(hull: TriMesh) -> tuple[Ints, float]:
    """Return the side of each face by its normal's third component, (m,), and ``steep``."""
    up = np.array([0.0, 0.0, 1.0])
    true = split(hull, "signed", up)  # raises if the body has no sheet in any direction
    try:
        side = split(hull, "normal", up).side
    except NoSheetError as error:
        raise SplitError(
            f"seen along its axis of least extent the body has no top and bottom: {LIMITATION}; "
            f"{CURE}"
        ) from error
    area = np.where(true.rim, 0.0, triangle_areas(hull.V, hull.F))
    return side, float(area[side != true.side].sum() / area.sum())


def _one_side(hull: TriMesh, faces: Bools, outward: float, trim: int) -> Side:
    """Return the part of the chosen faces that is seen from ``outward`` (+1 above, -1 below)."""
    name = "top" if outward > 0 else "bottom"
    mesh, _ = hull.submesh(faces)
    behind = _hidden(mesh, outward)
    plan = outward * triangle_areas(mesh.V[:, :2], mesh.F)
    hidden = float(plan[behind].sum() / plan.sum())
    if hidden > HIDDEN:
        raise SplitError(
            f"{hidden:.0%} of the {name} lies behind another part of it: {LIMITATION}; {CURE}"
        )
    mesh, pieces = _largest_piece(TriMesh(mesh.V, mesh.F[~behind]))
    height = _mean_height(mesh)
    for _ in range(trim):
        mesh, torn = _largest_piece(_without_border(mesh, name))
        pieces = 1 - (1 - pieces) * (1 - torn)
    if pieces > TORN:
        raise SplitError(f"steep slopes tear {pieces:.0%} of the {name} off: {LIMITATION}; {CURE}")
    F = mesh.F if outward > 0 else mesh.F[:, ::-1]
    return Side(TriMesh(mesh.V, F), height, hidden, pieces)


def _mean_height(mesh: TriMesh) -> float:
    """Return the mean of a surface's third coordinate, by area."""
    return float(np.average(mesh.V[mesh.F, 2].mean(axis=1), weights=triangle_areas(mesh.V, mesh.F)))


def _largest_piece(mesh: TriMesh) -> tuple[TriMesh, float]:
    """Return the piece (across edges) of the largest plan area, and the others' share of it."""
    fans = _split_fans(mesh)
    part = face_components(fans.F)
    area = np.abs(np.bincount(part, triangle_areas(fans.V[:, :2], fans.F)))
    return fans.submesh(part == area.argmax())[0], float(1 - area.max() / area.sum())


def _without_border(mesh: TriMesh, name: str) -> TriMesh:
    """Return the mesh without the faces that touch its outer border."""
    V, F = mesh.V, mesh.F
    loops = boundary_loops(F)
    around = [lengths(V, np.stack([loop, np.roll(loop, -1)], axis=1)).sum() for loop in loops]
    outer = np.zeros(len(V), dtype=bool)
    outer[loops[int(np.argmax(around))]] = True
    keep = ~outer[F].any(axis=1)
    if not keep.any():
        raise SplitError(f"nothing is left of the {name} without its border; {CURE}")
    return TriMesh(V, F[keep])


def _hidden(mesh: TriMesh, outward: float) -> Bools:
    """Return which faces have another face vertically in front of their centroid, (m,)."""
    ray = np.broadcast_to([0.0, 0.0, outward], (len(mesh.F), 3))
    hit, _ = SurfaceIndex(mesh.V, mesh.F).first_hit(mesh.V[mesh.F].mean(axis=1) + LIFT * ray, ray)
    return hit >= 0


def _split_fans(mesh: TriMesh) -> TriMesh:
    """Return the mesh with a vertex of its own for each fan of faces that met in a point."""
    F = mesh.F
    corner = np.arange(F.size).reshape(F.shape)
    start, end = F, F[:, [1, 2, 0]]
    key = (np.minimum(start, end) * len(mesh.V) + np.maximum(start, end)).ravel()
    order = np.argsort(key, kind="stable")
    twin = np.flatnonzero(key[order][1:] == key[order][:-1])
    i, j = order[twin], order[twin + 1]
    ahead = corner[:, [1, 2, 0]].ravel()
    # The hull is oriented: a shared edge runs from a to b in one face and b to a in the other.
    rows, columns = np.concatenate([i, ahead[i]]), np.concatenate([ahead[j], j])
    joined = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(F.size, F.size))
    count, label = connected_components(joined, directed=False)
    V = np.empty((count, 3))
    V[label] = mesh.V[F.ravel()]
    faces: Ints = label.reshape(F.shape).astype(np.int64)
    return TriMesh(V, faces)
