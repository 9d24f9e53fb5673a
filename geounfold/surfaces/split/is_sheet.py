"""Checks that a split surface is a sheet with two sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from geounfold.errors import NoSheetError
from geounfold.geometry.measures import triangle_areas
from geounfold.surfaces.split.result import SurfaceSplit

MIN_EXTENT = 4.5  # area of a side over the squared thickness below which there is no sheet ...


MIN_PARTED = 2.5  # ... the same where flanks are told from the sides ...


FLANKED = 0.15  # ... (share of the hull from which flanks are) ...


MIN_LENGTH = 5.0  # ... unless it is a strip of so many thicknesses in length


def side_extent(result: SurfaceSplit) -> tuple[float, float]:
    """Return the area of top and of bottom away from the rim, over the squared thickness."""
    area = triangle_areas(result.mesh.V, result.mesh.F) / result.median_thickness**2
    top, bottom = (float(area[(result.side == s) & ~result.rim].sum()) for s in (1, -1))
    return top, bottom


def side_length(result: SurfaceSplit) -> float:
    """Return how many thicknesses long the top is, along its surface."""
    rows = np.flatnonzero((result.side > 0) & ~result.beyond)
    if not len(rows):
        return 0.0
    number = np.full(len(result.side), -1)
    number[rows] = np.arange(len(rows))
    start, end = np.repeat(number[rows], 3), number[result.adjacency[rows]].ravel()
    start, end = start[end >= 0], end[end >= 0]
    centre = result.mesh.V[result.mesh.F[rows]].mean(axis=1)
    step = np.linalg.norm(centre[start] - centre[end], axis=1)
    links = sp.coo_array((step, (start, end)), (len(rows), len(rows))).tocsr()
    part = connected_components(links, directed=False)[1]
    far = int(np.argmax(part == np.bincount(part).argmax()))
    for _ in range(2):  # the face farthest from any face is one end of the longest way
        reach = np.asarray(dijkstra(links, indices=np.array([far])))[0]
        reach[~np.isfinite(reach)] = 0.0
        far = int(reach.argmax())
    return float(reach[far]) / result.median_thickness


def check_sheet(result: SurfaceSplit) -> None:
    """Raise NoSheetError where a side is too small for its thickness: a ball, a cube.

    Where ridges part the sides from flanks they are told from them by more than size, and the
    least extent is MIN_PARTED, flanks left out; a strip no wider than it is thick may be long
    instead.
    """
    extent = min(side_extent(result))
    if extent >= MIN_EXTENT:
        return
    area = triangle_areas(result.mesh.V, result.mesh.F) / result.median_thickness**2
    if area[result.beyond].sum() > FLANKED * area.sum():
        parted = min(float(area[(result.side == s) & ~result.beyond].sum()) for s in (1, -1))
        if parted >= MIN_PARTED or (parted >= 1 and side_length(result) >= MIN_LENGTH):
            return
    raise NoSheetError(
        "the body has no two opposite surfaces to flatten: each covers only "
        f"{extent:.1f} times its thickness squared (a sheet has at least {MIN_EXTENT:g}, or a "
        f"strip {MIN_LENGTH:g} times its thickness in length)"
    )
