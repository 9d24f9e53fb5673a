"""Quality of an unfolding: neighbour distances, distortion, and distance from a truth.

`neighbour_distances` holds the thesis's measure (NMD and epsilon, equations 2.2 to 2.5), which
`lattice_neighbours` computes faster for blocks on a lattice.  `blocks` holds the distortion of
every block, `truth` the comparison with a known truth, `torn_blocks` the blocks that were separated
from a neighbour.

The thesis's measure hardly detects folds: a body left folded has epsilon 0 against itself, and
less than many real unfoldings against the truth.  Epsilon is therefore given beside epsilon of the
folded body itself, and beside measures that do detect folds.

All lengths are in the unit of the points given.  Ratios are unfolded over folded, or answer over
truth, so 1 means no change.
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
