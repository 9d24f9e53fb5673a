"""Points that a map carried, and points that it brought back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints

INSIDE, EXTRAPOLATED, OUTSIDE = "inside", "extrapolated", "outside"


@dataclass(frozen=True, eq=False)
class Carried:
    """Points carried by a map.

    Attributes
    ----------
    points : (n, 3) float
        Their images; NaN where the point lies beyond the map's reach.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top; NaN where there is no image.
    inside : (n,) bool
        Whether the control mesh holds the point.
    placed : (n,) bool
        Whether the point has an image: inside, or within the map's reach.
    element : (n,) int
        The tetrahedron that carried each point: of the control mesh, from
        ``len(control.folded.T)`` on of the shell around it; -1 where there is no image.
    distance : (n,) float
        From the control mesh, in the space the points were given in and their unit; 0 inside.
    unsolved : int
        Points in a prism for which no image was found: its coordinates have no closed inverse.
        They have none, then, and are not placed; always 0 with the coordinates of tetrahedra.
    """

    points: Floats
    stratigraphic: Floats
    inside: Bools
    placed: Bools
    element: Ints
    distance: Floats
    unsolved: int = 0

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
        )
        for name in ("points", "stratigraphic", "inside", "placed", "element", "distance"):
            getattr(out, name)[rows] = getattr(self, name)
        return out

    def part(self, rows: slice) -> Carried:
        """Return what became of some of the points."""
        return Carried(
            self.points[rows],
            self.stratigraphic[rows],
            self.inside[rows],
            self.placed[rows],
            self.element[rows],
            self.distance[rows],
        )


@dataclass(frozen=True, eq=False)
class Returned:
    """How points came back.

    Attributes
    ----------
    largest : float
        Largest distance between a point and its return, over those that have both; else 0.
    lost : (n,) bool
        Points that did not come back though the mesh holds their image: no inverse was found.
    """

    largest: float
    lost: Bools


def checked_points(points: Floats) -> Floats:
    """Return points as finite, contiguous (n, 3) floats, or raise InputError."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"points must have shape (n, 3), but have {P.shape}")
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise InputError(f"{len(bad)} points are not finite, the first is row {bad[0] + 1}")
    return P
