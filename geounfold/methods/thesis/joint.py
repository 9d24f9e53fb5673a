"""One plane triangulation for top and bottom (the thesis's Algorithm 1), and its border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial import Delaunay, cKDTree

from geounfold.backends.igl import SurfaceIndex
from geounfold.errors import ControlMeshError
from geounfold.geometry.measures import triangle_areas
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh

ON_FACE = 1e-6  # distance in plan below which a point lies in the footprint, working units
NEIGHBOURS = 24  # vertices that give the slope past the border
CELL = 1.5  # working units: spacing of the border's vertices
MERGE = 0.5  # working units: least distance in plan between vertices of the two surfaces


class PlanField:
    """Values on a height field as functions of the position in plan.

    Inside the footprint they are linear in each triangle.  Past it (and in its holes) they
    continue from the nearest point of the footprint along the slope there: that of the plane
    fitted to the nearest vertices.

    Parameters
    ----------
    mesh : TriMesh
        The height field, (n, 3) vertices; only its plan is used.
    values : (n, d) float
        Values at its vertices.
    """

    def __init__(self, mesh: TriMesh, values: Floats) -> None:
        self.xy, self.F, self.values = mesh.V[:, :2], mesh.F, values
        self._index = SurfaceIndex(np.column_stack([self.xy, np.zeros(len(self.xy))]), mesh.F)
        self._tree = cKDTree(self.xy)

    def at(self, q: Floats) -> tuple[Floats, Bools]:
        """Return the values (k, d) at positions (k, 2), and which lie in the footprint."""
        distance, face, near = self._index.closest(np.column_stack([q, np.zeros(len(q))]))
        corners = self.F[face]
        share = barycentric(self.xy[corners], near[:, :2])
        out = np.einsum("ij,ijk->ik", share, self.values[corners])
        inside = distance <= ON_FACE
        away = ~inside
        if away.any():
            step = q[away] - near[away, :2]
            out[away] += np.einsum("ij,ijk->ik", step, self._slope(near[away, :2]))
        return out, inside

    def _slope(self, q: Floats) -> Floats:
        """Return the values' derivative by x and y, (k, 2, d), fitted around positions (k, 2)."""
        _, near = self._tree.query(q, k=min(NEIGHBOURS, len(self.xy)))
        step = self.xy[near] - self.xy[near].mean(axis=1, keepdims=True)
        rise = self.values[near] - self.values[near].mean(axis=1, keepdims=True)
        normal = np.einsum("nki,nkj->nij", step, step)
        normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        out: Floats = np.linalg.solve(normal, np.einsum("nki,nkd->nid", step, rise))
        return out


def barycentric(corners: Floats, q: Floats) -> Floats:
    """Return the barycentric coordinates (k, 3) of positions (k, 2) in triangles (k, 3, 2).

    >>> barycentric(np.array([[[0.0, 0], [2, 0], [0, 2]]]), np.array([[0.5, 1]])).tolist()
    [[0.25, 0.25, 0.5]]
    """
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    share = np.linalg.solve(sides, (q - corners[:, 0])[:, :, None])[:, :, 0]
    return np.column_stack([1 - share.sum(axis=1), share])


@dataclass(frozen=True, eq=False)
class JointPlan:
    """The plane triangulation that top and bottom share.

    Attributes
    ----------
    xy : (n, 2) float
        Vertices: the top's, then the bottom's that were inserted, then the border's.
    F : (m, 3) int
        Triangles, counter-clockwise.
    block_face : (blocks,) int
        Triangle holding each block in plan.
    """

    xy: Floats
    F: Ints
    block_face: Ints


def joint_plan(blocks: Floats, top: PlanField, bottom: PlanField) -> JointPlan:
    """Return the Delaunay triangulation of both surfaces' vertices, and a border around it.

    Inserting the vertices of each surface into the other by Delaunay insertion, as Algorithm 1
    does, ends at the Delaunay triangulation of both, whatever the order.  A vertex within MERGE of
    an existing one is not inserted.  The border consists of the nodes of a grid of cells under the
    blocks and one ring more, except under both surfaces.  Triangles are kept if they hold a block
    or if their centre lies in such a cell.

    Parameters
    ----------
    blocks : (k, 2) float
        Blocks in plan.
    top, bottom : PlanField
        The two surfaces.

    Raises
    ------
    ControlMeshError
        A block lies in no triangle.
    """
    gap = cKDTree(top.xy).query(bottom.xy)[0]
    inner = np.concatenate([top.xy, bottom.xy[gap > MERGE]])
    low, mask = _cells(blocks)
    nodes = low + CELL * np.argwhere(_corners(mask))
    both = top.at(nodes)[1] & bottom.at(nodes)[1]
    far = cKDTree(inner).query(nodes)[0] > 0.75 * CELL
    xy = np.concatenate([inner, nodes[far & ~both]])
    mesh = Delaunay(xy)
    F = mesh.simplices.astype(np.int64)
    area = triangle_areas(xy, F)
    F[area < 0] = F[area < 0][:, [0, 2, 1]]
    held = mesh.find_simplex(blocks)
    if (held < 0).any():
        raise ControlMeshError(f"{(held < 0).sum()} blocks lie outside the joint triangulation")
    at = np.floor((xy[F].mean(axis=1) - low) / CELL).astype(np.int64)
    at = np.clip(at, 0, np.array(mask.shape) - 1)
    keep = mask[at[:, 0], at[:, 1]] & (np.abs(area) > 1e-9)
    keep[held] = True
    return JointPlan(xy, F[keep], (np.cumsum(keep) - 1)[held])


def _cells(blocks: Floats) -> tuple[Floats, Bools]:
    """Return the grid's origin and the cells that hold blocks, dilated by one ring."""
    low = blocks.min(axis=0) - 2.5 * CELL
    at = np.floor((blocks - low) / CELL).astype(np.int64)
    mask = np.zeros(at.max(axis=0) + 3, dtype=bool)
    mask[at[:, 0], at[:, 1]] = True
    wide: Bools = binary_dilation(mask, np.ones((3, 3), dtype=bool))
    return low, wide


def _corners(mask: Bools) -> Bools:
    """Return which grid nodes are corners of the cells of a mask."""
    node = np.zeros((mask.shape[0] + 1, mask.shape[1] + 1), dtype=bool)
    for i in (0, 1):
        for j in (0, 1):
            node[i : i + mask.shape[0], j : j + mask.shape[1]] |= mask
    return node
