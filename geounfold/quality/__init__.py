"""How good an unfolding is: neighbour distances, distortion, and distance from a truth.

The thesis's measure (NMD and epsilon, equations 2.2 to 2.5) is nearly blind to folds: a body left
as it is scores 0 against itself and less than many real unfoldings against the truth.  It is
therefore given together with what doing nothing would score, and with measures that see folds.

All lengths are in the unit of the points given; ratios are unfolded over folded (or answer over
truth), so that 1 is no change.
"""

from geounfold.quality.blocks import (
    BlockQuality,
    Quality,
    assess,
    assess_points,
    block_quality,
    neighbour_gradients,
)
from geounfold.quality.neighbour_distances import (
    NEIGHBOURS,
    epsilon,
    lattice_epsilon,
    neighbours,
    nmd,
)
from geounfold.quality.statistics import Statistics
from geounfold.quality.torn_blocks import SUSPECT, TORN, torn_blocks
from geounfold.quality.truth import (
    TruthQuality,
    aligned_rms,
    compare_with_truth,
    distance_ratios,
    random_pairs,
    spacing_ratios,
)

__all__ = [
    "NEIGHBOURS",
    "SUSPECT",
    "TORN",
    "BlockQuality",
    "Quality",
    "Statistics",
    "TruthQuality",
    "aligned_rms",
    "assess",
    "assess_points",
    "block_quality",
    "compare_with_truth",
    "distance_ratios",
    "epsilon",
    "lattice_epsilon",
    "neighbour_gradients",
    "neighbours",
    "nmd",
    "random_pairs",
    "spacing_ratios",
    "torn_blocks",
]
