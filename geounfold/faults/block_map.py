"""One fault block unfolded, and its pose in the flat space that all fault blocks share."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Bools, Floats, TetMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods import BodyFit, SurfacePair
from geounfold.methods.turned_over import turned_over


@dataclass(frozen=True, eq=False)
class Pose:
    """Place of a fault block in the joint flat space: ``R(angle) (x + shear z) + shift``, z kept.

    Layers stay level and volumes stay as they are. Each block was unfolded with a pin line of its
    own, which the shear brings together.

    Attributes
    ----------
    angle : float
        Turn about the vertical, radians.
    shift : (2,) float
        Working units.
    shear : (2,) float
        Layer-parallel shift per unit of height.
    """

    angle: float = 0.0
    shift: Floats = field(default_factory=lambda: np.zeros(2))
    shear: Floats = field(default_factory=lambda: np.zeros(2))

    @property
    def turn(self) -> Floats:
        """The turn as a matrix, (2, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, -s], [s, c]])

    def place(self, flat: Floats) -> Floats:
        """Return points (n, 3) of the block's own flat space in the joint one."""
        out = np.array(flat, dtype=np.float64)
        out[:, :2] = (flat[:, :2] + flat[:, 2:] * self.shear) @ self.turn.T + self.shift
        return out

    def unplace(self, joint: Floats) -> Floats:
        """Return points (n, 3) of the joint flat space in the block's own one."""
        out = np.array(joint, dtype=np.float64)
        out[:, :2] = (joint[:, :2] - self.shift) @ self.turn - joint[:, 2:] * self.shear
        return out

    def moved(self, step: Floats) -> Pose:
        """Return the pose after a step (5,): angle, shift and shear."""
        return Pose(self.angle + float(step[0]), self.shift + step[1:3], self.shear + step[3:])

    def jacobian(self, flat: Floats) -> Floats:
        """Return the derivative of the place of points (n, 3) by angle, shift, shear, (n, 2, 5)."""
        R = self.turn
        by_angle = np.array([[-R[1, 0], -R[0, 0]], [R[0, 0], -R[1, 0]]])
        out = np.zeros((len(flat), 2, 5))
        out[:, :, 0] = (flat[:, :2] + flat[:, 2:] * self.shear) @ by_angle.T
        out[:, 0, 1] = out[:, 1, 2] = 1.0
        out[:, :, 3:] = flat[:, 2, None, None] * R
        return out


@dataclass(frozen=True, eq=False)
class Layers:
    """Points carried by a fault block's own map.

    Attributes
    ----------
    flat : (n, 3) float
        Own flat places, working units; NaN if there is none.
    level : (n,) float
        Stratigraphic coordinate.
    there : (n,) bool
        Whether the map carries the point.
    gradient : (n, 3, 3) float
        Derivative of the flat place by the folded one; NaN if there is none.
    """

    flat: Floats
    level: Floats
    there: Bools
    gradient: Floats


@dataclass(frozen=True, eq=False)
class BlockMap:
    """One fault block with its own map, in working units.

    Attributes
    ----------
    points : (n, 3) float
        Its blocks.
    fit : BodyFit
        Its stages.
    steps : (3,) float or None
        Sides of a block on the lattice.
    reach : float
        Distance past the control mesh to which its map carries.
    over : bool
        Whether its layers were turned over.
    """

    points: Floats
    fit: BodyFit
    steps: Floats | None
    reach: float
    over: bool = False

    @cached_property
    def map(self) -> UnfoldingMap:
        """The block's own map, in working units on both sides."""
        frame = Frame(np.zeros(3), np.eye(3), 1.0, self.steps, self.steps)
        if self.fit.control is None:
            raise TypeError("a fault block's method must have a control mesh")
        return UnfoldingMap(frame, self.fit.control, self.fit.shell, self.reach)

    @cached_property
    def tree(self) -> cKDTree:
        """Its blocks by place."""
        return cKDTree(self.points)

    def turned(self) -> BlockMap:
        """Return the block with top and bottom exchanged."""
        return replace(self, fit=turned_over(self.fit), over=not self.over)

    def carry(self, points: Floats, *, gradients: bool = False) -> Layers:
        """Return folded points (n, 3) in the block's own flat space."""
        carried = self.map.carry(points)
        slope = np.full((len(points), 3, 3), np.nan)
        rows = np.flatnonzero(carried.placed)
        if gradients and len(rows):
            slope[rows] = self.map.gradients(points[rows], carried.element[rows])
        return Layers(carried.points, carried.stratigraphic, carried.placed, slope)


def posed(fit: BodyFit, pose: Pose) -> BodyFit:
    """Return a fit whose flat side has taken its pose in the joint flat space."""

    def at(mesh: ControlMesh | None) -> ControlMesh | None:
        if mesh is None:
            return None
        flat = TetMesh(pose.place(mesh.unfolded.V), mesh.unfolded.T)
        return ControlMesh(mesh.folded, flat, mesh.stratigraphic)

    surfaces = {
        name: SurfacePair(
            pair.folded, pair.unfolded.with_vertices(pose.place(pair.unfolded.V)), pair.flattening
        )
        for name, pair in fit.surfaces.items()
    }
    return replace(fit, control=at(fit.control), shell=at(fit.shell), surfaces=surfaces)
