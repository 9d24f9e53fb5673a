"""The scale of the spread: standard deviations that hold the errors of bodies of known truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.quality.uncertainty.spread import Spread


@dataclass(frozen=True)
class Mix:
    """How mean squares of members add up to a variance, along or across the layers.

    Attributes
    ----------
    weights : mapping of float
        Factor on the mean square of every kind of member.
    local : float
        Share that is taken at the block itself; the rest is the mean over the body.
    floor : float
        Standard deviation that is always there, in blocks.
    """

    weights: Mapping[str, float]
    local: float
    floor: float

    def deviation(self, squares: Mapping[str, Floats]) -> Floats:
        """Return the standard deviation of every block, (n,), working units.

        Parameters
        ----------
        squares : mapping of (n,) float
            Mean square of the members of each kind, working units squared.
        """
        total = np.full(len(next(iter(squares.values()))), self.floor**2)
        for name, square in squares.items():
            blended = self.local * square + (1 - self.local) * square.mean()
            total += self.weights[name] * blended
        out: Floats = np.sqrt(total)
        return out


ALONG = Mix(
    weights={
        "in_cell": 0.029,
        "stiffness": 1.1,
        "rim": 1.6,
        "sides": 0.19,
        "left_out": 0.022,
        "hull_level": 0.0012,
        "pin_line": 0.005,
        "slip": 0.00015,
        "noise": 0.91,
    },
    local=0.88,
    floor=0.0024,
)
ACROSS = Mix(
    weights={
        "in_cell": 0.0081,
        "stiffness": 1.8,
        "rim": 6.5,
        "sides": 0.97,
        "left_out": 0.034,
        "hull_level": 0.0033,
        "pin_line": 0.01,
        "slip": 0.11,
        "noise": 0.91,
    },
    local=0.88,
    floor=0.0024,
)
"""Along and across the layers.

Fitted to 106 random bodies of 33 families, seeds 910000 + 100 family + 0 to 3, none of which set
another threshold: the largest likelihood of Student's t (4 degrees of freedom, as bodies differ in
how well their members tell), with bands of 90 % that hold 90 % of the blocks, every body once.
`tests/soak/uncertainty.py` shows what they hold on other bodies.
"""


def calibrated(spread: Spread) -> Floats:
    """Return the standard deviations of every block's place along and across the layers, (n, 2).

    Parameters
    ----------
    spread : Spread
        Of the members of one body.
    """
    along, across = ALONG.deviation(spread.along), ACROSS.deviation(spread.across)
    return np.stack([along, across], axis=1)
