"""The axes of a variogram in the unfolded space, and where they point in the body."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.estimation import Variogram
from geounfold.estimation.axes import axes_in_body, axes_told


def dipping(flat: np.ndarray, strike: float, dip: float) -> np.ndarray:
    """Return places of a flat layer laid into a plane: its y axis along the strike, dip right."""
    s, d = np.radians([strike, dip])
    along = np.array([np.sin(s), np.cos(s), 0])
    down = np.array([np.cos(s) * np.cos(d), -np.sin(s) * np.cos(d), -np.sin(d)])
    return flat @ np.stack([down, along, np.cross(down, along)]) + [7e5, 6e6, 300]


@pytest.mark.parametrize(("strike", "dip"), [(40, 30), (200, 65), (0, 0.5)])
def test_axes_along_strike_and_down_dip_of_a_plane(strike: float, dip: float) -> None:
    flat = np.random.default_rng(1).uniform(size=(40, 3)) * [100, 200, 10]
    folded = dipping(flat, strike, dip)
    one, two = axes_in_body(Variogram(0.1, (), (0.0, 0.0, 0.0)), flat, folded)
    assert (one.flat_azimuth, two.flat_azimuth) == (90, 0)
    assert one.trend == pytest.approx((strike + 90) % 360, abs=1e-6)
    assert one.plunge == pytest.approx(dip, abs=1e-6)
    # A level line has two trends; which of them is rounding.
    assert min(abs(two.trend - strike) % 180, 180 - abs(two.trend - strike) % 180) < 1e-6
    assert two.plunge == pytest.approx(0, abs=1e-6)
    # Turned by 90 degrees, axis 2 points down the dip.
    _, two = axes_in_body(Variogram(0.1, (), (90.0, 0.0, 0.0)), flat, folded)
    assert two.flat_azimuth == pytest.approx(90)
    assert two.trend == pytest.approx((strike + 90) % 360, abs=1e-6)
    assert axes_told((two,)) == (
        f"Axis 2: azimuth 90 in the unfolded space; in the body it trends {two.trend:.0f} and "
        f"plunges {two.plunge:.0f} degrees (mean over the samples).",
    )
