"""Estimation in the unfolded space: variograms, search neighbourhoods, kriging and scores.

`variogram` holds the model and `fit` fits one to samples. `neighbourhood` selects the samples of
each target. `kriging` estimates points in one space; `estimate` carries samples and blocks to the
unfolded space and calls it. `exploration` computes the tables of exploratory data analysis.
`realisations` simulates grades that honour the samples. `scores` compares estimates with true
values and sums up tonnage and metal. gstlearn (extra ``geostat``) solves the kriging systems.
"""

from geounfold.estimation.declustering import Declustering, decluster
from geounfold.estimation.estimate import Estimation, estimate
from geounfold.estimation.experimental import FEWEST_SAMPLES, directional
from geounfold.estimation.exploration import Exploration, contact, explore, histogram, swath
from geounfold.estimation.fit import FittedVariogram, fit_variogram
from geounfold.estimation.flat_samples import FlatSamples, flat_samples
from geounfold.estimation.kriging import (
    FLAGS,
    METHODS,
    Estimates,
    cross_validate,
    hole_numbers,
    krige,
)
from geounfold.estimation.neighbourhood import Neighbourhood
from geounfold.estimation.scores import Scores, conservation, grade_tonnage, score
from geounfold.estimation.variogram import KINDS, Structure, Variogram, from_json, from_toml

__all__ = [
    "FEWEST_SAMPLES",
    "FLAGS",
    "KINDS",
    "METHODS",
    "Declustering",
    "Estimates",
    "Estimation",
    "Exploration",
    "FittedVariogram",
    "FlatSamples",
    "Neighbourhood",
    "Scores",
    "Structure",
    "Variogram",
    "conservation",
    "contact",
    "cross_validate",
    "decluster",
    "directional",
    "estimate",
    "explore",
    "fit_variogram",
    "flat_samples",
    "from_json",
    "from_toml",
    "grade_tonnage",
    "histogram",
    "hole_numbers",
    "krige",
    "score",
    "swath",
]
