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
        NMD of each cloud with its own neighbours, epsilon with the folded body's neighbours kept
        and with each cloud's own; without a truth the ratios of far distances, with one what
        `quality.TruthQuality` holds.

    Raises
    ------
    InputError
        Too few points, or points that coincide with all their neighbours.
    """
    k = quality.NEIGHBOURS if neighbours is None else neighbours
    facts: dict[str, Any] = {"points": len(folded), "neighbours": k}
    clouds = {"nmd_folded": folded, "nmd_unfolded": unfolded}
    if truth is not None:
        clouds["nmd_truth"] = truth
    for name, cloud in clouds.items():
        facts[name] = _statistics(quality.nmd(cloud, quality.neighbours(cloud, k)))
    own = {"epsilon_own_neighbours": _statistics(quality.epsilon(folded, unfolded, k, "own"))}
    if truth is not None:
        return facts | quality.compare_with_truth(folded, unfolded, truth, k).summary() | own
    ratios = quality.distance_ratios(folded, unfolded, quality.random_pairs(len(folded)))
    epsilon = {"epsilon_folded": _statistics(quality.epsilon(folded, unfolded, k))}
    return facts | epsilon | own | {"distances": _statistics(np.abs(ratios - 1))}


def _statistics(values: Floats) -> dict[str, float]:
    return asdict(quality.Statistics.of(values))
