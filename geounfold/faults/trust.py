"""How far to trust the joining of fault blocks: reasons for the judge."""

from __future__ import annotations

import numpy as np

from geounfold.faults.result import MOST_OVERLAP, FaultFit, FaultResult
from geounfold.faults.slips import Slips
from geounfold.quality.trust import WORDS, Reason, Trust

MISFIT = 1.0
"""Blocks by which the cut-offs of two blocks may miss each other.

Measured on 57 bodies: 0.03 to 0.8 on those joined to within 0.5 blocks, but 1.1 and 1.8 on two of
them, in which a fault ends at another; 2.6 on one that is 1.6 blocks off.
"""

_SIGN = 1.0  # blocks of throw beyond which its sign counts
_STEADY = 1.0  # blocks by which throws may scatter about a steady change along strike


def with_fault_reasons(trust: Trust | None, found: FaultResult) -> Trust | None:
    """Return a run's trust with what its faults show; None if nothing was judged."""
    if trust is None:
        return None
    told = [reason for fault in found.faults for reason in _reasons(fault, found.scale)]
    if found.overlap > MOST_OVERLAP:
        told.append(
            Reason(
                f"{found.overlap:.1%} of the blocks overlap those of another fault block in the "
                "flat space",
                *(None, 0),
                "compare the fault surfaces with the blocks",
                "poor",
            )
        )
    if len(set(found.groups)) > 1:
        what = f"the fault blocks form {len(set(found.groups))} groups that no fault joins"
        do = "compare the fault surfaces with the blocks, or extend them"
        told.append(Reason(what, None, 0, do, "poor"))
    every = sorted((*trust.reasons, *told), key=lambda reason: -WORDS.index(reason.word))
    return Trust(every[0].word if every else trust.word, tuple(every))


def _reasons(fault: FaultFit, scale: float) -> list[Reason]:
    """Return what speaks against a fault's joining."""
    name = f"fault {fault.fault} between fault blocks {fault.foot} and {fault.hanging}"
    look = "compare the fault surface with the blocks, and look at the layers on both sides"
    s = fault.slips
    if s is None:
        what = f"{name}: no cut-offs meet in the flat space"
        return [Reason(what, None, 0, look, "poor")]
    x, y, z = np.median(s.foot, axis=0).tolist()
    where, count, out = (x, y, z), len(s.gap), []
    if s.misfit > MISFIT:
        what = f"{name}: the cut-offs miss each other by {s.misfit:.1f} blocks"
        out.append(Reason(what, where, count, look, "poor"))
    if _turns(s, scale):
        what = f"{name}: the throw changes its sign without a steady change along strike"
        out.append(Reason(what, where, count, look, "poor"))
    if not fault.slip_known and s.misfit <= MISFIT:
        what = f"{name}: nothing marks the slip along strike; the least slip was taken"
        do = "give --slip-direction if it is known"
        out.append(Reason(what, where, count, do, "fair"))
    return out


def _turns(s: Slips, scale: float) -> bool:
    """Return whether throws change their sign and scatter about a straight line along strike."""
    throw = s.throw / scale
    low, high = np.quantile(throw, (0.1, 0.9))
    if low > -_SIGN or high < _SIGN:
        return False
    level = s.foot[:, :2] - s.foot[:, :2].mean(axis=0)
    along = level @ np.linalg.svd(level, full_matrices=False)[2][0] / scale
    rows = np.stack([np.ones(len(along)), along], axis=1)
    fit = np.linalg.lstsq(rows, throw, rcond=None)[0]
    return bool(np.std(throw - rows @ fit) > _STEADY)
