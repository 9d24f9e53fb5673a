"""The figures that `geounfold quality` prints."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from geounfold import quality
from geounfold.mesh import Floats


def quality_figures(
    folded: Floats, unfolded: Floats, truth: Floats | None, neighbours: int | None
) -> dict[str, Any]:
    """Return how an unfolding keeps distances, and how far from a truth it lies.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The same points row by row, in the same unit.
    truth : (n, 3) float, optional
        Where they truly lay.
    neighbours : int, optional
        Per point; 26 without.

    Returns
    -------
    dict
        Without a truth: epsilon with the folded body's neighbours kept and with each cloud's
        own, and the ratios of far distances. With one: see `quality.TruthQuality`.

    Raises
    ------
    InputError
        Too few points, or points that coincide with all their neighbours.
    """
    k = quality.NEIGHBOURS if neighbours is None else neighbours
    facts: dict[str, Any] = {"points": len(folded), "neighbours": k}
    if truth is not None:
        return facts | quality.compare_with_truth(folded, unfolded, truth, k).summary()
    ratios = quality.distance_ratios(folded, unfolded, quality.random_pairs(len(folded)))
    own = quality.epsilon(folded, unfolded, k, "own")
    return facts | {
        "epsilon_folded": asdict(quality.Statistics.of(quality.epsilon(folded, unfolded, k))),
        "epsilon_own_neighbours": asdict(quality.Statistics.of(own)),
        "distances": asdict(quality.Statistics.of(np.abs(ratios - 1))),
    }
