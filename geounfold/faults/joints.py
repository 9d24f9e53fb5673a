"""Joints: pairs of fault blocks that end at the same fault, one on each side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.fault_surface import FaultSurface
from geounfold.faults.block_map import BlockMap, Pose
from geounfold.faults.cutoffs import MIDDLE, Cutoff, strike_of
from geounfold.geometry.mesh import Floats

_COMMON = 3.0  # blocks of strike that two cut-offs must have in common
_NEAR = 4.0  # blocks between two cut-offs that need none


@dataclass(frozen=True, eq=False)
class Joint:
    """Two fault blocks that end at one fault.

    Attributes
    ----------
    foot, hanging : int
        Fault blocks below and above the fault.
    fault : int
        Which of the run's surfaces.
    surface : FaultSurface
        The fault, refined, working units.
    low, high : Cutoff
        Cut-offs of the footwall block and of the hanging-wall block.
    weld : (k, 3) float or None
        Places at which both blocks touch and no fault parts them, working units.
    """

    foot: int
    hanging: int
    fault: int
    surface: FaultSurface
    low: Cutoff
    high: Cutoff
    weld: Floats | None = None

    def turned(self, block: int) -> Joint:
        """Return the joint after a fault block was turned over."""
        return replace(
            self,
            low=self.low.turned() if block == self.foot else self.low,
            high=self.high.turned() if block == self.hanging else self.high,
        )

    @property
    def shorter(self) -> float:
        """Length of the shorter one of the two cut-offs, summed over levels."""
        return float(min(self.low.length.sum(), self.high.length.sum()))


def facing(low: Cutoff, high: Cutoff, surface: FaultSurface, up: Floats) -> bool:
    """Return whether cut-offs on the two sides of a fault lie side by side along it."""
    strike = strike_of(surface, low.folded[::5], up)
    a, b = low.folded @ strike, high.folded @ strike
    common = min(a.max(), b.max()) - max(a.min(), b.min())
    away = cKDTree(low.folded).query(high.folded)[0]
    return bool(common > _COMMON or np.median(away) < _NEAR)


def _left(block: BlockMap, cut: Cutoff, along: Floats) -> float:
    """Return +1 if a block lies left of its cut-off, seen along a folded direction; else -1."""
    middle = cut.rows(MIDDLE)
    flat, place = cut.flat[middle, :2], cut.folded[middle] @ along
    order = np.argsort(place, kind="stable")
    few = max(1, len(order) // 4)
    ahead = flat[order[-few:]].mean(axis=0) - flat[order[:few]].mean(axis=0)
    layers = block.carry(block.points[:: max(1, len(block.points) // 500)])
    to = layers.flat[layers.there, :2].mean(axis=0) - flat.mean(axis=0)
    return float(np.sign(ahead[0] * to[1] - ahead[1] * to[0]))


def first_poses(
    blocks: Sequence[BlockMap], joints: Sequence[Joint], up: Floats
) -> tuple[list[BlockMap], list[Joint], list[Pose], list[int]]:
    """Return blocks, turned over if need be, joints, first poses, and the group of each block.

    Blocks are joined one by one to the largest block of their group, the longest cut-offs first. A
    block takes the pose that brings its cut-off to the places nearest to it in the folded space.
    """
    blocks, joints = list(blocks), list(joints)
    poses = [Pose() for _ in blocks]
    group = [-1] * len(blocks)
    for start in range(len(blocks)):
        if group[start] >= 0:
            continue
        group[start] = start
        while True:
            open_ = [
                (j.shorter, -number)
                for number, j in enumerate(joints)
                if (group[j.foot] == start) != (group[j.hanging] == start)
            ]
            if not open_:
                break
            joint = joints[-max(open_)[1]]
            fixed, moving = joint.foot, joint.hanging
            if group[moving] == start:
                fixed, moving = moving, fixed
            joint = _same_way_up(blocks, joints, joint, fixed, moving, up)
            poses[moving] = _nearest_pose(joint, moving, poses[fixed])
            group[moving] = start
    return blocks, joints, poses, group


def _same_way_up(
    blocks: list[BlockMap], joints: list[Joint], joint: Joint, fixed: int, moving: int, up: Floats
) -> Joint:
    """Turn a block over, in the lists, if both would lie on the same side; return the joint."""
    own, other = (joint.low, joint.high) if fixed == joint.foot else (joint.high, joint.low)
    strike = strike_of(joint.surface, own.folded[::5], up)
    if _left(blocks[fixed], own, strike) != _left(blocks[moving], other, strike):
        return joint
    number = joints.index(joint)
    blocks[moving] = blocks[moving].turned()
    joints[:] = [j.turned(moving) for j in joints]
    return joints[number]


def _nearest_pose(joint: Joint, moving: int, fixed: Pose) -> Pose:
    """Return the turn and shift that bring the moving block's cut-off to the other's."""
    own, other = (joint.high, joint.low) if moving == joint.hanging else (joint.low, joint.high)
    a, b = own.rows(MIDDLE), other.rows(MIDDLE)
    near = b[cKDTree(other.folded[b]).query(own.folded[a])[1]]
    target, q = fixed.place(other.flat[near])[:, :2], own.flat[a, :2]
    H = (q - q.mean(axis=0)).T @ (target - target.mean(axis=0))
    pose = Pose(float(np.arctan2(H[0, 1] - H[1, 0], H[0, 0] + H[1, 1])))
    return replace(pose, shift=target.mean(axis=0) - pose.turn @ q.mean(axis=0))
