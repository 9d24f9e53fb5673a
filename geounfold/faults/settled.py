"""What settles the slip along a fault, and how well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.faults.block_map import Pose
from geounfold.faults.cutoffs import LEVELS
from geounfold.faults.poses import JointView, PoseRules
from geounfold.geometry.mesh import Floats

_SHAPE = 1.0
"""Standard deviation in blocks of the slip along a fault by the cut-offs' shape alone, up to which
that shape settles it. Measured by the whole fit without outlines, on 57 bodies: 0.4 to 0.8 if the
shape settles it, 0.9 to 4 if only the prior does."""


def settled_by(v: JointView, poses: Sequence[Pose], rules: PoseRules) -> str:
    """Return what settles a joint's slip along the fault."""
    if v.welds:
        return "weld"
    if v.given:
        return "given"
    if v.used == 2 and not all(m.plane for m in v.marks):
        return "outline"
    return "shape" if shape_sd(v, poses, rules) <= _SHAPE else "prior"


def _axis(v: JointView, poses: Sequence[Pose]) -> Floats:
    """Return the main direction of a joint's cut-offs in the joint flat plane, (2,)."""
    tangents = [
        cut.tangent @ poses[block].turn.T
        for block, cut in ((v.joint.foot, v.joint.low), (v.joint.hanging, v.joint.high))
    ]
    both = np.concatenate(tangents)
    out: Floats = np.linalg.eigh(both.T @ both)[1][:, 1]
    return out


def shape_sd(v: JointView, poses: Sequence[Pose], rules: PoseRules) -> float:
    """Return the standard deviation of the slip along a fault by its cut-offs' shape, in blocks."""
    axis = _axis(v, poses)
    across = np.array([-axis[1], axis[0]])
    worst = 0.0
    for block, cut in ((v.joint.foot, v.joint.low), (v.joint.hanging, v.joint.high)):
        tangent = cut.tangent @ poses[block].turn.T
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        place = poses[block].place(cut.flat)[:, :2]
        place = place - place.mean(axis=0)
        swing = np.stack([-place[:, 1], place[:, 0]], axis=1)
        rows = np.stack([normal @ axis, normal @ across, (normal * swing).sum(axis=1)], axis=1)
        weight = cut.length / (rules.along * len(LEVELS) * rules.normal**2)
        N = (rows * weight[:, None]).T @ rows + np.diag([1e-9, 1e-9, rules.turn**-2])
        worst = max(worst, float(np.sqrt(np.linalg.inv(N)[0, 0])))
    return worst


def along_sd(v: JointView, poses: Sequence[Pose], covariance: Floats) -> float:
    """Return the standard deviation of the slip along a fault by the whole fit, in blocks."""
    axis, row = _axis(v, poses), np.zeros(len(covariance))
    for block, cut, sign in (
        (v.joint.foot, v.joint.low, -1.0),
        (v.joint.hanging, v.joint.high, 1.0),
    ):
        middle = cut.flat.mean(axis=0)[None]
        row[5 * block : 5 * block + 5] += sign * axis @ poses[block].jacobian(middle)[0]
    return float(np.sqrt(max(float(row @ covariance @ row), 0.0)))
