"""Conditions under which a flattener that works in steps stops."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.errors import check_number, check_whole


@dataclass(frozen=True, kw_only=True)
class IterationOptions:
    """Options of the flatteners that work in steps.

    Parameters
    ----------
    tol : float
        Share of the surface's size: iteration stops if a step moves no vertex farther.
    max_iter : int
        Largest number of steps.

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
