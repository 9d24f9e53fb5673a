"""A triangular prism whose quadrilaterals are split: numbering, border, convexity.

Corners 0, 1, 2 are a, b, c and 3, 4, 5 those above them.  Quadrilaterals are split from the lower
of the earlier to the upper of the later corner (``geounfold.prisms``), so that the border is made
of eight triangles, and is the same from either side of a face that two prisms share.
"""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Bools, Floats

TRIANGLES = (
    *((0, 2, 1), (3, 4, 5)),
    *((0, 1, 4), (0, 4, 3)),
    *((1, 2, 5), (1, 5, 4)),
    *((2, 0, 5), (0, 3, 5)),
)
"""The border, outward if a, b, c are counter-clockwise seen from above."""

EDGES = tuple(
    sorted({(min(f[k - 1], f[k]), max(f[k - 1], f[k])) for f in TRIANGLES for k in range(3)})
)
"""The border's twelve edges, lower corner first."""

_FOLD = 1e-3
"""Share of the size by which every fold of the border must bulge out to be convex.

Wachspress coordinates change from linear to bilinear on a split quadrilateral within a depth of
about its bulge.  Measured at the faces of four folded bodies' control meshes: with bulges from
1e-6 on, determinants of the map fall to -12; from 1e-4 on, to 0.07; from 1e-3 on, to 0.81.
"""


def opposite_edges() -> tuple[np.ndarray, Floats]:
    """Return the row in EDGES of the edge opposite to each corner of TRIANGLES, and its sense."""
    rows, sense = np.empty((8, 3), np.int64), np.empty((8, 3))
    for t, face in enumerate(TRIANGLES):
        for k in range(3):
            i, j = face[(k + 1) % 3], face[(k + 2) % 3]
            rows[t, k], sense[t, k] = EDGES.index((min(i, j), max(i, j))), 1.0 if i < j else -1.0
    return rows, sense


def fans() -> tuple[tuple[int, ...], ...]:
    """Return for each corner the triangles around it, rows of TRIANGLES, in one sense."""
    out = []
    for corner in range(6):
        # From the edge that leaves the corner in a triangle to the edge that returns to it.
        leaves, comes = {}, {}
        for t, face in enumerate(TRIANGLES):
            if corner in face:
                k = face.index(corner)
                leaves[face[(k + 1) % 3]], comes[t] = t, face[(k + 2) % 3]
        around = [min(comes)]
        while len(around) < len(comes):
            around.append(leaves[comes[around[-1]]])
        out.append(tuple(around))
    return tuple(out)


def cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (3, ...)."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def dot(a: Floats, b: Floats) -> Floats:
    """Return the dot products of vectors (3, ...)."""
    out: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return out


def face_normals(corners: Floats) -> Floats:
    """Return the normals of TRIANGLES, twice their areas long, (3, 8, n) of corners (3, 6, n)."""
    i, j, k = np.array(TRIANGLES).T
    return cross(corners[:, j] - corners[:, i], corners[:, k] - corners[:, i])


def convex(corners: Floats) -> Bools:
    """Return which prisms (n, 6, 3) are strictly convex, every split quadrilateral bulging out.

    A bulge of less than a thousandth of the prism's size counts as none, and as not convex: on a
    plane quadrilateral Wachspress coordinates are bilinear, not those of the split one.
    """
    C = np.ascontiguousarray(corners.transpose(2, 1, 0))
    normal = face_normals(C)
    size = np.sqrt(np.max([dot(e, e) for e in (C[:, j] - C[:, i] for i, j in EDGES)], axis=0))
    least = _FOLD * size * np.sqrt(dot(normal, normal))
    heights = []
    for t, face in enumerate(TRIANGLES):
        rest = [c for c in range(6) if c not in face]
        heights.append([dot(normal[:, t], C[:, c] - C[:, face[0]]) for c in rest])
    height = np.array(heights)  # (8, 3, n)
    out: Bools = (height < -least[:, None]).all(axis=(0, 1)) | (height > least[:, None]).all(
        axis=(0, 1)
    )
    return out
