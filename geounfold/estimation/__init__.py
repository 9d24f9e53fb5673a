"""Estimation in the unfolded space: variograms, neighbourhoods, kriging, how good it is.

`variogram` holds the model, `fit` finds one, `neighbourhood` chooses samples, `kriging` estimates
points in one space, `estimate` carries samples and blocks there and back, `exploration` looks at
the samples first, `scores` judges. The systems are solved by gstlearn (extra ``geostat``).
"""

from geounfold.estimation.estimate import Estimation, FlatSamples, estimate, flat_samples
from geounfold.estimation.exploration import Exploration, contact, explore, histogram, swath
from geounfold.estimation.fit import FEWEST_SAMPLES, FittedVariogram, directional, fit_variogram
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
from geounfold.estimation.variogram import KINDS, Structure, Variogram, from_json

__all__ = [
    "FEWEST_SAMPLES",
    "FLAGS",
    "KINDS",
    "METHODS",
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
    "directional",
    "estimate",
    "explore",
    "fit_variogram",
    "flat_samples",
    "from_json",
    "grade_tonnage",
    "histogram",
    "hole_numbers",
    "krige",
    "score",
    "swath",
]
