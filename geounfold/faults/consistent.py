"""Joints that contradict the others are left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.block_cells import connected
from geounfold.body.working_frame import Frame
from geounfold.faults.block_map import BlockMap, Pose
from geounfold.faults.poses import JointView, PoseFit, solve_poses
from geounfold.faults.slips import slips_of
from geounfold.geometry.mesh import Floats

_MISFIT = 1.0  # blocks from which a joint may contradict the others
_BETTER = 0.6  # share of the others' misfit that is left without a joint that contradicts them


def consistent_poses(
    blocks: Sequence[BlockMap],
    views: list[JointView],
    poses: list[Pose],
    groups: Sequence[int],
    frame: Frame,
) -> tuple[PoseFit, list[str]]:
    """Return the poses, and the joints that were left out, one sentence each.

    A joint is left out if its blocks are joined by others too, it does not fit, and the others fit
    much better without it: two blocks that end at one fault side by side need not have met there.

    Parameters
    ----------
    blocks, views, poses, groups
        As `solve_poses` takes them.
    frame : Frame
        The working frame.
    """
    found = solve_poses(blocks, views, poses, groups)
    left_out: list[str] = []
    while True:
        misfit = _misfits(found, blocks, frame)
        worst = int(misfit.argmax()) if len(misfit) else -1
        if worst < 0 or misfit[worst] <= _MISFIT or not _spare(found.views, worst, len(blocks)):
            return found, left_out
        rest = [v for k, v in enumerate(found.views) if k != worst]
        without = solve_poses(blocks, rest, poses, groups)
        before = np.delete(misfit, worst)
        if _rms(_misfits(without, blocks, frame)) > _BETTER * _rms(before):
            return found, left_out
        j = found.views[worst].joint
        left_out.append(
            f"fault {j.surface.name} does not join fault blocks {j.foot} and {j.hanging}: their "
            f"cut-offs miss each other by {misfit[worst]:.1f} blocks, and the others fit without"
        )
        found = without


def _rms(misfit: Floats) -> float:
    return float(np.sqrt((misfit**2).mean())) if len(misfit) else 0.0


def _misfits(found: PoseFit, blocks: Sequence[BlockMap], frame: Frame) -> Floats:
    """Return the misfit of every joint, in blocks."""
    slips = [slips_of(v.joint, blocks, found.poses, frame) for v in found.views]
    return np.array([0.0 if s is None else s.misfit for s in slips])


def _spare(views: Sequence[JointView], number: int, count: int) -> bool:
    """Return whether a joint's blocks are joined by others too."""
    pairs = [(v.joint.foot, v.joint.hanging) for k, v in enumerate(views) if k != number]
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    label = connected(ends[:, 0], ends[:, 1], count)
    joint = views[number].joint
    return bool(label[joint.foot] == label[joint.hanging])
