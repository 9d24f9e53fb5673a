"""Mean, standard deviation, 95th percentile and maximum of a set of values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints


@dataclass(frozen=True)
class Statistics:
    """Mean, standard deviation, 95th percentile and maximum of a set of values."""

    mean: float
    std: float
    p95: float
    max: float

    @classmethod
    def of(cls, values: Floats) -> Statistics:
        """Return the statistics of values of any shape.

        Raises
        ------
        InputError
            There are no values, or some are not finite.

        Examples
        --------
        >>> Statistics.of(np.array([1.0, 3.0]))
        Statistics(mean=2.0, std=1.0, p95=2.9, max=3.0)
        """
        values = np.asarray(values, dtype=np.float64)
        if values.size == 0:
            raise InputError("there are no values to summarise")
        if not np.isfinite(values).all():
            bad = int(np.count_nonzero(~np.isfinite(values)))
            raise InputError(f"{bad} of {values.size} values are not finite")
        p95 = float(np.percentile(values, 95))
        return cls(float(values.mean()), float(values.std()), p95, float(values.max()))

    @classmethod
    def weighted(cls, values: Floats, counts: Ints) -> Statistics:
        """Return the statistics of values (n,) that occur so many times each.

        Examples
        --------
        >>> Statistics.weighted(np.array([3.0, 1.0]), np.array([1, 3]))
        Statistics(mean=1.5, std=0.8660254037844386, p95=3.0, max=3.0)
        """
        there = counts > 0
        order = np.argsort(values[there], kind="stable")
        v, n = values[there][order], counts[there][order]
        mean = float(np.average(v, weights=n))
        std = float(np.sqrt(np.average((v - mean) ** 2, weights=n)))
        at = int(np.searchsorted(np.cumsum(n), 0.95 * n.sum()))
        return cls(mean, std, float(v[at]), float(v[-1]))


class RunningStatistics:
    """Statistics of values that are seen in batches; the 95th percentile to 0.1 %.

    Values are counted in classes whose bounds grow by 0.1 % from 1e-7 to 1e4.
    """

    _LEAST, _RATIO, _CLASSES = 1e-7, 1.001, 25_400

    def __init__(self) -> None:
        self.count = 0
        self._sum = self._square = self._largest = 0.0
        self._classes = np.zeros(self._CLASSES, np.int64)

    def add(self, values: Floats) -> None:
        """Add values that are not negative; NaN is left out."""
        own = values[np.isfinite(values)]
        if not len(own):
            return
        self.count += len(own)
        self._sum += float(own.sum())
        self._square += float(own @ own)
        self._largest = max(self._largest, float(own.max()))
        place = np.log(np.maximum(own, self._LEAST) / self._LEAST) / np.log(self._RATIO)
        self._classes += np.bincount(
            np.minimum(place.astype(np.int64), self._CLASSES - 1), minlength=self._CLASSES
        )

    def made(self) -> Statistics:
        """Return the statistics of all values.

        Raises
        ------
        InputError
            There are no values.
        """
        if not self.count:
            raise InputError("there are no values to summarise")
        mean = self._sum / self.count
        std = float(np.sqrt(max(self._square / self.count - mean**2, 0.0)))
        at = int(np.searchsorted(np.cumsum(self._classes), 0.95 * self.count))
        p95 = self._LEAST * self._RATIO ** (at + 0.5) if at else 0.0
        return Statistics(mean, std, min(p95, self._largest), self._largest)
