"""Points carried by a map, and the distances of their round trip."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints

FEW, FEW_SHARE = 20, 0.001
"""Number of blocks, and share of them, the larger of which may be left without an image."""

INSIDE, EXTRAPOLATED, OUTSIDE = "inside", "extrapolated", "outside"


@dataclass(frozen=True, eq=False)
class Carried:
    """Points carried by a map.

    Attributes
    ----------
    points : (n, 3) float
        Images of the points; NaN if a point lies beyond the map's reach.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top; NaN if there is no image.
    inside : (n,) bool
        Whether the point lies in the control mesh.
    placed : (n,) bool
        Whether the point has an image: inside, or within the map's reach.
    element : (n,) int
        Tetrahedron that carried each point; -1 if there is no image. Indices from
        ``len(control.folded.T)`` on are those of the shell.
    distance : (n,) float
        Distance from the control mesh, in the points' space and unit; 0 inside.
    block : (n,) int or None
        Fault block whose mesh carried each point, -1 if there is no image; None without faults.
    unsolved : int
        Number of points in a prism for which Newton's method found no image; they are not
        placed. Always 0 with the coordinates of tetrahedra.
    """

    points: Floats
    stratigraphic: Floats
    inside: Bools
    placed: Bools
    element: Ints
    distance: Floats
    unsolved: int = 0
    block: Ints | None = None

    @property
    def location(self) -> np.ndarray:
        """``inside``, ``extrapolated`` or ``outside`` (no image) for every point, (n,) of str."""
        words = np.array([OUTSIDE, EXTRAPOLATED, INSIDE])
        return words[self.placed * (1 + self.inside.astype(np.int8))]

    def spread(self, rows: Bools) -> Carried:
        """Return these points as the True rows (m,) among others that have no image."""
        if rows.all():
            return self
        out = Carried(
            points=np.full((len(rows), 3), np.nan),
            stratigraphic=np.full(len(rows), np.nan),
            inside=np.zeros(len(rows), bool),
            placed=np.zeros(len(rows), bool),
            element=np.full(len(rows), -1, dtype=np.int64),
            distance=np.full(len(rows), np.nan),
            unsolved=self.unsolved,
            block=None if self.block is None else np.full(len(rows), -1),
        )
        if out.block is not None and self.block is not None:
            out.block[rows] = self.block
        for name in ("points", "stratigraphic", "inside", "placed", "element", "distance"):
            getattr(out, name)[rows] = getattr(self, name)
        return out

    def without(self, rows: Ints) -> Carried:
        """Return the results with some points (k,) left empty, as if the map did not reach them."""
        out = replace(
            self,
            points=self.points.copy(),
            stratigraphic=self.stratigraphic.copy(),
            inside=self.inside.copy(),
            placed=self.placed.copy(),
            element=self.element.copy(),
            block=None if self.block is None else self.block.copy(),
        )
        if out.block is not None:
            out.block[rows] = -1
        out.points[rows] = out.stratigraphic[rows] = np.nan
        out.inside[rows] = out.placed[rows] = False
        out.element[rows] = -1
        return out

    def part(self, rows: slice | Ints) -> Carried:
        """Return the results of some of the points."""
        return Carried(
            self.points[rows],
            self.stratigraphic[rows],
            self.inside[rows],
            self.placed[rows],
            self.element[rows],
            self.distance[rows],
            block=None if self.block is None else self.block[rows],
        )


@dataclass(frozen=True, eq=False)
class Returned:
    """Round trip of points through the map and its inverse.

    Attributes
    ----------
    largest : float
        Largest distance between a point and its return; 0 if no point returns.
    lost : (n,) bool
        Whether the image lies in the mesh, but no inverse was found.
    """

    largest: float
    lost: Bools


def few(count: int) -> int:
    """Return how many of some blocks may be left without an image.

    One of 110,834 and six of 75,590 made otherwise proved runs fail.
    """
    return max(FEW, int(FEW_SHARE * count))


def checked_points(points: Floats) -> Floats:
    """Return points as finite, contiguous (n, 3) floats, or raise InputError."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"points must have shape (n, 3), but have {P.shape}")
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise InputError(f"{len(bad)} points are not finite, the first is row {bad[0] + 1}")
    return P
