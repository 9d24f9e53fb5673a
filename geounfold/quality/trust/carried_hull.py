"""The faces of a body's hull in the folded and in the flat space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geounfold.geometry.measures import triangle_areas
from geounfold.geometry.mesh import Floats, Ints, TriMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.mesh_map import UnfoldingMap

_LEAST_RISE = 1e-3
"""Least rise of the stratigraphic coordinate per block that counts: a thickness of 1000 blocks."""


@dataclass(frozen=True, eq=False)
class CarriedHull:
    """Faces of the hull that the map carries, working units.

    Attributes
    ----------
    folded, flat : (m, 3, 3) float
        Corners of each face in both spaces.
    level : (m,) float
        Stratigraphic coordinate at its centre: 0 at the bottom, 1 at the top.
    thickness : (m,) float
        Thickness of the layer there: flat height over stratigraphic coordinate.
    lost : float
        Share of the hull's area that the map does not carry.
    face : (m,) int
        Number of each face in the hull.
    """

    folded: Floats
    flat: Floats
    level: Floats
    thickness: Floats
    lost: float
    face: Ints

    @cached_property
    def flat_normal(self) -> Floats:
        """Normals in the flat space, (m, 3), as long as twice the face's area."""
        P = self.flat
        return np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0])

    @cached_property
    def flat_area(self) -> Floats:
        """Areas in the flat space, (m,)."""
        out: Floats = np.linalg.norm(self.flat_normal, axis=1) / 2
        return out

    @cached_property
    def up(self) -> Floats:
        """Vertical component of the flat unit normal, (m,): 1 looks up, -1 down."""
        out: Floats = self.flat_normal[:, 2] / np.maximum(2 * self.flat_area, 1e-12)
        return out

    @cached_property
    def flat_centre(self) -> Floats:
        """Centres in the flat space, (m, 3)."""
        out: Floats = self.flat.mean(axis=1)
        return out

    @cached_property
    def folded_centre(self) -> Floats:
        """Centres in the folded space, (m, 3)."""
        out: Floats = self.folded.mean(axis=1)
        return out

    def stretch(self, faces: Ints) -> tuple[Floats, Floats]:
        """Return the largest |log| of a principal stretch, flat over folded, and the folded area.

        Parameters
        ----------
        faces : (k,) int
            Which faces.
        """
        A, B = (_metric(corners[faces]) for corners in (self.folded, self.flat))
        ratio = np.linalg.solve(A + 1e-9 * np.eye(2), B)
        mean, product = np.trace(ratio, axis1=1, axis2=2) / 2, np.linalg.det(ratio)
        spread = np.sqrt(np.maximum(mean**2 - product, 0.0))
        squared = np.maximum([mean + spread, mean - spread], 1e-9)
        area: Floats = np.sqrt(np.maximum(np.linalg.det(A), 0.0)) / 2
        return np.abs(0.5 * np.log(squared)).max(axis=0), area


def _metric(corners: Floats) -> Floats:
    """Return the Gram matrices of two edges of each triangle, (k, 2, 2)."""
    E = corners[:, 1:] - corners[:, :1]
    out: Floats = E @ E.swapaxes(1, 2)
    return out


def carry_hull(hull: TriMesh, mapping: UnfoldingMap) -> CarriedHull:
    """Return the faces of a hull in both spaces.

    Parameters
    ----------
    hull : TriMesh
        The closed surface around the body's blocks, working units.
    mapping : UnfoldingMap
        The finished map.
    """
    carried = mapping.carry(mapping.frame.to_world(hull.V))
    element = np.maximum(carried.element, 0)
    used, row = np.unique(element, return_inverse=True)
    thickness = _thickness(mapping.whole, used)[row]
    there = (carried.placed & (carried.element >= 0))[hull.F].all(axis=1)
    F = hull.F[there]
    area = triangle_areas(hull.V, hull.F)
    return CarriedHull(
        folded=hull.V[F],
        flat=carried.points[F] / mapping.frame.scale,
        level=carried.stratigraphic[F].mean(axis=1),
        thickness=thickness[F].mean(axis=1),
        lost=float(area[~there].sum() / area.sum()),
        face=np.flatnonzero(there),
    )


def _thickness(mesh: ControlMesh, elements: Ints) -> Floats:
    """Return the thickness of the layer in tetrahedra: flat height over level, (k,)."""
    T = mesh.folded.T[elements]
    Q, level = mesh.unfolded.V[T], mesh.stratigraphic[T]
    edges = Q[:, 1:] - Q[:, :1] + 1e-9 * np.eye(3)
    rise = np.linalg.solve(edges, (level[:, 1:] - level[:, :1])[..., None])[:, 2, 0]
    out: Floats = 1 / np.maximum(rise, _LEAST_RISE)
    return out
