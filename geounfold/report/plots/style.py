"""Colours and options of all pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geounfold.errors import OptionError
from geounfold.extras import require as require_library

Image = NDArray[np.uint8]

Limits = tuple[float, float]

# Okabe and Ito's colours, which colour-blind readers can distinguish.
TOP, BOTTOM, RIM, UNDECIDED = "#0072B2", "#E69F00", "#999999", "#CC79A7"


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """Options of a view of a body.

    Parameters
    ----------
    azimuth : float
        Direction of the viewer, degrees anticlockwise from east.
    elevation : float
        Elevation of the viewer, degrees above the horizon, -90 to 90.
    size : (int, int)
        Width and height of each three-dimensional view, pixels.
    max_blocks : int
        Largest number of blocks drawn; if more are visible, every second, third ... is drawn.
    """

    azimuth: float = -65.0
    elevation: float = 24.0
    size: tuple[int, int] = (900, 620)
    max_blocks: int = 200_000

    def __post_init__(self) -> None:
        if not -90 <= self.elevation <= 90:
            raise OptionError(f"elevation must be -90 to 90 degrees, but is {self.elevation}")
        if min(self.size) < 16 or max(self.size) > 8192:
            raise OptionError(f"size must be 16 to 8192 pixels a side, but is {self.size}")
        if self.max_blocks < 1:
            raise OptionError(f"max_blocks must be at least 1, but is {self.max_blocks}")


def require(name: str) -> Any:
    """Return a library for pictures; see `extras.require`."""
    return require_library(name, "pictures")
