"""What the spread of other unfoldings adds to the trust."""

from __future__ import annotations

from geounfold.quality.trust import WORDS, Reason, Trust
from geounfold.quality.uncertainty.position import PositionUncertainty

FAIR, POOR = 0.8, 1.1
"""Expected root mean square error, in blocks, from which trust is at most fair, and poor.

On the bodies of the calibration, answers within 0.3 blocks of the truth were expected to be off by
0.78 at most; the four more than a block off, by 1.15 to 2.3.
"""


def with_spread_reason(
    trust: Trust | None, off: PositionUncertainty | None, scale: float
) -> Trust | None:
    """Return a run's trust with what the spread shows; as it is if either was not measured.

    Parameters
    ----------
    trust : Trust or None
        The judge's.
    off : PositionUncertainty or None
        How far off the places may be, in the data's unit.
    scale : float
        Side of a block, in that unit.
    """
    if trust is None or off is None:
        return trust
    blocks = float(off.summary()["rms"]) / scale
    if not blocks > FAIR:
        return trust
    worst = int((off.sd**2).sum(axis=1).argmax())
    x, y, z = off.points[worst].tolist()
    reason = Reason(
        f"other unfoldings that the blocks allow differ from this one by {blocks:.1f} blocks",
        (x, y, z),
        len(off.points),
        "look at sd_along and sd_across: give the surfaces by --top and --bottom, or cut off ends "
        "that are not the layer's",
        "poor" if blocks > POOR else "fair",
    )
    every = sorted((*trust.reasons, reason), key=lambda r: -WORDS.index(r.word))
    return Trust(every[0].word, tuple(every))
