"""When a flattener that works in steps stops."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.errors import check_number, check_whole


@dataclass(frozen=True, kw_only=True)
class IterationOptions:
    """Options of the flatteners that work in steps.

    Parameters
    ----------
    tol : float
        Stop if a step moves no vertex by more than this share of the surface's size.
    max_iter : int
        Most steps.

    Raises
    ------
    OptionError
        A value out of its range.
    """

    tol: float
    max_iter: int

    def __post_init__(self) -> None:
        check_number("flattener_options.tol", self.tol, 0, low_open=True)
        check_whole("flattener_options.max_iter", self.max_iter, 1)
