"""Options of the thesis's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.errors import OptionError

_SHARES = ("max_hidden", "max_pieces", "max_steep")


@dataclass(frozen=True, kw_only=True)
class ThesisOptions:
    """Options of the thesis's method; lengths in blocks.

    Parameters
    ----------
    flattener : str
        A name in FLATTENERS.  ``spring`` brings the thesis's energy to its minimum;
        ``spring_dynamic`` with the stop rule ``thesis`` among its options stops where the
        thesis's code does.
    flattener_options : dataclass, optional
        The flattener's options.
    axis : str
        Direction of the vertical pairing: ``principal``, the principal axis of least extent, as
        the thesis has it, or ``up``, the direction given as up.
    cell : float
        Spacing of the border's vertices.
    merge : float
        Vertices of one surface this close, in plan, to one of the other are not inserted.
    pad : float
        Height of the mesh above and below the outermost blocks.
    least_gap : float
        Least vertical distance of top and bottom; they are moved apart where they come closer.
    trim : int
        Rings of faces left out along the outer border of each side, where remeshing has rounded
        the hull's rim.
    max_hidden, max_pieces : float
        Largest share of a side that may lie behind itself, or be torn off by steep slopes.
    max_steep : float
        Largest share of the hull away from its rim that the filter may miss or take for the
        other side (at most 0.08 on the bodies it served, 0.18 on the next).
    """

    flattener: str = "spring"
    flattener_options: Any = None
    axis: str = "principal"
    cell: float = 1.5
    merge: float = 0.5
    pad: float = 0.5
    least_gap: float = 0.5
    trim: int = 1
    max_hidden: float = 0.05
    max_pieces: float = 0.1
    max_steep: float = 0.1

    def __post_init__(self) -> None:
        if self.axis not in ("principal", "up"):
            raise OptionError(f"thesis: axis must be principal or up, but is {self.axis!r}")
        for name in ("cell", "pad", "least_gap"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise OptionError(f"thesis: {name} must be positive, but is {value}")
        for name, most in (("merge", np.inf), ("trim", np.inf), *((n, 1.0) for n in _SHARES)):
            value = getattr(self, name)
            if not 0 <= value <= most or value == np.inf:
                raise OptionError(f"thesis: {name} must be from 0 to {most}, but is {value}")
