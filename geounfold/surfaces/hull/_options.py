"""Options of the hulls."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.errors import check_number

#: Blocks: a wider blur reaches past the bricks beside the one it is in.
WIDEST_BLUR = 2.5


@dataclass(frozen=True, kw_only=True)
class HullOptions:
    """Options of the hulls; lengths in blocks.

    Parameters
    ----------
    level : float
        Share of the inner density at which the density hull runs; 0.5 on the blocks' faces.
    blur : float
        Standard deviation of the density's blur; half of it keeps stairs, twice rounds hinges.
    edge : float
        Edge length of the hull's triangles.
    alpha : float or None
        Radius of the alpha shape's ball; None takes the smallest that holds the points.

    Raises
    ------
    OptionError
        A value out of its range.
    """

    level: float = 0.5
    blur: float = 0.8
    edge: float = 1.5
    alpha: float | None = None

    def __post_init__(self) -> None:
        check_number("hull_options.level", self.level, 0, 1, low_open=True, high_open=True)
        check_number("hull_options.blur", self.blur, 0, WIDEST_BLUR, low_open=True)
        check_number("hull_options.edge", self.edge, 0, low_open=True)
        check_number("hull_options.alpha", self.alpha, 0, low_open=True, none=True)
