"""The choices by which drill-holes become a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from geounfold.errors import OptionError, check_number, check_numbers, check_one_of

Shape = Literal["auto", "plane", "fold"]
SHAPES: tuple[str, ...] = get_args(Shape)


@dataclass(frozen=True, kw_only=True)
class BodyOptions:
    """Rules by which coded intervals become a body.

    Parameters
    ----------
    code : sequence of str
        Codes of the body's intervals, such as ORE1 and ORE2.
    code_column : str, optional
        Column of the codes; by default the one text column that holds all of them.
    cut_off : (str, float), optional
        Grade column and value, in place of codes: intervals of this grade or above are the body's.
    max_waste : float
        Longest waste inside an intercept, in the tables' unit, that the body includes.
    least_length : float
        Shortest intercept that is used, in the tables' unit.
    least_thickness : float
        Thickness to which the body is widened about its middle, in the tables' unit; 0 lets it
        pinch out.
    extent : float, optional
        Distance to which the body reaches beyond its outermost intercepts; by default half the
        spacing of the holes.
    polygon : (k, 2) float, optional
        Outline in x and y, in place of the extent.
    block_size : float or three floats, optional
        Sides of a block; by default an eighth of the mean thickness, rounded down.
    shape : {"auto", "plane", "fold"}
        Surface over which the walls are drawn: the mean plane, or a curve along a fold axis. By
        default the fold if the intercepts of some hole lie above each other or the walls are steep
        on the mean plane.
    axis : (float, float), optional
        Trend and plunge of the fold axis, degrees; measured by default.

    Raises
    ------
    OptionError
        A value is outside its valid range, or neither codes nor a cut-off are given, or both.
    """

    code: Sequence[str] = ()
    code_column: str | None = None
    cut_off: tuple[str, float] | None = None
    max_waste: float = 0.0
    least_length: float = 0.0
    least_thickness: float = 0.0
    extent: float | None = None
    polygon: Sequence[Sequence[float]] | None = None
    block_size: float | Sequence[float] | None = None
    shape: Shape = "auto"
    axis: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        codes = (self.code,) if isinstance(self.code, str) else tuple(str(c) for c in self.code)
        object.__setattr__(self, "code", codes)
        if bool(codes) == (self.cut_off is not None):
            raise OptionError("give the body's codes or a cut-off grade, one of them")
        if self.cut_off is not None:
            if self.code_column is not None:
                raise OptionError("code_column is for codes, not for a cut-off grade")
            if len(self.cut_off) != 2:
                raise OptionError("cut_off needs a column and a value")
            check_number("cut_off", self.cut_off[1])
        for name in ("max_waste", "least_length", "least_thickness"):
            check_number(name, getattr(self, name), 0)
        check_number("extent", self.extent, 0, low_open=True, none=True)
        if self.extent is not None and self.polygon is not None:
            raise OptionError("extent and polygon exclude each other")
        check_one_of("shape", self.shape, SHAPES)
        if self.axis is not None:
            check_numbers("axis", self.axis, 2)
            if self.shape == "plane":
                raise OptionError("axis is for a fold, and shape is plane")
        self._check_polygon()
        self._check_block_size()

    def _check_polygon(self) -> None:
        if self.polygon is None:
            return
        corners = np.asarray(self.polygon, dtype=np.float64)
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
            raise OptionError(f"polygon needs corners (k, 2), three or more, not {corners.shape}")
        if not np.isfinite(corners).all():
            raise OptionError("polygon has a corner that is not finite")

    def _check_block_size(self) -> None:
        if self.block_size is None:
            return
        sides = np.atleast_1d(np.asarray(self.block_size, dtype=object)).tolist()
        if len(sides) not in (1, 3):
            raise OptionError(f"block_size must be a length or three, but is {self.block_size}")
        for side in sides:
            check_number("block_size", side, 0, low_open=True)
