"""Slips: vectors between places on the two walls of a fault that meet in the flat space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.working_frame import Frame
from geounfold.faults.block_map import BlockMap, Pose
from geounfold.faults.cutoffs import LEVELS, MIDDLE
from geounfold.faults.joints import Joint
from geounfold.geometry.mesh import Floats, Ints

_BESIDE = 1.0  # blocks along the fault between places that meet

VALUES = ("throw", "heave", "strike_slip", "slip", "rake")
"""What is measured of every slip vector."""


@dataclass(frozen=True, eq=False)
class Slips:
    """Places on both walls of a fault that meet in the flat space.

    Attributes
    ----------
    foot, hanging : (k, 3) float
        The places, in the data's coordinates.
    vector : (k, 3) float
        From foot to hanging wall, in the data's unit.
    throw, heave, strike_slip, slip, rake : (k,) float
        Down, along the dip's direction and along strike (the dip on its right: left-lateral is
        positive); length; angle from strike in the fault, degrees, -90 for a normal fault.
    level : (k,) int
        Index in LEVELS.
    gap : (k,) float
        Distance that is left between the places in the flat space, in blocks; negative if the
        blocks overlap there.
    length : (k,) float
        Length of cut-off of each, in blocks.
    """

    foot: Floats
    hanging: Floats
    vector: Floats
    throw: Floats
    heave: Floats
    strike_slip: Floats
    slip: Floats
    rake: Floats
    level: Ints
    gap: Floats
    length: Floats

    @property
    def misfit(self) -> float:
        """Root mean square of the gaps, in blocks."""
        return float(np.sqrt((self.gap**2).mean()))

    def area(self, sign: float) -> float:
        """Return the area of gaps (sign 1) or overlaps (-1) at the middle level, in blocks."""
        mid = self.level == MIDDLE
        return float((np.maximum(sign * self.gap[mid], 0) * self.length[mid]).sum())


def slips_of(
    joint: Joint, blocks: Sequence[BlockMap], poses: Sequence[Pose], frame: Frame
) -> Slips | None:
    """Return the slips of a joint; None if no places meet.

    Parameters
    ----------
    joint : Joint
        The joint.
    blocks : sequence of BlockMap
        The fault blocks.
    poses : sequence of Pose
        Their poses.
    frame : Frame
        The working frame.
    """
    low, high = joint.low, joint.high
    A, B = poses[joint.foot].place(low.flat), poses[joint.hanging].place(high.flat)
    along = low.tangent @ poses[joint.foot].turn.T
    own = blocks[joint.foot]
    some = own.carry(own.points[:: max(1, len(own.points) // 1000)])
    centre = poses[joint.foot].place(some.flat[some.there])[:, :2].mean(axis=0)
    a, b, gaps = [], [], []
    for level in range(len(LEVELS)):
        c, d = high.rows(level), low.rows(level)
        if min(len(c), len(d)) < 3:
            continue
        q = d[cKDTree(A[d, :2]).query(B[c, :2])[1]]
        apart = B[c, :2] - A[q, :2]
        ok = np.abs((apart * along[q]).sum(axis=1)) < _BESIDE
        normal = np.stack([-along[q, 1], along[q, 0]], axis=1)
        outward = np.sign((normal * (A[q, :2] - centre)).sum(axis=1))
        a.append(q[ok])
        b.append(c[ok])
        gaps.append(((apart * normal).sum(axis=1) * outward)[ok])
    if not sum(map(len, a)):
        return None
    return _measured(joint, np.concatenate(a), np.concatenate(b), np.concatenate(gaps), frame)


def _measured(joint: Joint, a: Ints, b: Ints, gap: Floats, frame: Frame) -> Slips:
    """Return the slips between samples a of the footwall and b of the hanging wall."""
    places = joint.low.folded[a]
    foot, hanging = frame.to_world(places), frame.to_world(joint.high.folded[b])
    vector = hanging - foot
    normal = joint.surface.normal[joint.surface.sides(places).face] @ frame.rotation
    normal = normal * np.where(normal[:, 2] < 0, -1.0, 1.0)[:, None]
    dip = normal * [1.0, 1.0, 0.0]
    dip = dip / np.maximum(np.linalg.norm(dip, axis=1, keepdims=True), 1e-9)
    strike = np.stack([-dip[:, 1], dip[:, 0], 0 * dip[:, 0]], axis=1)
    throw, heave = -vector[:, 2], (vector * dip).sum(axis=1)
    sideways = (vector * strike).sum(axis=1)
    up_dip = -np.sign(throw) * np.hypot(throw, heave)
    return Slips(
        foot=foot,
        hanging=hanging,
        vector=vector,
        throw=throw,
        heave=heave,
        strike_slip=sideways,
        slip=np.linalg.norm(vector, axis=1),
        rake=np.degrees(np.arctan2(up_dip, sideways)),
        level=joint.high.level[b],
        gap=gap,
        length=joint.high.length[b],
    )
