"""Grades that are known everywhere: random fields in the unfolded space of a body.

A field is a sum of many waves with random directions, lengths and phases, drawn so that it has a
given covariance (the spectral method: Shinozuka 1971; Chiles and Delfiner 2012, section 7.5.4).
It has a value at every point, so samples, blocks and checks need no grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats
from geounfold.synthetic.profile import require_finite, require_positive

FIELD_KINDS = ("spherical", "exponential", "gaussian")
"""Covariance models; fields of the first two are rough, those of the last smooth."""

_SCALE = np.log(20.0)  # 5 % of the covariance is left at the range
_ROWS = 4096  # points evaluated at a time
_TABLE = 200_000  # entries in the table of the spherical model's spectrum
_CYCLES = 2000.0  # largest wave number in that table, in cycles per range


@dataclass(frozen=True)
class GradeField:
    """A random field of grades in the truth coordinates (u, v, w) of a simulated body.

    Parameters
    ----------
    kind : {"spherical", "exponential", "gaussian"}
        Covariance of the gaussian field from which the grades are made.
    ranges : (float, float, float)
        Distances along u, v and w at which 5 % of the covariance is left (spherical: none).
    seed : int
        Seed of the waves; equal seeds give equal fields.
    mean : float
        Mean of the grades, without layers.
    deviation : float
        Standard deviation of the grades, without layers.
    lognormal : bool
        Whether grades are lognormal, with this mean and deviation, instead of gaussian.
    layers : tuple of float
        Values added to the grades in layers of equal stratigraphic height, from the bottom up.
    waves : int
        Number of waves in the sum.

    Raises
    ------
    OptionError
        A value is outside its valid ones.
    """

    kind: str
    ranges: tuple[float, float, float]
    seed: int = 0
    mean: float = 0.0
    deviation: float = 1.0
    lognormal: bool = False
    layers: tuple[float, ...] = ()
    waves: int = 2000

    def __post_init__(self) -> None:
        if self.kind not in FIELD_KINDS:
            raise OptionError(f"field {self.kind!r} is not one of: {', '.join(FIELD_KINDS)}")
        if np.shape(self.ranges) != (3,):
            raise OptionError(f"ranges must be three numbers, not {self.ranges!r}")
        for value in self.ranges:
            require_positive("ranges", value)
        require_finite("mean", self.mean)
        require_positive("deviation", self.deviation)
        for value in self.layers:
            require_finite("layers", value)
        if self.lognormal and not self.mean > 0:
            raise OptionError(f"the mean of lognormal grades must be above 0, not {self.mean!r}")
        for name in ("seed", "waves"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < (name == "waves"):
                raise OptionError(f"{name} must be a whole number from {int(name == 'waves')} up")

    def at(self, truth: Floats, stratigraphic: Floats | None = None) -> Floats:
        """Return the grades (n,) at points.

        Parameters
        ----------
        truth : (n, 3) float
            Truth coordinates of a body (`Body.truth`, `Sheet.unfold`).
        stratigraphic : (n,) float, optional
            0 at the bottom, 1 at the top; needed if there are layers.

        Raises
        ------
        OptionError
            There are layers, but no stratigraphic coordinates.
        """
        z = self.standard(truth)
        if self.lognormal:
            spread = np.sqrt(np.log1p((self.deviation / self.mean) ** 2))
            grade = self.mean * np.exp(spread * z - 0.5 * spread**2)
        else:
            grade = self.mean + self.deviation * z
        if not self.layers:
            return np.asarray(grade)
        if stratigraphic is None:
            raise OptionError("layered grades need the points' stratigraphic coordinates")
        layer = np.floor(np.asarray(stratigraphic) * len(self.layers)).astype(np.int64)
        return np.asarray(grade + np.asarray(self.layers)[np.clip(layer, 0, len(self.layers) - 1)])

    def standard(self, truth: Floats) -> Floats:
        """Return the gaussian field of the grades, (n,), with mean 0 and variance 1."""
        frequency, phase = self._spectrum
        place = np.asarray(truth, dtype=np.float64) / self.ranges
        out = np.empty(len(place))
        for start in range(0, len(place), _ROWS):
            rows = slice(start, start + _ROWS)
            out[rows] = np.cos(place[rows] @ frequency.T + phase).sum(axis=1)
        out *= np.sqrt(2.0 / self.waves)
        return out

    @cached_property
    def _spectrum(self) -> tuple[Floats, Floats]:
        """Wave vectors (waves, 3) in units of the ranges, and phases (waves,)."""
        rng = np.random.default_rng(self.seed)
        direction = rng.normal(size=(self.waves, 3))
        if self.kind == "gaussian":  # exp(-a h^2): components of variance 2 a
            frequency = direction * np.sqrt(2 * _SCALE)
        elif self.kind == "exponential":  # exp(-a h): Student's t of one degree of freedom
            frequency = direction * _SCALE / np.abs(rng.normal(size=(self.waves, 1)))
        else:
            length = np.interp(rng.random(self.waves), *_ball_spectrum())
            frequency = direction / np.linalg.norm(direction, axis=1)[:, None] * length[:, None]
        return frequency, rng.uniform(0, 2 * np.pi, self.waves)


def _ball_spectrum() -> tuple[Floats, Floats]:
    """Return the cumulative distribution of the spherical model's wave numbers: share, number.

    The model is the overlap of two balls of diameter 1, so its spectrum is the square of a ball's
    transform, (sin x - x cos x)^2 / x^6 with x half the wave number.
    """
    x = np.linspace(0, _CYCLES * np.pi, _TABLE + 1)[1:]
    density = (np.sin(x) - x * np.cos(x)) ** 2 / x**4
    share = np.concatenate([[0.0], np.cumsum(density)])
    return share / share[-1], 2 * np.concatenate([[0.0], x])
