"""How far to trust an unfolding: the body's own hull, carried through the finished map.

A certificate proves that a map is one-to-one; it does not prove that the layers are right.  The
hull does more: if the map is right, its top and bottom come to lie on levels 1 and 0 of the flat
space, and keep their lengths.  `carried_hull` carries it, `signs` measures it, `judge` gives the
word and the reasons.
"""

from geounfold.quality.trust.judge import (
    WORDS,
    Reason,
    Trust,
    grade,
    judge,
    judge_counted,
    out_of_layer,
    score,
)
from geounfold.quality.trust.signs import Signs, measure_signs

__all__ = [
    "WORDS",
    "Reason",
    "Signs",
    "Trust",
    "grade",
    "judge",
    "judge_counted",
    "measure_signs",
    "out_of_layer",
    "score",
]
