"""Conditional simulation: equally likely grades on the blocks, which honour the samples.

Normal scores of the grades are simulated by turning bands in the unfolded space (gstlearn;
Matheron 1973, Advances in Applied Probability 5: 439-468), without regard to the samples. Simple
kriging of what the samples differ by makes the simulation pass through them (Chiles and Delfiner
2012, section 7.3.1). Scores are then carried back to the distribution of the samples' grades.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from geounfold.backends import gstlearn
from geounfold.errors import BackendError, OptionError, check_whole
from geounfold.estimation.estimate import Estimation
from geounfold.estimation.fit import fit_variogram
from geounfold.estimation.kriging import estimated, gathered, krige
from geounfold.estimation.normal_scores import normal_scores
from geounfold.estimation.variogram import Variogram


def with_realisations(result: Estimation, count: int, *, seed: int = 1) -> Estimation:
    """Return an estimation with so many realisations, columns ``GRADE_r1``, ``GRADE_r2`` ...

    Realisations are of points, nugget and all, as samples are; their mean over a block's points is
    a block's. They have the search of the estimation, and its distribution is that of the samples,
    each with the same weight.

    Parameters
    ----------
    result : Estimation
        Of points, by kriging. If its variogram was given, not fitted, the scores have the same
        ranges and shares of the nugget.
    count : int
        Number of realisations, 1 or more.
    seed : int
        1 or more; the same seed gives the same realisations.

    Raises
    ------
    OptionError
        A number is outside its valid range, or the estimation is of blocks or has no variogram.
    BackendError
        gstlearn failed.
    """
    check_whole("realisations", count, 1)
    check_whole("seed", seed, 1)
    if result.support is not None:
        raise OptionError("realisations are of points: leave out the block size")
    if result.variogram is None:
        raise OptionError("realisations need a variogram: take ordinary or simple kriging")
    flat, there = result.samples, estimated(result.blocks.flag)
    given = gathered(flat.points, flat.grades, flat.holes)
    scores = normal_scores(given.values)
    model = result.variogram
    if result.fitted is not None:
        model = fit_variogram(given.points, scores, holes=given.holes, scores=False).model
    model = _of_unit_sill(model)
    places = result.carried.points[there]
    # Each place once and sorted: a block at a sample's place is that sample, nugget and all, and
    # the answer does not depend on the order of the input rows.
    every, place = np.unique(np.concatenate([given.points, places]), axis=0, return_inverse=True)
    free = gstlearn.turning_bands(every, model.parts, model.axes, count, seed)
    noise = np.random.default_rng(seed).normal(size=(count, len(every))).T
    free = (free + np.sqrt(model.nugget) * noise)[place.ravel()]
    out = np.full((len(there), count), np.nan)
    grades, at = np.sort(given.values), (np.arange(len(scores)) + 0.5) / len(scores)
    for k in range(count):
        own, new = free[: len(scores), k], free[len(scores) :, k]
        off = krige(
            given.points, scores - own, places, model, result.neighbourhood,
            method="simple", mean=0.0, holes=given.holes,
        )  # fmt: skip
        lost = int(np.count_nonzero(~estimated(off.flag)))
        if lost:
            raise BackendError(f"kriging systems of {lost} blocks could not be solved for scores")
        out[there, k] = np.interp(ndtr(new + off.estimate), at, grades)
    return replace(result, realisations=out)


def _of_unit_sill(model: Variogram) -> Variogram:
    """Return a model in proportion whose sill is 1."""
    parts = tuple(replace(s, sill=s.sill / model.sill) for s in model.structures)
    return replace(model, nugget=model.nugget / model.sill, structures=parts)
