"""Mean, standard deviation, 95th percentile and maximum of a set of values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats


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
